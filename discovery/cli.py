"""The command line: one function a verb, no logic, heavy imports inside the verb."""

import os
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from discovery import __version__
from discovery.errors import UserError

# One thread for the linear algebra of a process: the problems are small, and several processes share the
# cores. It has to be said before numpy is imported; what the user has set stays.
for _library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR", "VECLIB"):
    os.environ.setdefault(f"{_library}_NUM_THREADS", "1")


class _Sentences(TyperGroup):
    """The one place where a failure becomes a sentence and an exit status."""

    def invoke(self, ctx: Any) -> Any:
        try:
            return super().invoke(ctx)
        except UserError as error:
            typer.echo(f"error: {error}", err=True)
            raise typer.Exit(1) from None
        except KeyboardInterrupt:
            typer.echo("\nstopped; nothing half-written is left, the command can be run again", err=True)
            raise typer.Exit(130) from None
        except OSError as error:
            if error.filename is None:
                raise
            typer.echo(f"error: {error.filename}: {error.strerror}", err=True)
            raise typer.Exit(1) from None


app = typer.Typer(
    cls=_Sentences,
    no_args_is_help=True,
    add_completion=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 110},
    epilog="A first hour: write campaign.toml beside your files, `discovery check` it, "
    "then write an experiment and `discovery run` it. Every verb explains itself: `discovery VERB --help`. "
    "Exit status: 0 done, 1 the work could not be done (the message says why), 2 wrong usage.",
)


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"discovery {__version__}")
        raise typer.Exit


@app.callback()
def main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and stop.")
    ] = False,
) -> None:
    """Models of a machine tool's thermal errors, from recordings: fitted, discovered, compared, diagnosed."""


@app.command()
def check(
    campaign: Annotated[Path, typer.Argument(help="A campaign file, or a folder that holds campaign.toml.")],
    models: Annotated[
        list[Path] | None,
        typer.Option("--model", help="A model file: do its names and units fit? Repeatable."),
    ] = None,
) -> None:
    """List what is wrong with the recordings of CAMPAIGN: where, and what to do about it.

    An `error` keeps the recording from being used (exit status 1); a `warning` is worth a look.
    """
    from discovery.recordings.check import check_campaign, summary

    findings = check_campaign(campaign)
    for finding in findings:
        typer.echo(str(finding))
    typer.echo(summary(findings))
    if models:
        from discovery.models.check import check_models

        for warning in check_models(campaign, models):
            typer.echo(f"warning: {warning}")
    if any(finding.severity == "error" for finding in findings):
        raise typer.Exit(1)


@app.command()
def new(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that the files are written into.")],
    sources: Annotated[
        list[Path],
        typer.Option("--from", metavar="CSV", help="Your recording; repeat it for several of one machine."),
    ],
) -> None:
    """Make campaign, model and experiment from your own CSV, and say what was guessed."""
    from discovery.firsthour.new import new as make

    for line in make(folder, sources):
        typer.echo(line)


@app.command("list")
def list_words(
    what: Annotated[str, typer.Argument(metavar="effects|models|roles", help="What to list.")],
) -> None:
    """List the effects, the kinds of models, or the roles of channels, each in a line."""
    from discovery.firsthour.explain import list_words as lines_of

    for line in lines_of(what):
        typer.echo(line)


@app.command()
def explain(
    effect: Annotated[str, typer.Argument(metavar="EFFECT", help="A word of `discovery list effects`.")],
) -> None:
    """Explain the physics of EFFECT: formula, size, signature, what it is confused with."""
    from discovery.firsthour.explain import explain as lines_of

    for line in lines_of(effect):
        typer.echo(line)


@app.command()
def schema(
    file: Annotated[str, typer.Argument(metavar="campaign|model|experiment", help="Which file.")],
) -> None:
    """Print the JSON schema of a file, for completion in an editor."""
    from discovery.firsthour.schemas import schema as schema_of

    typer.echo(schema_of(file))


