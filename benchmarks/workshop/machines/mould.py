"""Injection mould: the melt heats the cavity, and water tempers it."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    COOLANT,
    NOTHING,
    Case,
    Machine,
    Physics,
    Signals,
    ambient,
    effect,
    free,
    power,
    read,
    thermometer,
)
from benchmarks.workshop.network import Array, Network
from benchmarks.workshop.signals import Rng, flicker, lagged, levels, local_air, room, wander


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """The water warms on its way. `insert`: a large insert in the cavity that nothing reads."""
    net = Network()
    cavity, back = net.body(11000, 4, 120.0), net.body(26000, 4, 80.0)
    net.link(cavity, 3, back, 0, 22.0)
    if "insert" in acting:
        net.link(cavity, 1, net.body(24000), 0, 19.0)
    P = flicker(rng, levels(rng, count, 500, 2600, 1100, 0.25, at_rest_first=True), 0.08, 12)
    T_water = 30 + wander(rng, count, 1200, 0.8)
    T_water = lagged(T_water + 8 * levels(rng, count, 0, 1, 3500, 0.3, at_rest_first=True), 200.0)
    T_amb = room(rng, count, 24)
    air = T_amb + local_air(rng, count)

    def heat(T: Array, k: int) -> Array:
        into, wall, water = np.zeros_like(T), T[cavity], T_water[k]
        warmed = water + 0.5 * max(wall[2] - water, 0.0) * 85 / 840.0
        into[cavity] += np.array(
            [0.6 * P[k], 0.4 * P[k] + 35 * (water - wall[1]), 50 * (warmed - wall[2]), 0.0]
        )
        into[back] += 1.7 * (air[k] - T[back])
        return into

    x = net.temperatures(count, T_amb[0], heat)
    return {
        "T_amb": T_amb,
        "T_water": T_water,
        "P": P,
        "T_cav": x[:, cavity][:, 1],
        "T_back": x[:, back][:, 1],
    }


MACHINE = Machine(
    channels={
        "T_amb": ambient(noise=0.05, step=0.1, lag=60, zero=0.4),
        "T_water": thermometer(noise=0.1, step=0.1, lag=15, zero=0.15, role=COOLANT),
        "P": power(relative=0.05, step=5),
        "T_cav": thermometer(noise=0.12, step=0.1, lag=5, zero=0.15),
        "T_back": thermometer(noise=0.08, step=0.1, lag=12, zero=0.1),
    },
    parameters=free("g", 0.8, "1") + free("hc", 70, "W/K") + free("G", 18, "W/K") + free("hA", 5, "W/K"),
    states={"T_cav": 11500.0, "T_back": 25000.0},
    terms=[
        ("T_cav", "", "g*P"),
        ("T_cav", "", "hc*(T_water - T_cav)"),
        ("T_back", "T_cav", "G*(T_cav - T_back)"),
        ("T_back", "", "hA*(T_amb - T_back)"),
    ],
    outputs=read("T_cav", "T_back"),
    every=20,
    hours=(5, 6, 5, 5),
    late=0.9,
)
CASES = {
    "mould_a": Case(MACHINE, simulate, NOTHING),
    "mould_b": Case(MACHINE, simulate, effect("second_thermal_mass", "T_cav"), lacks=frozenset({"insert"})),
}
