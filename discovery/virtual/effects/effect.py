"""The form of an effect that can be concealed, and what most of them need."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from discovery.virtual.machine import Machine
from discovery.virtual.materials import Share
from discovery.virtual.network import Array, Form, Gate, Inputs, Law, times
from discovery.virtual.signals import Draw

Place = tuple[str, ...]
"""Where an effect acts: bodies, or one output."""


@dataclass
class Shapes:
    """Numbers that shape an effect: textbook values, or drawn about them. Each is drawn once."""

    rng: Draw | None = None
    values: dict[str, float] = field(default_factory=dict)

    def __call__(self, name: str, low: float, usual: float, high: float) -> float:
        """The number of that name."""
        if name not in self.values:
            self.values[name] = usual if self.rng is None else float(self.rng.uniform(low, high))
        return self.values[name]


class Effect(NamedTuple):
    """An effect: size in `unit`, law in one line, where it can act on a machine, what it does there."""

    word: str
    unit: str
    law: str
    places: Callable[[Machine], list[Place]]
    reach: Callable[[Machine, Place], float]  # largest size that is physical
    conceal: Callable[[Machine, Place, float, Shapes], Machine]
    also: tuple[str, ...] = ()  # names that are right, too
    accepts: tuple[str, ...] = ()  # verdicts that are right, too


def each(bodies: tuple[str, ...] | dict[str, float]) -> list[Place]:
    """One place a body."""
    return [(body,) for body in bodies]


def exchange(machine: Machine, body: str) -> float:
    """Sum of the conductances [W/K] that the baseline has at a body."""
    joints = sum(G for pair, G in machine.joints.items() if body in pair)
    return joints + machine.air.get(body, 0.0) + machine.wet.get(body, 0.0)


def conductance(share: float) -> Callable[[Machine, Place], float]:
    """Reach of an effect in W/K: a share of what the body exchanges anyway."""
    return lambda machine, place: share * exchange(machine, place[0])


def around(share: float) -> Callable[[Machine, Place], float]:
    """Reach of an effect of the air in W/K: a share of what the air takes from the body anyway."""
    return lambda machine, place: share * machine.air.get(place[0], 0.1 * exchange(machine, place[0]))


def power(share: float) -> Callable[[Machine, Place], float]:
    """Reach of an effect in W: a share of the heat that such a machine makes."""
    return lambda machine, _: share * machine.heat


def number(most: float) -> Callable[[Machine, Place], float]:
    """Reach of an effect whose size needs no machine."""
    return lambda *_: most


def stretch(machine: Machine, body: str, shapes: Shapes) -> list[Share]:
    """The stretch of a body where an effect acts: half of it or more, not just where losses enter."""
    low = shapes("stretch from", 0.0, 0.0, 0.4)
    return machine.bodies[body].span(low, low + shapes("stretch length", 0.5, 0.6, 0.6))


def laws_at(
    name: str,
    form: Form,
    nodes: list[Share],
    size: float,
    gate: Gate | None = None,
    source: str = "",
    shape: tuple[float, ...] = (),
    leaves: str = "",
    film: tuple[str, float] | None = None,
    take: float = 1.0,
) -> list[Law]:
    """A law spread over nodes by their shares; its source is the node itself where none is given."""
    return [
        Law(
            name,
            form,
            node,
            source or node,
            size * share,
            gate,
            shape,
            leaves,
            take,
            film,
        )
        for node, share in nodes
    ]


def speed_power(machine: Machine, exponent: float) -> Callable[[Inputs], Array]:
    """(n/top speed)^exponent."""
    w = machine.words
    return lambda u: np.asarray(np.abs(u[w.speed] / w.top_speed) ** exponent)


def minutes(machine: Machine, at_72_h: float) -> float:
    """A time constant [s] in proportion to the length of a recording, given in minutes for 72 h."""
    return at_72_h * 60.0 * machine.pace.hours / 72.0


def aged(machine: Machine, names: Collection[str], size: float, shapes: Shapes) -> Machine:
    """Exchanges that are less by a share `size` after the first recording, and less of what is left after
    each further one, faster or slower than before.
    """
    power = shapes("power", 0.6, 1.0, 1.4)

    def lost(u: Inputs) -> Array:
        return np.asarray((1.0 - size) ** u["age"] ** power)

    def change(law: Law) -> Law:
        return replace(law, gate=times(law.gate, lost)) if law.name in names else law

    return replace(machine, network=machine.network.changed(change))
