"""Battery pack on a cold plate, with a pump, a fan and a housing."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    COOLANT,
    NOTHING,
    OTHER,
    Case,
    Machine,
    Physics,
    Signals,
    ambient,
    effect,
    free,
    power,
    read,
    switch,
    thermometer,
)
from benchmarks.workshop.network import Array, Network
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room, switched, wander


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`fan`: it blows on the housing. `jacket`: the coolant touches the housing."""
    net = Network()
    cells, plate = net.body(21000, 5, 45.0), net.body(5200, 2, 120.0)
    housing = net.body(8200, 2, 30.0)
    net.link(cells, 4, plate, 0, 30.0)
    net.link(cells, 2, plate, 1, 6.0)
    net.link(cells, 0, housing, 0, 4.0)
    net.link(plate, 1, housing, 1, 5.0)
    current = np.abs(flicker(rng, levels(rng, count, 30, 190, 700, 0.25), 0.06, 15))
    pump, fan = switched(rng, count, 2400, 1500), switched(rng, count, 2500, 2500)
    T_cool = 18 + wander(rng, count, 1800, 0.6) + 2.5 * levels(rng, count, 0, 1, 4000, 0.3)
    T_amb = room(rng, count, 23)
    air = T_amb + local_air(rng, count)
    exchange = 1.6 + 3.4 * fan * ("fan" in acting)  # W/K
    jacket = 4.5 * ("jacket" in acting)  # W/K

    def heat(T: Array, k: int) -> Array:
        into = np.zeros_like(T)
        resistance = 0.0080 * (1 - 0.002 * (T[cells].mean() - 25))  # ohm
        into[cells] += resistance * current[k] ** 2 / 5
        into[plate] += 42 * pump[k] * (T_cool[k] - T[plate])
        into[housing] += exchange[k] * (air[k] - T[housing]) + jacket * (T_cool[k] - T[housing])
        return into

    x = net.temperatures(count, T_amb[0], heat)
    return {
        "T_amb": T_amb,
        "T_cool": T_cool,
        "pump": pump,
        "I": current,
        "fan": fan,
        "T_cells": x[:, cells][:, 1],
        "T_plate": x[:, plate][:, 0],
        "T_house": x[:, housing][:, 0],
    }


MACHINE = Machine(
    channels={
        "T_amb": ambient(noise=0.05, step=0.1, lag=40, zero=0.2),
        "T_cool": thermometer(noise=0.08, step=0.1, lag=10, zero=0.15, role=COOLANT),
        "pump": switch(),
        "I": power(relative=0.02, step=0.5, unit="A", role=OTHER),
        "fan": switch(),
        **{
            name: thermometer(noise=0.05, step=0.1, lag=12, zero=0.08)
            for name in ("T_cells", "T_plate", "T_house")
        },
    },
    parameters=free("R", 0.006, "ohm")
    + free("hc", 60, "W/K")
    + free("Gcp", 25, "W/K")
    + free("Gch", 3, "W/K")
    + free("Gph", 3, "W/K")
    + free("hA", 2.5, "W/K"),
    states={"T_cells": 20000.0, "T_plate": 5500.0, "T_house": 8500.0},
    terms=[
        ("T_cells", "", "R*I**2"),
        ("T_plate", "", "hc*pump*(T_cool - T_plate)"),
        ("T_plate", "T_cells", "Gcp*(T_cells - T_plate)"),
        ("T_house", "T_cells", "Gch*(T_cells - T_house)"),
        ("T_house", "T_plate", "Gph*(T_plate - T_house)"),
        ("T_house", "", "hA*(T_amb - T_house)"),
    ],
    outputs=read("T_cells", "T_plate", "T_house"),
    every=20,
    hours=(6, 8, 7, 6),
    late=0.3,
    runs=("r1", "r2", "r3", "r4"),
)
CASES = {
    "battery_a": Case(MACHINE, simulate, NOTHING),
    "battery_b": Case(MACHINE, simulate, effect("input_exchange", "T_house"), lacks=frozenset({"fan"})),
    "battery_c": Case(
        MACHINE, simulate, effect("coolant_convection", "T_house"), lacks=frozenset({"jacket"})
    ),
}
