"""Injected faults: what a compensator is tried with before it is trusted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.guards import Reading

Array = NDArray[np.float64]

KINDS = (
    "nan", "infinite", "text", "none", "huge", "offset", "drift", "quality", "stale", "future", "no stamp",
    "missing", "frozen", "link", "clock back", "clock jump", "clock nan", "disabled", "part done",
    "acknowledge",
)  # fmt: skip


@dataclass(frozen=True)
class Injection:
    """A fault of one input (or of everything) for some time; `size` is in the unit of the input."""

    kind: str
    input: str
    start_s: float
    length_s: float
    size: float = 0.0


@dataclass(frozen=True)
class Trial:
    """Offsets (K, Y), states and status words of a run with faults."""

    offsets: Array
    states: tuple[str, ...]
    status: tuple[int, ...]


def try_faults(
    exported: Exported,
    inputs: Array,
    injections: Sequence[Injection],
    tick_s: float,
    settings: Settings | None = None,
) -> Trial:
    """Run a compensator on inputs (K, U) at ticks of `tick_s` while faults happen."""
    compensator = Compensator(exported, settings or Settings(tick_s=tick_s))
    names = exported.compiled.inputs
    offsets, states, status = [], [], []
    for k, row in enumerate(inputs):
        time = k * tick_s
        readings = {name: Reading(value, time) for name, value in zip(names, row.tolist(), strict=True)}
        now, options = time, {"enabled": True, "part_done": False}
        for one in injections:
            if one.start_s <= time < one.start_s + one.length_s:
                now = _inject(one, readings, now, options, inputs, names, tick_s)
                if one.kind == "acknowledge":
                    compensator.acknowledge()
        tick = compensator.tick(readings, now, **options)
        offsets.append(list(tick.offsets.values()))
        states.append(tick.state.name)
        status.append(tick.status)
    return Trial(np.array(offsets), tuple(states), tuple(status))


def _inject(
    one: Injection,
    readings: dict[str, Reading],
    now: float,
    options: dict[str, bool],
    inputs: Array,
    names: Sequence[str],
    tick_s: float,
) -> float:
    """Spoil the readings of a tick; returns its instant."""
    since = now - one.start_s
    first = inputs[min(int(one.start_s / tick_s), len(inputs) - 1)]
    value = readings[one.input].value if one.input in readings else None
    plain = value if isinstance(value, float) else 0.0
    match one.kind:
        case "nan" | "infinite" | "text" | "none" | "huge":
            wrong = {"nan": np.nan, "infinite": -np.inf, "text": "22.0", "none": None, "huge": 10**400}[
                one.kind
            ]
            readings[one.input] = Reading(wrong, now)
        case "offset":
            readings[one.input] = Reading(plain + one.size, now)
        case "drift":
            readings[one.input] = Reading(plain + one.size * since / 3600.0, now)
        case "quality":
            readings[one.input] = Reading(plain + one.size, now, False)
        case "stale":
            readings[one.input] = Reading(plain, now - 1e5)
        case "future":
            readings[one.input] = Reading(plain, now + 1e5)
        case "no stamp":
            readings[one.input] = Reading(plain, float("nan"))
        case "missing":
            readings.pop(one.input, None)
        case "frozen":
            readings[one.input] = Reading(float(first[names.index(one.input)]), now)
        case "link":
            for name, reading in readings.items():
                readings[name] = Reading(reading.value, one.start_s - 1.0, False)
        case "clock back":
            return now - abs(one.size) * 60.0
        case "clock jump":
            return now + abs(one.size) * 600.0
        case "clock nan":
            return float("nan")
        case "disabled":
            options["enabled"] = False
        case "part done":
            options["part_done"] = True
    return now


def violations(exported: Exported, trial: Trial, tick_s: float) -> dict[str, int]:
    """How often a run gave an offset that is not finite, beyond its limit, or moved faster than its rate."""
    errors = [o.range for o in exported.outputs if o.role == "error"]
    limit = np.array([r.limit for r in errors])
    most = np.array([r.rate for r in errors]) * tick_s
    moves = np.diff(trial.offsets, axis=0, prepend=0.0)
    return {
        "not finite": int(np.sum(~np.isfinite(trial.offsets))),
        "beyond the limit": int(np.sum(np.abs(trial.offsets) > limit * (1 + 1e-12))),
        "steps above the rate limit": int(np.sum(np.abs(moves) > most * (1 + 1e-9) + 1e-12)),
    }
