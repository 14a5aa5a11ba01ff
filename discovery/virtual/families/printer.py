"""A printer's frame, warmed by its bed through the air of a chamber; a fan of the chamber is recorded.

Not a machine tool: minutes instead of hours, aluminium, a bed on a thermostat. The air of the chamber is a
state of its own (some 120 J/K); convection with 1/4 and 1/3 powers, radiation from the bed to the gantry.
"""

from __future__ import annotations

from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import Channel, Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import ALUMINIUM, STEEL, Bar, Material
from discovery.virtual.network import Form, Inputs, Law, Switch, linear
from discovery.virtual.signals import Draw, levels, room

PACE = Pace(
    hours=6.0, step_s=2.0, log_s=6.0, read_s=(12.0, 60.0), before_h=4.0, noise=(0.8, 4.0), heat_w=0.15
)
WORDS = Words(power="P_hot")


def printer(rng: Draw, refine: int = 1) -> Machine:
    """A desktop printer of some 0.4 m with a heated bed of 200 to 400 W."""
    a = Assembly(rng, refine=refine)
    about = a.about
    height, width = about(0.42, 0.1), about(0.40, 0.1)
    a.body(Bar("bed", ALUMINIUM, 0.006, about(0.09), 1))
    a.body(Bar("base", STEEL, about(0.04), about(0.016), 4))
    a.body(Bar("left", ALUMINIUM, height, about(6e-4), 6))
    a.body(Bar("right", ALUMINIUM, height, about(6e-4), 6))
    a.body(Bar("gantry", ALUMINIUM, width, about(5e-4), 6))
    a.body(Bar("chamber", Material(1.2, 1000.0, 0.026, 0.0), 0.4, about(0.25), 1))

    a.joint("base", "bed", about(0.8), at=(0.7, 1.0))
    a.joint("left", "base", about(1.2), (0.0, 0.2), (0.0, 0.5))
    a.joint("right", "base", about(1.2), (0.0, 0.2), (0.0, 0.5))
    a.joint("gantry", "left", about(0.9), (0.0, 0.2), (0.6, 0.9))
    a.joint("gantry", "right", about(0.9), (0.8, 1.0), (0.6, 0.9))
    a.air("base", about(1.0), exponent=0.25)
    a.air("chamber", about(4.0))
    for body, area in (("bed", 0.9), ("left", 0.7), ("right", 0.7), ("gantry", 0.6)):
        G, p = about(area), 1.0 / 3.0 if body == "bed" else 0.25
        rise = 50.0 if body == "bed" else 8.0
        a.nature(
            *[
                Law(
                    f"{body} to chamber",
                    Form.POWER,
                    node,
                    "chamber",
                    G * share / rise**p,
                    shape=(p,),
                    leaves="chamber",
                )
                for node, share in a.span(body)
            ]
        )
        unit = f"W/K**{1 + p:.2f}"
        a.believe(
            f"chamber around {body}",
            body,
            f"h_{body}*abs(chamber - {body})**{p:.2f}*(chamber - {body})",
            {f"h_{body}": (G / rise**p, unit)},
            "chamber",
        )

    target = "bed_target"
    power, shine = about(280.0), about(0.006)
    a.nature(
        Law("bed heater", Form.HEAT, "bed", size=power, switch="thermostat"),
        *[
            Law("shine", Form.RADIATION, node, "bed", shine * share, leaves="bed")
            for node, share in a.span("gantry")
        ],
        switches={"thermostat": Switch("bed", target, rng.uniform(0.5, 1.5), heats=True)},
    )
    a.lacks("radiation", ("gantry", "bed"), "shine", believed=linear)
    a.believe("bed heater", "bed", "k_bed*P_bed", {"k_bed": (1.0, "1")})
    a.believe(
        "shine of the bed", "gantry", "G_shine*(bed - gantry)", {"G_shine": (6.5 * shine, "W/K")}, "bed"
    )
    a.loss("gantry", "P_hot", about(0.25), at=(0.3, 0.7))

    alpha = ALUMINIUM.expansion
    a.error(
        "E_Z",
        "um",
        {"left": 0.5 * alpha * height * 0.7, "right": 0.5 * alpha * height * 0.7, "bed": -0.15, "base": 0.8},
        uneven=0.15,
    )
    a.error("E_X", "um", {"gantry": alpha * width * 0.5, "base": -11.5 * width * 0.4}, uneven=0.15)
    a.error(
        "E_B",
        "um/m",
        {"left": alpha * height * 0.7 / width, "right": -alpha * height * 0.7 / width, "gantry": 3.0},
        noise=2.0,
        uneven=0.1,
    )
    a.sensor("T_frame", "left", 0.06, at=(0.4, 0.6))

    channels = [
        felt("T_env", "ambient temperature"),
        Channel("P_bed", "heat load", "W", 1, lambda r: r.flow("bed heater")),
        logged("P_hot", "heat load", "W", 1),
        logged("fan", "other input", "percent"),
        logged("P_light", "heat load", "W", 1),
    ]
    return a.machine(
        "printer frame",
        channels,
        _cycle,
        WORDS,
        PACE,
        heat=25.0,
        unlinked=(("left", "right"), ("bed", "gantry"), ("bed", "left")),
        spare=(
            Spare("fan", "input_exchange", "chamber", "T_env", size=4.0, full=100.0),
            Spare("fan", "input_exchange", "right", "chamber", size=1.0, full=100.0),
            Spare("P_light", "input_heat", "right", size=8.0, full=12.0),
            Spare("P_light", "input_path", output="E_X", size=15.0, full=12.0),
        ),
        work=("P_hot", "P_light"),
    )


def _cycle(rng: Draw, hours: float) -> Inputs:
    """Prints of twenty minutes to two hours, each with its own bed, between pauses; the fan at random."""
    step = PACE.step_s
    n = round(hours * 3600 / step)
    job = levels(rng, n, step, 0.3, 2.0, lambda: float(rng.choice([0.0, 60.0, 75.0, 90.0, 105.0])))
    return {
        "T_env": room(rng, n, step, rng.uniform(20, 24), rng.uniform(0.5, 1.5), 0.4),
        "bed_target": job,
        "P_hot": (job > 0) * levels(rng, n, step, 0.1, 0.6, lambda: rng.uniform(20, 45)),
        "fan": levels(rng, n, step, 0.2, 1.5, lambda: float(rng.choice([0.0, 30.0, 60.0, 100.0]))),
        "P_light": levels(rng, n, step, 0.3, 2.0, lambda: float(rng.choice([0.0, 5.0, 12.0]))),
    }
