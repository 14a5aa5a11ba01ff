"""Recordings without a fault: how many of them `discovery check` warns of.

    python -m tests.recordings.sound

keeps the table of `benchmarks/damages.md`: the recordings of this repository, and 100 simulated campaigns.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

from benchmarks.tables import keep
from discovery.recordings import load_campaign
from discovery.recordings.check import check_campaign
from tests.recordings.damages import write_campaign
from tests.recordings.simulated import simulated

DATASETS = Path(__file__).parents[2] / "datasets"
SEEDS = range(700, 800)


def warned(folder: Path, name: str) -> tuple[int, int, list[str]]:
    """Recordings of a campaign, those that are warned of, and the findings."""
    found = check_campaign(folder)
    files = {one.file.resolve() for one in found}
    said = [f"{name}: {one.file.name}: {one.what}" for one in found]
    return len(load_campaign(folder).recordings), len(files), said


def main() -> None:
    """Count, print what is found, keep the table."""
    rows: list[tuple[str, int, int]] = []
    for name in ("tclab", "nmv5000", "demonstration", "tanks"):
        count, bad, said = warned(DATASETS / name, name)
        rows.append((f"`datasets/{name}`", count, bad))
        print(*said, sep="\n")
    count = bad = 0
    for seed in SEEDS:
        made = simulated(seed)
        with tempfile.TemporaryDirectory() as name:
            folder = write_campaign(Path(name) / "c", "simulated", made.channels, made.frames)
            here, there, said = warned(folder, f"seed {seed}")
        count, bad = count + here, bad + there
        print(*said, sep="\n", end="\n" if said else "")
    rows.append((f"{len(SEEDS)} simulated campaigns (seeds {SEEDS[0]} to {SEEDS[-1]})", count, bad))
    whole, wrong = sum(row[1] for row in rows), sum(row[2] for row in rows)
    after = f"{wrong} of {whole} sound recordings are warned of: {wrong / whole:.1%}.".replace("%", " %")
    print(after)
    keep("sound", "python -m tests.recordings.sound", ("recordings", "count", "warned of"), rows, after)


if __name__ == "__main__":
    main()
