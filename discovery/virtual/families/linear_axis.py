"""A linear axis: ball screw with a nut whose heat moves along it, fixed bearing, table, bed with a memory.

The screw has 18 cells in the plant and three bodies in the baseline. The friction of the nut enters the
stretch of the screw that is travelled: each cell by the share of the stroke that lies on it.
"""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import CAST_IRON, STEEL, Bar
from discovery.virtual.network import Array, Form, Gate, Inputs, Law, heat, link, natural, times
from discovery.virtual.signals import Draw, levels, room, shifts

PACE = Pace(noise=(0.3, 1.4), heat_w=1.2)
WORDS = Words(speed="speed", top_speed=3000.0, power="P_servo")
SECTIONS = ("screw_1", "screw_2", "screw_3")


def linear_axis(rng: Draw, refine: int = 1) -> Machine:
    """An axis with a screw of some 40 mm and 1.1 m, a table of 100 kg and a bed of 700 kg."""
    a = Assembly(rng, refine=refine)
    about = a.about
    length, section = about(1.1), about(1.6e-3)
    for name in SECTIONS:
        a.body(Bar(name, STEEL, length / 3, section, 6))
    a.body(Bar("bearing", STEEL, 0.08, about(6e-3), 1))
    a.body(Bar("nut", STEEL, 0.10, about(4.5e-3), 1))
    a.body(Bar("table", CAST_IRON, about(0.12), about(0.12), 4))
    a.body(Bar("bed", CAST_IRON, about(0.45), about(0.22), 5, web=about(0.12)))

    for one, other in itertools.pairwise(SECTIONS):
        a.joint(one, other, STEEL.conductivity * section / (length / 6), (0.75, 1.0), (0.0, 0.25))
    a.joint("bearing", "screw_1", about(8.0), other_at=(0.0, 0.2))
    a.joint("bearing", "bed", about(25.0), other_at=(0.7, 1.0))
    a.joint("nut", "table", about(14.0), other_at=(0.0, 0.3))
    a.joint("table", "bed", about(25.0), at=(0.0, 0.4), other_at=(0.6, 1.0))
    for name in SECTIONS:
        a.air(name, about(0.9))
    a.air("table", about(4.0), exponent=0.25)
    a.air("bed", about(14.0), exponent=0.25)

    # the nut rubs on the stretch that it travels
    nut, grip = about(12.0), about(8.0)
    cells = [node for name in SECTIONS for node in a.bodies[name].nodes]

    def rubbing(u: Inputs) -> Array:
        n = np.abs(u["speed"]) / 1000.0
        return np.asarray(nut * (0.35 * n + 0.65 * n ** (5.0 / 3.0)))

    def usual(u: Inputs) -> Array:
        return np.asarray(nut * (np.abs(u["speed"]) / 1000.0) ** 1.4)

    strokes = {node: on_cell(k, len(cells), length) for k, node in enumerate(cells)}
    for node, share in strokes.items():
        a.nature(Law("loss nut", Form.HEAT, node, size=0.5, gate=times(rubbing, share)))
        a.nature(Law("nut on screw", Form.LINK, node, "nut", grip, share, leaves="nut"))
    a.nature(heat("loss nut", "nut", 0.5, rubbing))
    a.lacks(
        "friction_speed",
        ("nut", *SECTIONS),
        "loss nut",
        believed=lambda law: replace(
            law, gate=times(usual, strokes[law.into]) if law.into in strokes else usual
        ),
    )
    a.driven["nut"] = "speed"
    a.believe("friction of the nut", "nut", "P_nut*(speed/1000)**1.4", {"P_nut": (0.5 * nut, "W")})
    for k, name in enumerate(SECTIONS):
        start, end = k * length / 3, (k + 1) * length / 3
        share = f"max(min(x_high, {end:.3f}) - max(x_low, {start:.3f}), 0)/(x_high - x_low)"
        a.believe(
            f"nut rubs on {name}", name, f"P_screw*(speed/1000)**1.4*{share}", {"P_screw": (0.5 * nut, "W")}
        )
        a.believe(
            f"nut touches {name}", name, f"G_nut*{share}*(nut - {name})", {"G_nut": (grip, "W/K")}, "nut"
        )

    preload, motor = about(7.0), about(0.25)
    a.friction(
        "bearing",
        "speed",
        lambda u: preload * (0.4 * u["speed"] / 1000 + 0.6 * (u["speed"] / 1000) ** (5 / 3)),
    )
    a.nature(
        link("motor flange", "motor", "bearing", about(3.0)),
        natural("motor air", "motor", "T_env", 1.5, 0.25),
        heat("motor", "motor", motor, "P_servo"),
        nodes={"motor": about(4e3)},
    )
    a.lacks(
        "second_thermal_mass",
        ("bearing",),
        *("motor", "motor flange", "motor air"),
        believed=lambda law: (
            replace(law, into="bearing", size=0.6 * motor) if law.form == Form.HEAT else None
        ),
    )
    a.driven["bearing"] = "speed"
    a.believe(
        "motor warms the bearing", "bearing", "loss_bearing*P_servo", {"loss_bearing": (0.6 * motor, "1")}
    )

    growth = STEEL.expansion * length / 3
    a.error(
        "E_X_far",
        "um",
        {"screw_1": growth, "screw_2": growth, "screw_3": 0.5 * growth, "bed": -0.5},
        uneven=0.1,
    )
    a.error(
        "E_X_near",
        "um",
        {"screw_1": growth, "screw_2": 0.3 * growth, "bed": -0.3, "bearing": 0.4},
        uneven=0.1,
    )
    a.error("E_Z", "um", {"table": 10.8 * 0.12, "bed": 10.8 * 0.2}, uneven=0.1)
    a.sensor("T_nut", "nut", 0.2)

    copper, iron = about(160.0), about(40.0)

    def servo(u: Inputs) -> Array:
        return np.asarray(copper * u["force"] ** 2 + iron * (u["speed"] / 3000.0) ** 1.5)

    channels = [
        felt("T_env", "ambient temperature"),
        logged("speed", "rotation speed", "rpm"),
        logged("x_low", "other input", "m", 3),
        logged("x_high", "other input", "m", 3),
        logged("P_servo", "heat load", "W", 1),
        logged("air_blast", "other input", "l/min"),
        logged("P_hydraulic", "heat load", "W"),
    ]

    def cycle(draw: Draw, hours: float) -> Inputs:
        u = _cycle(draw, hours, length)
        return {**u, "P_servo": servo(u)}

    return a.machine(
        "linear axis",
        channels,
        cycle,
        WORDS,
        PACE,
        heat=120.0,
        rotating=SECTIONS,
        on_bed=("bed",),
        unlinked=(("nut", "bed"), ("bearing", "table"), ("screw_2", "bed")),
        spare=(
            Spare("air_blast", "input_exchange", "screw_3", "T_env", size=1.5, full=200.0),
            Spare("P_hydraulic", "input_heat", "table", size=30.0, full=200.0),
            Spare("P_hydraulic", "input_path", output="E_Z", size=4.0, full=200.0),
        ),
        work=("speed", "force", "P_servo", "P_hydraulic"),
    )


