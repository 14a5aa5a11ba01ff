"""The rotary and swivelling table of the paper's five-axis machine, finer than any model that is fitted to it.

About 50 nodes. Beyond the five bodies that a thermobalance has: bearing and winding, cabin air, bed, a side structure
that the sump warms, skins left and right; film on the table and below it, with mass and temperature; hose and sump;
coolant loop with a chiller that switches. Friction follows speed, temperature and preload; films are centrifugal
where the table turns and a wall jet where it rests; they evaporate and are dragged along.

Every number is a dimension of such a machine or a constant of a formula, with its source beside it. None was fitted,
neither to the paper's tables nor to a model.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discovery.virtual import physics
from discovery.virtual.families.rotary_table import BODIES, structure
from discovery.virtual.machine import Assembly, Channel, Machine, Pace, Words
from discovery.virtual.materials import CAST_IRON, STEEL, Bar
from discovery.virtual.network import LEVEL, Array, Inputs, Law, heat, link, stream
from discovery.virtual.network import Form as F

PACE = Pace(hours=72.0, step_s=10.0, log_s=60.0, before_h=24.0, heat_w=1.0)
WORDS = Words(
    fluid="hose", fluid_channel="T_fluid", pump="pump", flow="pump", speed="speed", top_speed=1200.0, power="P_drive",
)  # fmt: skip

# fluid: 6 % emulsion at 25 degC
RHO, HEAT, NU, LAMBDA, PRANDTL = 1000.0, 4100.0, 1.2e-6, 0.58, 8.5
LATENT = 2.45e6  # J/kg
G = 9.81
NOZZLE = 0.010  # m
TABLE_AREA = 0.196  # m2, 0.5 m across
LEFT = 0.3  # share of the fluid that still meets the table when the nozzle stands on the left
PER_LITRE = RHO * HEAT / 60e3  # W/K of a flow of 1 l/min


def rest(u: Inputs) -> Array:
    """1 where the table stands, (n,)."""
    return np.asarray((np.abs(u["speed"]) < 1.0).astype(float))


def on_table(u: Inputs) -> Array:
    """Share of the fluid that meets the table, by the side of the nozzle (0 centre, 1 left)."""
    return np.asarray(1.0 - (1.0 - LEFT) * np.clip(u["nozzle_side"], 0.0, 1.0))


def jet(u: Inputs) -> Array:
    """Exchange [W/K] of a jet with a table at rest, as far as its hydraulic jump.

    The jet falls: V^2 = V_0^2 + 2 g h. h = 0.6 lambda Pr^(1/3) (V/(nu r))^(1/2) on a wall jet (Liu, Lienhard, Lombara,
    J. Heat Transfer 113, 1991), r = 0.1 m (Q/10)^(5/8) (V/V_0)^(1/5) (jump radius, Watson 1964, in its powers).
    """
    Q = np.maximum(u["flow"], 1e-3)
    V0 = Q / 60e3 / (np.pi * NOZZLE**2 / 4)
    V = np.sqrt(V0**2 + 2 * G * u["h_nozzle"] / 1000.0)
    r = np.minimum(0.1 * (Q / 10.0) ** 0.625 * (V / V0) ** 0.2, 0.24)
    return np.asarray(0.6 * LAMBDA * PRANDTL ** (1 / 3) * np.sqrt(V / (NU * r)) * np.pi * r**2)


def table_film(u: Inputs) -> Array:
    """Exchange [W/K] of the table with its film: the jet at rest, a centrifugal film where it turns.

    Nusselt's film in the field of w^2 r: h = 1.88 lambda/delta, delta = (3 nu Q/(2 pi w^2 r^2))^(1/3) at r = 0.17 m;
    three quarters of the table are covered. Beyond the jump a slow film of 300 W/m2K.
    """
    Q = np.maximum(u["flow"], 1e-3) * on_table(u)
    w = np.maximum(np.abs(u["speed"]) * physics.RPM, 1e-3)
    delta = (3 * NU * Q / 60e3 / (2 * np.pi * w**2 * 0.17**2)) ** (1 / 3)
    turning = 0.75 * TABLE_AREA * 1.88 * LAMBDA / delta
    still = (jet(u) + 300.0 * 0.3 * TABLE_AREA * np.minimum(Q / 10.0, 1.0) ** 0.6) * on_table(u)
    return np.asarray((still**4 + turning**4) ** 0.25)


def below_film(u: Inputs) -> Array:
    """Exchange [W/K] of C-Body 1 with what runs down from the table; the rim throws more of it off with speed."""
    n = np.abs(u["speed"])
    return np.asarray(75.0 * (0.25 + 0.75 / (1.0 + (n / 180.0) ** 2)) * on_table(u))


def disk_air(u: Inputs) -> Array:
    """Exchange [W/K] of the table with air, half of it where the top is wet.

    Rotating disk: Nu = 0.36 Re^0.5 laminar, 0.015 Re^0.8 beyond Re = 2.4e5 (Kreith; Dorfman), r = 0.25 m.
    """
    n = np.abs(u["speed"])
    Re = n * physics.RPM * 0.25**2 / 1.55e-5
    laminar, turbulent = 0.36 * np.sqrt(Re), 0.015 * Re**0.8
    h = 5.0 + 0.026 / 0.25 * np.where(Re < 2.4e5, laminar, turbulent)
    return np.asarray(h * 0.26 * (1.0 - 0.5 * (u["flow"] > 0)))


def evaporating(u: Inputs) -> Array:
    """W at 22 degC against dry air: Lewis, h_m = h/(rho c_p Le^(2/3)); 280 W/m2 at rest, more with the speed."""
    return np.asarray(55.0 * (1.0 + 3.9 * (np.abs(u["speed"]) / 600.0) ** 0.8) * on_table(u))


def drag(u: Inputs) -> Array:
    """Power [W] that brings the film to the speed of the rim, half of it heat on the table: m' (w r)^2/2."""
    w = np.abs(u["speed"]) * physics.RPM
    return np.asarray(0.5 * RHO * u["flow"] / 60e3 * on_table(u) * (w * 0.2) ** 2)


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
        "virtual NMV 5000", CHANNELS, lambda *_: {}, WORDS, PACE,
        heat=250.0, rotating=("table", "c_body_1"), splashed=("b_body_1", "b_body_2", "c_body_2"),
        gaps=(("c_body_1", "b_body_1"), ("table", "b_body_1")), chips=("table",), on_bed=("b_body_1", "b_body_2"),
        unlinked=(("table", "b_body_1"), ("c_body_2", "b_body_2"), ("table", "c_body_2")),
    )  # fmt: skip
    return replace(m, bodies={name: m.bodies[name] for name in BODIES})