@app.command()
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
        typer.Option(help="fit, validation, dry, flow, environment, fluid, internal or warm_up."),
    ] = "fit",
    seed: Annotated[int, typer.Option(min=0, help="Everything random comes from it.")] = 1,
    hours: Annotated[float, typer.Option(help="Length of a recording.")] = 72.0,
    nozzle_height: Annotated[float, typer.Option(help="Nozzle above the table, mm.")] = 50.0,
    effect: Annotated[
        list[str] | None,
        typer.Option(help="NAME[@BODY[+BODY]]=SIZE, may be repeated; --effect help lists them."),
    ] = None,
    fault: Annotated[
        list[str] | None,
        typer.Option(help="NAME[@CHANNEL]=SIZE: a fault of measuring, in the first recording."),
    ] = None,
    conceal: Annotated[bool, typer.Option("--conceal", help="Hide an effect drawn by seed.")] = False,
    reveal: Annotated[bool, typer.Option("--reveal", help="Put the answer into OUT, too.")] = False,
) -> None:
    """Record the virtual machine: a rotary table of five bodies under cutting fluid, with R-Test readings.

    The same options give the same files, bit for bit. What was concealed stands in OUT.answer.json.

    \b
    discovery record --out runs/plain --recordings 2
    discovery record --effect radiation=0.5 --nozzle-height 100 --seed 3 --out runs/radiating
    discovery record --conceal --seed 7 --recordings 3 --out runs/riddle
    discovery record --campaign nmv5000 --out datasets/nmv5000
    """
    from discovery.virtual.command import orders_of, record_orders

    title, orders = orders_of(
        campaign, recordings, cycle, seed, hours, nozzle_height, effect or [], fault or [], conceal
    )
    for line in record_orders(out, title, orders, reveal=reveal, envelope=campaign is None):
        typer.echo(line)


@app.command()
def diagnose(
    experiment: Annotated[
        Path, typer.Argument(metavar="EXPERIMENT", help="An experiment file, experiments/*.toml.")
    ],
    out: Annotated[
        Path | None, typer.Option(help="Folder of the results; default runs/<experiment name>.")
    ] = None,
) -> None:
    """Find what the model of [mismatch] leaves out: where, which physics, how sure, and how much better the
    repair fits.

    Writes diagnosis.json, the repaired model and report.html. "no mismatch" and "unexplained" are answers
    too: nothing is named that the recordings cannot tell apart.
    """
    from discovery.experiment import diagnose as find
    from discovery.mismatch.summary import summary
    from discovery.progress import shown

    with shown() as progress:
        folder = find(experiment, out, progress)
    for line in summary(folder / "diagnosis.json"):
        typer.echo(line)
    typer.echo(f"report: {folder / 'report.html'}")


@app.command()
def run(
    experiment: Annotated[Path, typer.Argument(help="An experiment file, e.g. experiments/nmv5000.toml.")],
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the results [runs/NAME].")] = None,
) -> None:
    """Do the main job: fit, discover, cross-validate, compare, diagnose, report, export.

    The folder of results is written as a whole at the end; an interrupted run leaves nothing behind.
    """
    from discovery.experiment import run as run_experiment
    from discovery.progress import shown
    from discovery.summary import summary

    with shown() as progress:
        folder = run_experiment(experiment, out, progress)
    for line in summary(folder):
        typer.echo(line)


@app.command()
def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN...", help="Folders of results.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write a page on them: FILE.html, or a folder.")
    ] = None,
) -> None:
    """Put the models of several runs side by side: rms of each error, recording by recording."""
    from discovery.summary import comparison

    for line in comparison(runs):
        typer.echo(line)
    if out:
        from discovery.report import write_comparison

        typer.echo(write_comparison(runs, out))


@app.command()
def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A folder of results.")],
    figures: Annotated[
        bool, typer.Option("--figures", help="Also write RUN/figures/*.svg and *.pdf.")
    ] = False,
) -> None:
    """Write the report of RUN anew: one page that opens offline."""
    from discovery.report import write_figures, write_report

    typer.echo(write_report(run))
    if figures:
        written = write_figures(run)
        typer.echo(f"{written[0].parent}: {len(written)} figures")


@app.command()
def export(
    run: Annotated[Path, typer.Argument(help="Folder of a finished run.")],
    model: Annotated[str, typer.Option(help="Name of one of its models.")],
    to: Annotated[list[str], typer.Option(help="json, c, fmu, fmu3 or st; may be repeated.")],
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the files [RUN/export/MODEL].")] = None,
    campaign: Annotated[Path | None, typer.Option(help="Campaign file [the one of the run].")] = None,
    step: Annotated[float, typer.Option(help="Fixed internal step, s.")] = 10.0,
    states: Annotated[int | None, typer.Option(help="Reduce the model to so many states first.")] = None,
    sign: Annotated[
        Path | None, typer.Option(help="Private key (PEM, Ed25519) that signs; made when there is none yet.")
    ] = None,
) -> None:
    """Export a fitted model for the compensation runtime, proved equal to the Python model before it is
    written.

    \b
    discovery export "runs/cutting fluid" --model thermobalance --to c --to fmu
    discovery export "runs/cutting fluid" --model thermobalance --to json --sign machine.pem
    """
    from discovery.export import export_run
    from discovery.export.seal import private_key

    key = private_key(sign) if sign else None
    done = export_run(run, model, to, out, campaign=campaign, step_s=step, states=states, key=key)
    for line in done.lines():
        typer.echo(line)


