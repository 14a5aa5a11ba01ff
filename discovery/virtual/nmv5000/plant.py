"""The rotary and swivelling table of the paper's five-axis machine, finer than any model that is fitted to
it.

About 50 nodes. Beyond the five bodies that a thermobalance has: bearing and winding, cabin air, bed, a side
structure that the sump warms, skins left and right; film on the table and below it, with mass and
temperature; hose and sump; coolant loop with a chiller that switches. Friction follows speed, temperature
and preload; films are centrifugal where the table turns and a wall jet where it rests; they evaporate and
are dragged along.

Every number is a dimension of such a machine or a constant of a formula, with its source next to it. None
was fitted, neither to the paper's tables nor to a model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discovery.virtual import physics
from discovery.virtual.assembly import Assembly
from discovery.virtual.families.rotary_table import BODIES, structure
from discovery.virtual.machine import Channel, Machine, Pace, Words, felt, logged
from discovery.virtual.materials import CAST_IRON, STEEL, Bar, facing
from discovery.virtual.network import LEVEL, Array, Form, Inputs, Law, heat, link, stream
from discovery.virtual.nmv5000 import film

PACE = Pace(hours=72.0, step_s=10.0, log_s=60.0, before_h=24.0, heat_w=1.0)
WORDS = Words(
    fluid="hose",
    fluid_channel="T_fluid",
    pump="pump",
    flow="pump",
    speed="speed",
    top_speed=1200.0,
    power="P_drive",
)


def five_axis(refine: int = 1) -> Machine:
    """The plant. `refine`: times as many cells in every body, to see that the mesh is fine enough."""
    a = Assembly(np.random.default_rng(5000), refine=refine, spread=0.0)
    structure(a)
    _air(a)
    _drive(a)
    _cooling(a)
    _fluid(a)
    _surroundings(a)
    _levers(a)
    a.wet = {"table": 220.0, "c_body_1": 65.0}
    a.driven = {"c_body_1": "P_drive", "c_body_2": "P_drive"}
    m = a.machine(
        "virtual NMV 5000",
        CHANNELS,
        lambda *_: {},
        WORDS,
        PACE,
        heat=250.0,
        rotating=("table", "c_body_1"),
        splashed=("b_body_1", "b_body_2", "c_body_2"),
        gaps=(("c_body_1", "b_body_1"), ("table", "b_body_1")),
        chips=("table",),
        on_bed=("b_body_1", "b_body_2"),
        unlinked=(("table", "b_body_1"), ("c_body_2", "b_body_2"), ("table", "c_body_2")),
    )
    return replace(m, bodies={name: m.bodies[name] for name in BODIES})


def _air(a: Assembly) -> None:
    """Cabin air, 2.5 m3; natural convection and radiation of the bodies; the room."""
    laws = [
        Law("air table", Form.LINK, node, "cabin", share, film.disk_air, leaves="cabin")
        for node, share in a.span("table", 0.2, 1.0)
    ]
    # m2; 1.4 |dT|^(1/4) W/m2K on upright walls (McAdams), emissivity 0.5
    for body, area in (("c_body_1", 0.35), ("c_body_2", 0.6), ("b_body_1", 1.4), ("b_body_2", 1.8)):
        for node, share in a.span(body):
            laws.append(
                Law(
                    f"air {body}",
                    Form.POWER,
                    node,
                    "cabin",
                    1.4 * area * share,
                    shape=(0.25,),
                    leaves="cabin",
                )
            )
            laws.append(Law(f"radiation {body}", Form.RADIATION, node, "T_env", 0.5 * area * share))
        a.airs[body] = 2.1 * area
    a.airs["table"] = 4.0
    mist = Law("mist", Form.LINK, "cabin", "film", 12.0, "pump", leaves="film")
    a.nature(*laws, mist, link("room", "cabin", "T_env", 18.0), nodes={"cabin": 3e3})


def _drive(a: Assembly) -> None:
    """Bearing of 260 mm: Palmgren with a grease that thins out, load torque with thermal preload; motor."""

    def viscous(u: Inputs) -> Array:
        return physics.palmgren_power(np.abs(u["speed"]).astype(np.float64), 260.0, 1.5, 40.0)

    def loaded(u: Inputs) -> Array:
        return np.asarray(2.8 * np.abs(u["speed"]) * physics.RPM)  # 2.8 Nm

    def iron(u: Inputs) -> Array:
        return np.asarray(80.0 * (np.abs(u["speed"]) / 600.0) ** 1.5)

    def copper(u: Inputs) -> Array:
        torque = (viscous(u) + loaded(u)) / np.maximum(np.abs(u["speed"]) * physics.RPM, 1.0)
        return np.asarray(40.0 * (torque / 6.5) ** 2 * (1.0 - film.rest(u)))

    top = a.span("c_body_1", 0.2, 1.0)
    stator = a.span("c_body_2")
    a.nature(
        Law(
            "loss c_body_1",
            Form.VISCOUS,
            "bearing",
            "bearing",
            gate=viscous,
            shape=physics.viscous_shape(2 / 3, 25.0),
        ),
        Law("loss c_body_1", Form.PRELOAD, "bearing", "jacket", gate=loaded, shape=(0.02, 1.0)),
        *[link("bearing inner", node, "bearing", 80.0 * share) for node, share in top],
        *[
            link("bearing outer", node, "bearing", 60.0 * share)
            for node, share in a.span("c_body_2", 0.0, 0.8)
        ],
        *[
            link("bearing outer", node, "bearing", 25.0 * share)
            for node, share in a.span("b_body_1", 0.0, 0.6)
        ],
        *[heat("loss c_body_2", node, 0.7 * share, iron) for node, share in stator],
        *[heat("loss c_body_1", node, 0.3 * share, iron) for node, share in top],
        Law("loss c_body_2", Form.PRELOAD, "winding", "T_env", gate=copper, shape=(0.00393, 1.0)),
        *[link("winding", node, "winding", 25.0 * share) for node, share in stator],
        nodes={"bearing": 5.6e3, "winding": 4e3},
    )


def _cooling(a: Assembly) -> None:
    """Jackets, a loop of 3.2 l/min, a tank of 16 l whose chiller of 2 kW switches about its own set point."""
    a.nature(
        *[link("jacket", node, "jacket", 113.0 * share) for node, share in a.span("c_body_2")],
        *[link("jacket", node, "jacket", 30.0 * share) for node, share in a.span("c_body_1", 0.2, 1.0)],
        link("coolant", "jacket", "coolant", 220.0),
        link("coolant air", "coolant", "T_env", 6.0),
        nodes={"jacket": 8e3, "coolant": 65e3},
    )
    laws, nodes, switches = physics.chiller("coolant", 2000.0, "T_set", 0.5)
    a.nature(*laws, nodes=nodes, switches=switches)


def _fluid(a: Assembly) -> None:
    """Sump, hose, the film on the table and what runs down from it: temperatures and masses of their own."""
    wet = ("film mass", 0.01)
    for body, gate, layer in (
        ("table", film.table_film, "film"),
        ("c_body_1", film.below_film, "film below"),
    ):
        span = a.span("table", 0.2, 1.0) if body == "table" else a.span("c_body_1", 0.0, 0.6)
        a.nature(
            *[
                Law(f"fluid {body}", Form.LINK, node, layer, share, gate, leaves=layer, film=wet)
                for node, share in span
            ]
        )
    a.nature(
        heat("pump", "sump", 63.5, "flow"),  # W for each l/min: 635 W at 10 l/min
        heat("tank", "sump", 1.0, "sump_heat"),
        link("sump air", "sump", "T_env", 91.0),
        # what flows: sump, hose, film, below, sump; on the left past the table
        stream("supply", "hose", "sump", film.PER_LITRE, "flow"),
        stream("supply", "film", "hose", 1.0, film.flow),
        stream("supply", "film below", "film", 1.0, film.flow),
        stream("return", "sump", "film below", 1.0, film.flow),
        stream("return", "sump", "hose", 1.0, film.aside),
        link("hose air", "hose", "T_env", 3.0),
        heat("film drag", "film", 1.0, film.drag),
        # mass of the film on a square metre
        heat("film fed", "film mass", 0.0015, film.fed),
        Law("film drains", Form.POWER, "film mass", size=0.0015 / 0.1**3, shape=(2.0,)),
        Law("film thrown off", Form.LINK, "film mass", size=1 / 600.0, gate=film.spun),
        Law(
            "evaporation",
            Form.EVAPORATION,
            "film",
            "cabin",
            gate=film.evaporating,
            shape=(0.7,),
            film=wet,
            leaves="film mass",
            take=-1.0 / (film.LATENT * film.TABLE_AREA),
        ),
        # the gap below the table fills and leaks
        heat("gap fills", "gap", 1 / 240.0, film.fed),
        Law("gap leaks", Form.LINK, "gap", size=1 / 900.0),
        *[
            Law("gap", Form.LINK, x, y, 10.0 * share, leaves=y, film=("gap", 0.3))
            for x, y, share in facing(a.span("c_body_1", 0.0, 0.6), a.span("b_body_1", 0.0, 0.6))
        ],
        nodes={
            "sump": 1.2e6,
            "hose": 7e3,
            "film": 1.2e3,
            "film below": 2.0e3,
            "film mass": LEVEL,
            "gap": LEVEL,
        },
    )

    a.nature(
        *[
            Law("splash", Form.LINK, node, "film", 6.0 * share, film.splash, leaves="film")
            for node, share in a.span("b_body_1")
        ]
    )


def _surroundings(a: Assembly) -> None:
    """Bed of 3 t, skins of 60 kg left and right, a side structure of 400 kg that the sump warms."""
    a.bodies["bed"] = Bar("bed", CAST_IRON, 0.5, 0.83, 3 * a.refine)
    a.bodies["side"] = Bar("side", STEEL, 1.0, 0.05, 4 * a.refine, web=0.02)
    for name in ("bed", "side"):
        bar = a.bodies[name]
        a.nature(
            *[
                link(f"inside {name}", x, y, bar.conductance * bar.cells)
                for x, y in zip(bar.nodes, bar.nodes[1:], strict=False)
            ],
            nodes=dict.fromkeys(bar.nodes, bar.capacity / bar.cells),
        )

    a.nature(
        *[link("bed air", node, "T_env", 14.0 * share) for node, share in a.span("bed")],
        *[
            link("foot", x, y, 15.0 * share)
            for x, y, share in facing(a.span("b_body_2", 0.4, 1.0), a.span("bed", 0.0, 1 / 3))
        ],
        *[link("side sump", node, "sump", 15.0 * share) for node, share in a.span("side", 0.0, 0.25)],
        *[link("side air", node, "T_env", 10.0 * share) for node, share in a.span("side")],
        *[
            link("side mount", x, y, 6.0 * share)
            for x, y, share in facing(a.span("b_body_2", 0.4, 0.8), a.span("side", 0.5, 1.0))
        ],
        nodes={"skin left": 30e3, "skin right": 30e3},
    )
    for skin in ("skin left", "skin right"):
        a.nature(
            *[link("skin", node, skin, 15.0 * share) for node, share in a.span("b_body_1", 0.2, 1.0)],
            *[link("skin", node, skin, 10.0 * share) for node, share in a.span("b_body_2", 0.0, 0.6)],
            Law("air skin", Form.POWER, skin, "cabin", 0.8, shape=(0.25,), leaves="cabin"),
        )
    # a nozzle on the left wets the structure: 20 W/K on the corpus, 10 W/K behind it, the skin most of all
    a.nature(
        *[
            Law("left nozzle", Form.LINK, n, "hose", 20.0 * s, film.left, leaves="hose")
            for n, s in a.span("b_body_1", 0.2, 1.0)
        ],
        *[
            Law("left nozzle", Form.LINK, n, "hose", 10.0 * s, film.left, leaves="hose")
            for n, s in a.span("b_body_2", 0.0, 0.6)
        ],
        Law("left nozzle", Form.LINK, "skin left", "hose", 25.0, film.left, leaves="hose"),
    )


def _levers(a: Assembly) -> None:
    """Errors by lever arms [m] times expansion, um/K and um/m/K; the cells of a body count unevenly."""
    a.error("E_X0C", "um", {"c_body_1": 0.02, "b_body_1": 0.05})
    a.error(
        "E_Y0C", "um", {"c_body_1": -1.6, "c_body_2": -0.8, "b_body_1": -4.9, "b_body_2": -2.6}, uneven=0.25
    )
    a.error("E_Z0T", "um", {"table": 0.74, "c_body_1": 1.6, "c_body_2": 1.8, "b_body_1": 1.5}, uneven=0.25)
    a.error("E_R0T", "um", {"table": 11.5 * 0.167}, uneven=0.2)
    a.error(
        "E_A0C",
        "um/m",
        {"c_body_1": 5.2, "c_body_2": 2.6, "b_body_1": -5.6, "b_body_2": -2.2},
        noise=2.5,
        uneven=0.25,
    )
    # a difference of 1 K over a width of 0.5 m bends an overhang of 0.48 m by 10.8*0.48^2/(2*0.5) = 2.5 um
    a.levers["E_X0C"] |= {"skin left": 2.5, "skin right": -2.5}
    a.levers["E_Y0C"] |= {"skin left": -0.25, "skin right": -0.25, "bearing": -0.15} | dict.fromkeys(
        a.bodies["side"].nodes, -0.35 / (4 * a.refine)
    )
    a.levers["E_Z0T"] |= {"bearing": 0.25}
    a.levers["E_A0C"] |= {"skin left": -0.4, "skin right": -0.4} | dict.fromkeys(
        a.bodies["side"].nodes, 0.9 / (4 * a.refine)
    )


CHANNELS = (
    felt("T_env", "ambient temperature"),
    felt("T_fluid", "fluid temperature", "sump"),
    felt("T_cool", "coolant temperature", "coolant"),
    logged("pump", "fluid flow", "1", 3),
    logged("flow", "fluid flow", "l/min", 2),
    logged("speed", "rotation speed", "rpm", 1),
    Channel("P_drive", "heat load", "W", 1, lambda r: r.flow(lambda law: law.name.startswith("loss "))),
    Channel("P_cool", "cooling power", "W", 1, lambda r: 220.0 * (r["jacket"] - r["coolant"])),
    logged("h_nozzle", "nozzle height", "mm"),
    logged("nozzle_side", "nozzle side", "1", 1),
)