def _air(a: Assembly) -> None:
    """Cabin air, 2.5 m3; natural convection and radiation of the bodies; the room."""
    laws = [
        Law("air table", F.LINK, node, "cabin", share, disk_air, leaves="cabin")
        for node, share in a.span("table", 0.2, 1.0)
    ]
    # m2; 1.4 |dT|^(1/4) W/m2K on upright walls (McAdams), emissivity 0.5
    for body, area in (("c_body_1", 0.35), ("c_body_2", 0.6), ("b_body_1", 1.4), ("b_body_2", 1.8)):
        for node, share in a.span(body):
            laws.append(
                Law(f"air {body}", F.POWER, node, "cabin", 1.4 * area * share, shape=(0.25,), leaves="cabin")
            )
            laws.append(Law(f"radiation {body}", F.RADIATION, node, "T_env", 0.5 * area * share))
        a.airs[body] = 2.1 * area
    a.airs["table"] = 4.0
    mist = Law("mist", F.LINK, "cabin", "film", 12.0, lambda u: (u["flow"] > 0) * 1.0, leaves="film")
    a.nature(*laws, mist, link("room", "cabin", "T_env", 18.0), nodes={"cabin": 3e3})


def _drive(a: Assembly) -> None:
    """Bearing of 260 mm: Palmgren with a grease that thins out, load torque with thermal preload; motor."""

    def viscous(u: Inputs) -> Array:
        return physics.palmgren_power(np.abs(u["speed"]), 260.0, 1.5, 40.0)

    def loaded(u: Inputs) -> Array:
        return np.asarray(2.8 * np.abs(u["speed"]) * physics.RPM)  # 2.8 Nm

    def iron(u: Inputs) -> Array:
        return np.asarray(80.0 * (np.abs(u["speed"]) / 600.0) ** 1.5)

    def copper(u: Inputs) -> Array:
        torque = (viscous(u) + loaded(u)) / np.maximum(np.abs(u["speed"]) * physics.RPM, 1.0)
        return np.asarray(40.0 * (torque / 6.5) ** 2 * (1.0 - rest(u)))

    top = a.span("c_body_1", 0.4, 1.0)
    stator = a.span("c_body_2", 0.0, 0.6)
    first = a.bodies["c_body_2"].nodes[0]
    a.nature(
        Law(
            "loss c_body_1",
            F.VISCOUS,
            "bearing",
            "bearing",
            gate=viscous,
            shape=physics.viscous_shape(2 / 3, 25.0),
        ),
        Law("loss c_body_1", F.PRELOAD, "bearing", first, gate=loaded, shape=(0.02, 1.0)),
        *[link("bearing inner", node, "bearing", 80.0 * share) for node, share in top],
        *[
            link("bearing outer", node, "bearing", 60.0 * share)
            for node, share in a.span("c_body_2", 0.0, 0.4)
        ],
        *[
            link("bearing outer", node, "bearing", 25.0 * share)
            for node, share in a.span("b_body_1", 0.0, 0.3)
        ],
        *[heat("loss c_body_2", node, 0.7 * share, iron) for node, share in stator],
        *[heat("loss c_body_1", node, 0.3 * share, iron) for node, share in top],
        Law("loss c_body_2", F.PRELOAD, "winding", "T_env", gate=copper, shape=(0.00393, 1.0)),
        *[link("winding", node, "winding", 25.0 * share) for node, share in stator],
        nodes={"bearing": 5.6e3, "winding": 4e3},
    )


