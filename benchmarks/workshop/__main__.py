"""Realistic machines of a workshop: python -m benchmarks.workshop FOLDER [CASE ...]

Writes the cases (all of them if none is named) into FOLDER, with `keys.json`.
`discovery challenge --cases-from FOLDER --no-baselines` then solves and scores them.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from .machines import CASES
from .writing import write_case


def write(folder: Path, names: Sequence[str]) -> None:
    """Write cases and their keys. Keys of cases that the folder already has stay."""
    place = folder / "keys.json"
    keys = json.loads(place.read_text("utf-8")) if place.exists() else {}
    for name in names:
        keys[name] = write_case(folder / name, name, CASES[name])
        place.write_text(json.dumps(keys, indent=1) + "\n", "utf-8")
        print(f"wrote {name}", flush=True)


def main() -> None:
    """Write the cases."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.workshop",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("cases", nargs="*", metavar="CASE", help=", ".join(CASES))
    given = parser.parse_args()
    unknown = [name for name in given.cases if name not in CASES]
    if unknown:
        parser.error(f"no case {unknown[0]!r}; choose from {', '.join(CASES)}")
    write(given.folder, given.cases or [*CASES])


if __name__ == "__main__":
    main()
