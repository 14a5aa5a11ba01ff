"""Experiments of a folder on one and on two Dask workers: python -m benchmarks.dask_folder [experiments]

Copies of the experiment of the tests, 16 by default, on a scheduler with workers as processes; each worker
has done one experiment before the clock starts. Prints seconds by the clock and of processor time, and the
speed-up by the clock: on a machine that others use, it says what they left.
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import psutil
from distributed import Client, LocalCluster

from discovery.experiment.many import run_many
from tests.small import write_small

MISMATCH = '\n[mismatch]\nmodel = "one_body"\n'


def written(folder: Path, count: int) -> Path:
    for k in range(count):
        place = folder / f"machine_{k:02d}"
        place.mkdir(parents=True)
        write_small(place)
        with (place / "experiment.toml").open("a") as file:
            file.write(MISMATCH)
    return folder


def spent(workers: list[psutil.Process]) -> float:
    return sum(sum(w.cpu_times()[:2]) for w in workers)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 16
    seconds = {}
    for workers in (1, 2):
        with (
            tempfile.TemporaryDirectory() as name,
            LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster,
        ):
            place = Path(name)
            address = cluster.scheduler_address
            run_many(written(place / "warm", 2 * workers), place / "warm_out", address)
            with Client(address) as client:
                processes = [
                    psutil.Process(pid) for pid in client.run(lambda: __import__("os").getpid()).values()
                ]
            written(place / "all", count)
            used, began = spent(processes), time.perf_counter()
            done = run_many(place / "all", place / "out", address)
            seconds[workers] = time.perf_counter() - began
            used = spent(processes) - used
            failed = [one.failure for one in done if one.failure]
            print(
                f"{count} experiments, {workers} workers: {seconds[workers]:.1f} s, {used:.1f} s CPU {failed}"
            )
    print(
        f"speed-up {seconds[1] / seconds[2]:.2f}; load {psutil.getloadavg()[0]:.1f} on {psutil.cpu_count()}"
    )


if __name__ == "__main__":
    main()
