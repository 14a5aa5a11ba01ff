"""What each constant of the diagnosis does: `python -m benchmarks.thresholds CASES [--constant NAME ...]`.

CASES is a folder of practice cases with `keys.json`, as `discovery challenge --practice` writes it. Every
case is diagnosed with each constant of `discovery/diagnosis/thresholds.py` unchanged, divided and multiplied
by 1.5, one constant at a time; the table counts what was right, wrong or missed, and how far probabilities
moved. A constant of which nothing moves on several families does not matter and should go.
"""

from __future__ import annotations

import argparse
import json
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from discovery.diagnosis import thresholds

FACTOR = 1.5
FIXED = ("DRAWS", "BLOCKS", "RIVALS_SHOWN")  # resolution, and what is shown


def constants() -> dict[str, Any]:
    """The constants that can be larger or smaller, with their values."""
    found = {name: value for name, value in vars(thresholds).items() if name.isupper()}
    return {name: value for name, value in found.items() if name not in FIXED}


def scaled(value: Any, factor: float) -> Any:
    """A constant times a factor; a probability stays one (its odds are scaled), and so do weights."""
    if isinstance(value, dict):
        return {scaled(size, factor): weight for size, weight in value.items()}
    if isinstance(value, tuple):
        return tuple(factor * v for v in value)
    if 0 < value < 1:
        odds = factor * value / (1 - value)
        return odds / (1 + odds)
    return type(value)(factor * value)


def solve(job: tuple[str, float, str, str]) -> tuple[str, float, str, str, float]:
    """One case with one constant changed: constant, factor, case, outcome, probability of what is named."""
    name, factor, folder, case = job
    from discovery.challenge.methods.workbench import workbench
    from discovery.challenge.problem import read_problem
    from discovery.challenge.scoring import judge

    before = getattr(thresholds, name, None)
    if name:
        setattr(thresholds, name, scaled(before, factor))
    try:
        answer = workbench(read_problem(Path(folder) / case))
    finally:
        if name:
            setattr(thresholds, name, before)
    key = json.loads((Path(folder) / "keys.json").read_text())[case]
    named = [float(p["probability"]) for p in answer["physics"]]
    return name, factor, case, judge(key, answer).word, max(named, default=0.0)


def jobs(folders: Sequence[str], names: Sequence[str]) -> Iterator[tuple[str, float, str, str]]:
    """Every case with nothing changed, then with each constant smaller and larger."""
    changes = [("", 1.0), *((name, f) for name in names for f in (1 / FACTOR, FACTOR))]
    for name, factor in changes:
        for folder in folders:
            for case in sorted(json.loads((Path(folder) / "keys.json").read_text())):
                yield name, factor, folder, case


def main() -> None:
    """Run the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("cases", nargs="+", help="folders of practice cases")
    parser.add_argument("--constant", action="append", choices=sorted(constants()), help="only this one")
    parser.add_argument("--jobs", type=int, default=2)
    asked = parser.parse_args()
    names = asked.constant or list(constants())
    known: dict[str, tuple[str, float]] = {}
    rows: dict[tuple[str, float], list[tuple[str, str, float]]] = {}
    with ProcessPoolExecutor(asked.jobs, mp_context=get_context("spawn")) as pool:
        for name, factor, case, word, chance in pool.map(solve, jobs(asked.cases, names)):
            rows.setdefault((name, factor), []).append((case, word, chance))
    known = {case: (word, chance) for case, word, chance in rows["", 1.0]}
    print("| constant | factor | outcomes | changed | probability moved by |\n|---|---|---|---|---|")
    for (name, factor), found in rows.items():
        count = ", ".join(f"{n} {word}" for word, n in Counter(word for _, word, _ in found).most_common())
        changed = ", ".join(case for case, word, _ in found if known[case][0] != word) or "none"
        moved = max(abs(chance - known[case][1]) for case, _, chance in found)
        print(f"| {name or 'as it is'} | {factor:.2f} | {count} | {changed} | {moved:.2f} |")


if __name__ == "__main__":
    main()
