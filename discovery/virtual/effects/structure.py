"""Effects of air, structure and memory."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np

from discovery.virtual.effects.effect import (
    Effect,
    Place,
    Shapes,
    aged,
    around,
    conductance,
    each,
    laws_at,
    minutes,
    number,
    power,
    stretch,
)
from discovery.virtual.machine import Machine
from discovery.virtual.materials import facing
from discovery.virtual.network import Array, Form, Gate, Inputs, Law, link


def _natural(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Laminar (1/4) or turbulent (1/3) natural convection; size in W/K at 5 K."""
    p = 0.25 if shapes("turbulent", 0, 0, 1) < 0.5 else 1.0 / 3.0
    air = m.words.air
    return m.plus(
        laws_at("natural", Form.POWER, stretch(m, at[0], shapes), size / 5.0**p, None, air, (p,), air)
    )


def _radiation(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Radiation to walls that follow the room slowly; size = emissivity x area [m2]."""
    wall, tau = f"wall before {at[0]}", shapes("wall h", 0.5, 1.0, 4.0) * 3600.0 * m.pace.hours / 72.0
    laws = laws_at("radiation", Form.RADIATION, stretch(m, at[0], shapes), size, None, wall)
    return m.plus([*laws, link("wall", wall, m.words.air, 1.0)], {wall: tau})


def _air(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Air at a body where the baseline has none; with a mild natural convection in it."""
    p, air = shapes("m", 0.0, 0.1, 0.2), m.words.air
    return m.plus(laws_at("air", Form.POWER, stretch(m, at[0], shapes), size / 5.0**p, None, air, (p,), air))


def _path(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    pairs = facing(stretch(m, at[0], shapes), stretch(m, at[1], shapes))
    return m.plus([link("path", a, b, size * share) for a, b, share in pairs])


def _second_mass(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A hidden mass behind `size`, one lump or several cells that heat diffuses through."""
    cells = max(1, round(shapes("cells", 0.5, 1, 6.5)))
    tau = shapes("time constant s", minutes(m, 25.0), minutes(m, 53.0), minutes(m, 120.0))
    names = [f"behind {at[0]} {k}" for k in range(cells)]
    first = [link("hidden mass", node, names[0], size * share) for node, share in stretch(m, at[0], shapes)]
    inner = [link("hidden mass", b, a, 3.0 * size * cells) for a, b in itertools.pairwise(names)]
    return m.plus([*first, *inner], dict.fromkeys(names, size * tau / cells))


def _bed(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A bed that follows the room over a day or two, and is warmed a little by the body itself: air around it
    takes half to three times what the body gives. With less it would be a second mass of the body.
    """
    tau, air = shapes("bed h", 20.0, 30.0, 50.0) * 3600.0, size * shapes("bed air", 0.5, 1.0, 3.0)
    laws = [link("bed", node, "bed behind", size * share) for node, share in stretch(m, at[0], shapes)]
    return m.plus([*laws, link("bed air", "bed behind", m.words.air, air)], {"bed behind": air * tau})


def _contact(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A joint that is pressed as it warms, up to a limit: G (1 + size tanh((T - T_0)/dT))."""
    shape = (size, shapes("T_0", 23.0, 24.0, 26.0), shapes("dT", 2.0, 4.0, 6.0))

    def change(law: Law) -> Law:
        if law.name not in (f"{at[0]}-{at[1]}", f"{at[1]}-{at[0]}"):
            return law
        return replace(law, form=Form.CONTACT, shape=shape)

    return replace(m, network=m.network.changed(change))


def _loosening(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A joint whose screws settle."""
    return aged(m, {f"{at[0]}-{at[1]}", f"{at[1]}-{at[0]}"}, size, shapes)


def _fouling(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Dust on a surface that the air cools."""
    return aged(m, {f"air {at[0]}"}, size, shapes)


def _joint(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Part of an error follows a joint with play of `size` [um], narrower on the way up, that creeps home."""
    slip, narrow = shapes("slip", 0.4, 0.7, 1.0), shapes("up", 0.4, 0.7, 1.0)
    creep, j = shapes("creep 1/h", 0.0, 0.05, 0.2), m.outputs.index(at[0])

    def show(y: Array, step_s: float) -> Array:
        x, now, share = y[:, j], float(y[0, j]), creep * step_s / 3600.0
        out = np.empty_like(x)
        for k, value in enumerate(x.tolist()):
            now = max(value - size, min(value + narrow * size, now))
            now += share * (value - now)
            out[k] = now
        shown = y.copy()
        shown[:, j] += slip * (out - x)
        return shown

    return replace(m, shown=(*m.shown, show))


def window(m: Machine, shapes: Shapes, seconds: float) -> tuple[float, float, float]:
    """Start, end and width of the edges [s] of a window of heat in a recording."""
    length = shapes("length", 0.04, 0.1, 0.14) * seconds
    start = shapes("start", 0.05, 0.5, 0.95) * (seconds - length)
    return start, start + length, shapes("edge min", 1.0, 3.0, 7.0) * minutes(m, 1.0)


def _for_a_time(m: Machine, shapes: Shapes) -> Gate:
    """One in one window of one recording (`age` 0 or 1), with soft edges; else zero."""
    where = float(int(shapes("recording", 0, 0, 2)))
    start, end, edge = window(m, shapes, m.pace.hours * 3600.0)

    def gate(u: Inputs) -> Array:
        t = u["clock"]
        return np.asarray(
            (u["number"] == where) * (np.tanh((t - start) / edge) - np.tanh((t - end) / edge)) / 2
        )

    return gate


def _unmeasured(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    gate = _for_a_time(m, shapes)
    return m.plus(laws_at("unmeasured", Form.HEAT, stretch(m, at[0], shapes), size, gate))


def _draught(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A door that is open for some hours; size in W/K, with a mild natural convection in it."""
    gate, p, air = _for_a_time(m, shapes), shapes("m", 0.0, 0.1, 0.2), m.words.air
    nodes = stretch(m, at[0], shapes)
    return m.plus(laws_at("draught", Form.POWER, nodes, size / 5.0**p, gate, air, (p,), air))


def _second_bodies(m: Machine) -> list[Place]:
    return each(tuple(b for b, bar in m.bodies.items() if bar.cells > 1))


STRUCTURE = (
    Effect(
        "natural_convection",
        "W/K",
        "q = size (|dT|/5)^(1/4) dT, dT = T_env - T",
        lambda m: each(tuple(m.air)),
        around(3.0),
        _natural,
        ("radiation", "air_convection"),
    ),
    Effect(
        "radiation",
        "m2",
        "q = size sigma (T_wall^4 - T^4), size = emissivity x area",
        lambda m: each(tuple(m.air)),
        around(0.2),
        _radiation,
        ("natural_convection",),
    ),
    Effect(
        "air_convection",
        "W/K",
        "q = size (T_env - T)",
        lambda m: each(tuple(b for b in m.bodies if b not in m.air)),
        around(3.0),
        _air,
        ("natural_convection",),
    ),
    Effect(
        "conduction_path", "W/K", "q = size (T_1 - T_2)", lambda m: list(m.unlinked), conductance(1.5), _path
    ),
    Effect(
        "second_thermal_mass",
        "W/K",
        "a hidden mass hangs on the body by size",
        _second_bodies,
        conductance(2.0),
        _second_mass,
    ),
    Effect(
        "bed_memory",
        "W/K",
        "q = size (T_bed - T), the bed follows the room in 30 h",
        lambda m: each(m.on_bed),
        conductance(2.0),
        _bed,
    ),
    Effect(
        "contact_conductance",
        "1",
        "G (1 + size tanh((T - 24)/4)), T the mean of both",
        lambda m: list(m.joints),
        number(0.9),
        _contact,
    ),
    Effect(
        "joint_loosening",
        "1",
        "the joint conducts less by a share size from one recording to the next",
        lambda m: list(m.joints),
        number(0.6),
        _loosening,
    ),
    Effect(
        "air_fouling",
        "1",
        "the air takes less by a share size from one recording to the next",
        lambda m: each(tuple(m.air)),
        number(0.6),
        _fouling,
    ),
    Effect(
        "joint_hysteresis",
        "um",
        "the error follows its joint beyond a play of size",
        lambda m: [(o.name,) for o in m.channels if o.role == "error"],
        lambda m, _: 8.0 * m.pace.noise[1],
        _joint,
    ),
    Effect(
        "unmeasured_heat",
        "W",
        "heat in one window of some hours",
        lambda m: each(tuple(m.bodies)),
        power(2.0),
        _unmeasured,
        (),
        (),
    ),
    Effect(
        "draught",
        "W/K",
        "exchange with the air in one window of some hours",
        lambda m: each(tuple(m.bodies)),
        conductance(4.0),
        _draught,
        (),
        (),
    ),
)
