"""Effects of the fluid: splash, film, gap, hose, sump. Films and gaps fill and empty as states."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discovery.virtual.effects.effect import (
    Effect,
    Place,
    Shapes,
    conductance,
    each,
    laws_at,
    minutes,
    number,
    power,
    speed_power,
    stretch,
)
from discovery.virtual.machine import Machine
from discovery.virtual.materials import facing
from discovery.virtual.network import LEVEL, Array, Form, Gate, Inputs, Law, heat, link, stream, times
from discovery.virtual.physics import film

LATENT = 2.45e6  # J/kg, evaporation of water at 20 degC


def _wet(m: Machine) -> list[Place]:
    return each(tuple(m.wet))


def _wet_and_rotating(m: Machine) -> list[Place]:
    return each(tuple(b for b in m.wet if b in m.rotating))


def _splash(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A body that the baseline takes for dry is reached by the fluid; its film builds up and runs off."""
    name = f"film on {at[0]}"
    thickness = shapes("film kg/m2", 0.04, 0.1, 0.15)
    own = film(name, m.words.pump, shapes("splash kg/m2/s", 1e-4, 3e-4, 6e-4), thickness)
    laws = laws_at(
        "splash",
        Form.LINK,
        stretch(m, at[0], shapes),
        size,
        m.words.pump,
        m.words.fluid,
        leaves=m.words.fluid,
        film=(name, 0.02),
    )
    return m.plus([*laws, *own], {name: LEVEL})


