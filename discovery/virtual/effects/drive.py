"""Effects of bearings, motors and their cooling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discovery.virtual.effects.effect import (
    Effect,
    Place,
    Shapes,
    around,
    each,
    exchange,
    laws_at,
    number,
    power,
    speed_power,
    stretch,
)
from discovery.virtual.machine import Machine
from discovery.virtual.network import Array, Form, Inputs, Law, times
from discovery.virtual.physics import viscous_shape

COPPER = 0.00393  # 1/K


def _hidden_friction(m: Machine) -> list[Place]:
    """Bodies whose friction the recorded power or a speed term does not follow anyway."""
    return (
        each(tuple(b for b in {**m.driven, **dict.fromkeys(m.rotating)} if m.driven.get(b) != m.words.speed))
        if m.words.speed
        else []
    )


def _driven_by_speed(m: Machine) -> list[Place]:
    bodies = [b for b, by in m.driven.items() if by == m.words.speed] or [
        b for b in m.driven if m.words.speed
    ]
    return each(tuple(bodies))


def _driven_by_power(m: Machine) -> list[Place]:
    return each(tuple(b for b, by in m.driven.items() if by == m.words.power))


def _friction(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A seal or bearing whose friction no channel shows."""
    gate = speed_power(m, shapes("m", 1.3, 1.67, 1.9))
    return m.plus(laws_at("hidden friction", Form.HEAT, stretch(m, at[0], shapes), size, gate))


def _viscosity(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Friction of a lubricant that thins out: Palmgren with Vogel, or Stribeck's curve with the same oil."""
    nodes = stretch(m, at[0], shapes)
    oil = viscous_shape(1.0 if (stribeck := shapes("stribeck", 0, 0, 1) > 0.6) else 2 / 3)
    if not stribeck:
        gate = speed_power(m, shapes("m", 1.4, 1.67, 1.8))
        return m.plus(laws_at("oil", Form.VISCOUS, nodes, size, gate, shape=oil))
    boundary, top = shapes("boundary", 0.1, 0.2, 0.3), m.words.top_speed
    watts = size / (top * 2 * np.pi / 60 * (top / 1000.0) ** (2 / 3))  # Nm at x = 1
    share = boundary * (top / 1000.0) ** (2 / 3)
    laws = laws_at("oil", Form.STRIBECK, nodes, 1.0, m.words.speed, shape=(*oil, watts * share, watts))
    # a law of speed is not linear in its gate: each node gets its share as a share of torque
    shared = [
        replace(law, size=1.0, shape=(*oil, watts * share * part, watts * part))
        for law, (_, part) in zip(laws, nodes, strict=True)
    ]
    return m.plus(shared)


def _preload(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The inner ring grows against the outer one: the load grows with their difference."""
    k, b = shapes("1/K", 0.03, 0.05, 0.1), shapes("m", 0.5, 1.0, 1.0)
    partner = next(p for pair in m.joints if at[0] in pair for p in pair if p != at[0])
    other = m.bodies[partner].nodes[0]
    gate = speed_power(m, shapes("speed m", 0.9, 1.0, 1.2))
    return m.plus(laws_at("preload", Form.PRELOAD, stretch(m, at[0], shapes), size / k, gate, other, (k, b)))


def _copper(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Winding loss grows with the winding's temperature above the room."""
    nodes = stretch(m, at[0], shapes)
    more = laws_at("copper", Form.PRELOAD, nodes, size, m.words.power, m.words.air, (COPPER, 1.0))
    return m.plus([*more, *laws_at("copper", Form.HEAT, nodes, -size, m.words.power)])


def _windage(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    gate = speed_power(m, shapes("m", 2.7, 2.8, 3.0))
    return m.plus(laws_at("windage", Form.HEAT, stretch(m, at[0], shapes), size, gate))


def _rotating_air(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    gate, air = speed_power(m, shapes("m", 0.6, 0.8, 0.9)), m.words.air
    return m.plus(laws_at("air by speed", Form.LINK, stretch(m, at[0], shapes), size, gate, air, leaves=air))


def _dead_band(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The cooling follows its signal only beyond a dead band of `size` watts, and creeps after it."""
    channel, creep = m.words.cooling, shapes("creep 1/h", 0.0, 0.1, 0.3)
    names = {f"cooling {b}" for b in at}

    def gate(u: Inputs) -> Array:
        share = creep * m.pace.step_s / 3600.0
        now, out = float(u[channel][0]), np.empty_like(u[channel])
        for k, x in enumerate(u[channel].tolist()):
            now = max(x - size, min(x + size, now))
            now += share * (x - now)
            out[k] = now
        return out

    def change(law: Law) -> Law:
        return replace(law, gate=gate) if law.name in names else law

    return replace(m, network=m.network.changed(change))


def _worn(m: Machine) -> list[Place]:
    """Bodies that a recorded loss heats: a nut that rubs on a screw heats the screw as well."""
    return [
        (body, *(b for b in m.bodies if b != body and set(m.bodies[b].nodes) & _heated(m, f"loss {body}")))
        for body in m.driven
    ]


def _heated(m: Machine, name: str) -> set[str]:
    return {law.into for law in m.network.laws if law.name == name}


def _wear(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Less of the recorded loss reaches the body, by `age` of the recording; a run-in is fast at first."""
    run_in = shapes("recordings", 1.5, 1e6, 6.0)

    def change(u: Inputs) -> Array:
        age = u["age"]
        return np.asarray(-size * (run_in * (1.0 - np.exp(-age / run_in)) if run_in < 1e3 else age))

    losses = [law for law in m.network.laws if law.name == f"loss {at[0]}"]
    return m.plus(
        [
            replace(law, name=f"wear of {law.name}", gate=times(law.gate, change) if law.gate else change)
            for law in losses
        ]
    )


def _preload_reach(m: Machine, at: Place) -> float:
    return 0.3 * exchange(m, at[0])


DRIVE = (
    Effect(
        "friction_speed",
        "W",
        "q = size (n/top)^1.67, in no recorded power",
        _hidden_friction,
        power(1.0),
        _friction,
        ("windage",),
    ),
    Effect(
        "viscosity_temperature",
        "W",
        "q = size (n/top)^1.67 nu(T)^(2/3) by Vogel, or Stribeck's curve",
        _driven_by_speed,
        power(2.0),
        _viscosity,
        ("friction_speed",),
    ),
    Effect(
        "thermal_preload",
        "W/K",
        "q = size n/top (1/k + T - T_neighbour)",
        _driven_by_speed,
        _preload_reach,
        _preload,
        ("friction_speed",),  # by far the most of it: size n/top / k, also of a cold bearing
    ),
    Effect(
        "copper_resistance", "1", "q = size P 0.00393 (T - T_env)", _driven_by_power, number(1.0), _copper
    ),
    Effect(
        "windage", "W", "q = size (n/top)^2.8", _hidden_friction, power(0.6), _windage, ("friction_speed",)
    ),
    Effect(
        "rotating_air_convection",
        "W/K",
        "q = size (n/top)^0.8 (T_env - T)",
        lambda m: each(tuple(b for b in m.rotating if b in m.air)),
        around(5.0),
        _rotating_air,
    ),
    Effect(
        "cooling_hysteresis",
        "W",
        "the cooling follows its signal beyond a dead band of size",
        lambda m: each(m.cooled) if m.words.cooling else [],
        power(0.6),
        _dead_band,
    ),
    Effect(
        "wear",
        "1",
        "the loss falls by size from one recording to the next",
        _worn,
        number(0.4),
        _wear,
    ),
)
