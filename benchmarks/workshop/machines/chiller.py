"""Cold plate of a diode laser: the coolant warms on its way, and the flow changes."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    COOLANT,
    FLOW,
    NOTHING,
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
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room, two_point, wander


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`flow`: the film coefficient follows the flow; otherwise it is fixed."""
    net = Network()
    plate, base = net.body(3600, 4, 90.0), net.body(9500, 3, 40.0)
    for part in range(4):
        net.link(plate, part, base, 0, 4.5)
    P = flicker(rng, levels(rng, count, 120, 620, 900, 0.25), 0.04)
    flow = levels(rng, count, 2, 8, 1500, 0.0)
    T_in = 19 + wander(rng, count, 900, 0.5) + 0.2 * two_point(count, 420.0)
    T_in = T_in + 1.5 * levels(rng, count, 0, 1, 3000, 0.3)
    T_amb = room(rng, count, 21.5)
    air = T_amb + local_air(rng, count)
    running = np.maximum(flow, 0.3)
    film = (running / 8) ** 0.78 if "flow" in acting else np.full(count, 0.62)

    def heat(T: Array, k: int) -> Array:
        into = np.zeros_like(T)
        into[plate] += 0.25 * P[k]
        water, carried = T_in[k], 69.5 * running[k]  # degC, W/K
        for part in range(4):
            taken = 70 * film[k] / 4 * (water - T[part])
            into[part] += taken
            water -= taken / carried
        into[base] += 1.3 * (air[k] - T[base])
        return into

    x = net.temperatures(count, T_amb[0], heat)
    read_flow = flow + 0.05 * wander(rng, count, 20, 1)
    return {
        "T_amb": T_amb,
        "T_in": T_in,
        "flow": read_flow,
        "P": P,
        "T_plate": x[:, plate][:, 1],
        "T_base": x[:, base][:, 1],
    }


def machine(film: str) -> Machine:
    """The machine with a law of its film coefficient in the model."""
    return Machine(
        channels={
            "T_amb": ambient(noise=0.04, step=0.05, lag=30, zero=0.25),
            "T_in": thermometer(noise=0.12, step=0.01, lag=12, zero=0.1, role=COOLANT),
            "flow": Channel(FLOW, "l/min", noise=0.04, step=0.05, gain=0.01),
            "P": power(relative=0.03, step=1),
            "T_plate": thermometer(noise=0.06, step=0.01, lag=8, zero=0.06),
            "T_base": thermometer(noise=0.06, step=0.01, lag=8, zero=0.06),
        },
        parameters=free("g", 0.9, "1") + free("hc", 50, "W/K") + free("G", 25, "W/K") + free("hA", 3, "W/K"),
        states={"T_plate": 3800.0, "T_base": 9000.0},
        terms=[
            ("T_plate", "", "g*P"),
            ("T_plate", "", f"{film}*(T_in - T_plate)"),
            ("T_plate", "T_base", "G*(T_base - T_plate)"),
            ("T_base", "", "hA*(T_amb - T_base)"),
        ],
        outputs=read("T_plate", "T_base"),
        every=15,
        hours=(5, 6, 5, 6),
        late=0.6,
        runs=("mon", "tue", "wed", "thu"),
    )


FLOWING = frozenset({"flow"})
CASES = {
    "chiller_a": Case(machine("hc*(flow/8)**0.8"), simulate, NOTHING, knows=FLOWING),
    "chiller_b": Case(
        machine("hc"),
        simulate,
        effect("fluid_convection_flow", "T_plate", also=["input_exchange"]),
        lacks=FLOWING,
    ),
}
