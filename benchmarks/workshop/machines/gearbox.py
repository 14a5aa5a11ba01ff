"""Gearbox with an oil sump: churning heats the oil, friction under load the gears."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    SPEED,
    Case,
    Channel,
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
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room, wander


def simulate(rng: Rng, count: int, run: str, acting: Physics) -> Signals:
    """`thinning`: warm oil churns less. `wear`: more heat in w3, w4. `thermostat`: cools above 39 degC."""
    net = Network()
    gears, oil, housing = net.body(14000, 3, 60.0), net.body(16000), net.body(60000, 6, 90.0)
    for part in range(3):
        net.link(gears, part, oil, 0, 14.0)
    for part in range(3):
        net.link(housing, part, oil, 0, 16.0)
    speed = levels(rng, count, 400, 3000, 2400, 0.2, grid=100)
    P = flicker(rng, levels(rng, count, 2000, 22000, 1800, 0.15) * (speed > 0), 0.05)
    T_amb = room(rng, count, 20)
    air = T_amb + local_air(rng, count)
    worn = 1.45 if "wear" in acting and run in ("w3", "w4") else 1.0

    def heat(T: Array, k: int) -> Array:
        into, turns, sump = np.zeros_like(T), speed[k] / 1000, T[oil][0]
        thin = np.exp(-0.032 * (sump - 22)) if "thinning" in acting else 0.55
        into[oil] += (70 * turns**1.75 + 18 * turns) * thin * worn
        into[gears] += 0.011 * P[k] / 3
        warmer = T[housing] - air[k]
        into[housing] -= 1.5 * warmer * (1 + 0.004 * warmer)
        if "thermostat" in acting:
            into[oil] -= 26 * (sump - T_amb[k]) / (1 + np.exp(-(sump - 39.0) / 0.5))
        return into

    x = net.temperatures(count, T_amb[0], heat)
    return {
        "T_amb": T_amb,
        "speed": speed * (1 + 0.003 * wander(rng, count, 20, 1)),
        "P": P,
        "T_oil": x[:, oil][:, 0],
        "T_house": x[:, housing][:, 2],
    }


MACHINE = Machine(
    channels={
        "T_amb": ambient(noise=0.05, step=0.1, lag=60, zero=0.3),
        "speed": Channel(SPEED, "rpm", step=1),
        "P": power(relative=0.04, step=10),
        "T_oil": thermometer(noise=0.08, step=0.1, lag=20, zero=0.1),
        "T_house": thermometer(noise=0.08, step=0.1, lag=20, zero=0.1),
    },
    parameters=free("k_ch", 50, "W")
    + free("m", 1.6, "1", 0.8, 2.5)
    + free("mu", 0.012, "1")
    + free("Ggo", 30, "W/K")
    + free("Goh", 40, "W/K")
    + free("hA", 8, "W/K"),
    states={"gears": 14500.0, "T_oil": 15500.0, "T_house": 58000.0},
    terms=[
        ("T_oil", "", "k_ch*(speed/1000)**m"),
        ("gears", "", "mu*P"),
        ("T_oil", "gears", "Ggo*(gears - T_oil)"),
        ("T_house", "T_oil", "Goh*(T_oil - T_house)"),
        ("T_house", "", "hA*(T_amb - T_house)"),
    ],
    outputs=read("T_oil", "T_house"),
    every=60,
    hours=(10, 12, 9, 12),
    late=0.5,
    runs=("w1", "w2", "w3", "w4"),
)
CASES = {
    "gearbox_a": Case(
        MACHINE, simulate, effect("viscosity_temperature", "T_oil"), lacks=frozenset({"thinning"})
    ),
    "gearbox_b": Case(MACHINE, simulate, effect("wear", "T_oil"), lacks=frozenset({"wear"})),
    "gearbox_c": Case(
        MACHINE,
        simulate,
        effect("out of catalogue", "T_oil", accepts=["unexplained"]),
        lacks=frozenset({"thermostat"}),
    ),
}
