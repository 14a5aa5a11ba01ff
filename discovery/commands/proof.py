"""The verb that puts the diagnosis to the proof."""

from pathlib import Path
from typing import Annotated

import typer


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
