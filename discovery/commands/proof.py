"""The verb that puts the diagnosis to the proof."""

from pathlib import Path
from typing import Annotated

import typer

from discovery.threads import jobs as at_a_time
from discovery.threads import use_jobs


def challenge(
    family: Annotated[
        list[str] | None,
        typer.Option(help="Family of machines, may be repeated; `help` lists them [all]."),
    ] = None,
    cases: Annotated[int | None, typer.Option(min=1, help="Number of cases [200].")] = None,
    seed: Annotated[int | None, typer.Option(min=0, help="Seed of everything random [drawn now].")] = None,
    out: Annotated[Path, typer.Option("--out", help="Folder of the challenge.")] = Path("runs/challenge"),
    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs",
            "-j",
            min=1,
            help="Cases at a time, each in a process on one core. The answers are the same with any number. "
            "[every core; or the environment variable DISCOVERY_JOBS]",
        ),
    ] = None,
    baselines: Annotated[bool, typer.Option(help="Also solve with other methods.")] = True,
    cases_from: Annotated[
        Path | None, typer.Option(help="Use the cases of this folder, with keys.json or answers.json.")
    ] = None,
    write: Annotated[
        Path | None, typer.Option(help="Write cases and keys.json into this folder, and stop.")
    ] = None,
    score: Annotated[
        Path | None,
        typer.Option(
            help="Score the answers in this folder (case_01.json, ...) to the cases of --cases-from."
        ),
    ] = None,
) -> None:
    """Conceal effects in many simulated cases, seal the answers, solve the cases and score the diagnosis.

    --write only writes cases for practice, with their keys. It solves nothing. --score judges the answers of
    your own method to them: files in the form of diagnosis.json, case_01.json or case_01/diagnosis.json.

    \b
    discovery challenge --family headstock --cases 40 --seed 7 --write practice/headstock
    discovery challenge --cases-from practice/headstock --score my_answers
    discovery challenge --family portal --family printer --cases 60

    A case takes 20 s to 2 min of processor time with all methods. Run the same command again to continue
    after a stop. Writes report.html, results.json and challenge.md
    into OUT.
    """
    from discovery.challenge.run import challenge as run_challenge
    from discovery.challenge.run import family_list, practice
    from discovery.errors import UsageError
    from discovery.progress import shown

    use_jobs(jobs)
    if family and "help" in family:
        typer.echo(family_list())
        return
    if score is not None:
        from discovery.challenge.answers import score_answers

        if cases_from is None:
            raise UsageError("--score needs the cases: name their folder with --cases-from.")
        typer.echo("\n".join(score_answers(cases_from, score)))
        return
    with shown() as progress:
        if write is not None:
            typer.echo(practice(write, family or [], cases, seed, at_a_time(), progress))
            return
        outcome = run_challenge(out, family or [], cases, seed, at_a_time(), baselines, cases_from, progress)
    for line in outcome.lines:
        typer.echo(line)
    typer.echo(f"report: {outcome.folder / 'report.html'}")
