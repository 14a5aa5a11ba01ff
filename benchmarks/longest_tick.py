"""The longest tick of a learning compensation: python -m benchmarks.longest_tick [days]

Days of minutes with errors every half hour, as fast as they go; then ticks of a second in real time, while
the hypotheses are compared on all that was seen: by the process of the ticks, and by another one.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from benchmarks.month import ERRORS, TICK, Plan, World, machine, world
from discovery.export.document import Exported, render
from discovery.export.seal import private_key
from discovery.runtime.compensator import Settings
from discovery.runtime.guards import Reading
from discovery.runtime.learning import EVERY_S, Learner
from discovery.runtime.session import Session
from discovery.runtime.thinking import other_process

REAL = 60  # ticks of a second in real time


def readings(happening: World, k: int, now: float, *, errors: bool) -> dict[str, Reading]:
    """What the machine shows in a minute, at an instant."""
    found = {name: Reading(float(series[k]), now) for name, series in happening.inputs.items()}
    if errors:
        found |= {n: Reading(float(v), now) for n, v in zip(ERRORS, happening.probed[k], strict=True)}
    return found


def ticks(session: Session, happening: World, count: int) -> Iterator[float]:
    """Wall time [s] of each tick of a second: the first is due to compare the hypotheses."""
    assert session.learn is not None
    now = float(happening.times[count])
    session.learn.compared = -1e30
    for k in range(REAL):
        seen = readings(happening, count, now + k, errors=k == 0)
        began = time.perf_counter()
        session.tick(seen, now + k)
        yield time.perf_counter() - began
        time.sleep(max(0.0, 1.0 - (time.perf_counter() - began)))


def learnt(exported: Exported, happening: World, count: int, folder: Path, thinking: object) -> Session:
    """A session that has seen all of it."""
    (folder / "model.json").write_bytes(render(exported.document))
    session = Session(
        exported, model=folder / "model.json", folder=folder / "memory", settings=Settings(tick_s=TICK),
        learn=Learner(private_key(folder / "key.pem")), save_every_s=EVERY_S,
    )  # fmt: skip
    assert session.learn is not None
    session.learn.compared = np.inf  # not before the end
    for k in range(count):
        now = float(happening.times[k])
        session.tick(readings(happening, k, now, errors=k % 30 == 0), now)
    session.thinking = thinking  # type: ignore[assignment]
    return session


def main(days: int) -> None:
    """Print the longest tick with and without another process."""
    exported, plan = machine(), Plan([], [], 24.0 * days + 1.0)
    happening = world(plan, 4300, faults=False, ageing=False)
    count = len(happening.times) - 2
    for title, process in (("the process of the ticks", nullcontext), ("another process", other_process)):
        with tempfile.TemporaryDirectory() as name, process() as thinking:
            session = learnt(exported, happening, count, Path(name), thinking)
            found = np.array(list(ticks(session, happening, count)))
            session.close(float(happening.times[-1]))
        print(
            f"compared by {title}: longest tick {1e3 * found.max():.0f} ms, "
            f"median {1e3 * np.median(found):.1f} ms",
            flush=True,
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 8)
