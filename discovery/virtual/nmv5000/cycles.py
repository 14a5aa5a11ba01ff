"""Test cycles by seed: the commands of the machine and the room around it, with the hours before a
recording.

R-Test readings need the table at rest: every reading is a stop of two minutes, with the sensors read in its
middle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UsageError
from discovery.virtual.network import Array, Inputs
from discovery.virtual.nmv5000.plant import PACE
from discovery.virtual.signals import HOUR, Draw, levels, room

STEP_S = PACE.step_s
STOP_S = 120.0
BEFORE_H = PACE.before_h
FLOW = 10.0  # l/min, nominal


@dataclass(frozen=True)
class Cycle:
    """Inputs over steps of `STEP_S`, the step where the recording begins, readings after it [s]."""

    inputs: Inputs
    first: int
    readings: Array
    fluid_start: float  # degC of the sump when the inputs begin


@dataclass(frozen=True)
class Pattern:
    """What differs between kinds; (n,) each, or a number."""

    air: Array
    speed: Array | float = 0.0
    flow: Array | float = 0.0  # l/min
    sump_heat: Array | float = 0.0
    height: Array | float | None = None
    cooling: Array | float = 22.0  # degC, set point
    fluid_start: float = 22.0


def make_cycle(
    kind: str, seed: int, hours: float = 72.0, nozzle_height_mm: float = 50.0, nozzle_side: float = 0.0
) -> Cycle:
    """A test cycle of `kind` (one of KINDS). The same arguments give the same cycle.

    Raises:
        UsageError: an unknown kind, a duration not between 1 h and 2000 h, an impossible nozzle.
    """
    if kind not in KINDS:
        raise UsageError(f"There is no test cycle '{kind}'; choose one of: {', '.join(KINDS)}.")
    if not 1.0 <= hours <= 2000.0:
        raise UsageError(f"A cycle of {hours:g} h is not possible; give --hours between 1 and 2000.")
    if not 5.0 <= nozzle_height_mm <= 500.0:
        raise UsageError(f"A nozzle at {nozzle_height_mm:g} mm is not possible; give 5 to 500 mm.")
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    first, n = round(BEFORE_H * HOUR / STEP_S), round((hours + BEFORE_H) * HOUR / STEP_S)
    p = KINDS[kind](rng, n, first)
    readings, stops = _readings(rng, n - first, first)
    flow = np.broadcast_to(p.flow, (n,)).astype(float)
    height = nozzle_height_mm if p.height is None else p.height
    inputs = {
        "T_env": p.air,
        "speed": np.where(stops, 0.0, p.speed),
        "flow": flow,
        "pump": (flow > 0).astype(float),
        "sump_heat": np.broadcast_to(p.sump_heat, (n,)).astype(float),
        "h_nozzle": np.broadcast_to(height, (n,)).astype(float),
        "nozzle_side": np.full(n, nozzle_side),
        "T_set": np.broadcast_to(p.cooling, (n,)).astype(float),
        "clock": (np.arange(n) - first + 0.5) * STEP_S,
    }
    return Cycle(inputs, first, readings, p.fluid_start)


def _readings(rng: Draw, n: int, first: int) -> tuple[Array, NDArray[np.bool_]]:
    """Instants every 10 to 15 min on the grid, and the steps in which the table stops for them."""
    gaps = rng.integers(60, 91, size=n // 60 + 1)
    at = np.concatenate([[0], np.cumsum(gaps)])
    at = at[at <= n - 6]
    stops, half = np.zeros(n + first, dtype=bool), round(STOP_S / STEP_S / 2)
    for k in at + first:
        stops[max(0, k - half) : k + half] = True
    return at * STEP_S, stops


def _random_speed(rng: Draw, n: int) -> Array:
    """Random speed pattern: jobs of 6 to 18 h with their own speeds, one twelfth of the time at rest."""
    job = levels(rng, n, STEP_S, 6, 18, lambda: float(rng.integers(400, 1200)))
    around = levels(rng, n, STEP_S, 0.3, 3.0, lambda: float(rng.integers(-300, 300)))
    resting = levels(rng, n, STEP_S, 0.3, 3.0, lambda: float(rng.uniform() < 0.08))
    return np.where(resting > 0, 0.0, np.clip(job + around, 100.0, 1200.0))


def _pauses(rng: Draw, n: int) -> Array:
    """Pump on at its nominal flow, with pauses of 0.4 to 1.5 h about every 15 h; l/min."""
    flow, at = np.full(n, FLOW), 0
    while at < n:
        at += round(rng.uniform(10, 20) * HOUR / STEP_S)
        end = at + round(rng.uniform(0.4, 1.5) * HOUR / STEP_S)
        flow[at:end] = 0.0
        at = end
    return flow


def _after(first: int, values: Array | float, n: int, before: float = 0.0) -> Array:
    """`values` from the beginning of the recording on, `before` in the hours before it."""
    out = np.broadcast_to(values, (n,)).astype(float).copy()
    out[:first] = before
    return out


def _held_room(rng: Draw, n: int) -> Array:
    return room(rng, n, STEP_S, 22.0, 0.05, 0.05)


def _wet(rng: Draw, n: int, first: int) -> Pattern:
    """Random cycle under fluid that is warm from the hours before."""
    del first
    return Pattern(room(rng, n, STEP_S), _random_speed(rng, n), _pauses(rng, n), fluid_start=26.0)


def _dry(rng: Draw, n: int, first: int) -> Pattern:
    """Random cycle without fluid, from a cold start."""
    return Pattern(room(rng, n, STEP_S), _after(first, _random_speed(rng, n), n))


def _flow(rng: Draw, n: int, first: int) -> Pattern:
    """As the wet cycle, with the flow in steps."""
    del first
    flow = levels(rng, n, STEP_S, 0.5, 3.0, lambda: float(rng.choice([0.0, 2.5, 5.0, 7.5, 10.0])))
    return Pattern(room(rng, n, STEP_S), _random_speed(rng, n), flow, fluid_start=25.0)


def _environment(rng: Draw, n: int, first: int) -> Pattern:
    """Only the room changes: machine at rest, pump off."""
    del first
    steps = levels(rng, n, STEP_S, 8, 16, lambda: float(rng.uniform(-1.5, 1.5)))
    return Pattern(room(rng, n, STEP_S, 22.0, 2.0, 0.8) + steps)


def _fluid(rng: Draw, n: int, first: int) -> Pattern:
    """Only the fluid changes: tank heated and cooled in steps, table at 60 rpm to be wet all round."""
    tank = levels(rng, n, STEP_S, 3, 10, lambda: float(rng.uniform(-900, 300)))
    return Pattern(_held_room(rng, n), _after(first, 60.0, n), _after(first, FLOW, n), _after(first, tank, n))


def _internal(rng: Draw, n: int, first: int) -> Pattern:
    """Only the drive works: random speed, pump off, room held."""
    return Pattern(_held_room(rng, n), _after(first, _random_speed(rng, n), n))


def _load_wet(rng: Draw, n: int, first: int) -> Pattern:
    """Only the drive works, under fluid that a cooler keeps near the room."""
    flow = np.full(n, FLOW)
    return Pattern(_held_room(rng, n), _after(first, _random_speed(rng, n), n), flow, np.full(n, -635.0))


def _cooling(rng: Draw, n: int, first: int) -> Pattern:
    """Only the axis cooling changes: its set point in steps, table at rest, pump off."""
    steps = levels(rng, n, STEP_S, 3, 10, lambda: float(rng.uniform(16.0, 24.0)))
    return Pattern(_held_room(rng, n), cooling=_after(first, steps, n, 22.0))


def _warm_up(rng: Draw, n: int, first: int) -> Pattern:
    """600 rpm for 60 % of the time (15 of 25 h), then at rest; pump on, fluid cold at the start."""
    pattern = _warm_up_dry(rng, n, first)
    return Pattern(pattern.air, pattern.speed, _after(first, FLOW, n))


def _warm_up_dry(rng: Draw, n: int, first: int) -> Pattern:
    """The same without fluid."""
    speed = np.where(np.arange(n) < first + 0.6 * (n - first), 600.0, 0.0)
    return Pattern(room(rng, n, STEP_S, 22.0, 0.1, 0.1), _after(first, speed, n))


def _nozzle(rng: Draw, n: int, first: int) -> Pattern:
    """Height and flow matter: table at rest, warm fluid in pulses of their own flow and height."""
    flow = levels(rng, n, STEP_S, 0.3, 1.2, lambda: float(rng.choice([0.0, 0.0, 2.0, 3.0, 5.0, 8.0, 14.0])))
    height = levels(rng, n, STEP_S, 0.6, 2.0, lambda: float(rng.choice([20.0, 50.0, 100.0, 200.0, 400.0])))
    tank = levels(rng, n, STEP_S, 2.0, 6.0, lambda: float(rng.uniform(0.0, 1500.0)))
    return Pattern(_held_room(rng, n), 0.0, _after(first, flow, n), tank, height, fluid_start=27.0)


def _flooded(rng: Draw, n: int, first: int) -> Pattern:
    """Height and flow do not matter: the table turns under plenty of fluid."""
    flow = levels(rng, n, STEP_S, 0.5, 2.0, lambda: float(rng.choice([8.0, 12.0, 16.0])))
    height = levels(rng, n, STEP_S, 0.6, 2.0, lambda: float(rng.choice([20.0, 50.0, 100.0, 200.0, 400.0])))
    del first
    return Pattern(room(rng, n, STEP_S), _random_speed(rng, n), flow, height=height, fluid_start=27.0)


# The order is part of the seed: append only.
KINDS: dict[str, Callable[[Draw, int, int], Pattern]] = {
    "fit": _wet,
    "validation": _wet,
    "dry": _dry,
    "flow": _flow,
    "environment": _environment,
    "fluid": _fluid,
    "internal": _internal,
    "warm_up": _warm_up,
    "warm_up_dry": _warm_up_dry,
    "load_wet": _load_wet,
    "cooling": _cooling,
    "nozzle": _nozzle,
    "flooded": _flooded,
}
