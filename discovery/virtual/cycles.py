"""Test cycles by seed: what the machine is told to do and what the room does, on a grid of 10 s.

R-Test readings need the table at rest, so every reading is a stop of two minutes in the speed, with
the sensors read in its middle.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UsageError

Array = NDArray[np.float64]
STEP_S = 10.0
STOP_S = 120.0
HOUR = 3600.0


@dataclass(frozen=True)
class Cycle:
    """Inputs held over steps of `step_s` [s], all of shape (n,), and the instants of the readings [s]."""

    step_s: float
    air: Array  # degC
    speed: Array  # rpm, with the stops of the readings
    flow: Array  # 0 ... 1 of the pump
    height: Array  # mm / 1000: m, nozzle above the table
    sump_heat: Array  # W, heater (+) or cooler (-) of the tank
    readings: Array  # s
    fluid_start: float  # degC


Draw = np.random.Generator


def make_cycle(kind: str, seed: int, hours: float = 72.0, nozzle_height_mm: float = 50.0) -> Cycle:
    """A test cycle of `kind` (one of KINDS). The same arguments give the same cycle.

    Raises UsageError for an unknown kind or a duration that is not between 1 h and 2000 h.
    """
    if kind not in KINDS:
        raise UsageError(f"There is no test cycle '{kind}'; choose one of: {', '.join(KINDS)}.")
    if not 1.0 <= hours <= 2000.0:
        raise UsageError(f"A cycle of {hours:g} h is not possible; give --hours between 1 and 2000.")
    if not 5.0 <= nozzle_height_mm <= 500.0:
        raise UsageError(f"A nozzle at {nozzle_height_mm:g} mm is not possible; give 5 to 500 mm.")
    rng = np.random.default_rng([seed, list(KINDS).index(kind)])
    n = round(hours * HOUR / STEP_S)
    pattern = KINDS[kind](rng, n)
    readings, stops = _readings(rng, n)
    return Cycle(
        STEP_S,
        pattern.air,
        np.where(stops, 0.0, pattern.speed),
        pattern.flow,
        np.full(n, nozzle_height_mm / 1000.0),
        pattern.sump_heat,
        readings,
        pattern.fluid_start,
    )


@dataclass(frozen=True)
class _Pattern:
    air: Array
    speed: Array
    flow: Array
    sump_heat: Array
    fluid_start: float


def _readings(rng: Draw, n: int) -> tuple[Array, NDArray[np.bool_]]:
    """Instants every 10 to 15 min on the grid, and the steps in which the table stands for them."""
    gaps = rng.integers(60, 91, size=n // 60 + 1)
    at = np.concatenate([[0], np.cumsum(gaps)])
    at = at[at <= n]
    stops, half = np.zeros(n, dtype=bool), round(STOP_S / STEP_S / 2)
    for k in at:
        stops[max(0, k - half) : k + half] = True
    return at * STEP_S, stops


def room(rng: Draw, n: int, daily: float = 0.6, weather: float = 0.4, mean: float = 22.0) -> Array:
    """Room temperature [degC]: a daily wave and slow weather, straight between half hours."""
    t = (np.arange(n) + 0.5) * STEP_S
    knots = np.arange(0.0, n * STEP_S + 1801.0, 1800.0)
    wander = noise(rng, len(knots), 1800.0, 6 * HOUR, weather)
    wave = daily * np.sin(2 * np.pi * (knots / (24 * HOUR) + rng.uniform()))
    return np.asarray(mean + np.interp(t, knots, wander + wave))


def noise(rng: Draw, n: int, step_s: float, tau_s: float, sd: float) -> Array:
    """First-order noise (n,) of standard deviation `sd` and correlation time `tau_s`."""
    from scipy.signal import lfilter

    keep = float(np.exp(-step_s / tau_s))
    drive = rng.normal(0.0, sd * np.sqrt(1 - keep**2), n)
    drive[0] = rng.normal(0.0, sd)
    return np.asarray(lfilter([1.0], [1.0, -keep], drive))


def steps(
    rng: Draw,
    n: int,
    low_h: float,
    high_h: float,
    level: Callable[[], float],
    step_s: float = STEP_S,
    least: int = 1,
) -> Array:
    """Random levels (n,) held for random times, from `low_h` to `high_h` [h] and at least `least` steps."""
    values, at = np.empty(n), 0
    while at < n:
        end = at + max(least, round(rng.uniform(low_h, high_h) * HOUR / step_s))
        values[at:end] = level()
        at = end
    return values


def _random_speed(rng: Draw, n: int) -> Array:
    """Random speed pattern: jobs of 6 to 18 h with their own speeds, one twelfth of the time at rest."""
    job = steps(rng, n, 6, 18, lambda: float(rng.integers(400, 1200)))
    around = steps(rng, n, 0.3, 3.0, lambda: float(rng.integers(-300, 300)))
    rest = steps(rng, n, 0.3, 3.0, lambda: float(rng.uniform() < 0.08))
    return np.where(rest > 0, 0.0, np.clip(job + around, 100.0, 1200.0))


def _pump(rng: Draw, n: int) -> Array:
    """Pump on, with pauses of 0.4 to 1.5 h about every 15 h."""
    flow, at = np.ones(n), 0
    while at < n:
        at += round(rng.uniform(10, 20) * HOUR / STEP_S)
        end = at + round(rng.uniform(0.4, 1.5) * HOUR / STEP_S)
        flow[at:end] = 0.0
        at = end
    return flow


def _wet(rng: Draw, n: int) -> _Pattern:
    air, speed, flow = room(rng, n), _random_speed(rng, n), _pump(rng, n)
    return _Pattern(air, speed, flow, np.zeros(n), 27.0 + rng.normal(0, 0.3))


def _dry(rng: Draw, n: int) -> _Pattern:
    return _Pattern(room(rng, n), _random_speed(rng, n), np.zeros(n), np.zeros(n), 22.0)


def _flow(rng: Draw, n: int) -> _Pattern:
    """As the wet cycle, with the flow in steps."""
    flow = steps(rng, n, 0.5, 3.0, lambda: float(rng.choice([0.0, 0.25, 0.5, 0.75, 1.0])))
    return _Pattern(room(rng, n), _random_speed(rng, n), flow, np.zeros(n), 25.0)


def _environment(rng: Draw, n: int) -> _Pattern:
    """Only the room changes: machine at rest, pump off."""
    air = room(rng, n, daily=2.0, weather=0.8) + steps(rng, n, 8, 16, lambda: float(rng.uniform(-1.5, 1.5)))
    return _Pattern(air, np.zeros(n), np.zeros(n), np.zeros(n), 22.0)


def _fluid(rng: Draw, n: int) -> _Pattern:
    """Only the fluid changes: tank heated and cooled in steps, table at 60 rpm to be wet all round."""
    tank = steps(rng, n, 3, 10, lambda: float(rng.uniform(-900, 300)))
    return _Pattern(room(rng, n, 0.05, 0.05), np.full(n, 60.0), np.ones(n), tank, 22.0)


def _internal(rng: Draw, n: int) -> _Pattern:
    """Only the drive works: random speed, pump off, room held."""
    return _Pattern(room(rng, n, 0.05, 0.05), _random_speed(rng, n), np.zeros(n), np.zeros(n), 22.0)


def _warm_up(rng: Draw, n: int) -> _Pattern:
    """600 rpm for 60 % of the time (15 of 25 h), then at rest; pump on, fluid cold at the start."""
    speed = np.where(np.arange(n) < 0.6 * n, 600.0, 0.0)
    return _Pattern(room(rng, n, 0.1, 0.1), speed, np.ones(n), np.zeros(n), 22.0)


# The order is part of the seed: append only.
KINDS: dict[str, Callable[[Draw, int], _Pattern]] = {
    "fit": _wet,
    "validation": _wet,
    "dry": _dry,
    "flow": _flow,
    "environment": _environment,
    "fluid": _fluid,
    "internal": _internal,
    "warm_up": _warm_up,
}
