"""How time and memory grow with the size of a job: python -m benchmarks.growth

Seconds of processor time (least of a few, compiled before) and the largest memory of Python's and numpy's own
allocations: against readings and recordings of a fit, bodies of a network, candidates of a sparse search. The
last column is the exponent p of time ~ size^p between the two largest sizes.
"""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import make_grid, make_system, simulate
from discovery.dynamics.sensitivity import sensitivities
from discovery.fitting import fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.optimiser import SparseSearch
from discovery.terms import Number, Term, parse

Array = NDArray[np.float64]
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "y": Channel("y", "temperature", "degC", 0.1, "linear"),
}


def recording(name: str, rows: int, every: int, seed: int) -> Recording:
    """72 h of power that switches, an output read every so many rows."""
    rng = np.random.default_rng(seed)
    t = np.linspace(0.0, 72 * 3600.0, rows)
    power = rng.choice([0.0, 300.0, 900.0], 80)[(t / t[-1] * 79).astype(int)]
    y = np.full(rows, np.nan)
    y[::every] = 22.0 + 5.0 * np.sin(t[::every] / 9e3) + rng.normal(0, 0.1, len(y[::every]))
    return Recording(name, t, {"P": power, "y": y})


def chain(bodies: int) -> Model:
    """Bodies in a row, the first one heated, the last one read."""
    parameters = {f"G{k}": Parameter(20.0, "W/K", 0.0) for k in range(bodies)}
    states = {f"b{k}": State(f"b{k}", "degC", 40e3, Number(22.0), 0.0) for k in range(bodies)}
    terms = [Term("heat", "b0", parse("P"))]
    for k in range(bodies):
        other = f"b{k + 1}" if k + 1 < bodies else "22"
        source = f"b{k + 1}" if k + 1 < bodies else None
        terms.append(Term(f"path {k}", f"b{k}", parse(f"G{k}*({other} - b{k})"), source))
    return Model("chain", parameters, states, tuple(terms), {"y": parse(f"b{bodies - 1}")})


def readings(count: int) -> Callable[[], object]:
    campaign = Campaign("c", CHANNELS, {"r": recording("r", count, 1, 0)})
    return lambda: fit_model(chain(1), campaign, ["r"], ["y"])


def recordings(count: int) -> Callable[[], object]:
    names = [f"r{k}" for k in range(count)]
    campaign = Campaign("c", CHANNELS, {n: recording(n, 4000, 10, k) for k, n in enumerate(names)})
    return lambda: fit_model(chain(1), campaign, names, ["y"])


def bodies(count: int) -> Callable[[], object]:
    campaign = Campaign("c", CHANNELS, {"r": recording("r", 4000, 10, 0)})
    system = make_system(chain(count), make_grid(campaign, "r", ["P"], ["y"]))
    values = system.model.values()
    return lambda: sensitivities(simulate(system, values), system.model.free)


def candidates(count: int) -> Callable[[], object]:
    rng = np.random.default_rng(0)
    x = rng.normal(size=(4000, count))
    y = (x[:, :4] @ np.array([1.0, -0.5, 0.8, 0.3]) + 0.1 * rng.normal(size=4000))[:, None]
    return lambda: SparseSearch(noise=[0.1]).fit(x, y)


JOBS: dict[str, tuple[Callable[[int], Callable[[], object]], Sequence[int]]] = {
    "readings of a fit": (readings, (1_000, 10_000, 100_000, 1_000_000)),
    "recordings of a fit": (recordings, (1, 4, 16, 64)),
    "bodies, run and all sensitivities": (bodies, (5, 10, 20, 50)),
    "candidates of a search": (candidates, (50, 500, 2000)),
}


def main() -> None:
    """Print the table."""
    print("| job | size | s | MB | exponent |\n|---|---|---|---|---|")
    for job, (make, sizes) in JOBS.items():
        make(sizes[0])()  # compiled
        before: tuple[int, float] | None = None
        for size in sizes:
            work, found = make(size), []
            for _ in range(3):
                began = time.process_time()
                work()
                found.append(time.process_time() - began)
            tracemalloc.start()
            work()
            memory = tracemalloc.get_traced_memory()[1] / 2**20
            tracemalloc.stop()
            grows = (
                "" if before is None else f"{np.log(min(found) / before[1]) / np.log(size / before[0]):.2f}"
            )
            print(f"| {job} | {size} | {min(found):.3g} | {memory:.0f} | {grows} |", flush=True)
            before = size, min(found)


if __name__ == "__main__":
    main()