def _faster(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The film gets thinner and conducts better with the speed."""
    gate = times(m.words.pump, speed_power(m, shapes("m", 0.5, 0.67, 0.9)))
    nodes = stretch(m, at[0], shapes)
    return m.plus(laws_at("film by speed", Form.LINK, nodes, size, gate, m.words.fluid, leaves=m.words.fluid))


def _changed_fluid(m: Machine, bodies: Place, factor: Gate) -> Machine:
    """The machine with another factor on the fluid's exchange with some bodies."""
    names = {f"fluid {b}" for b in bodies}

    def change(law: Law) -> Law:
        if law.name not in names:
            return law
        return replace(law, gate=times(law.gate, factor) if law.gate else factor)

    return replace(m, network=m.network.changed(change))


def _by_flow(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The exchange saturates with the flow: (1 - exp(-k f))/(1 - exp(-k)) in place of f."""
    k = shapes("k", 1.5, 2.0, 4.0)

    def factor(u: Inputs) -> Array:
        f = np.maximum(u[m.words.pump], 1e-9)
        return np.asarray(1.0 - size + size * (1.0 - np.exp(-k * f)) / (1.0 - np.exp(-k)) / f)

    return _changed_fluid(m, at, factor)


def _rim(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The faster the table throws the film off, the less of the body below it is wet."""
    edge, p = shapes("n_c/top", 0.12, 0.17, 0.3), shapes("m", 1.5, 2.0, 3.0)

    def factor(u: Inputs) -> Array:
        thrown = 1.0 - 1.0 / (1.0 + (np.abs(u[m.words.speed]) / (edge * m.words.top_speed)) ** p)
        return np.asarray(1.0 - size * thrown)

    return _changed_fluid(m, at, factor)


def _evaporation(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Lewis: the flux follows the vapour pressures over the film and in the room; the film dries by it."""
    name, flux = f"drying film on {at[0]}", shapes("W/m2", 200.0, 400.0, 700.0)
    own = film(name, m.words.pump, 8e-4, shapes("film kg/m2", 0.08, 0.12, 0.25), 1e5)
    laws = laws_at(
        "evaporation",
        Form.EVAPORATION,
        stretch(m, at[0], shapes),
        size,
        None,
        m.words.air,
        (shapes("humidity", 0.3, 0.45, 0.55),),
        name,
        (name, 0.004),
        -flux / max(size, 1e-9) / LATENT,
    )
    return m.plus([*laws, *own], {name: LEVEL})


def _drag(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The film is brought to speed: heat in the table and as much in the fluid."""
    gate = times(m.words.pump, speed_power(m, shapes("m", 1.8, 2.0, 2.2)))
    both = laws_at("film drag", Form.HEAT, stretch(m, at[0], shapes), size, gate)
    if m.words.fluid in m.network.nodes:
        both.append(heat("film drag", m.words.fluid, size, gate))
    return m.plus(both)


def _gap(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Fluid fills a gap between two bodies within minutes and leaks out again."""
    name, fill, leak = "gap", shapes("fill s", 60.0, 120.0, 600.0), shapes("leak s", 300.0, 600.0, 2400.0)
    pairs = facing(stretch(m, at[0], shapes), stretch(m, at[1], shapes))
    laws = [Law("gap", Form.LINK, a, b, size * share, leaves=b, film=(name, 0.15)) for a, b, share in pairs]
    level = [
        heat("gap fills", name, 1.0 / fill, m.words.pump),
        Law("gap is full", Form.LINK, name, size=1.0 / fill, gate=m.words.pump),  # the rest flows past it
        Law("gap leaks", Form.LINK, name, size=1.0 / leak),
    ]
    return m.plus([*laws, *level], {name: LEVEL})


def _behind(m: Machine, seconds: list[float], air: float) -> Machine:
    """The fluid comes through volumes in series, each of a residence time [s] at full flow."""
    names = [f"hose {k}" for k in range(len(seconds))]
    flow, fluid = 300.0, m.words.fluid  # W/K at full flow
    laws = [stream("hose", a, b, flow, m.words.pump) for a, b in zip(names, [fluid, *names], strict=False)]
    laws += [link("hose air", name, m.words.air, air / len(names)) for name in names]

    def change(law: Law) -> Law:
        return replace(law, source=names[-1]) if law.name.startswith("fluid ") else law

    changed = replace(m, network=m.network.changed(change))
    return changed.plus(laws, {name: flow * t for name, t in zip(names, seconds, strict=True)})


def _delay(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A long way from the sensor to the machine: plug flow, smeared by six volumes."""
    del at
    return _behind(m, [size / 6.0] * 6, shapes("hose W/K", 0.5, 1.0, 2.0))


def _sump(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """The fluid mixes behind the sensor in two volumes of unequal size."""
    del at
    share = shapes("share", 0.05, 0.1, 0.25)
    return _behind(m, [size * (1.0 - share), size * share], 0.0)


def _swarf(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Hot swarf falls on a body in jobs of their own; no channel shows them."""
    seed = int(shapes("seed", 0, 1, 2**31))

    def gate(u: Inputs) -> Array:
        rng = np.random.default_rng([seed, int(abs(u[m.words.air][0]) * 1e6)])
        n, out, at_step = len(u[m.words.air]), np.zeros(len(u[m.words.air])), 0
        while at_step < n:
            at_step += round(rng.exponential(minutes(m, 120.0)) / m.pace.step_s) + 1
            end = at_step + round(rng.uniform(5.0, 40.0) / 60.0 * minutes(m, 60.0) / m.pace.step_s) + 1
            out[at_step:end] = rng.uniform(0.5, 1.5)
            at_step = end
        return out * (u[m.words.pump] > 0)

    return m.plus(laws_at("swarf", Form.HEAT, stretch(m, at[0], shapes), size, gate))


def _all_wet(m: Machine) -> list[Place]:
    return [tuple(m.wet)] if m.wet else []


FLUID = (
    Effect(
        "fluid_convection",
        "W/K",
        "q = size pump film (T_fluid - T); a film that builds up and runs off",
        lambda m: each(m.splashed),
        conductance(1.0),
        _splash,
        ("fluid_convection_speed",),
    ),
    Effect(
        "fluid_convection_flow",
        "1",
        "exchange with the fluid saturates with the flow: size 0 is in proportion",
        lambda m: _wet(m) if m.words.flow else [],
        number(1.0),
        _by_flow,
    ),
    Effect(
        "fluid_convection_speed",
        "W/K",
        "q = size pump (n/top)^m (T_fluid - T), m 0.67",
        _wet_and_rotating,
        conductance(2.0),
        _faster,
        ("rim_detachment",),
    ),
    Effect(
        "rim_detachment",
        "1",
        "G_wet (1 - size + size/(1 + (n/n_c)^2))",
        _wet_and_rotating,
        number(1.0),
        _rim,
        ("fluid_convection_speed",),
    ),
    Effect(
        "evaporation_drying",
        "W",
        "q = -size film (p(T) - 0.45 p(T_env))/p_0 while a film is there",
        lambda m: _wet(m) if m.words.water else [],
        power(1.5),
        _evaporation,
    ),
    Effect(
        "film_drag",
        "W",
        "q = size pump (n/top)^2, and as much into the fluid",
        _wet_and_rotating,
        power(1.0),
        _drag,
    ),
    Effect(
        "flooded_gap",
        "W/K",
        "q = size fill (T_1 - T_2); a gap that fills and leaks",
        lambda m: list(m.gaps),
        conductance(1.5),
        _gap,
    ),
    Effect(
        "fluid_delay",
        "s",
        "the fluid arrives size seconds late, smeared by six volumes",
        _all_wet,
        lambda m, _: minutes(m, 60.0),
        _delay,
        ("fluid_sump",),
    ),
    Effect(
        "fluid_sump",
        "s",
        "the fluid mixes behind its sensor with a time constant of size seconds",
        _all_wet,
        lambda m, _: minutes(m, 240.0),
        _sump,
        ("fluid_delay",),
    ),
    Effect(
        "swarf_heat",
        "W",
        "pulses of heat in jobs of their own while the pump runs",
        lambda m: each(m.chips),
        power(2.0),
        _swarf,
        ("unmeasured_heat",),
        ("unexplained",),
    ),
)
