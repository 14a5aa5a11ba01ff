"""Inputs of a machine in steps of 5 s: loads, switches, the room."""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from .network import STEP, Array

Rng = np.random.Generator


def clock(count: int) -> Array:
    """Time (N,) [s]."""
    return np.asarray(np.arange(count) * STEP)


def wander(rng: Rng, count: int, tau: float, size: float) -> Array:
    """A random walk that is drawn back to zero within `tau` s, of standard deviation `size`."""
    keep = np.exp(-STEP / tau)
    shocks = rng.normal(size=count) * size * np.sqrt(1 - keep * keep)
    shocks[0] = size * rng.normal()
    return np.asarray(lfilter([1], [1, -keep], shocks))


def lagged(series: Array, tau: float) -> Array:
    """First-order response to a series, with time constant `tau` [s], that begins settled."""
    keep = np.exp(-STEP / tau)
    return np.asarray(series[0] + lfilter([1 - keep], [1, -keep], series - series[0]))


def levels(
    rng: Rng,
    count: int,
    low: float,
    high: float,
    mean: float,
    rest: float,
    *,
    at_rest_first: bool = False,
    grid: float = 0.0,
) -> Array:
    """Multiples of `grid` from `low` to `high`, for about `mean` s each, a share `rest` of them zero."""
    out, i = np.zeros(count), 0
    while i < count:
        lasting = int((rng.exponential(mean) + 0.3 * mean) / STEP)
        value = 0.0 if rng.random() < rest else rng.uniform(low, high)
        if grid:
            value = round(value / grid) * grid
        out[i : i + lasting] = 0.0 if at_rest_first and i == 0 else value
        i += lasting
    return out


def switched(rng: Rng, count: int, on: float, off: float) -> Array:
    """A switch: 1 for about `on` s, 0 for about `off` s."""
    out, i, state = np.zeros(count), 0, bool(rng.random() < 0.5)
    while i < count:
        mean = on if state else off
        lasting = int((rng.exponential(mean) + 0.3 * mean) / STEP)
        out[i : i + lasting] = state
        i += lasting
        state = not state
    return out


def flicker(rng: Rng, series: Array, share: float, tau: float = 25.0) -> Array:
    """A series that varies by `share` of itself within `tau` s: a logger reads it at an instant."""
    return np.asarray(series * (1 + share * wander(rng, len(series), tau, 1.0)))


def two_point(count: int, period: float) -> Array:
    """What a two-point controller does: 1 and -1 by turns, `period` in s."""
    return np.asarray(np.sign(np.sin(2 * np.pi * np.arange(count) * STEP / period)))


def room(
    rng: Rng, count: int, mean: float, day: float = 1.2, slow: float = 0.5, heating: float = 0.25
) -> Array:
    """Air of a room [degC]: a daily wave, slow changes, and a heating that switches on and off."""
    time, phase = clock(count), rng.uniform(0, 2 * np.pi)
    level = mean + rng.normal() * 0.6
    wave = day * (np.sin(2 * np.pi * time / 86400 + phase) - np.sin(phase))
    walk = wander(rng, count, 5400, slow)
    return np.asarray(level + wave + walk + heating * 0.5 * two_point(count, rng.uniform(700, 1300)))


def local_air(rng: Rng, count: int, size: float = 0.12) -> Array:
    """Difference [K] between the air near the machine and the air at the thermometer of the room."""
    return wander(rng, count, 6000, size)
