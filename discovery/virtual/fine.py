"""A finer machine than any model of the tool has: every body is a chain of nodes; drawn at random by seed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from discovery.virtual.cycles import HOUR, noise, room, steps

Array = NDArray[np.float64]

BODIES = ("table", "c_body_1", "c_body_2", "b_corpus", "side")
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
LINKS = ((0, 1), (1, 2), (2, 3), (3, 4), (1, 3))
LOSSES = (1, 2, 3)  # bodies that take drive loss
WET = (0, 1)  # bodies that the fluid floods
COOLED = 2
STEP_S = 20.0
T_REF = 22.0


@dataclass(frozen=True)
class Inputs:
    """Inputs of one recording over steps of 20 s, shape (n,): degC, rpm, W; the pump is 0 or 1."""

    air: Array
    fluid: Array
    pump: Array
    speed: Array
    drive: Array
    cooling: Array


@dataclass(frozen=True)
class FineMachine:
    """A machine: lumped values as a modeller would know them, and how each body is cut into nodes."""

    capacity: Array  # (5,) J/K
    links: Array  # (5,) W/K, along LINKS
    air: Array  # (5,) W/K
    loss: Array  # (3,) share of the drive power, along LOSSES
    cooling: float  # share of the cooling power
    wet: Array  # (2,) W/K, along WET
    outputs: Array  # (4, 5) um/K
    nodes: NDArray[np.int64]  # (5,)
    weights: tuple[Array, ...]  # share of each node in its body's capacity
    stiffness: float  # W/K from end to end of a body, times the sum of its outer conductances
    power: tuple[float, float, float]  # recorded drive power: linear and power part [W at 600 rpm], exponent


def draw_machine(rng: np.random.Generator) -> FineMachine:
    """A machine with 20 to 45 nodes; every value drawn."""

    def around(values: list[float], spread: float) -> Array:
        return np.asarray(np.array(values) * np.exp(rng.normal(0.0, spread, len(values))))

    nodes = rng.integers(4, 10, size=5)
    weights = tuple(w / w.sum() for w in (rng.uniform(0.7, 1.3, k) for k in nodes))
    outputs = np.array(
        [
            [0.0, -1.2, -1.6, -2.6, 0.8],
            [0.8, 1.6, 1.8, 0.7, -0.3],
            [2.2, 0.4, 0.0, 0.0, 0.0],
            [0.0, 1.3, 1.8, -3.0, 1.4],
        ]
    )
    return FineMachine(
        capacity=around([45e3, 65e3, 90e3, 190e3, 130e3], 0.3).round(),
        links=around([28.0, 35.0, 28.0, 18.0, 10.0], 0.3),
        air=around([3.0, 2.0, 3.0, 8.0, 10.0], 0.3),
        loss=around([0.25, 0.45, 0.12], 0.2),
        cooling=float(rng.uniform(0.8, 1.1)),
        wet=around([45.0, 14.0], 0.3),
        outputs=(outputs * rng.uniform(0.6, 1.5, outputs.shape)).round(4),
        nodes=nodes,
        weights=weights,
        stiffness=30.0,
        power=(float(rng.uniform(150, 250)), float(rng.uniform(60, 140)), float(rng.uniform(1.4, 1.9))),
    )


def lumped(m: FineMachine) -> FineMachine:
    """The same machine with one node a body: what the baseline believes."""
    one = tuple(np.ones(1) for _ in BODIES)
    return replace(m, nodes=np.ones(5, dtype=np.int64), weights=one)


def draw_inputs(rng: np.random.Generator, m: FineMachine, hours: float = 72.0) -> Inputs:
    """A random cycle: speed and pump in steps, room and fluid drifting, cooling that follows the load."""
    n = round(hours * HOUR / STEP_S)
    t = (np.arange(n) + 0.5) * STEP_S

    held = partial(steps, rng, n, step_s=STEP_S, least=3)
    top = rng.uniform(1000, 1200)
    speed = held(0.3, 3.2, lambda: 0.0 if rng.uniform() < 0.3 else float(rng.uniform(0.12, 1.0) * top))
    pump = held(0.5, 4.0, lambda: float(rng.uniform() < 0.55))
    air = (
        room(rng, n * 2, rng.uniform(0.8, 1.6), 0.5, rng.uniform(21, 23))[: 2 * n].reshape(n, 2).mean(axis=1)
    )
    mean, swing, period, phase = rng.uniform([2.0, 0.5, 15.0, 0.0], [4.0, 1.2, 30.0, 6.28])
    tank = mean + swing * np.sin(2 * np.pi * t / (period * HOUR) + phase)
    fluid = first_order((air + np.where(pump > 0, tank, 0.3 * tank)), rng.uniform(900, 2400))
    rotation = speed / 600.0
    drive = m.power[0] * rotation + m.power[1] * rotation ** m.power[2]
    share = rng.uniform(0.08, 0.2)
    cooling = (
        5.0 + share * first_order(drive, rng.uniform(1200, 4000)) + 4.0 * noise(rng, n, STEP_S, HOUR, 1.0)
    )
    return Inputs(air, fluid, pump, speed, drive, np.maximum(0.0, cooling))


def first_order(x: Array, tau_s: float, start: float | None = None) -> Array:
    """`x` (n,) through a first-order lag of `tau_s`."""
    from scipy.signal import lfilter

    keep = float(np.exp(-STEP_S / tau_s))
    begin = x[0] if start is None else start
    return np.asarray(lfilter([1 - keep], [1.0, -keep], x, zi=[keep * begin])[0])
