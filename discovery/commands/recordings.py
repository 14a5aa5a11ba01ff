"""Verbs on recordings: look at them, make a campaign of them, record the virtual machine."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import click
import typer

if TYPE_CHECKING:
    from discovery.firsthour.asking import Question


def check(
    campaign: Annotated[
        Path,
        typer.Argument(metavar="CAMPAIGN", help="A campaign file, or a folder that holds campaign.toml."),
    ],
    models: Annotated[
        list[Path] | None,
        typer.Option("--model", help="Also check names and units of a model file; repeatable."),
    ] = None,
) -> None:
    """List the faults in the recordings of CAMPAIGN, worst first, each with its place and a remedy.

    Each channel is checked alone, against similar channels, and against other recordings: units, signs,
    clocks, swapped columns, dead or frozen sensors, copies. An `error` means that the recording cannot be
    used (exit status 1). A `warning` is a possible fault.
    """
    from discovery.recordings.check import check_campaign, summary
    from discovery.recordings.finding import folded

    findings, misfits = check_campaign(campaign), []
    for line in folded(findings):
        typer.echo(line)
    if models:
        from discovery.models.check import check_models

        for misfit in check_models(campaign, models):
            typer.echo(f"warning: {misfit}")
            misfits.append(misfit)
    typer.echo(summary(findings, misfits))
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(1)


def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder for the new files.")],
    sources: Annotated[
        list[Path] | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Your recording (any CSV, .xlsx, Parquet); repeat it for several of one machine.",
        ),
    ] = None,
    joins: Annotated[
        list[Path] | None,
        typer.Option("--join", metavar="FILE", help="A second logger of the same time, one for each --from."),
    ] = None,
    statements: Annotated[
        list[str] | None,
        typer.Option(
            "--is",
            metavar="NAME=ROLE,UNIT",
            help="Role and unit of a column: --is 'CH1=error,um'; unit of time: --is time=min. Repeatable.",
        ),
    ] = None,
    room: Annotated[
        str | None,
        typer.Option(metavar="COLUMN", help="Column to use as ambient temperature (outdoors, a cabinet)."),
    ] = None,
    again: Annotated[
        bool,
        typer.Option("--again", help="Make model and experiment again; your own changes in DIR stay."),
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Skip the comparison: write a simple and a discovered model.")
    ] = False,
    ask: Annotated[
        bool | None, typer.Option("--ask/--no-ask", help="Ask about doubtful guesses [if on a terminal].")
    ] = None,
) -> None:
    """Make campaign, model and experiment from your own files; show the guesses; choose a first model.

    \b
    discovery new lathe --from monday.csv --from tuesday.csv
    discovery new lathe --from temperatures.csv --join displacements.xlsx
    discovery new lathe --again          # after roles were corrected in lathe/campaign.toml
    """
    import sys

    from discovery.firsthour.new import new as make
    from discovery.progress import shown

    asks = ask if ask is not None else sys.stdin.isatty() and sys.stderr.isatty()
    with shown() as progress:
        lines = make(
            folder,
            sources or [],
            joins or [],
            statements or [],
            room,
            _asked if asks else None,
            progress,
            again=again,
            quick=quick,
        )
    for line in lines:
        typer.echo(line)


def _asked(question: "Question") -> int:
    """The place of the answer that a person chooses on the terminal; the first by just confirming."""
    typer.echo(question.text, err=True)
    for number, (words, _, _) in enumerate(question.answers, start=1):
        typer.echo(f"  {number}  {words}", err=True)
    choice = typer.prompt("which?", type=click.IntRange(1, len(question.answers)), default=1, err=True)
    return int(choice) - 1


def _list_effects(given: list[str] | None) -> list[str] | None:
    """Of --effect and --fault: `help` lists them, whatever else is said or missing."""
    if any(text.strip() == "help" or text.endswith("=help") for text in given or []):
        from discovery.virtual.command import effect_list

        typer.echo(effect_list())
        raise typer.Exit
    return given


def record(
    out: Annotated[Path, typer.Option("--out", help="Folder for the campaign.")],
    campaign: Annotated[
        str | None,
        typer.Option(help="Record a known campaign, e.g. nmv5000; only --out is used then."),
    ] = None,
    recordings: Annotated[
        int, typer.Option(min=1, max=100, help="Number of recordings; each uses the next seed.")
    ] = 1,
    cycle: Annotated[
        str,
        typer.Option(
            help="fit, validation, dry, flow, environment, fluid, internal, warm_up, warm_up_dry, load_wet, "
            "cooling, nozzle or flooded."
        ),
    ] = "fit",
    seed: Annotated[int, typer.Option(min=0, help="Seed of everything random.")] = 1,
    hours: Annotated[float, typer.Option(help="Length of a recording.")] = 72.0,
    nozzle_height: Annotated[float, typer.Option(help="Nozzle above the table, mm.")] = 50.0,
    nozzle_side: Annotated[float, typer.Option(help="0: over the centre, 1: left of the table.")] = 0.0,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            callback=_list_effects,
            is_eager=True,
            help="NAME[@BODY[+BODY]]=SIZE, may be repeated; --effect help lists them.",
        ),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            callback=_list_effects,
            is_eager=True,
            help="NAME[@CHANNEL]=SIZE: a measurement fault in the first recording; help lists them.",
        ),
    ] = None,
    conceal: Annotated[
        bool, typer.Option("--conceal", help="Hide an effect that the seed chooses, without --effect.")
    ] = False,
    reveal: Annotated[bool, typer.Option("--reveal", help="Also write the answer into OUT.")] = False,
) -> None:
    """Record a simulated machine: a rotary table under cutting fluid, 59 temperatures, with R-Test readings.

    The same options give the same files, bit for bit. OUT.answer.json holds a concealed effect.

    \b
    discovery record --out runs/plain --recordings 2
    discovery record --effect radiation=0.5 --nozzle-height 100 --seed 3 --out runs/radiating
    discovery record --conceal --seed 7 --recordings 3 --out runs/riddle
    discovery record --campaign nmv5000 --out datasets/nmv5000
    """
    from discovery.virtual.command import orders_of, record_orders

    title, orders = orders_of(
        campaign,
        recordings,
        cycle,
        seed,
        hours,
        nozzle_height,
        nozzle_side,
        effect or [],
        fault or [],
        conceal,
    )
    for line in record_orders(out, title, orders, reveal=reveal, envelope=campaign is None):
        typer.echo(line)
