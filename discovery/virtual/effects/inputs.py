"""Recorded inputs that the baseline does not use: heat, a factor on an exchange, a path of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from discovery.virtual.effects.effect import Effect, Place, Shapes, laws_at, minutes, stretch
from discovery.virtual.machine import Machine, Spare
from discovery.virtual.network import Array, Form, Inputs, heat, link


def spare_at(m: Machine, at: Place, kind: str) -> Spare:
    """The spare input that can act at a place in this way."""
    return next(s for s in m.spare if s.kind == kind and at == (s.output or s.body,))


def _places(kind: str) -> Callable[[Machine], list[Place]]:
    return lambda m: [(s.output or s.body,) for s in m.spare if s.kind == kind]


def _reach(kind: str) -> Callable[[Machine, Place], float]:
    return lambda m, at: 3.0 * spare_at(m, at, kind).size


def _heat(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """Heat of `size` watts at full input, through a small mass of its own."""
    s, tau = (
        spare_at(m, at, "input_heat"),
        shapes("lag s", minutes(m, 2.0), minutes(m, 5.0), minutes(m, 10.0)),
    )
    source, nodes = f"behind {s.channel}", stretch(m, at[0], shapes)
    G = max(abs(size), 1e-6)
    laws = [link("input heat", node, source, G * share) for node, share in nodes]
    return m.plus([*laws, heat("input heat", source, size / s.full, s.channel)], {source: G * tau})


def _exchange(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """`size` W/K more at full input, by a power of it."""
    s, p = spare_at(m, at, "input_exchange"), shapes("m", 0.5, 0.7, 0.9)

    def gate(u: Inputs) -> Array:
        return np.asarray(np.maximum(u[s.channel] / s.full, 0.0) ** p)

    return m.plus(
        laws_at("input exchange", Form.LINK, stretch(m, at[0], shapes), size, gate, s.source, leaves=s.source)
    )


def _path(m: Machine, at: Place, size: float, shapes: Shapes) -> Machine:
    """A small part that the input warms moves an output by `size` at full input, with a lag."""
    s = spare_at(m, at, "input_path")
    tau = shapes("lag s", minutes(m, 15.0), minutes(m, 40.0), minutes(m, 120.0))
    part = f"part behind {s.channel}"
    laws = [heat("input path", part, 1.0 / s.full, s.channel), link("input path", part, m.words.air, 1.0)]
    # the part counts in kelvin above the room: its air is subtracted by a second part that is not heated
    still = f"unheated {part}"
    laws.append(link("input path", still, m.words.air, 1.0))
    levers = {o: dict(nodes) for o, nodes in m.levers.items()}
    levers[at[0]] |= {part: size, still: -size}
    return replace(m.plus(laws, {part: tau, still: tau}), levers=levers)


INPUTS = (
    Effect("input_heat", "W", "size watts at full input", _places("input_heat"), _reach("input_heat"), _heat),
    Effect(
        "input_exchange",
        "W/K",
        "size W/K more at full input",
        _places("input_exchange"),
        _reach("input_exchange"),
        _exchange,
    ),
    Effect(
        "input_path",
        "um",
        "size at full input, with a lag",
        _places("input_path"),
        _reach("input_path"),
        _path,
    ),
)
