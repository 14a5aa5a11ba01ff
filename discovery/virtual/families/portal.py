"""A portal with two columns in a tall hall: crossbeam, head, bed; the air above is warmer than below.

Columns and beam are bars of eight cells; each cell of a column sees the air of its height. The head is
cooled by a recorded cooling power, the bed is flooded from a sump, the foundation remembers.
"""

from __future__ import annotations

import numpy as np

from discovery.virtual import physics
from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import CAST_IRON, Bar
from discovery.virtual.network import LEVEL, Array, Form, Inputs, Law, heat, linear, link
from discovery.virtual.signals import Draw, lagged, levels, room, shifts, switched

PACE = Pace(hours=96.0, step_s=30.0, log_s=60.0, before_h=60.0, noise=(0.3, 1.6), heat_w=4.0)
WORDS = Words(
    fluid="sump",
    fluid_channel="T_fluid",
    pump="pump",
    speed="speed",
    top_speed=6000.0,
    power="P_spindle",
    cooling="P_cool",
)
COLUMNS = ("left", "right")


def portal(rng: Draw, refine: int = 1) -> Machine:
    """A portal of some 3 m, columns of 1.5 t."""
    a = Assembly(rng, refine=refine)
    about = a.about
    height, width = about(2.4, 0.08), about(2.6, 0.08)
    section = about(0.09)
    for name in COLUMNS:
        a.body(Bar(name, CAST_IRON, height, section * rng.uniform(0.95, 1.05), 8))
    a.body(Bar("beam", CAST_IRON, width, about(0.07), 8))
    a.body(Bar("head", CAST_IRON, about(0.9), about(0.05), 5))
    a.body(Bar("bed", CAST_IRON, about(0.6), about(1.1), 5))

    for k, name in enumerate(COLUMNS):
        a.joint(name, "bed", about(60.0), (0.0, 0.1), (0.0, 0.2))
        a.joint("beam", name, about(45.0), (0.0, 0.1) if k == 0 else (0.9, 1.0), (0.88, 1.0))
    a.joint("head", "beam", about(30.0), (0.3, 1.0), (0.3, 0.7))
    a.air("bed", about(45.0), exponent=0.25)
    for name in COLUMNS:
        _tall_air(a, name, about(19.0))
    a.air("beam", about(16.0), exponent=0.25, air="T_top")
    a.air("head", about(7.0), air="T_mid", believed="0.5*T_env + 0.5*T_top")

    a.loss("head", "P_spindle", about(0.5), at=(0.5, 1.0))
    a.nature(
        *[heat("cooling head", node, -0.9 * share, "P_cool") for node, share in a.span("head", 0.5, 1.0)]
    )
    a.believe("cooling of the head", "head", "-k_cool*P_cool", {"k_cool": (0.9, "1")})

    a.nature(
        heat("pump", "sump", about(600.0), "pump"),
        heat("cutting", "sump", about(700.0), lambda u: u["load"] * u["pump"]),
        link("sump air", "sump", "T_env", about(110.0)),
        *physics.film("film", "pump", dry_s=4000.0),
        nodes={"sump": about(2.5e6), "film": LEVEL},
    )
    a.fluid("bed", about(60.0), WORDS, at=(0.0, 0.3), film="film")

    grow = CAST_IRON.expansion * height
    a.error(
        "E_Z", "um", {"left": 0.5 * grow, "right": 0.5 * grow, "head": -10.8 * 0.35, "bed": -2.0}, uneven=0.1
    )
    a.error("E_Y", "um", {"head": 10.8 * 0.5, "beam": 10.8 * 0.25}, uneven=0.2)
    a.error(
        "E_A", "um/m", {"left": grow / width, "right": -grow / width, "head": 1.2}, noise=1.5, uneven=0.05
    )

    channels = [
        felt("T_env", "ambient temperature"),
        felt("T_top", "ambient temperature"),
        felt("T_fluid", "fluid temperature", "sump"),
        logged("pump", "fluid flow", "1", 3),
        logged("speed", "rotation speed", "rpm"),
        logged("P_spindle", "heat load", "W", 1),
        logged("P_cool", "cooling power", "W", 1),
        logged("P_hydraulic", "heat load", "W"),
        logged("door", "other input", "1", 2),
    ]
    cost, viscous, share = about(250.0), about(500.0), rng.uniform(0.35, 0.5)

    def cycle(draw: Draw, hours: float) -> Inputs:
        u = dict(_cycle(draw, hours))
        n = u["speed"] / 6000.0
        power: Array = cost * u["load"] * (n > 0) + viscous * n ** (5.0 / 3.0)
        u["P_spindle"] = power
        u["P_cool"] = share * lagged(power, PACE.step_s, draw.uniform(900, 2400))
        u["T_mid"] = 0.5 * (u["T_env"] + u["T_top"])
        return u | {f"air {k}": u["T_env"] + (k + 0.5) / 8.0 * (u["T_top"] - u["T_env"]) for k in range(8)}

    return a.machine(
        "portal with two columns",
        channels,
        cycle,
        WORDS,
        PACE,
        heat=400.0,
        cooled=("head",),
        chips=("bed",),
        splashed=COLUMNS,
        on_bed=("bed",),
        gaps=(("left", "bed"), ("right", "bed")),
        unlinked=(("head", "left"), ("head", "right"), ("left", "right")),
        spare=(
            Spare("P_hydraulic", "input_heat", "right", size=250.0, full=900.0),
            Spare("door", "input_exchange", "left", "T_env", size=25.0, full=1.0),
            Spare("P_hydraulic", "input_path", output="E_Y", size=8.0, full=900.0),
        ),
        work=("speed", "load", "pump", "P_spindle", "P_cool", "P_hydraulic"),
    )


