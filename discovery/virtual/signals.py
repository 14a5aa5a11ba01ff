"""Random inputs by seed: the commands of a machine and the room around it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Draw = np.random.Generator
HOUR, DAY = 3600.0, 86400.0


def noise(rng: Draw, n: int, step_s: float, tau_s: float, sd: float) -> Array:
    """First-order noise (n,) of standard deviation `sd` and correlation time `tau_s`."""
    from scipy.signal import lfilter

    keep = float(np.exp(-step_s / tau_s))
    drive = rng.normal(0.0, sd * np.sqrt(1 - keep**2), n)
    drive[0] = rng.normal(0.0, sd)
    return np.asarray(lfilter([1.0], [1.0, -keep], drive))


def lagged(x: Array, step_s: float, tau_s: float) -> Array:
    """`x` (n,) through a first-order lag, settled at the beginning."""
    from scipy.signal import lfilter

    keep = float(np.exp(-step_s / tau_s))
    return np.asarray(lfilter([1 - keep], [1.0, -keep], x, zi=[keep * x[0]])[0])


def levels(
    rng: Draw, n: int, step_s: float, low_h: float, high_h: float, level: Callable[[], float]
) -> Array:
    """Random levels (n,), each held for a random time between `low_h` and `high_h` [h]."""
    values, at = np.empty(n), 0
    while at < n:
        end = at + max(1, round(rng.uniform(low_h, high_h) * HOUR / step_s))
        values[at:end] = level()
        at = end
    return values


def switched(
    rng: Draw, n: int, step_s: float, on_h: tuple[float, float], off_h: tuple[float, float]
) -> Array:
    """On and off in turn (n,), 1 and 0, each for a random time [h]; begins with either."""
    values, at, now = np.empty(n), 0, float(rng.uniform() < 0.5)
    while at < n:
        end = at + max(1, round(rng.uniform(*(on_h if now else off_h)) * HOUR / step_s))
        values[at:end] = now
        at, now = end, 1.0 - now
    return values


def shifts(rng: Draw, n: int, step_s: float, start_h: float = 0.0) -> Array:
    """Hours of work (n,), 1 and 0: a day begins between 6 and 8 o'clock and lasts 8 to 17 h.

    The recording begins at `start_h` o'clock.
    """
    clock = start_h + (np.arange(n) + 0.5) * step_s / HOUR
    working = np.zeros(n)
    for day in range(int(clock[-1] // 24) + 1):
        begin = 24.0 * day + rng.uniform(6.0, 8.0)
        working[(clock >= begin) & (clock < begin + rng.uniform(8.0, 17.0))] = 1.0
    return working


def room(
    rng: Draw, n: int, step_s: float, mean: float = 22.0, daily: float = 0.6, weather: float = 0.4
) -> Array:
    """Room temperature [degC]: a daily wave that is no sine and slow weather, straight between half hours."""
    t = (np.arange(n) + 0.5) * step_s
    knots = np.arange(0.0, n * step_s + 1801.0, 1800.0)
    turn = 2 * np.pi * (knots / DAY + rng.uniform())
    wave = np.sin(turn) + rng.uniform(0.0, 0.3) * np.sin(2 * turn + rng.uniform(0, 6.3))
    return np.asarray(
        mean + np.interp(t, knots, daily * wave + noise(rng, len(knots), 1800.0, 6 * HOUR, weather))
    )