def on_cell(k: int, count: int, length: float) -> Gate:
    """Share of the stroke that lies on the k-th of `count` cells of the screw, (n,)."""

    def share(u: Inputs) -> Array:
        low, high = u["x_low"], u["x_high"]
        start, end = k * length / count, (k + 1) * length / count
        return np.asarray(np.clip(np.minimum(high, end) - np.maximum(low, start), 0.0, None) / (high - low))

    return share


def _cycle(rng: Draw, hours: float, length: float) -> Inputs:
    """Jobs with a speed, a place and a force of their own, in shifts."""
    step = PACE.step_s
    n = round(hours * 3600 / step)
    work = np.maximum(
        shifts(rng, n, step, rng.uniform(0, 24)),
        levels(rng, n, step, 2, 9, lambda: float(rng.uniform() < 0.35)),
    )
    busy = levels(rng, n, step, 0.2, 2.0, lambda: float(rng.uniform() < 0.85))
    speed = levels(rng, n, step, 0.5, 4.0, lambda: rng.uniform(500, 3000)) * work * busy
    stroke = levels(rng, n, step, 1.0, 5.0, lambda: rng.uniform(0.55, 0.85) * length)
    place = levels(rng, n, step, 1.0, 5.0, rng.uniform)
    middle = 0.05 * length + stroke / 2 + place * (0.9 * length - stroke)
    force = levels(rng, n, step, 0.2, 2.0, lambda: rng.uniform(0.1, 1.0)) * (speed > 0)
    return {
        "T_env": room(rng, n, step, rng.uniform(21, 23), rng.uniform(0.5, 1.2), 0.4),
        "speed": speed,
        "x_low": middle - stroke / 2,
        "x_high": middle + stroke / 2,
        "force": force,
        "air_blast": levels(rng, n, step, 1.0, 6.0, lambda: float(rng.choice([0.0, 50.0, 120.0, 200.0]))),
        "P_hydraulic": levels(rng, n, step, 0.5, 5.0, lambda: float(rng.choice([0.0, 0.0, 90.0, 180.0]))),
    }
