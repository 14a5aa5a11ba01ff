"""Time, memory and precision of a run on long recordings: python benchmarks/long_recordings.py 1e7 [csv] [x1]

Two (`x1`: one) recordings of a body that a drive heats, 10 readings a second, every row with ripple on the
power and noise on two readings. `discovery run` fits the body in a process of its own; printed are its
seconds, its largest memory, and each number of the model with the width of its 95 % interval next to what
all readings can give. By default for 1e5, 1e6 and 1e7 rows each in Parquet.
"""

from __future__ import annotations

import json
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from pyarrow import csv, parquet
from scipy.signal import lfilter

STEP, PIECE = 0.1, 1_000_000  # s, rows
C, G, LOSS, PER_K, NOISE = 60e3, 50.0, 0.4, 1.5, 0.5  # J/K, W/K, share, um/K, um
CAMPAIGN = """
name = "long"
[channels]
T_env = { role = "ambient temperature", unit = "degC" }
P     = { role = "heat load", unit = "W" }
E_Y   = { role = "error", unit = "um", noise = 0.5 }
T_b   = { role = "temperature", unit = "degC", noise = 0.1 }
[recordings]
"""
MODEL = """
name = "one body"
[parameters]
G    = { start = 30.0, unit = "W/K", min = 0.0 }
loss = { start = 0.2, unit = "1", min = 0.0 }
k    = { start = 1.0, unit = "um/K" }
[states]
T_b = { unit = "degC", capacity = 60e3, start = "T_env" }
[[terms]]
into = "T_b"
expression = "G*(T_env - T_b) + loss*P"
[outputs]
E_Y = "k*(T_b - 22)"
"""
EXPERIMENT = """
name = "long"
campaign = "campaign.toml"
outputs = ["E_Y", "T_b"]
fit = [FIT]
[models]
body = { file = "model.toml" }
"""
Array = NDArray[np.float64]


def pieces(rows: int) -> list[tuple[int, int]]:
    return [(k, min(k + PIECE, rows)) for k in range(0, rows, PIECE)]


def write(path: Path, rows: int, seed: int) -> None:
    """A recording, piece by piece, exact where the power is held for a row."""
    rng = np.random.default_rng(seed)
    e = np.exp(-G / C * STEP)
    state = np.array([e * 22.0])
    writer = None
    levels = rng.choice([0.0, 400.0, 1500.0], int(rows * STEP / 600) + 2)
    for begin, end in pieces(rows):
        t = np.arange(begin, end) * STEP
        power = levels[(t / (1800.0 if rows > 2e5 else 600.0)).astype(int)]
        power = np.where(power > 0, power + rng.normal(0.0, 40.0, len(t)), 0.0)
        room = 22.0 + 2.0 * np.sin(2 * np.pi * t / 86400.0)
        body, state = lfilter([0.0, 1 - e], [1.0, -e], room + LOSS * power / G, zi=state)
        table = pa.table(
            {
                "time": t,
                "T_env": np.round(room, 3),
                "P": np.round(power, 1),
                "E_Y": np.round(PER_K * (body - 22.0) + rng.normal(0.0, NOISE, len(t)), 3),
                "T_b": np.round(body + rng.normal(0.0, 0.1, len(t)), 3),
            }
        )
        if writer is None:
            kind = csv.CSVWriter if path.suffix == ".csv" else parquet.ParquetWriter
            writer = kind(str(path), table.schema)
        writer.write_table(table)
    if writer is not None:
        writer.close()


def measured(rows: int, recordings: int, suffix: str, folder: Path) -> None:
    names = "abcdefgh"[:recordings]
    lines = [f'{name} = {{ file = "{name}.{suffix}" }}\n' for name in names]
    (folder / "campaign.toml").write_text(CAMPAIGN + "".join(lines))
    (folder / "model.toml").write_text(MODEL)
    (folder / "experiment.toml").write_text(EXPERIMENT.replace("FIT", ", ".join(f'"{n}"' for n in names)))
    for seed, name in enumerate(names):
        write(folder / f"{name}.{suffix}", rows, seed)
    began = time.perf_counter()
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "discovery.cli", "run", "experiment.toml", "--out", "out", "--quiet"]
    code = (
        "import resource, runpy, sys; sys.argv = ['discovery', *sys.argv[1:]]\n"
        "try:\n    runpy.run_module('discovery.cli', run_name='__main__')\n"
        "finally:\n    print('MB', resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)"
    )
    command = [sys.executable, "-c", code, *command[3:]]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    seconds, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode:
        sys.exit(done.stderr)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    memory = float(done.stdout.split("MB")[-1])
    size = sum(path.stat().st_size for path in folder.glob(f"*.{suffix}")) / 2**20
    print(f"{recordings} x {rows:.0e} rows, {suffix}, {size:.0f} MB: ", end="")
    print(f"{seconds:.1f} s, {cpu:.1f} s CPU, at most {memory:.0f} MB of memory")
    results = json.loads((folder / "out" / "results.json").read_text())
    for name, one in results["models"]["body"]["values"].items():
        true = {"G": G, "loss": LOSS, "k": PER_K}[name]
        half = (one["high"] - one["low"]) / 2
        off = (one["value"] - true) / (half / 1.96)
        print(f"   {name} = {one['value']:.6g} +- {half:.2g}, off by {off:+.1f} standard errors", flush=True)


def main() -> None:
    suffix = "csv" if "csv" in sys.argv else "parquet"
    recordings = next((int(a[1:]) for a in sys.argv[1:] if a.startswith("x")), 2)
    sizes = [int(float(a)) for a in sys.argv[1:] if a[0].isdigit()] or [10**5, 10**6, 10**7]
    for rows in sizes:
        with tempfile.TemporaryDirectory() as folder:
            measured(rows, recordings, suffix, Path(folder))


if __name__ == "__main__":
    main()
