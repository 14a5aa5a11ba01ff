"""Verbs on experiments and their results."""

from pathlib import Path
from typing import Annotated

import typer


def run(
    experiment: Annotated[
        Path,
        typer.Argument(metavar="EXPERIMENT", help="An experiment file, e.g. experiments/demonstration.toml."),
    ],
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the results [runs/NAME].")] = None,
    force: Annotated[
        bool, typer.Option("--force", help="Run although the recordings cannot be used as they are.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Nothing but the last five lines.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="What was found as one JSON object on stdout, nothing else.")
    ] = False,
) -> None:
    """Do the main job: look at the recordings, fit, discover, cross-validate, compare, diagnose, report,
    export.

    Recordings that are wrong (`discovery check`) stop it, unless --force. The last five lines say which
    model wins,
    how sure that is, what is missing, what is doubtful, what to do next. The results in the folder are
    replaced as a
    whole at the end: an interrupted run leaves nothing behind. Exports, figures and notes in it stay.
    """
    import json

    from discovery.experiment import run as run_experiment
    from discovery.experiment.ending import ending
    from discovery.experiment.summary import summary
    from discovery.progress import shown, silent

    def tell(line: str) -> None:
        typer.echo(line, err=True)

    with shown(quiet=quiet or as_json) as progress:
        folder = run_experiment(
            experiment, out, progress, force=force, tell=silent if quiet or as_json else tell
        )
    found = ending(folder)
    if as_json:
        typer.echo(json.dumps(found.document(), indent=1, ensure_ascii=False))
        return
    if not quiet:
        for line in summary(folder):
            typer.echo(line)
        typer.echo()
    for line in found.lines():
        typer.echo(line)


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

    Writes diagnosis.json, the repaired model and report.html; other models that a run of the same recordings
    left in the folder stay. "no mismatch" and "unexplained" are answers too: nothing is named that the
    recordings cannot tell apart.
    """
    from discovery.diagnosis.summary import summary
    from discovery.experiment import diagnose as find
    from discovery.experiment.summary import remarks
    from discovery.progress import shown

    with shown() as progress:
        folder = find(experiment, out, progress)
    for line in summary(folder):
        typer.echo(line)
    for line in remarks(folder):
        typer.echo(line)
    typer.echo(f"report: {folder / 'report.html'}")


def compare(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN RUN", help="Folders of results.")],
    out: Annotated[
        Path | None, typer.Option("--out", help="Write a page on them: FILE.html, or a folder.")
    ] = None,
) -> None:
    """Put the models of several runs side by side: rms of each error, recording by recording."""
    from discovery.experiment.summary import comparison

    for line in comparison(runs):
        typer.echo(line)
    if out:
        from discovery.report import write_comparison

        typer.echo(write_comparison(runs, out))


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
