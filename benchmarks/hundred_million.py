"""One recording of 1e8 rows (115 days at 10 Hz), loaded and fitted: python -m benchmarks.hundred_million

Readings repeat every million rows, so that the file is written at once; prints seconds of processor time and
the largest memory of the process after each step.
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyarrow as pa
from pyarrow import parquet
from scipy.signal import lfilter

from benchmarks.long_recordings import CAMPAIGN, LOSS, MODEL, NOISE, PER_K, STEP, C, G

PIECE = 1_000_000


def write(path: Path, rows: int) -> None:
    """A power that repeats every PIECE rows, so that from the second piece on the body does, too."""
    rng = np.random.default_rng(0)
    power = np.repeat(rng.choice([0.0, 400.0, 1500.0], PIECE // 20_000), 20_000)
    e = np.exp(-G / C * STEP)
    twice = lfilter([0.0, 1 - e], [1.0, -e], np.tile(22.0 + LOSS * power / G, 2), zi=[e * 22.0])[0]
    writer = None
    for k in range(0, rows, PIECE):
        body = twice[:PIECE] if k == 0 else twice[PIECE:]
        columns = {
            "time": (np.arange(PIECE) + k) * STEP,
            "T_env": np.full(PIECE, 22.0),
            "P": power,
            "E_Y": np.round(PER_K * (body - 22.0) + rng.normal(0.0, NOISE, PIECE), 2),
            "T_b": np.round(body + rng.normal(0.0, 0.1, PIECE), 2),
        }
        table = pa.table(columns)
        writer = writer or parquet.ParquetWriter(str(path), table.schema, compression="none")
        writer.write_table(table)
    if writer is not None:
        writer.close()


def main() -> None:
    rows = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10**8
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder / "a.parquet", rows)
        (folder / "campaign.toml").write_text(CAMPAIGN + 'a = { file = "a.parquet" }\n')
        (folder / "model.toml").write_text(MODEL)

        def said(what: str, began: float) -> None:
            memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
            print(
                f"{rows:.0e} rows, {what}: {time.process_time() - began:.1f} s CPU, {memory:.0f} MB",
                flush=True,
            )

        said("written", 0.0)
        from discovery.fitting import fit_model
        from discovery.models import read_model
        from discovery.recordings import load_campaign

        began = time.process_time()
        campaign = load_campaign(folder)
        said(f"read, {len(campaign.recordings['a'].time)} rows kept", began)
        fit = fit_model(read_model(folder / "model.toml"), campaign, ["a"], ["E_Y", "T_b"])
        said("read and fitted", began)
        for one in ("G", "loss", "k"):
            p = fit.model.parameters[one]
            assert p.low is not None
            assert p.high is not None
            print(f"   {one} = {p.value:.7g}, 95 % {p.low:.7g} to {p.high:.7g}")


if __name__ == "__main__":
    main()