def _tall_air(a: Assembly, name: str, coefficient: float) -> None:
    """Air along a column: warmer above; the baseline takes the mean of below and above."""
    for k in range(8):
        for node, share in a.span(name, k / 8, (k + 1) / 8):
            a.nature(
                Law(
                    f"air {name}",
                    Form.POWER,
                    node,
                    f"air {k}",
                    coefficient * share / 8 / 5.0**0.25,
                    shape=(0.25,),
                )
            )
    a.lacks("natural_convection", (name,), f"air {name}", believed=linear)
    a.believe(
        f"air around {name}",
        name,
        f"hA_{name}*(0.5*T_env + 0.5*T_top - {name})",
        {f"hA_{name}": (coefficient, "W/K")},
    )
    a.airs[name] = coefficient


def _cycle(rng: Draw, hours: float) -> Inputs:
    """Days in a hall, warm above in the afternoon; jobs, hydraulics, an open door now and then."""
    step = PACE.step_s
    n = round(hours * 3600 / step)
    start = rng.uniform(0, 24)
    day = shifts(rng, n, step, start)
    low = room(rng, n, step, rng.uniform(20, 23), rng.uniform(0.8, 1.8), 0.7)
    above = 0.6 + lagged(
        rng.uniform(0.5, 2.0) * day * levels(rng, n, step, 2, 8, lambda: rng.uniform(0.3, 1.2)), step, 7200.0
    )
    work = np.maximum(day, levels(rng, n, step, 2, 9, lambda: float(rng.uniform() < 0.3)))
    busy = work * levels(rng, n, step, 0.3, 3.0, lambda: float(rng.uniform() < 0.8))
    return {
        "T_env": low,
        "T_top": low + above,
        "speed": busy * levels(rng, n, step, 0.5, 5.0, lambda: rng.uniform(800, 6000)),
        "load": busy * levels(rng, n, step, 0.3, 2.0, lambda: rng.uniform(0.0, 1.0)),
        "pump": work * switched(rng, n, step, (1.0, 8.0), (0.5, 4.0)),
        "P_hydraulic": work * levels(rng, n, step, 1.0, 6.0, lambda: float(rng.choice([0.0, 400.0, 900.0]))),
        "door": levels(rng, n, step, 0.5, 6.0, lambda: float(rng.choice([0.0, 0.0, 0.5, 1.0]))),
    }
