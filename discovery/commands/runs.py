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
    force: Annotated[bool, typer.Option("--force", help="Run in spite of faulty recordings.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the last five lines.")] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print only one JSON object with the findings.")
    ] = False,
) -> None:
    """Run a whole experiment: check the recordings, fit, discover, compare, diagnose, report, export.

    Faulty recordings (see `discovery check`) stop the run; --force overrides this. The last five lines give
    the best model, how sure that is, the missing physics, the doubts and the next step. The results in the
    folder are replaced at the very end, so an interrupted run changes nothing. Your exports, figures and
    notes stay.
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
    experiment: Annotated[Path, typer.Argument(metavar="EXPERIMENT", help="An experiment file.")],
    out: Annotated[Path | None, typer.Option(help="Folder of the results [runs/NAME].")] = None,
) -> None:
    """Find the physics that the model of [mismatch] lacks: which effect, where, how sure, and what its repair
    gains.

    Writes diagnosis.json, the repaired model and report.html. Other models of the same recordings stay in the
    folder. "no mismatch" and "unexplained" are possible answers: an effect is named only if the recordings
    determine it.
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
        Path | None, typer.Option("--out", help="Also write a page: FILE.html, or a folder.")
    ] = None,
) -> None:
    """Compare the models of several runs: rms of each error and recording."""
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
    """Write the report of RUN again: one HTML file that opens offline."""
    from discovery.report import write_figures, write_report

    typer.echo(write_report(run))
    if figures:
        written = write_figures(run)
        typer.echo(f"{written[0].parent}: {len(written)} figures")