def _cooling(a: Assembly) -> None:
    """Jackets, a loop of 3.2 l/min, a tank of 16 l whose chiller of 2 kW switches about its own set point."""
    a.nature(
        *[link("jacket", node, "jacket", 113.0 * share) for node, share in a.span("c_body_2", 0.0, 0.8)],
        *[link("jacket", node, "jacket", 30.0 * share) for node, share in a.span("c_body_1", 0.5, 1.0)],
        link("coolant", "jacket", "coolant", 220.0),
        link("coolant air", "coolant", "T_env", 6.0),
        nodes={"jacket": 8e3, "coolant": 65e3},
    )
    laws, nodes, switches = physics.chiller("coolant", 2000.0, "T_set", 0.5)
    a.nature(*laws, nodes=nodes, switches=switches)


def _fluid(a: Assembly) -> None:
    """Sump, hose, the film on the table and what runs down from it: temperatures and masses of their own."""

    def flow(u: Inputs) -> Array:
        return np.asarray(PER_LITRE * u["flow"] * on_table(u))

    def aside(u: Inputs) -> Array:
        return np.asarray(PER_LITRE * u["flow"] * (1.0 - on_table(u)))

    def fed(u: Inputs) -> Array:
        return np.asarray(u["flow"] / 10.0 * on_table(u))

    def spun(u: Inputs) -> Array:
        return np.asarray((u["speed"] / 90.0) ** 2)

    wet = ("film mass", 0.01)
    for body, gate, film in (("table", table_film, "film"), ("c_body_1", below_film, "film below")):
        span = a.span("table", 0.1, 1.0) if body == "table" else a.span("c_body_1", 0.0, 0.7)
        a.nature(
            *[
                Law(f"fluid {body}", F.LINK, node, film, share, gate, leaves=film, film=wet)
                for node, share in span
            ]
        )
    a.nature(
        heat("pump", "sump", 63.5, "flow"),  # W for each l/min: 635 W at 10 l/min
        heat("tank", "sump", 1.0, "sump_heat"),
        link("sump air", "sump", "T_env", 91.0),
        # what flows: sump, hose, film, below, sump; on the left past the table
        stream("supply", "hose", "sump", PER_LITRE, "flow"),
        stream("supply", "film", "hose", 1.0, flow),
        stream("supply", "film below", "film", 1.0, flow),
        stream("return", "sump", "film below", 1.0, flow),
        stream("return", "sump", "hose", 1.0, aside),
        link("hose air", "hose", "T_env", 3.0),
        heat("film drag", "film", 1.0, drag),
        # mass of the film on a square metre
        heat("film fed", "film mass", 0.0015, fed),
        Law("film drains", F.POWER, "film mass", size=0.0015 / 0.1**3, shape=(2.0,)),
        Law("film thrown off", F.LINK, "film mass", size=1 / 600.0, gate=spun),
        Law("evaporation", F.EVAPORATION, "film", "cabin", gate=evaporating, shape=(0.7,), film=wet,
            leaves="film mass", take=-1.0 / (LATENT * TABLE_AREA)),
        # the gap below the table fills and leaks
        heat("gap fills", "gap", 1 / 240.0, fed),
        Law("gap leaks", F.LINK, "gap", size=1 / 900.0),
        *[Law("gap", F.LINK, n1, n2, 8.0 * s1 * 2.0, leaves=n2, film=("gap", 0.3))
          for (n1, s1), (n2, _) in zip(a.span("c_body_1", 0.0, 0.5), a.span("b_body_1", 0.0, 0.5), strict=False)],
        nodes={"sump": 1.2e6, "hose": 7e3, "film": 1.2e3, "film below": 2.0e3, "film mass": LEVEL, "gap": LEVEL},
    )  # fmt: skip
    # splash on the B corpus while the table turns
    splash = lambda u: (u["flow"] > 0) * (1.0 - np.exp(-np.abs(u["speed"]) / 400.0)) * on_table(u)  # noqa: E731
    a.nature(
        *[
            Law("splash", F.LINK, node, "film", 6.0 * share, splash, leaves="film")
            for node, share in a.span("b_body_1")
        ]
    )


