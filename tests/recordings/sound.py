"""Recordings without a fault: how many of them `discovery check` warns of.

    python -m tests.recordings.sound [--frame FOLDER]

keeps the table of `benchmarks/damages.md`: the recordings of this repository, and simulated campaigns that
begin cold or warm. FOLDER has four recordings of the frame of a printer, not part of the repository.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from benchmarks.tables import keep
from discovery.firsthour.new import new
from discovery.recordings import load_campaign
from discovery.recordings.check import check_campaign
from tests.recordings.damages import write_campaign
from tests.recordings.simulated import Begin, simulated

DATASETS = Path(__file__).parents[2] / "datasets"
SEEDS: dict[Begin, range] = {"cold": range(700, 800), "warm": range(800, 900)}
FRAME = ("own_june05", "own_morning", "other_printer", "own_night")
FAULTY = ("own_june05", "other_printer")  # eleven readings 4.3 mm off; a sensor that is not connected
Row = tuple[str, int, int]


def warned(folder: Path, name: str) -> tuple[int, set[str], list[str]]:
    """Recordings of a campaign, those that are warned of, and the findings."""
    found = check_campaign(folder)
    said = [f"{name}: {one.file.name}: {one.what}" for one in found]
    return len(load_campaign(folder).recordings), {one.file.stem for one in found}, said


def shipped() -> Iterator[Row]:
    """Rows of the datasets of this repository."""
    for name in ("tclab", "nmv5000", "demonstration", "tanks"):
        count, bad, said = warned(DATASETS / name, name)
        print(*said, sep="\n", end="\n" if said else "")
        yield f"`datasets/{name}`", count, len(bad)


def frame(folder: Path) -> Row:
    """The frame of a printer: recordings that are sound. Each faulty one has to be warned of."""
    with tempfile.TemporaryDirectory() as name:
        made = Path(name) / "frame"
        files = [folder / f"{one}.csv.gz" for one in FRAME]
        new(made, files, statements=["mcu_pos_z=error,2.5 um"], quick=True)
        count, bad, said = warned(made, "frame")
    print(*said, sep="\n", end="\n" if said else "")
    named = sum(any(one.startswith(faulty) for one in bad) for faulty in FAULTY)
    sound = f"frame of a printer, not shipped ({named} of {len(FAULTY)} faulty recordings warned of)"
    return sound, count - len(FAULTY), len(bad) - named


def drawn(begin: Begin) -> Row:
    """Simulated campaigns of one beginning."""
    count = wrong = 0
    for seed in SEEDS[begin]:
        made = simulated(seed, begin)
        with tempfile.TemporaryDirectory() as name:
            folder = write_campaign(Path(name) / "c", "simulated", made.channels, made.frames)
            here, bad, said = warned(folder, f"seed {seed}, {begin}")
        count, wrong = count + here, wrong + len(bad)
        print(*said, sep="\n", end="\n" if said else "")
    seeds = f"seeds {SEEDS[begin][0]} to {SEEDS[begin][-1]}"
    return f"{len(SEEDS[begin])} simulated campaigns, {begin} at the beginning ({seeds})", count, wrong


def main(arguments: Sequence[str] | None = None) -> None:
    """Count, print what is found, keep the table."""
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("--frame", type=Path)
    given = asked.parse_args(arguments)
    rows = [*shipped(), *([frame(given.frame)] if given.frame else []), *(drawn(begin) for begin in SEEDS)]
    whole, wrong = sum(row[1] for row in rows), sum(row[2] for row in rows)
    after = f"{wrong} of {whole} sound recordings are warned of: {wrong / whole:.1%}.".replace("%", " %")
    print(after)
    command = "python -m tests.recordings.sound" + (" --frame FOLDER" if given.frame else "")
    keep("sound", command, ("recordings", "count", "warned of"), rows, after)


if __name__ == "__main__":
    main()
