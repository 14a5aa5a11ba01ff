"""Joint of a robot: a motor, a gear and a link."""

from __future__ import annotations

import numpy as np

from benchmarks.workshop.case import (
    NOTHING,
    OTHER,
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
    two_effects,
)
from benchmarks.workshop.network import Array, Network
from benchmarks.workshop.signals import Rng, flicker, levels, local_air, room


def simulate(rng: Rng, count: int, _run: str, acting: Physics) -> Signals:
    """`friction`: in the gear; `thinning`: less of it when warm. `path`: the motor also touches the link."""
    net = Network()
    motor, gear, link = net.body(2100, 3, 12.0), net.body(2900, 3, 15.0), net.body(9500, 4, 12.0)
    net.link(motor, 2, gear, 0, 2.6)
    net.link(gear, 2, link, 0, 3.2)
    if "path" in acting:
        net.link(motor, 0, link, 1, 2.4)
    speed = levels(rng, count, 200, 2800, 700, 0.25, at_rest_first=True, grid=50)
    current = np.abs(flicker(rng, levels(rng, count, 1, 7.5, 600, 0.2), 0.08, 12))
    T_amb = room(rng, count, 23)
    air = T_amb + local_air(rng, count)
    turns = speed / 1000
    friction = 9.0 * turns + 6.5 * turns**1.8 + 4.0 * turns * np.exp(-((turns / 0.3) ** 2))  # W
    friction = friction * ("friction" in acting)
    thinning = 0.004 * ("thinning" in acting)  # 1/K

    def heat(T: Array, k: int) -> Array:
        into = np.zeros_like(T)
        copper = 0.85 * current[k] ** 2 * (1 + 0.0015 * (T[motor][1] - 30))
        into[motor] += copper / 3 + 0.35 * (air[k] - T[motor])
        into[gear] += 0.4 * (air[k] - T[gear]) + friction[k] * (1 - thinning * (T[gear][1] - 30)) / 3
        into[link] += 0.55 * (air[k] - T[link])
        return into

    x = net.temperatures(count, T_amb[0], heat)
    bodies = {"T_motor": motor, "T_gear": gear, "T_link": link}
    inputs = {"T_amb": T_amb, "speed": speed, "I": current}
    return {**inputs, **{name: x[:, body][:, 1] for name, body in bodies.items()}}


def machine(parameters: str = "", *terms: tuple[str, str, str]) -> Machine:
    """The machine with more terms in its model."""
    return Machine(
        channels={
            "T_amb": ambient(noise=0.05, step=0.1, lag=60, zero=0.3),
            "speed": Channel(SPEED, "rpm", step=1),
            "I": power(relative=0.03, step=0.05, unit="A", role=OTHER),
            "T_motor": thermometer(noise=0.1, step=0.1, lag=8, zero=0.12),
            "T_gear": thermometer(noise=0.08, step=0.1, lag=12, zero=0.1),
            "T_link": thermometer(noise=0.06, step=0.1, lag=12, zero=0.08),
        },
        parameters=free("R", 0.7, "ohm")
        + free("Gmg", 2, "W/K")
        + free("Ggl", 2, "W/K")
        + free("hm", 1, "W/K")
        + free("hg", 1, "W/K")
        + free("hl", 2, "W/K")
        + parameters,
        states={"T_motor": 2000.0, "T_gear": 3000.0, "T_link": 9800.0},
        terms=[
            ("T_motor", "", "R*I**2"),
            ("T_gear", "T_motor", "Gmg*(T_motor - T_gear)"),
            ("T_link", "T_gear", "Ggl*(T_gear - T_link)"),
            ("T_motor", "", "hm*(T_amb - T_motor)"),
            ("T_gear", "", "hg*(T_amb - T_gear)"),
            ("T_link", "", "hl*(T_amb - T_link)"),
            *terms,
        ],
        outputs=read("T_motor", "T_gear", "T_link"),
        every=20,
        hours=(4, 5, 5, 4),
        late=0.5,
    )


RUBBING = machine(free("Pf", 20, "W") + free("m", 1.4, "1", 0.8, 2.5), ("T_gear", "", "Pf*(speed/1000)**m"))
CASES = {
    "robot_b": Case(
        machine(),
        simulate,
        effect("friction_speed", "T_gear", also=["viscosity_temperature"]),
        lacks=frozenset({"friction", "thinning"}),
    ),
    "robot_c": Case(
        machine(),
        simulate,
        two_effects(("friction_speed", ["T_gear"]), ("conduction_path", ["T_motor", "T_link"])),
        lacks=frozenset({"friction", "thinning", "path"}),
    ),
    "robot_d": Case(RUBBING, simulate, NOTHING, knows=frozenset({"friction"})),
}
