"""Column of a milling machine in a hall: only its errors are read."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    NOTHING,
    Case,
    Machine,
    Physics,
    Signals,
    ambient,
    effect,
    error,
    free,
    power,
)
from benchmarks.workshop.network import Array, Network
from benchmarks.workshop.signals import Rng, clock, flicker, levels, local_air, room, wander


def sunshine(rng: Rng, count: int, run: str, acting: Physics) -> Array:
    """Heat of the sun on the back [W]: `sun` on one evening, `daily` on each day behind clouds."""
    hour = clock(count) / 3600
    if "sun" in acting and run == "tue":
        shines = (hour > 17) & (hour < 23.5)
        return np.asarray(230.0 * shines * np.clip(1 + 0.15 * wander(rng, count, 1500, 1), 0, 2))
    if "daily" in acting:
        height = np.clip(np.sin(2 * np.pi * (hour - 7) / 24), 0, 1)
        return np.asarray(150.0 * height**1.5 * (0.55 + 0.45 * (wander(rng, count, 5000, 1) > 0)))
    return np.zeros(count)


def simulate(rng: Rng, count: int, run: str, acting: Physics) -> Signals:
    """The air is warmer at the top. `sun` and `daily`: sunshine that nothing records."""
    net = Network()
    front, back, head = net.body(150000, 4, 70.0), net.body(190000, 5, 60.0), net.body(60000, 3, 80.0)
    net.link(front, 0, back, 0, 12.0)
    net.link(front, 3, back, 4, 12.0)
    net.link(front, 3, head, 0, 40.0)
    P = flicker(rng, levels(rng, count, 200, 1500, 7000, 0.3, at_rest_first=True), 0.04)
    T_hall = room(rng, count, 21, 1.8, 0.5)
    gradient = 0.3 + local_air(rng, count, 0.25)
    air = T_hall + local_air(rng, count, 0.15)
    sun = sunshine(rng, count, run, acting)
    exchange = np.repeat([2.2, 2.1, 2.0], [4, 5, 3])  # W/K
    height = np.concatenate([np.linspace(-0.5, 0.5, 4), np.linspace(-0.5, 0.5, 5), np.full(3, 0.5)])

    def heat(T: Array, k: int) -> Array:
        into = exchange * (air[k] + gradient[k] * height - T)
        into[head] += 0.16 * P[k] / 3
        into[back] += sun[k] / 5
        return np.asarray(into)

    x = net.temperatures(count, T_hall[0], heat) - 22
    F = x[:, front] @ np.array([0.2, 0.25, 0.25, 0.3])
    B = x[:, back] @ np.array([0.16, 0.18, 0.2, 0.22, 0.24])
    H = x[:, head] @ np.array([0.4, 0.3, 0.3])
    return {
        "T_hall": T_hall,
        "P": P,
        "E_Y": 4.1 * F - 4.6 * B + 1.1 * H,
        "E_Z": 3.2 * F + 2.9 * B + 2.4 * H,
        "E_A": -5.2 * F + 5.8 * B + 0.9 * H,
    }


MACHINE = Machine(
    channels={
        "T_hall": ambient(noise=0.05, step=0.1, lag=120, zero=0.3),
        "P": power(relative=0.05, step=10),
        "E_Y": error(noise=0.3),
        "E_Z": error(noise=0.3),
        "E_A": error(noise=0.4, unit="um/m"),
    },
    parameters=free("g", 0.2, "1")
    + free("Gfb", 15, "W/K")
    + free("Gfh", 30, "W/K")
    + free("hf", 7, "W/K")
    + free("hb", 9, "W/K")
    + free("hh", 5, "W/K"),
    states={"front": 150000.0, "back": 190000.0, "head": 60000.0},
    terms=[
        ("head", "", "g*P"),
        ("front", "head", "Gfh*(head - front)"),
        ("back", "front", "Gfb*(front - back)"),
        ("front", "", "hf*(T_hall - front)"),
        ("back", "", "hb*(T_hall - back)"),
        ("head", "", "hh*(T_hall - head)"),
    ],
    outputs={
        "E_Y": "4.1*(front - 22) + -4.6*(back - 22) + 1.1*(head - 22)",
        "E_Z": "3.2*(front - 22) + 2.9*(back - 22) + 2.4*(head - 22)",
        "E_A": "-5.2*(front - 22) + 5.8*(back - 22) + 0.9*(head - 22)",
    },
    every=300,
    hours=(48, 60, 48, 48),
    late=0.5,
    runs=("mon", "tue", "wed", "thu"),
)
CASES = {
    "column_a": Case(MACHINE, simulate, NOTHING),
    "column_b": Case(MACHINE, simulate, effect("unmeasured_heat", "back"), lacks=frozenset({"sun"})),
    "column_c": Case(
        MACHINE,
        simulate,
        effect("unmeasured_heat", "back", accepts=["unexplained"]),
        lacks=frozenset({"daily"}),
    ),
}