def _surroundings(a: Assembly) -> None:
    """Bed of 3 t, skins of 60 kg left and right, a side structure of 400 kg that the sump warms from below."""
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
    left = lambda u: np.clip(u["nozzle_side"], 0.0, 1.0) * (u["flow"] > 0)  # noqa: E731
    a.nature(
        *[link("bed air", node, "T_env", 14.0 * share) for node, share in a.span("bed")],
        *[
            link("foot", x, y, 15.0 * s)
            for (x, s), (y, _) in zip(a.span("b_body_2", 0.8, 1.0), a.span("bed", 0.0, 0.3), strict=False)
        ],
        *[link("side sump", node, "sump", 15.0 * share) for node, share in a.span("side", 0.0, 0.3)],
        *[link("side air", node, "T_env", 10.0 * share) for node, share in a.span("side")],
        *[
            link("side mount", x, y, 6.0 * s)
            for (x, s), (y, _) in zip(a.span("b_body_2", 0.5, 0.9), a.span("side", 0.6, 1.0), strict=False)
        ],
        nodes={"skin left": 30e3, "skin right": 30e3},
    )
    for skin in ("skin left", "skin right"):
        a.nature(
            *[link("skin", node, skin, 30.0 * share) for node, share in a.span("b_body_1", 0.2, 1.0)],
            *[link("skin", node, skin, 20.0 * share) for node, share in a.span("b_body_2", 0.0, 0.6)],
            Law("air skin", F.POWER, skin, "cabin", 0.8, shape=(0.25,), leaves="cabin"),
        )
    # a nozzle on the left wets the structure: 20 W/K on the corpus, 10 W/K behind it, the skin most of all
    a.nature(
        *[
            Law("left nozzle", F.LINK, n, "hose", 20.0 * s, left, leaves="hose")
            for n, s in a.span("b_body_1", 0.2, 1.0)
        ],
        *[
            Law("left nozzle", F.LINK, n, "hose", 10.0 * s, left, leaves="hose")
            for n, s in a.span("b_body_2", 0.0, 0.6)
        ],
        Law("left nozzle", F.LINK, "skin left", "hose", 25.0, left, leaves="hose"),
    )


