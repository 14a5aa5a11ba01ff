"""A process that solves one case: `python -m discovery.challenge.solve CASE_FOLDER OUT_FOLDER METHOD...`.

It gets the folder of the case, where to write, and which methods; nothing leads from there to the answers.
"""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path

from discovery.challenge.methods import METHODS
from discovery.challenge.problem import timed
from discovery.files import write_atomic


def solve(case: Path, out: Path, methods: Sequence[str]) -> None:
    """Write OUT/<method>.json for each method, whole or not at all."""
    for name in methods:
        answer = timed(METHODS[name], case)
        write_atomic(out / f"{name}.json", json.dumps(answer) + "\n")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    solve(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3:])
