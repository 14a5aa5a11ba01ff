"""Vacuum chamber with a heated plate, a chuck and a flange in the room."""

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
    free,
    power,
    read,
    thermometer,
)
from benchmarks.workshop.network import BOLTZMANN, Array, Network, kelvin4
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`radiation`: the plate radiates; otherwise it loses 0.55 W/K."""
    net = Network()
    plate, chuck, flange = net.body(2600, 3, 30.0), net.body(4200, 3, 20.0), net.body(12000, 3, 60.0)
    net.link(plate, 2, chuck, 0, 0.9)
    net.link(chuck, 2, flange, 0, 1.6)
    P = flicker(rng, levels(rng, count, 15, 150, 2400, 0.25), 0.03)
    T_amb = room(rng, count, 22)
    air = T_amb + local_air(rng, count)

    def heat(T: Array, k: int) -> Array:
        into = np.zeros_like(T)
        into[plate] += P[k] / 3
        if "radiation" in acting:
            into[plate] += BOLTZMANN * 0.058 / 3 * (kelvin4(air[k]) - kelvin4(T[plate]))
        else:
            into[plate] += 0.55 / 3 * (air[k] - T[plate])
        into[flange] += 1.4 * (air[k] - T[flange])
        return into

    x = net.temperatures(count, T_amb[0], heat)
    bodies = {"T_plate": plate, "T_chuck": chuck, "T_flange": flange}
    return {"T_amb": T_amb, "P": P, **{name: x[:, body][:, 1] for name, body in bodies.items()}}


def machine(loss: str, parameter: str) -> Machine:
    """The machine with a law of the loss of the plate in the model."""
    return Machine(
        channels={
            "T_amb": ambient(noise=0.05, step=0.1, lag=40, zero=0.3),
            "P": power(relative=0.02, step=0.5),
            "T_plate": thermometer(noise=0.2, step=0.1, lag=6, zero=0.3),
            "T_chuck": thermometer(noise=0.1, step=0.1, lag=6, zero=0.15),
            "T_flange": thermometer(noise=0.06, step=0.1, lag=10, zero=0.1),
        },
        parameters=free("g", 1.0, "1")
        + free("Gpc", 1.2, "W/K")
        + free("Gcf", 1.2, "W/K")
        + free("hA", 3, "W/K")
        + parameter,
        states={"T_plate": 2700.0, "T_chuck": 4000.0, "T_flange": 12500.0},
        terms=[
            ("T_plate", "", "g*P"),
            ("T_chuck", "T_plate", "Gpc*(T_plate - T_chuck)"),
            ("T_flange", "T_chuck", "Gcf*(T_chuck - T_flange)"),
            ("T_flange", "", "hA*(T_amb - T_flange)"),
            ("T_plate", "", loss),
        ],
        outputs=read("T_plate", "T_chuck", "T_flange"),
        every=30,
        hours=(8, 8, 10, 8),
        late=0.4,
    )


RAYS = frozenset({"radiation"})
RADIATING = machine("A*5.67e-8*((T_amb + 273.15)**4 - (T_plate + 273.15)**4)", free("A", 0.04, "m**2"))
CASES = {
    "vacuum_a": Case(RADIATING, simulate, NOTHING, knows=RAYS),
    "vacuum_b": Case(
        machine("hp*(T_amb - T_plate)", free("hp", 0.5, "W/K")),
        simulate,
        effect("radiation", "T_plate", also=["natural_convection"]),
        lacks=RAYS,
    ),
}