@app.command()
def compensate(
    model: Annotated[Path, typer.Argument(help="An exported model (.json).")],
    inputs: Annotated[
        str | None, typer.Option(help="CSV file with time and the inputs, or - for stdin.")
    ] = None,
    out: Annotated[Path | None, typer.Option("--out", help="CSV file of the offsets [stdout].")] = None,
    state: Annotated[
        Path | None,
        typer.Option(
            help="Folder that keeps state and models; another MODEL there runs in the shadow first."
        ),
    ] = None,
    trust: Annotated[
        Path | None, typer.Option(help="Public key (.pub) that must have signed the model.")
    ] = None,
    allow_unsigned: Annotated[
        bool, typer.Option("--allow-unsigned", help="Try a model without a key.")
    ] = False,
    shadow_hours: Annotated[float, typer.Option(help="Length of a shadow run.")] = 24.0,
    back: Annotated[
        bool, typer.Option("--back", help="One step back to the model before, in --state.")
    ] = False,
    opcua: Annotated[Path | None, typer.Option(help="TOML file of an OPC UA connection.")] = None,
    opcua_demo: Annotated[
        bool, typer.Option("--opcua-demo", help="Start a simulated machine server and compensate it.")
    ] = False,
    seconds: Annotated[float | None, typer.Option(help="Stop OPC UA after so long.")] = None,
) -> None:
    """Run an exported model: readings in, offsets [um, um/m] with status word and heartbeat out.

    \b
    discovery compensate model.json --trust machine.pem.pub --inputs today.csv --out offsets.csv --state
    memory discovery compensate model.json --allow-unsigned --opcua-demo --seconds 60
    """
    from discovery.runtime.command import compensate_rows, go_back, trusted_model

    def say(text: str) -> None:
        typer.echo(text, err=True)

    if back:
        if state is None:
            raise UserError("--back needs --state, the folder that keeps the models")
        go_back(state, say)
        return
    exported, key = trusted_model(model, trust, allow_unsigned=allow_unsigned)
    if opcua is not None or opcua_demo:
        from discovery.runtime.opcua import compensate_opcua

        compensate_opcua(
            exported,
            opcua,
            model=model,
            folder=state,
            trusted=key,
            seconds=seconds,
            shadow_hours=shadow_hours,
            say=say,
        )
    elif inputs is not None:
        compensate_rows(
            exported, inputs, out, model=model, folder=state, trusted=key, shadow_hours=shadow_hours, say=say
        )
    else:
        raise UserError(
            "say where the readings come from: --inputs FILE, --inputs -, --opcua FILE or --opcua-demo"
        )


@app.command()
def challenge(
    cases: Annotated[int | None, typer.Option(min=1, help="How many cases are written [200].")] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="Everything random comes from it [drawn now].")
    ] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder of the challenge.")] = Path("runs/challenge"),
    jobs: Annotated[int, typer.Option(min=1, help="Processes at a time.")] = 2,
    baselines: Annotated[bool, typer.Option(help="Solve with the other methods, too.")] = True,
    cases_from: Annotated[
        Path | None, typer.Option(help="Take the cases of this folder, with keys.json or answers.json.")
    ] = None,
) -> None:
    """Conceal effects in many cases, seal the answers, solve the cases, score what was found.

    Run it again to go on where it stopped. Writes OUT/report.html, OUT/results.json and OUT/challenge.md.
    """
    from discovery.challenge.run import challenge as run_challenge
    from discovery.progress import shown

    with shown() as progress:
        outcome = run_challenge(out, cases, seed, jobs, baselines, cases_from, progress)
    for line in outcome.lines:
        typer.echo(line)
    typer.echo(f"report: {outcome.folder / 'report.html'}")


@app.command()
def update(
    model: Annotated[Path, typer.Argument(help="The exported model at work (.json).")],
    campaign: Annotated[
        Path, typer.Argument(help="A campaign file with the recordings since its last revision.")
    ],
    recordings: Annotated[
        list[str] | None, typer.Option("--recording", help="In order; may be repeated [all of the campaign].")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", help="File of the next revision [MODEL with .rN].")
    ] = None,
    sign: Annotated[Path | None, typer.Option(help="Private key (PEM, Ed25519) that signs it.")] = None,
) -> None:
    """Keep an exported model up with an ageing machine: noise, drift, or a new effect?

    A drift becomes the next revision, with a changelog entry; `discovery compensate` runs it in the shadow
    first.
    """
    from discovery.export.seal import private_key
    from discovery.recordings import load_campaign
    from discovery.runtime.update import next_name, update_file

    loaded = load_campaign(campaign, only=recordings or None)
    names = recordings or list(loaded.recordings)
    key = private_key(sign) if sign else None
    for line in update_file(model, loaded, names, out or next_name(model), key).lines():
        typer.echo(line)


if __name__ == "__main__":
    sys.exit(app())
