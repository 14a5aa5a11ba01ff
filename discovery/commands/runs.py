"""Verbs on experiments and their results."""

from pathlib import Path
from typing import Annotated

import typer

from discovery.errors import UsageError, UserError
from discovery.threads import use_jobs

Jobs = Annotated[
    int | None,
    typer.Option(
        "--jobs",
        "-j",
        min=1,
        help="Number of fits that run at the same time, each on one core. The results are the same with any "
        "number. [all cores; or the environment variable DISCOVERY_JOBS]",
    ),
]
Force = Annotated[bool, typer.Option("--force", help="Use faulty recordings.")]


def _on_stderr(line: str) -> None:
    typer.echo(line, err=True)


def run(
    experiment: Annotated[
        Path,
        typer.Argument(
            metavar="EXPERIMENT",
            help="An experiment file, e.g. experiments/demonstration.toml; or a folder of them.",
        ),
    ],
    out: Annotated[Path | None, typer.Option("--out", help="Folder of the results [runs/NAME].")] = None,
    jobs: Jobs = None,
    dask: Annotated[
        str | None,
        typer.Option(
            "--dask",
            metavar="ADDRESS",
            help="Run the experiments of a folder on the workers of this Dask scheduler, e.g. "
            "tcp://10.0.0.5:8786. The workers need the same files at the same place.",
        ),
    ] = None,
    force: Force = False,
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

    For a folder, the command runs every experiment that is not finished yet. Start it again to continue after
    a stop.
    """
    import json

    use_jobs(jobs)
    if experiment.is_dir():
        _run_folder(experiment, out, dask, force=force, quiet=quiet, as_json=as_json)
        return
    if dask is not None:
        raise UsageError(f"--dask runs the experiments of a folder; {experiment} is not a folder")
    from discovery.experiment import run as run_experiment
    from discovery.experiment.ending import ending
    from discovery.experiment.summary import summary
    from discovery.progress import shown, silent

    with shown(quiet=quiet or as_json) as progress:
        folder = run_experiment(
            experiment, out, progress, force=force, tell=silent if quiet or as_json else _on_stderr
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


def _run_folder(
    folder: Path, out: Path | None, address: str | None, *, force: bool, quiet: bool, as_json: bool
) -> None:
    """Run the experiments in a folder; status 1 where one could not be done."""
    import json

    from discovery.experiment.many import run_many
    from discovery.progress import shown

    with shown(quiet=quiet or as_json) as progress:
        done = run_many(folder, out, address, progress, force=force)
    if as_json:
        found = [
            {"experiment": d.experiment, "folder": str(d.folder), "lines": d.lines, "failure": d.failure}
            for d in done
        ]
        typer.echo(json.dumps(found, indent=1, ensure_ascii=False))
    else:
        for one in done:
            head = f"{one.experiment}{' (finished before)' if one.skipped else ''}"
            typer.echo(f"{head}: error: {one.failure}" if one.failure else f"{head}: {one.folder}")
            for line in one.lines[:3]:
                typer.echo(f"  {line}")
    failed = sum(bool(one.failure) for one in done)
    if failed:
        raise UserError(
            f"{failed} of {len(done)} experiments could not be done; the others are kept. "
            "Correct their files and run the folder again"
        )


def diagnose(
    experiment: Annotated[
        Path,
        typer.Argument(metavar="EXPERIMENT", help="An experiment file, or a folder with an experiment.toml."),
    ],
    out: Annotated[Path | None, typer.Option(help="Folder of the results [runs/NAME].")] = None,
    jobs: Jobs = None,
    force: Force = False,
) -> None:
    """Find the physics that the model of [mismatch] lacks: which effect, where, how sure, and what its repair
    gains.

    Writes diagnosis.json, the repaired model and report.html. Other models of the same recordings stay in the
    folder. "no mismatch" and "unexplained" are possible answers: an effect is named only if the recordings
    determine it.

    Faulty recordings (see `discovery check`) stop the command; --force overrides this.
    """
    use_jobs(jobs)
    from discovery.diagnosis.summary import summary
    from discovery.experiment import diagnose as find
    from discovery.experiment.summary import remarks
    from discovery.progress import shown

    if (inside := experiment / "experiment.toml").is_file():
        experiment = inside
    with shown() as progress:
        folder = find(experiment, out, progress, force=force, tell=_on_stderr)
    for line in summary(folder):
        typer.echo(line)
    for line in remarks(folder):
        typer.echo(line)
    typer.echo(f"report: {folder / 'report.html'}")


def compare(
    runs: Annotated[
        list[Path],
        typer.Argument(metavar="RUN RUN", help="Folders of results, or one folder that holds them: runs."),
    ],
    out: Annotated[
        Path | None, typer.Option("--out", help="Also write a page: FILE.html, or a folder.")
    ] = None,
    against: Annotated[
        Path | None, typer.Option("--against", metavar="RUN", help="Run to compare with [the first].")
    ] = None,
) -> None:
    """Compare runs: list them, say how each differs from one of them, and set their models side by side.

    The rms of two runs is compared on the held-out recordings of both, with a 95 % interval. The page has a
    search field and lets you choose the run to compare with.
    """
    from discovery.experiment.summary import comparison
    from discovery.report.compare import load_runs, write_comparison

    loaded = load_runs(runs, against)
    for line in comparison(loaded):
        typer.echo(line)
    if out:
        typer.echo(write_comparison(loaded, out))


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
