"""A grinding headstock: spindle in two bearing sets, built-in motor, housing with a coolant jacket, base.

States of their own: jacket, coolant tank with chiller, sump, film on the front. Spindle, housing and base are
bars of cells. Friction by Palmgren, iron and copper loss of the motor; the log shows their sum.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from discovery.virtual import physics
from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import T_REF, Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import CAST_IRON, STEEL, Bar
from discovery.virtual.network import LEVEL, Array, Inputs, heat, link
from discovery.virtual.signals import Draw, lagged, levels, room, shifts, switched

PACE = Pace()
WORDS = Words(
    fluid="sump",
    fluid_channel="T_fluid",
    pump="pump",
    flow="pump",
    speed="speed",
    top_speed=4500.0,
    power="P_motor",
)


def headstock(rng: Draw, refine: int = 1) -> Machine:
    """A headstock with dimensions drawn around 80 mm of spindle and 150 kg of housing."""
    a = Assembly(rng, refine=refine)
    about = a.about
    length, front_mm, rear_mm = about(0.3), about(90.0, 0.1), about(75.0, 0.1)
    a.body(Bar("spindle", STEEL, length, about(4.0e-3), 12))
    a.body(Bar("front", STEEL, 0.06, about(6.0e-3), 1))
    a.body(Bar("rear", STEEL, 0.04, about(5.0e-3), 1))
    section = about(0.05)
    a.body(Bar("housing_front", CAST_IRON, length / 2, section, 5))
    a.body(Bar("housing_rear", CAST_IRON, length / 2, section, 5))
    a.body(Bar("base", CAST_IRON, about(0.3), about(0.16), 5))

    a.joint("front", "spindle", about(20.0), other_at=(0.05, 0.25))
    a.joint("rear", "spindle", about(15.0), other_at=(0.75, 0.9))
    a.joint("front", "housing_front", about(70.0), other_at=(0.1, 0.5))
    a.joint("rear", "housing_rear", about(50.0), other_at=(0.5, 0.9))
    a.joint(
        "housing_front",
        "housing_rear",
        CAST_IRON.conductivity * section / (0.25 * length),
        (0.75, 1.0),
        (0.0, 0.25),
    )
    a.joint("housing_front", "base", about(50.0), at=(0.3, 1.0), other_at=(0.7, 1.0))
    a.joint("housing_rear", "base", about(50.0), at=(0.0, 0.7), other_at=(0.7, 1.0))
    a.air("spindle", about(1.5), at=(0.0, 0.1))
    a.air("housing_front", about(2.5), exponent=0.25)
    a.air("housing_rear", about(2.5), exponent=0.25)
    a.air("base", about(9.0), exponent=0.25)

    f0, iron, copper = rng.uniform(1.8, 2.8), about(120.0), about(150.0)

    def motor(u: Inputs) -> Array:
        return np.asarray(iron * (u["speed"] / 3000.0) ** 1.5 + copper * u["torque"] ** 2)

    a.friction("front", "speed", lambda u: physics.palmgren_power(u["speed"], front_mm, f0))
    a.friction("rear", "speed", lambda u: physics.palmgren_power(u["speed"], rear_mm, f0))
    a.loss("housing_rear", "P_motor", 0.65, at=(0.0, 0.7))
    a.loss("spindle", "P_motor", 0.35, at=(0.35, 0.7))

    jacket, flow = about(120.0), about(500.0)
    a.nature(
        *[link("jacket", node, "jacket", jacket * share) for node, share in a.span("housing_rear")],
        link("coolant", "jacket", "tank", flow),
        link("tank air", "tank", "T_env", 5.0),
        nodes={"jacket": 6e3, "tank": about(70e3)},
    )
    laws, nodes, switches = physics.chiller("tank", about(1500.0), T_REF, rng.uniform(0.2, 0.5))
    a.nature(*laws, nodes=nodes, switches=switches)
    a.believe(
        "coolant jacket",
        "housing_rear",
        "cool_housing_rear*(T_cool - housing_rear)",
        {"cool_housing_rear": (jacket, "W/K")},
    )

    a.nature(
        heat("pump", "sump", about(350.0), "pump"),
        heat("grinding", "sump", about(500.0), lambda u: u["torque"] * u["pump"]),
        link("sump air", "sump", "T_env", about(70.0)),
        *physics.film("film", "pump"),
        nodes={"sump": about(1.0e6), "film": LEVEL},
    )
    a.fluid("housing_front", about(25.0), WORDS, at=(0.0, 0.6), film="film")

    a.error(
        "E_Z",
        "um",
        {"spindle": 11.5 * 0.6 * length, "front": 0.3, "housing_front": -10.8 * 0.3 * length},
        uneven=0.2,
    )
    a.error("E_Y", "um", {"front": 0.4, "housing_front": 10.8 * 0.12, "base": 10.8 * 0.3}, uneven=0.2)
    a.error(
        "E_A",
        "um/m",
        {
            "front": 1.5,
            "rear": -1.5,
            "housing_front": 10.8 * 0.12 / length,
            "housing_rear": -10.8 * 0.12 / length,
            "base": -2.0,
        },
        noise=2.0,
    )

    channels = [
        felt("T_env", "ambient temperature"),
        felt("T_fluid", "fluid temperature", "sump"),
        felt("T_cool", "coolant temperature", "tank"),
        logged("pump", "fluid flow", "1", 3),
        logged("speed", "rotation speed", "rpm"),
        logged("P_motor", "heat load", "W", 1),
        logged("mist_fan", "other input", "percent"),
        logged("P_dresser", "heat load", "W"),
    ]
    spare = (
        Spare("mist_fan", "input_exchange", "housing_rear", "T_env", size=10.0, full=100.0),
        Spare("P_dresser", "input_heat", "base", size=0.6, full=1.0),
        Spare("P_dresser", "input_path", output="E_Y", size=5.0, full=200.0),
    )
    return a.machine(
        "grinding headstock",
        channels,
        lambda r, h: _with(_cycle(r, h), P_motor=motor),
        WORDS,
        PACE,
        rotating=("spindle", "front"),
        splashed=("base", "front"),
        chips=("housing_front",),
        gaps=(("spindle", "housing_front"),),
        unlinked=(("front", "base"), ("spindle", "housing_rear"), ("rear", "base")),
        on_bed=("base",),
        spare=spare,
        work=("speed", "torque", "pump", "P_dresser", "P_motor"),
        heat=250.0,
    )


def _with(u: Inputs, **more: Callable[[Inputs], Array]) -> Inputs:
    return {**u, **{name: make(u) for name, make in more.items()}}


def _cycle(rng: Draw, hours: float) -> Inputs:
    """Shifts of grinding: jobs of their own speed, dressing now and then, pauses."""
    step = PACE.step_s
    n = round(hours * 3600 / step)
    work = shifts(rng, n, step, rng.uniform(0, 24))
    job = levels(rng, n, step, 1.0, 6.0, lambda: rng.uniform(1500, 4500))
    busy = levels(rng, n, step, 0.2, 2.0, lambda: float(rng.uniform() < 0.85))
    speed = job * np.maximum(work, levels(rng, n, step, 2, 8, lambda: float(rng.uniform() < 0.3))) * busy
    running = (speed > 0).astype(float)
    torque = lagged(levels(rng, n, step, 0.2, 1.5, lambda: rng.uniform(0.1, 1.0)), step, 120.0) * running
    flow = levels(rng, n, step, 0.5, 4.0, lambda: float(rng.choice([0.4, 0.7, 1.0])))
    pump = flow * switched(rng, n, step, (1.0, 6.0), (0.3, 3.0))
    return {
        "T_env": room(rng, n, step, rng.uniform(21, 23), rng.uniform(0.5, 1.2), 0.4),
        "speed": speed,
        "torque": torque,
        "pump": pump,
        "mist_fan": levels(rng, n, step, 1.0, 8.0, lambda: float(rng.choice([0.0, 40.0, 70.0, 100.0]))),
        "P_dresser": levels(rng, n, step, 0.2, 2.0, lambda: float(rng.choice([0.0, 0.0, 60.0, 150.0]))),
    }
