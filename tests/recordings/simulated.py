"""Sound campaigns of machines drawn at random: bodies, inputs, readings and noise of many kinds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Begin = Literal["cold", "warm"]
HOUR = 3600.0


@dataclass(frozen=True)
class Simulated:
    """`channels`: name -> role, unit. `frames`: recording -> columns with time."""

    channels: dict[str, tuple[str, str]]
    frames: dict[str, dict[str, Array]]


def simulated(seed: int, begin: Begin = "cold") -> Simulated:
    """A machine of two to five bodies, one to three loads, now and then a fluid; two to six recordings of it.

    Args:
        begin: "cold": all bodies begin at room temperature. "warm": every second recording, drawn by chance,
            begins at up to what loads of any size keep the bodies at.
    """
    rng = np.random.default_rng([seed, 7])
    before = np.random.default_rng([seed, 8])
    bodies, loads = int(rng.integers(2, 6)), int(rng.integers(1, 4))
    has_fluid, has_room = rng.random() < 0.4, rng.random() < 0.8
    step = float(rng.choice([1.0, 5.0, 10.0, 30.0, 60.0]))
    hours = float(rng.uniform(0.5, 3.0)) if step < 10 else float(rng.uniform(4.0, 60.0))
    tau = np.exp(rng.uniform(np.log(0.02), np.log(0.6), bodies)) * hours * HOUR
    loss = 1.0 / tau
    link = rng.uniform(0, 1, (bodies, bodies)) * (rng.random((bodies, bodies)) < 0.5) * loss[:, None]
    watts = np.exp(rng.uniform(np.log(50), np.log(4000), loads))
    gain = (
        rng.dirichlet(np.ones(bodies), loads).T * loss[:, None] * rng.uniform(3, 30, bodies)[:, None] / watts
    )
    wet = rng.uniform(0.3, 2.0, bodies) * loss * has_fluid
    outputs = int(rng.integers(1, 5))
    lever = rng.normal(0, 4, (outputs, bodies))
    errors = rng.random() < 0.7
    shown = [b for b in range(bodies) if rng.random() < 0.6] or [0]
    every = int(rng.choice([1, 1, 5, 10])) if step >= 10 else 1
    noise = np.exp(rng.uniform(np.log(0.1), np.log(1.0), outputs))
    channels: dict[str, tuple[str, str]] = {}
    if has_room:
        channels["T_env"] = ("ambient temperature", "degC")
    if has_fluid:
        channels |= {"T_fluid": ("fluid temperature", "degC"), "pump": ("fluid flow", "1")}
    kinds = [str(rng.choice(["W", "rpm", "percent"])) for _ in range(loads)]
    for k, unit in enumerate(kinds):
        role = "rotation speed" if unit == "rpm" else "heat load"
        channels[f"load{k}"] = (role, unit)
    for b in shown:
        channels[f"T{b}"] = ("temperature", "degC")
    if errors:
        for y in range(outputs):
            channels[f"E{y}"] = ("error", "um")
    frames = {}
    for r in range(int(rng.integers(2, 7))):
        n = int(rng.uniform(0.6, 1.2) * hours * HOUR / step)
        t = step * np.arange(n) + (rng.uniform(-0.1, 0.1, n) * step if rng.random() < 0.3 else 0.0)
        t = np.maximum.accumulate(t - t[0])
        room = (
            22
            + rng.normal(0, 2)
            + rng.uniform(0.2, 2) * np.sin(2 * np.pi * t / (24 * HOUR) + rng.uniform(0, 6))
        )
        power = np.array([_cycle(rng, n, w) for w in watts])
        flow = (_cycle(rng, n, 1.0) > 0.3).astype(float) if has_fluid else np.zeros(n)
        fluid = room + 4 + rng.normal(0, 1) + np.cumsum(rng.normal(0, 0.01, n))
        x = np.full(bodies, room[0]) + rng.normal(0, 0.1, bodies)
        if begin == "warm" and before.random() < 0.5:
            steady = np.linalg.solve(
                np.diag(loss + link.sum(axis=1)) - link, gain @ (watts * before.random(loads))
            )
            x = x + before.random() * steady
        states = np.empty((n, bodies))
        dt = np.diff(t, append=t[-1] + step)
        dry = link - np.diag(loss + link.sum(axis=1))
        heat = np.outer(room, loss) + (gain @ power).T + np.outer(flow * fluid, wet)
        long = np.minimum(dt, 0.3 / loss.max())
        between, driven = (
            long[:, None, None] * (dry - flow[:, None, None] * np.diag(wet)),
            long[:, None] * heat,
        )
        for k in range(n):
            states[k] = x
            x = x + between[k] @ x + driven[k]
        frame: dict[str, Array] = {"time": np.asarray(t, dtype=np.float64)}
        if has_room:
            frame["T_env"] = np.round(room + rng.normal(0, 0.05, n), 2)
        if has_fluid:
            frame |= {"T_fluid": np.round(fluid + rng.normal(0, 0.05, n), 2), "pump": flow}
        for k, unit in enumerate(kinds):
            scale = {"W": 1.0, "rpm": 3000 / watts[k], "percent": 100 / watts[k]}[unit]
            frame[f"load{k}"] = np.round(power[k] * scale, 1)
        for b in shown:
            frame[f"T{b}"] = np.round(states[:, b] + rng.normal(0, 0.05, n), 2)
        if errors:
            read = np.arange(n) % every == 0
            for y in range(outputs):
                value = (states - states[0]) @ lever[y] + rng.normal(0, noise[y], n)
                frame[f"E{y}"] = np.where(read, np.round(value, 2), np.nan)
        frames[f"run{r}"] = frame
    return Simulated(channels, frames)


def _cycle(rng: np.random.Generator, n: int, size: float) -> Array:
    """Blocks of different levels, as shifts and pauses make them."""
    count = int(rng.integers(3, 25))
    edges = np.sort(rng.integers(0, n, count))
    levels = rng.choice([0.0, 0.3, 0.5, 0.8, 1.0], count + 1) * size
    return np.asarray(levels[np.searchsorted(edges, np.arange(n), side="right")])
