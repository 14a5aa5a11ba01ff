"""A rotary and swivelling table of a five-axis machine under cutting fluid, drawn around the paper's.

Five bodies of five or six cells, a bearing and a motor between them, sump, film, bed. The chiller's cooling
power is recorded. `structure` is shared with the machine of the repository's campaign, which is finer
still.
"""

from __future__ import annotations

import numpy as np

from discovery.virtual import physics
from discovery.virtual.assembly import Assembly
from discovery.virtual.machine import Machine, Pace, Spare, Words, felt, logged
from discovery.virtual.materials import CAST_IRON, STEEL, Bar
from discovery.virtual.network import LEVEL, Array, Inputs, heat, link
from discovery.virtual.signals import Draw, lagged, levels, room, switched

PACE = Pace(noise=(0.25, 0.9))
WORDS = Words(
    fluid="sump",
    fluid_channel="T_fluid",
    pump="pump",
    flow="pump",
    speed="speed",
    top_speed=1200.0,
    power="P_drive",
    cooling="P_cool",
)
BODIES = ("table", "c_body_1", "c_body_2", "b_body_1", "b_body_2")


def structure(a: Assembly) -> None:
    """The five bodies and their joints, each along whole cells. kg and m from the size of such a machine (VDI
    class).

    Table 92 kg, C axis 130 and 170 kg, B corpus 330 and 480 kg.
    """
    about = a.about
    a.body(Bar("table", STEEL, 0.25, about(0.047, 0.1), 10))  # along the radius
    a.body(Bar("c_body_1", STEEL, 0.22, about(0.075, 0.1), 10))  # from the table down
    a.body(Bar("c_body_2", CAST_IRON, 0.28, about(0.084, 0.1), 5))
    a.body(Bar("b_body_1", CAST_IRON, 0.40, about(0.115, 0.1), 10))  # from the C axis outwards
    a.body(Bar("b_body_2", CAST_IRON, 0.45, about(0.148, 0.1), 5))
    a.joint("table", "c_body_1", about(60.0), (0.0, 0.6), (0.0, 0.4))
    # the C axis stands inside the B corpus: they meet along their length
    a.joint("c_body_1", "c_body_2", about(40.0), (0.2, 1.0), (0.0, 0.8))
    a.joint("c_body_1", "b_body_1", about(35.0), (0.0, 1.0), (0.0, 0.6))
    a.joint("c_body_2", "b_body_1", about(20.0), (0.0, 1.0), (0.0, 0.8))
    a.joint("b_body_1", "b_body_2", about(40.0), (0.4, 1.0), (0.0, 0.6))


def levers(a: Assembly) -> None:
    """Errors by lever arms [m] times expansion (11.5 um/m/K steel, 10.8 cast iron); tilts in um/m/K."""
    a.error(
        "E_Y0C",
        "um",
        {"c_body_1": -1.78, "c_body_2": -0.86, "b_body_1": -5.18, "b_body_2": -2.72},
        uneven=0.15,
    )
    a.error("E_Z0T", "um", {"table": 0.74, "c_body_1": 1.74, "c_body_2": 1.94, "b_body_1": 1.61}, uneven=0.15)
    a.error("E_R0T", "um", {"table": 11.5 * 0.167}, uneven=0.15)
    a.error(
        "E_A0C",
        "um/m",
        {"c_body_1": 5.83, "c_body_2": 2.87, "b_body_1": -6.29, "b_body_2": -2.41},
        noise=2.0,
        uneven=0.1,
    )


