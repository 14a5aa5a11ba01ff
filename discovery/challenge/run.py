"""`discovery challenge` from start to end: write, seal, solve, check the seal, score, report."""

from __future__ import annotations

import json
import secrets
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from discovery.challenge.document import document, markdown, summary
from discovery.challenge.methods import METHODS, WORKBENCH
from discovery.challenge.pool import SOLVED, solve_all
from discovery.challenge.prepare import adopt, opened, practise, prepare
from discovery.challenge.seal import ANSWERS, SEAL, check_seal, read_seal, sha256
from discovery.challenge.tally import Tally, score_all, tally
from discovery.errors import UserError
from discovery.experiment.results import write_json
from discovery.files import read_text, write_atomic
from discovery.progress import Progress, silent
from discovery.virtual.families import FAMILIES

COUNT = 200


@dataclass(frozen=True)
class Outcome:
    """A scored challenge: its folder, the text for the terminal."""

    folder: Path
    tallies: dict[str, Tally]
    lines: list[str]


def challenge(
    out: Path,
    families: Sequence[str] = (),
    count: int | None = None,
    seed: int | None = None,
    jobs: int = 2,
    baselines: bool = True,
    source: Path | None = None,
    progress: Progress = silent,
) -> Outcome:
    """Run a challenge, or go on with the one in `out`.

    Args:
        families: of machines; none: every family.
        count: cases to write, default 200; on going on, as many as there are.
        seed: everything random comes from it; default drawn now, after the code is fixed.
        jobs: processes.
        baselines: solve with the other methods, too.
        source: folder of cases that exist, with their keys, instead of new ones.

    Raises:
        UserError: `out` holds another challenge, or a sealed file was changed.
    """
    methods = list(METHODS) if baselines else [WORKBENCH]
    if (out / SEAL).exists():
        _same(out, families, count, seed, source)
        seal = read_seal(out)
    elif source is not None:
        seal = adopt(out, source)
    else:
        drawn = secrets.randbelow(2**31) if seed is None else seed
        progress(f"seed {drawn}")
        seal = prepare(out, list(families) or list(FAMILIES), count or COUNT, drawn, jobs, progress)
    progress(f"sealed {seal['sealed']}: SHA-256 of {SEAL} {sha256((out / SEAL).read_bytes())}")
    cases = opened(out)
    failures = solve_all(out, cases, methods, jobs, progress)
    changed = check_seal(out, seal)
    progress("scoring")
    keys = json.loads(read_text(out / ANSWERS))["cases"]
    tallies = {name: tally(score_all(keys, read_answers(out, cases, name))) for name in methods}
    write_json(out / "results.json", document(seal, changed, failures, tallies))
    write_atomic(out / "challenge.md", markdown(tallies, seal))
    from discovery.challenge.page import render

    write_atomic(out / "report.html", render(seal, changed, tallies))
    notes = (
        [f"note: {len(changed)} source files are no longer what was sealed, e.g. {changed[0]}"]
        if changed
        else []
    )
    failed = [f"{case}: failed, {why}" for case, why in failures.items()]
    return Outcome(out, tallies, [markdown(tallies, seal), *summary(tallies), *failed, *notes])


def practice(
    folder: Path,
    families: Sequence[str],
    count: int | None,
    seed: int | None,
    jobs: int,
    progress: Progress = silent,
) -> str:
    """Write cases to practise on, and say what was written. Raises UserError as `prepare.practise` does."""
    drawn = secrets.randbelow(2**31) if seed is None else seed
    chosen = list(families) or list(FAMILIES)
    practise(folder, chosen, count or COUNT, drawn, jobs, progress)
    return f"{count or COUNT} cases of {', '.join(chosen)} (seed {drawn}) and keys.json in {folder}"


def family_list() -> str:
    """The families with what they are, one a line."""
    width = max(map(len, FAMILIES))
    return "\n".join(f"{name:{width}}  {summary_of(make)}" for name, make in FAMILIES.items())


def summary_of(make: Callable[..., object]) -> str:
    """First paragraph of the documentation of a family's module, as one line."""
    return " ".join(str(import_module(make.__module__).__doc__).split("\n\n")[0].split())


def read_answers(folder: Path, cases: Sequence[str], method: str) -> dict[str, dict[str, Any] | None]:
    """What a method answered, by case; None where it failed."""
    paths = {case: folder / SOLVED / case / f"{method}.json" for case in cases}
    return {case: json.loads(read_text(path)) if path.exists() else None for case, path in paths.items()}


def _same(
    out: Path, families: Sequence[str], count: int | None, seed: int | None, source: Path | None
) -> None:
    """Refuse to go on with a challenge that is not the one asked for."""
    answers = json.loads(read_text(out / ANSWERS))
    there = len(answers["cases"])
    another = (count is not None and count != there) or (seed is not None and seed != answers["seed"])
    if another or (families and list(families) != answers.get("families")):
        raise UserError(
            f"{out}: holds another challenge, of {there} cases; choose another place with --out, "
            "or leave out --family, --cases and --seed to go on with it"
        )
    if source is not None and answers["seed"] is not None:
        raise UserError(f"{out}: holds a challenge with cases of its own; choose another place with --out")
