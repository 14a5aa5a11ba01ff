"""Recordings made by eq. (9) and three relatives of it, as an R-Test would see them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from discovery.recordings import Campaign, Channel, Recording

Array = NDArray[np.float64]

HOURS, STEP = 72, 10.0  # of a recording; seconds between inputs
CHANNELS = {
    "u1": ("ambient temperature", "degC", "linear"),
    "u2": ("heat load", "W", "held"),
    "u3": ("fluid temperature", "degC", "linear"),
    "speed": ("rotation speed", "rpm", "held"),
    "pump": ("fluid flow", "1", "held"),
    "decoy": ("other input", "1", "linear"),
}
LIBRARY = (
    "y", "1", "u1", "u2", "u3", "speed", "pump", "decoy", "speed**2", "speed**3", "pump*y", "pump*u1",
    "pump*u2", "pump*u3", "pump*speed", "u1**2", "u2**2", "y**2", "speed*y", "decoy*u1",
)  # fmt: skip

# Time constant in h and coefficients per hour, each drawn within 30 % of these sizes; one output per support.
TRUTH: dict[str, tuple[float, dict[str, float]]] = {
    "E1": (3.0, {"u1": -2.0, "u2": 12.0, "u3": 2.5, "1": 3.0}),  # eq. (9)
    "E2": (1.2, {"u1": -2.5, "u3": 4.0, "1": 3.0}),  # without the load
    "E3": (4.5, {"u1": -2.0, "u2": 8.0, "u3": 2.0, "speed**2": 6.0, "1": 3.0}),  # losses grow with the speed
    "E4": (
        2.0,
        {"u1": -2.0, "u2": 10.0, "pump*u3": 3.0, "pump*y": -0.3, "1": 3.0},
    ),  # fluid only while it runs
}


def make_campaign(
    seed: int, recordings: int, noise: float = 1.0
) -> tuple[Campaign, dict[str, dict[str, float]], dict[str, Array]]:
    """A data set: campaign, true coefficients by output and term, and the noise-free outputs of the last
    recording.
    """
    rng = np.random.default_rng(seed)
    truth = {
        name: {
            "y": -1.0 / (tau * rng.uniform(0.8, 1.25)),
            **{k: v * rng.uniform(0.7, 1.3) for k, v in terms.items()},
        }
        for name, (tau, terms) in TRUTH.items()
    }
    channels = {n: Channel(n, role, unit, None, between) for n, (role, unit, between) in CHANNELS.items()}  # type: ignore[arg-type]
    channels |= {name: Channel(name, "error", "um", noise, "linear") for name in TRUTH}
    made, clean = {}, {}
    for k in range(recordings):
        made[f"r{k}"], clean = _recording(rng, f"r{k}", truth, noise)
    return Campaign(f"recovery {seed}", channels, made, Path(f"recovery-{seed}")), truth, clean


def _recording(
    rng: np.random.Generator, name: str, truth: dict[str, dict[str, float]], noise: float
) -> tuple[Recording, dict[str, Array]]:
    count = int(HOURS * 3600 / STEP) + 1
    time = np.arange(count) * STEP
    hours = time / 3600
    u = {
        "u1": 2 * np.sin(2 * np.pi * (hours / 24 + rng.uniform())) + _wander(rng, count, 6.0, 1.0),
        "u2": _steps(rng, time, 2.0, lambda: rng.choice([0.0, 0.5, 1.0, 1.75])),
        "u3": 3 + 2 * np.sin(2 * np.pi * (hours / 17 + rng.uniform())) + _wander(rng, count, 4.0, 1.5),
        "speed": _steps(rng, time, 1.5, lambda: rng.uniform(0, 1.2)),
        "pump": _steps(rng, time, 2.5, lambda: float(rng.integers(0, 2))),
        "decoy": _wander(rng, count, 3.0, 1.0),
    }
    gaps = rng.choice(np.arange(30, 91), size=count)  # 5 to 15 minutes, in steps of 10 s
    read = np.concatenate([[0], np.cumsum(gaps)])
    read = read[read < count]
    values, clean = dict(u), {}
    for output, terms in truth.items():
        y = _simulate(terms, u)
        clean[output] = y
        values[output] = np.full(count, np.nan)
        values[output][read] = y[read] + noise * rng.standard_normal(len(read))
    return Recording(name, time, values), clean


def _steps(rng: np.random.Generator, time: Array, mean_hours: float, draw: object) -> Array:
    """A held signal that jumps to a new value after a random while."""
    out = np.empty(len(time))
    k = 0
    while k < len(time):
        length = max(30, int(rng.exponential(mean_hours * 3600) / STEP))
        out[k : k + length] = draw()  # type: ignore[operator]
        k += length
    return out


def _wander(rng: np.random.Generator, count: int, hours: float, size: float) -> Array:
    """Twice-filtered noise of a time constant and a standard deviation."""
    a = np.exp(-STEP / (hours * 3600 / 2))
    z = lfilter([1 - a], [1, -a], lfilter([1 - a], [1, -a], rng.standard_normal(count + 5000)))[5000:]
    return np.asarray(size * (z - z.mean()) / z.std())


def _simulate(terms: dict[str, float], u: dict[str, Array]) -> Array:
    """y' = sum of terms from rest, by exact steps with inputs held over each (10 s against hours)."""
    pole = terms["y"] + terms.get("pump*y", 0.0) * u["pump"]
    drive = np.full(len(pole), terms["1"])
    for word, size in terms.items():
        if word not in ("1", "y", "pump*y"):
            drive += size * _product(word, u)
    y = np.zeros(len(pole))
    for k in range(len(pole) - 1):
        decay = np.exp(pole[k] * STEP / 3600)
        y[k + 1] = decay * y[k] + (decay - 1) / pole[k] * drive[k]
    return y


def _product(word: str, u: dict[str, Array]) -> Array:
    """Value of "u1", "speed**2" or "pump*u3"."""
    if "**" in word:
        name, power = word.split("**")
        return np.asarray(u[name] ** int(power))
    return np.prod([u[name] for name in word.split("*")], axis=0)
