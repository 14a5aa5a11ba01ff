"""Verbs on recordings: look at them, make a campaign of them, record the virtual machine."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
        typer.Option("--model", help="A model file: do its names and units fit? Repeatable."),
    ] = None,
) -> None:
    """List what is wrong with the recordings of CAMPAIGN, worst first: where, and what to do about it.

    Each channel is looked at by itself, beside its siblings, and beside the other recordings: units,
    signs, clocks,
    swapped columns, dead or frozen sensors, copies. An `error` keeps the recording from being used (exit
    status 1); a `warning` is worth a look.
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
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that the files are written into.")],
    sources: Annotated[
        list[Path] | None,
        typer.Option(
            "--from",
            metavar="FILE",
            help="Your recording (CSV of any kind, .xlsx, Parquet); repeat it for several of one machine.",
        ),
    ] = None,
    joins: Annotated[
        list[Path] | None,
        typer.Option(
            "--join", metavar="FILE", help="A second logger of the same hours, one for each --from."
        ),
    ] = None,
    statements: Annotated[
        list[str] | None,
        typer.Option(
            "--is",
            metavar="NAME=ROLE,UNIT",
            help="What a column is: --is 'CH1=error,um'; the unit of the clock: --is time=min. Repeatable.",
        ),
    ] = None,
    room: Annotated[
        str | None,
        typer.Option(metavar="COLUMN", help="A column that stands for the air around (outdoors, a cabinet)."),
    ] = None,
    again: Annotated[
        bool,
        typer.Option("--again", help="Make model and experiment anew; what you wrote in DIR stays."),
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Do not compare models: write a simple and a discovered one.")
    ] = False,
    ask: Annotated[
        bool | None, typer.Option("--ask/--no-ask", help="Ask about doubtful guesses [if on a terminal].")
    ] = None,
) -> None:
    """Make campaign, model and experiment from your own files, say what was guessed, choose a first model.

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
    choice = typer.prompt("which?", type=typer.IntRange(1, len(question.answers)), default=1, err=True)
    return int(choice) - 1


def _list_effects(given: list[str] | None) -> list[str] | None:
    """Of --effect and --fault: `help` lists them, whatever else is said or missing."""
    if any(text.strip() == "help" or text.endswith("=help") for text in given or []):
        from discovery.virtual.command import effect_list

        typer.echo(effect_list())
        raise typer.Exit
    return given


def record(
    out: Annotated[Path, typer.Option("--out", help="Folder of the campaign that is written.")],
    campaign: Annotated[
        str | None,
        typer.Option(help="Record a known campaign, e.g. nmv5000; no other option but --out counts."),
    ] = None,
    recordings: Annotated[
        int, typer.Option(min=1, max=100, help="How many recordings, each with the next seed.")
    ] = 1,
    cycle: Annotated[
        str,
        typer.Option(
            help="fit, validation, dry, flow, environment, fluid, internal, warm_up, warm_up_dry, load_wet, "
            "cooling, nozzle or flooded."
        ),
    ] = "fit",
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it.")] = 1,
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
            help="NAME[@CHANNEL]=SIZE: a fault of measuring, in the first recording; help lists them.",
        ),
    ] = None,
    conceal: Annotated[
        bool, typer.Option("--conceal", help="Hide an effect drawn by seed, without --effect.")
    ] = False,
    reveal: Annotated[bool, typer.Option("--reveal", help="Put the answer into OUT, too.")] = False,
) -> None:
    """Record the virtual machine: a rotary table under cutting fluid, some 50 nodes, with R-Test readings.

    The same options give the same files, bit for bit. What was concealed stands in OUT.answer.json.

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
