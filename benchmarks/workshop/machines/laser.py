"""Laser cutting head: its temperatures and the shift of its focus."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    COOLANT,
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
from benchmarks.workshop.network import STEP, Array, Network
from benchmarks.workshop.signals import Rng, flicker, lagged, levels, local_air, room, two_point, wander

MELTING, LATENT, WAX = 29.0, 14000.0, 250.0  # degC, J, J/K


def wax_temperature(enthalpy: float) -> float:
    """Temperature [degC] of wax from its enthalpy [J] above the solid at its melting point."""
    return MELTING + (min(enthalpy, 0.0) + max(enthalpy - LATENT, 0.0)) / WAX


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`lens`: the beam heats a lens within 45 s. `wax`: some wax in the head melts."""
    net = Network()
    head, mount = net.body(2400, 3, 25.0), net.body(5200, 2, 30.0)
    net.link(head, 2, mount, 0, 3.2)
    P = flicker(rng, levels(rng, count, 800, 4000, 800, 0.3), 0.02)
    T_cool = 20 + wander(rng, count, 1500, 0.3) + 0.25 * two_point(count, 380.0)
    T_amb = room(rng, count, 23)
    air = T_amb + local_air(rng, count)
    lens = lagged(lagged(P / 4000.0, 45.0), 6.0) * (11.0 if "lens" in acting else 0.0)  # um
    enthalpy = WAX * (T_amb[0] - MELTING)

    def heat(T: Array, k: int) -> Array:
        nonlocal enthalpy
        into = np.zeros_like(T)
        into[head] += 0.034 * P[k] / 3 + 0.25 * (air[k] - T[head])
        into[2] += 6.5 * (T_cool[k] - T[2])
        into[mount] += 1.2 * (air[k] - T[mount])
        if "wax" in acting:
            flow = 7.0 * (T[0] - wax_temperature(enthalpy))
            enthalpy += flow * STEP
            into[0] -= flow
        return into

    x = net.temperatures(count, T_amb[0], heat)
    H, M = x[:, head] @ np.array([0.3, 0.35, 0.35]), x[:, mount][:, 1]
    return {
        "T_amb": T_amb,
        "T_cool": T_cool,
        "P": P,
        "T_head": x[:, head][:, 1],
        "T_mount": M,
        "E_focus": 1.9 * (H - 22) + 0.6 * (M - 22) + lens,
    }


MACHINE = Machine(
    channels={
        "T_amb": ambient(noise=0.05, step=0.1, lag=60, zero=0.3),
        "T_cool": thermometer(noise=0.08, step=0.1, lag=12, zero=0.1, role=COOLANT),
        "P": power(relative=0.03, step=10),
        "T_head": thermometer(noise=0.08, step=0.1, lag=6, zero=0.1),
        "T_mount": thermometer(noise=0.06, step=0.1, lag=10, zero=0.1),
        "E_focus": error(noise=0.4),
    },
    parameters=free("g", 0.03, "1")
    + free("hc", 5, "W/K")
    + free("G", 3, "W/K")
    + free("hh", 0.8, "W/K")
    + free("hm", 2, "W/K")
    + free("zh", 2, "um/K", None)
    + free("zm", 0.5, "um/K", None),
    states={"T_head": 2500.0, "T_mount": 5000.0},
    terms=[
        ("T_head", "", "g*P"),
        ("T_head", "", "hc*(T_cool - T_head)"),
        ("T_mount", "T_head", "G*(T_head - T_mount)"),
        ("T_head", "", "hh*(T_amb - T_head)"),
        ("T_mount", "", "hm*(T_amb - T_mount)"),
    ],
    outputs={
        "E_focus": "zh*(T_head - 22) + zm*(T_mount - 22)",
        "T_head": "T_head",
        "T_mount": "T_mount",
    },
    every=10,
    hours=(4, 4, 5, 4),
    late=0.5,
)
CASES = {
    "laser_a": Case(MACHINE, simulate, effect("input_path", output="E_focus"), lacks=frozenset({"lens"})),
    "laser_b": Case(
        MACHINE,
        simulate,
        effect("out of catalogue", "T_head", accepts=["unexplained"], also=["second_thermal_mass"]),
        lacks=frozenset({"wax"}),
    ),
}