def _levers(a: Assembly) -> None:
    """Errors by lever arms [m] times expansion, um/K and um/m/K; the cells of a body count unevenly."""
    um, um_m = {"unit": "um", "sd": 1.0}, {"unit": "um/m", "sd": 2.5}
    a.error(Channel("E_X0C", "error", **um), {"c_body_1": 0.02, "b_body_1": 0.05})  # type: ignore[arg-type]
    a.error(
        Channel("E_Y0C", "error", **um),
        {"c_body_1": -1.6, "c_body_2": -0.8, "b_body_1": -4.9, "b_body_2": -2.6},
        0.25,
    )  # type: ignore[arg-type]
    a.error(
        Channel("E_Z0T", "error", **um),
        {"table": 0.74, "c_body_1": 1.6, "c_body_2": 1.8, "b_body_1": 1.5},
        0.25,
    )  # type: ignore[arg-type]
    a.error(Channel("E_R0T", "error", **um), {"table": 11.5 * 0.167}, 0.2)  # type: ignore[arg-type]
    a.error(
        Channel("E_A0C", "error", **um_m),
        {"c_body_1": 5.2, "c_body_2": 2.6, "b_body_1": -5.6, "b_body_2": -2.2},
        0.25,
    )  # type: ignore[arg-type]
    a.levers["E_X0C"] |= {"skin left": 1.6, "skin right": -1.6}
    a.levers["E_Y0C"] |= {"skin left": -0.25, "skin right": -0.25, "bearing": -0.15} | dict.fromkeys(
        a.bodies["side"].nodes, -0.35 / (4 * a.refine)
    )
    a.levers["E_Z0T"] |= {"bearing": 0.25}
    a.levers["E_A0C"] |= {"skin left": -0.4, "skin right": -0.4} | dict.fromkeys(
        a.bodies["side"].nodes, 0.9 / (4 * a.refine)
    )


CHANNELS = (
    Channel("T_env", "ambient temperature", "degC", 2, lambda r: r["T_env"], 0.03),
    Channel("T_fluid", "fluid temperature", "degC", 2, lambda r: r["sump"], 0.03),
    Channel("T_cool", "coolant temperature", "degC", 2, lambda r: r["coolant"], 0.03),
    Channel("pump", "fluid flow", "1", 3, lambda r: r["pump"]),
    Channel("flow", "fluid flow", "l/min", 2, lambda r: r["flow"]),
    Channel("speed", "rotation speed", "rpm", 1, lambda r: r["speed"]),
    Channel("P_drive", "heat load", "W", 1, lambda r: r.flow(lambda law: law.name.startswith("loss "))),
    Channel("P_cool", "cooling power", "W", 1, lambda r: 220.0 * (r["jacket"] - r["coolant"])),
    Channel("h_nozzle", "nozzle height", "mm", 0, lambda r: r["h_nozzle"]),
    Channel("nozzle_side", "nozzle side", "1", 1, lambda r: r["nozzle_side"]),
)
