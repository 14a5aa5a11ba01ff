"""Axis with a linear motor: a slide on a beam, and a pump that stands on the slide."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    Case,
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
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`pump`: 14 % of the power of the pump heat the slide."""
    net = Network()
    coil, slide, beam = net.body(3200, 2, 60.0), net.body(13000, 4, 70.0), net.body(52000, 6, 60.0)
    net.link(coil, 1, slide, 0, 11.0)
    net.link(slide, 3, beam, 2, 3.5)
    net.link(slide, 1, beam, 1, 1.5)
    P_coil = flicker(rng, levels(rng, count, 40, 420, 900, 0.25), 0.08, 12)
    P_pump = flicker(rng, levels(rng, count, 150, 600, 2200, 0.35), 0.03)
    T_amb = room(rng, count, 22)
    air = T_amb + local_air(rng, count)
    pump = np.array([0.0, 0.0, 0.07, 0.07]) * ("pump" in acting)

    def heat(T: Array, k: int) -> Array:
        into = np.zeros_like(T)
        into[coil] += 0.42 * P_coil[k] + 0.4 * (air[k] - T[coil])
        into[slide] += pump * P_pump[k] + 1.4 * (air[k] - T[slide])
        into[beam] += 1.6 * (air[k] - T[beam])
        return into

    x = net.temperatures(count, T_amb[0], heat)
    return {
        "T_amb": T_amb,
        "P_coil": P_coil,
        "P_pump": P_pump,
        "T_slide": x[:, slide][:, 1],
        "T_beam": x[:, beam][:, 2],
        "E_X": 3.1 * (x[:, slide].mean(1) - 22) + 5.2 * (x[:, beam].mean(1) - 22),
    }


MACHINE = Machine(
    channels={
        "T_amb": ambient(noise=0.05, step=0.1, lag=60, zero=0.3),
        "P_coil": power(relative=0.06, step=1),
        "P_pump": power(relative=0.04, step=1),
        "T_slide": thermometer(noise=0.06, step=0.1, lag=12, zero=0.08),
        "T_beam": thermometer(noise=0.05, step=0.05, lag=15, zero=0.06),
        "E_X": error(noise=0.3),
    },
    parameters=free("g", 0.9, "1")
    + free("Gcs", 8, "W/K")
    + free("Gsb", 4, "W/K")
    + free("hc", 1, "W/K")
    + free("hs", 4, "W/K")
    + free("hb", 8, "W/K")
    + free("zs", 3, "um/K", None)
    + free("zb", 5, "um/K", None),
    states={"coil": 3300.0, "T_slide": 12500.0, "T_beam": 55000.0},
    terms=[
        ("coil", "", "g*P_coil"),
        ("T_slide", "coil", "Gcs*(coil - T_slide)"),
        ("T_beam", "T_slide", "Gsb*(T_slide - T_beam)"),
        ("coil", "", "hc*(T_amb - coil)"),
        ("T_slide", "", "hs*(T_amb - T_slide)"),
        ("T_beam", "", "hb*(T_amb - T_beam)"),
    ],
    outputs={
        "E_X": "zs*(T_slide - 22) + zb*(T_beam - 22)",
        "T_slide": "T_slide",
        "T_beam": "T_beam",
    },
    every=30,
    hours=(5, 6, 6, 5),
    late=0.4,
)
CASES = {"axis_a": Case(MACHINE, simulate, effect("input_heat", "T_slide"), lacks=frozenset({"pump"}))}
