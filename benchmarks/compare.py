"""Whether the workbench has become slower: python -m benchmarks.compare

Measures the ratios of benchmarks/side_by_side.py anew and holds them against benchmarks/figures.json.
Status 1 where a job takes half as long again as it did, next to the reference that runs on the same machine.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping

from benchmarks.side_by_side import FIGURES, pairs

SLOWER = 1.5


def slower(stored: Mapping[str, float], found: Mapping[str, float]) -> list[str]:
    """A sentence for each job that is slower by half, or gone.

    >>> slower({"run": 100.0, "fit": 10.0}, {"run": 60.0, "fit": 9.0})
    ['run: 60 times as fast as the reference, 100 before: slower by 67 %']
    """
    out = [f"{job}: not measured any more" for job in stored if job not in found]
    for job, before in stored.items():
        if job in found and found[job] * SLOWER < before:
            by = 100 * (before / found[job] - 1)
            out.append(
                f"{job}: {found[job]:.3g} times as fast as the reference, {before:.3g} before: "
                f"slower by {by:.0f} %"
            )
    return out


def main() -> None:
    """Print what is slower, and end with status 1 where anything is."""
    stored: dict[str, float] = json.loads(FIGURES.read_text())
    found = {one.job: one.ratio for one in pairs()}
    for job, ratio in found.items():
        print(
            f"{job}: {ratio:.3g} times as fast as the reference, {stored.get(job, float('nan')):.3g} before"
        )
    sys.exit("\n".join(lines) if (lines := slower(stored, found)) else 0)


if __name__ == "__main__":
    main()
