"""A bearing test rig: shaft, rings, housing, plate; oil flow, load and speed change in steps.

Not hours but minutes; readings every few seconds. Friction by Palmgren with a load-dependent part;
temperatures of the outer ring and the housing are measured, and the growth of the shaft.
"""

from __future__ import annotations

import numpy as np

from discovery.virtual import physics
from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import CAST_IRON, STEEL, Bar
from discovery.virtual.network import Array, Inputs, heat
from discovery.virtual.signals import Draw, lagged, levels, room

PACE = Pace(hours=8.0, step_s=2.0, log_s=6.0, read_s=(10.0, 60.0), before_h=4.0, noise=(0.4, 2.2), heat_w=0.6)
WORDS = Words(
    fluid="T_oil", fluid_channel="T_oil", water=False, pump="oil", flow="oil", speed="speed", top_speed=6000.0
)


def bearing_rig(rng: Draw, refine: int = 1) -> Machine:
    """A rig for bearings of some 80 mm."""
    a = Assembly(rng, refine=refine)
    about = a.about
    length, mean_mm = about(0.25), about(80.0, 0.1)
    a.body(Bar("shaft", STEEL, length, about(2.2e-3), 6))
    a.body(Bar("inner", STEEL, 0.03, about(2.4e-3), 1))
    a.body(Bar("outer", STEEL, 0.03, about(3.0e-3), 1))
    a.body(Bar("housing", CAST_IRON, about(0.12), about(0.022), 4))
    a.body(Bar("plate", STEEL, about(0.08), about(0.07), 4))

    a.joint("inner", "shaft", about(14.0), other_at=(0.1, 0.4))
    a.joint("inner", "outer", about(6.0))
    a.joint("outer", "housing", about(35.0), other_at=(0.0, 0.6))
    a.joint("housing", "plate", about(10.0), at=(0.6, 1.0), other_at=(0.8, 1.0))
    a.air("shaft", about(1.2), at=(0.4, 1.0))
    a.air("housing", about(1.4), exponent=0.25)
    a.air("plate", about(2.5), exponent=0.25)

    f0, f1 = rng.uniform(1.5, 3.0), about(6e-4)

    def friction(u: Inputs) -> Array:
        load = f1 * u["load"] * 1000.0 * mean_mm * 1e-3 * u["speed"] * physics.RPM
        return np.asarray(physics.palmgren_power(u["speed"], mean_mm, f0, 15.0) + load)

    for ring in ("inner", "outer"):
        a.nature(heat(f"loss {ring}", ring, 0.5, friction))
        a.driven[ring] = "speed"
        a.believe(f"friction of {ring}", ring, f"P_{ring}*(speed/1000)**1.667", {f"P_{ring}": (8.0, "W")})
        a.believe(
            f"load on {ring}",
            ring,
            f"Q_{ring}*load*speed/1000",
            {f"Q_{ring}": (0.5 * f1 * mean_mm * 104.7, "W")},
        )
    for body, G, at in (
        ("inner", 9.0, (0.0, 1.0)),
        ("outer", 14.0, (0.0, 1.0)),
        ("housing", 6.0, (0.0, 0.4)),
    ):
        a.fluid(body, about(G), WORDS, at=at)

    a.error("E_X", "um", {"shaft": STEEL.expansion * length * 0.8, "inner": 0.2, "housing": -0.5}, uneven=0.1)
    a.error("E_Y", "um", {"housing": 10.8 * 0.12, "plate": 11.5 * 0.05, "outer": 0.3}, noise=0.7, uneven=0.1)
    a.sensor("T_outer", "outer", 0.2)
    a.sensor("T_housing", "housing", 0.15, at=(0.4, 0.8))

    channels = [
        felt("T_env", "ambient temperature"),
        felt("T_oil", "fluid temperature", sd=0.05, decimals=2),
        logged("oil", "fluid flow", "1", 3),
        logged("speed", "rotation speed", "rpm"),
        logged("load", "other input", "kN", 2),
        logged("fan", "other input", "percent"),
        logged("P_heater", "heat load", "W"),
    ]
    return a.machine(
        "bearing test rig",
        channels,
        _cycle,
        WORDS,
        PACE,
        heat=60.0,
        rotating=("shaft", "inner"),
        splashed=("shaft",),
        gaps=(("shaft", "housing"),),
        unlinked=(("shaft", "housing"), ("outer", "plate")),
        spare=(
            Spare("fan", "input_exchange", "housing", "T_env", size=3.0, full=100.0),
            Spare("P_heater", "input_heat", "plate", size=30.0, full=50.0),
            Spare("P_heater", "input_path", output="E_X", size=6.0, full=50.0),
        ),
        work=("speed", "load", "P_heater"),
    )


def _cycle(rng: Draw, hours: float) -> Inputs:
    """Steps of speed, load and oil; the oil is warmed in its tank and comes at some temperature."""
    step = PACE.step_s
    n = round(hours * 3600 / step)
    speed = levels(rng, n, step, 0.15, 0.8, lambda: float(rng.choice([0.0, *rng.uniform(800, 6000, 4)])))
    warm = lagged(levels(rng, n, step, 0.5, 2.0, lambda: rng.uniform(0.0, 14.0)), step, rng.uniform(300, 900))
    air = room(rng, n, step, rng.uniform(20, 24), rng.uniform(0.4, 1.0), 0.3)
    return {
        "T_env": air,
        "T_oil": air + 3.0 + warm,
        "oil": levels(rng, n, step, 0.2, 1.0, lambda: float(rng.choice([0.0, 0.25, 0.5, 0.75, 1.0]))),
        "speed": speed,
        "load": levels(rng, n, step, 0.2, 1.2, lambda: rng.uniform(0.5, 6.0)) * (speed > 0),
        "fan": levels(rng, n, step, 0.2, 1.5, lambda: float(rng.choice([0.0, 40.0, 70.0, 100.0]))),
        "P_heater": levels(rng, n, step, 0.2, 1.2, lambda: float(rng.choice([0.0, 0.0, 25.0, 50.0]))),
    }
