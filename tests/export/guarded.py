"""Readings with every kind of fault, and what the Python runtime makes of them when it ticks once a step."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.guards import Reading

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Faulty:
    """Values, ages and qualities (K, U), and switches (K, 3): enabled, part done, acknowledge."""

    value: Array
    age: Array
    good: NDArray[np.bool_]
    switches: NDArray[np.bool_]


def faulty(exported: Exported, inputs: Array, seed: int, episodes: int = 40) -> Faulty:
    """Episodes of faults of random inputs, some of them at the same time."""
    rng = np.random.default_rng(seed)
    steps, width = inputs.shape
    value, age, good = inputs.copy(), np.zeros_like(inputs), np.ones(inputs.shape, dtype=bool)
    switches = np.tile([True, False, False], (steps, 1))
    for _ in range(episodes):
        start, i = int(rng.integers(1, steps)), int(rng.integers(width))
        end = start + int(rng.choice([1, 6, 40, 400, 1700]))
        spec = exported.inputs[i].range
        kind = rng.choice(
            ["nan", "bad", "old", "wild", "step", "far", "still", "spike", "both", "off", "ack"]
        )
        if kind == "nan":
            value[start:end, i] = rng.choice([np.nan, np.inf, -np.inf])
        elif kind == "bad":
            good[start:end, i] = False
        elif kind == "old":
            age[start:end, i] = spec.age_s * rng.choice([0.5, 2.0, np.nan, -2.0])
        elif kind == "wild":
            value[start:end, i] = spec.plausible_high * 3.0 + 1e3
        elif kind in ("step", "far"):
            value[start:end, i] += rng.choice([-1, 1]) * (2.5 if kind == "step" else 15.0)
        elif kind == "still":
            value[start:end, i] = value[start, i]
        elif kind == "spike":
            value[start:end, i] = spec.low + rng.uniform(1.2, 4.0) * max(spec.high - spec.low, 1.0)
        elif kind == "both":
            value[start:end] += 2.2
        elif kind == "off":
            switches[start:end, 0] = False
        else:
            switches[start, int(rng.integers(1, 3))] = True
    return Faulty(value, age, good, switches)


def by_the_runtime(exported: Exported, given: Faulty) -> tuple[Array, NDArray[np.int64], Array]:
    """Offsets (K, Y), status words (K,) and gains (K,) of the Python runtime."""
    compensator, step = Compensator(exported, Settings(hindsight=False)), exported.compiled.step_s
    names, offsets, status, gains = exported.compiled.inputs, [], [], []
    for k, (enabled, done, acknowledge) in enumerate(given.switches.tolist()):
        now = k * step
        rows = zip(names, given.value[k].tolist(), given.age[k].tolist(), given.good[k].tolist(), strict=True)
        readings = {n: Reading(v, now - a, g) for n, v, a, g in rows}
        tick = compensator.tick(readings, now, enabled=enabled, part_done=done, acknowledge=acknowledge)
        offsets.append(list(tick.offsets.values()))
        status.append(tick.status)
        gains.append(compensator.gain)
    return np.array(offsets), np.array(status), np.array(gains)


def table(given: Faulty) -> str:
    """One row a tick: value, age, quality of each input, the three switches."""
    rows = []
    for k in range(len(given.value)):
        cells = [
            f"{v!r} {a!r} {int(g)}"
            for v, a, g in zip(*(x[k].tolist() for x in (given.value, given.age, given.good)), strict=True)
        ]
        rows.append(" ".join([*cells, *(str(int(s)) for s in given.switches[k])]))
    return "\n".join(rows) + "\n"