def rotary_table(rng: Draw, refine: int = 1) -> Machine:
    """A table with dimensions drawn about the paper's machine."""
    a = Assembly(rng, refine=refine)
    about = a.about
    structure(a)
    a.air("table", about(4.0), at=(0.2, 1.0))
    for body, G in (("c_body_1", 1.7), ("c_body_2", 2.9), ("b_body_1", 6.7), ("b_body_2", 12.0)):
        a.air(body, about(G), exponent=0.1)

    iron, viscous, rubbing = about(50.0), about(100.0), about(110.0)

    def power(u: Inputs) -> Array:
        n = u["speed"] / 600.0
        return np.asarray(iron * n**1.5 + rubbing * n + viscous * n ** (5.0 / 3.0))

    a.loss("c_body_1", "P_drive", about(0.28), at=(0.2, 1.0))
    a.loss("c_body_2", "P_drive", about(0.45), at=(0.0, 0.8))
    a.loss("b_body_1", "P_drive", about(0.12), at=(0.0, 0.6))
    k_cool = about(0.9, 0.05)
    a.nature(
        *[
            heat("cooling c_body_2", node, -k_cool * share, "P_cool")
            for node, share in a.span("c_body_2", 0.0, 0.8)
        ]
    )
    a.believe("internal cooling", "c_body_2", "-k_cool*P_cool", {"k_cool": (k_cool, "1")})
    a.nature(
        heat("pump", "sump", about(550.0), "pump"),
        link("sump air", "sump", "T_env", about(90.0)),
        *physics.film("film", "pump"),
        nodes={"sump": about(1.2e6), "film": LEVEL},
    )
    a.fluid("table", about(90.0), WORDS, (0.2, 1.0), "film")
    a.fluid("c_body_1", about(30.0), WORDS, (0.0, 0.6), "film")
    levers(a)
    channels = [
        felt("T_env", "ambient temperature"),
        felt("T_fluid", "fluid temperature", "sump"),
        logged("pump", "fluid flow", "1", 3),
        logged("speed", "rotation speed", "rpm", 1),
        logged("P_drive", "heat load", "W", 1),
        logged("P_cool", "cooling power", "W", 1),
        logged("air_curtain", "other input", "percent"),
        logged("P_b_axis", "heat load", "W"),
    ]

    def cycle(draw: Draw, hours: float) -> Inputs:
        u = dict(_cycle(draw, hours))
        u["P_drive"] = power(u)
        u["P_cool"] = draw.uniform(0.15, 0.35) * lagged(u["P_drive"], PACE.step_s, draw.uniform(1200, 3600))
        return u

    return a.machine(
        "rotary table",
        channels,
        cycle,
        WORDS,
        PACE,
        heat=180.0,
        rotating=("table", "c_body_1"),
        cooled=("c_body_2",),
        splashed=("c_body_2", "b_body_1", "b_body_2"),
        gaps=(("c_body_1", "b_body_1"), ("table", "b_body_1")),
        chips=("table",),
        on_bed=("b_body_2", "b_body_1"),
        unlinked=(("table", "b_body_1"), ("c_body_2", "b_body_2"), ("table", "c_body_2")),
        spare=(
            Spare("air_curtain", "input_exchange", "c_body_1", "T_env", size=12.0, full=100.0),
            Spare("P_b_axis", "input_heat", "b_body_2", size=80.0, full=120.0),
            Spare("P_b_axis", "input_path", output="E_Z0T", size=5.0, full=120.0),
        ),
        work=("speed", "pump", "P_drive", "P_cool", "P_b_axis"),
    )


def _cycle(rng: Draw, hours: float) -> Inputs:
    """Random speeds and pauses; the pump in steps of its flow in half of the machines, else on and off."""
    step = PACE.step_s
    n = round(hours * 3600 / step)
    top = rng.uniform(900, 1200)
    speed = levels(
        rng, n, step, 0.3, 3.0, lambda: 0.0 if rng.uniform() < 0.3 else float(rng.uniform(0.1, 1.0) * top)
    )
    flow = levels(rng, n, step, 0.5, 3.0, lambda: float(rng.choice([0.35, 0.6, 0.8, 1.0])))
    return {
        "T_env": room(rng, n, step, rng.uniform(21, 23), rng.uniform(0.6, 1.4), 0.5),
        "speed": speed,
        "pump": flow * switched(rng, n, step, (0.7, 5.0), (0.5, 3.5)),
        "air_curtain": levels(rng, n, step, 1.0, 8.0, lambda: float(rng.choice([0.0, 40.0, 70.0, 100.0]))),
        "P_b_axis": levels(rng, n, step, 0.5, 4.0, lambda: float(rng.choice([0.0, 0.0, 60.0, 120.0]))),
    }
