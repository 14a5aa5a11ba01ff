"""Spindle in a cooled housing: its growth, and the temperature of its nose."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    COOLANT,
    NOTHING,
    SPEED,
    Case,
    Channel,
    Machine,
    Physics,
    Signals,
    ambient,
    effect,
    error,
    free,
    power,
    thermometer,
)
from benchmarks.workshop.network import Array, Network
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room, two_point, wander


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`air`: the rotating nose stirs the air."""
    net = Network()
    shaft, housing, nose = net.body(6500, 4, 18.0), net.body(24000, 4, 90.0), net.body(2600)
    net.link(shaft, 0, housing, 0, 9.0)
    net.link(shaft, 3, housing, 3, 9.0)
    net.link(shaft, 0, nose, 0, 7.0)
    speed = levels(rng, count, 2000, 14000, 1300, 0.25, at_rest_first=True, grid=500)
    T_hall = room(rng, count, 22)
    air = T_hall + local_air(rng, count)
    T_cool = 21 + 0.35 * two_point(count, 260.0) + wander(rng, count, 1500, 0.2)
    P = flicker(rng, levels(rng, count, 300, 3500, 1000, 0.3) * (speed > 0), 0.06)
    turns = speed / 10000
    stirred = 0.8 + 6.5 * turns**0.75 * ("air" in acting)  # W/K

    def heat(T: Array, k: int) -> Array:
        into = np.zeros_like(T)
        into[shaft] += np.array([85, 0, 0, 60]) * turns[k] ** 1.45 + np.array([0, 1, 1, 0]) * 0.018 * P[k]
        into[housing] += 22 * (T_cool[k] - T[housing]) + 0.7 * (air[k] - T[housing])
        into[nose] += stirred[k] * (air[k] - T[nose])
        return into

    x = net.temperatures(count, T_hall[0], heat)
    S, H = x[:, shaft] @ np.array([0.22, 0.27, 0.27, 0.24]), x[:, housing].mean(1)
    N = x[:, nose][:, 0]
    return {
        "T_hall": T_hall,
        "T_cool": T_cool,
        "speed": speed,
        "P": P,
        "E_Z": 2.6 * (S - 22) + 1.1 * (N - 22) - 1.5 * (H - 22),
        "T_nose": N,
        "T_house": x[:, housing][:, 1],
    }


MACHINE = Machine(
    channels={
        "T_hall": ambient(noise=0.05, step=0.1, lag=60, zero=0.3),
        "T_cool": thermometer(noise=0.1, step=0.1, lag=15, zero=0.1, role=COOLANT),
        "speed": Channel(SPEED, "rpm", step=10),
        "P": power(relative=0.05, step=10),
        "E_Z": error(noise=0.25),
        "T_nose": thermometer(noise=0.15, step=0.1, lag=4, zero=0.15),
        "T_house": thermometer(noise=0.06, step=0.1, lag=15, zero=0.08),
    },
    parameters=free("Pf", 120, "W")
    + free("m", 1.5, "1", 0.8, 2.5)
    + free("g", 0.03, "1")
    + free("Gsh", 15, "W/K")
    + free("Gsn", 6, "W/K")
    + free("hc", 60, "W/K")
    + free("hA", 3, "W/K")
    + free("hn", 1, "W/K")
    + free("zs", 2.3, "um/K")
    + free("zn", 1, "um/K")
    + free("zh", 1.2, "um/K"),
    states={"shaft": 6500.0, "T_house": 24000.0, "T_nose": 2600.0},
    terms=[
        ("shaft", "", "Pf*(speed/10000)**m"),
        ("shaft", "", "g*P"),
        ("T_house", "shaft", "Gsh*(shaft - T_house)"),
        ("T_nose", "shaft", "Gsn*(shaft - T_nose)"),
        ("T_house", "", "hc*(T_cool - T_house)"),
        ("T_house", "", "hA*(T_hall - T_house)"),
        ("T_nose", "", "hn*(T_hall - T_nose)"),
    ],
    outputs={
        "E_Z": "zs*(shaft - 22) + zn*(T_nose - 22) - zh*(T_house - 22)",
        "T_nose": "T_nose",
        "T_house": "T_house",
    },
    every=30,
    hours=(6, 7, 6, 6),
    late=0.5,
    runs=("s1", "s2", "s3", "s4"),
)
CASES = {
    "spindle_a": Case(MACHINE, simulate, NOTHING),
    "spindle_b": Case(
        MACHINE, simulate, effect("rotating_air_convection", "T_nose"), lacks=frozenset({"air"})
    ),
}
