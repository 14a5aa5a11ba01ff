"""A thermal network: what stores heat, what lets it flow, what switches it.

    C_i dx_i/dt = sum over the laws of q(x, u)

A *node* is anything that has a rate: a temperature with a capacity in J/K (its laws are heat flows in W), the
mass of a film on a square metre with capacity 1 (laws in kg/m2/s), a molten share. A *law* is one flow into
one node; it may leave another. A name that is no node is a series of the inputs: the room, a fluid that is
not simulated. A *switch* is on or off by a temperature and its dead band: a chiller, a thermostat.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Inputs = Mapping[str, Array]
"""Series by name, each (n,), held over the steps."""
Gate = str | Callable[[Inputs], Array]
"""Factor of a law: the name of an input, or a function of the inputs that gives (n,) or a number."""

STEFAN_BOLTZMANN = 5.670374e-8
KELVIN = 273.15

ZERO = "0"
"""The name of a boundary that is always zero."""

LEVEL = 1.0
"""Capacity of a node that is no temperature (film mass, fill of a gap, molten share). It starts at zero."""


class Form(IntEnum):
    """How a flow depends on T (the node it enters) and S (its source); g is size times gate."""

    HEAT = 0  # g
    LINK = 1  # g (S - T)
    POWER = 2  # g |S - T|^a (S - T)
    RADIATION = 3  # g sigma (S^4 - T^4), both in kelvin
    VISCOUS = 4  # g exp(a/(S + b) - a/(c + b)): Vogel's viscosity to some power, 1 at c
    STRIBECK = 5  # g w, torque w(x) = d exp(-x) + e x^(2/3), x = g/1000 exp(a/(S + b) - a/(c + b)), g in rpm
    PRELOAD = 6  # g max(0, 1 + a (T - S))^b
    EVAPORATION = 7  # -g max(0, p(T) - a p(S)) with the saturated vapour pressure p, 1 at 22 degC
    CONTACT = 8  # g (1 + a tanh(((T + S)/2 - b)/c)) (S - T)
    MELTING = 9  # g (1 + tanh((S - a)/b))/2


@dataclass(frozen=True)
class Law:
    """One flow into one node.

    `leaves`: the node that loses `take` times the flow. `film`: a node of film mass and the mass [kg/m2] at
    which a surface is half wet; the flow is multiplied by m/(m + half). `switch`: the flow runs while it is
    on.
    """

    name: str
    form: Form
    into: str
    source: str = ZERO
    size: float = 1.0
    gate: Gate | None = None
    shape: tuple[float, ...] = ()
    leaves: str = ""
    take: float = 1.0
    film: tuple[str, float] | None = None
    switch: str = ""


@dataclass(frozen=True)
class Switch:
    """On above `target` + `band` and off below `target` - `band` [K]; the reverse where it heats."""

    sensor: str
    target: str | float
    band: float
    heats: bool = False


@dataclass(frozen=True)
class Network:
    """Nodes with their capacities, laws, switches."""

    nodes: Mapping[str, float]
    laws: tuple[Law, ...]
    switches: Mapping[str, Switch] = field(default_factory=dict)

    def plus(
        self,
        laws: Sequence[Law] = (),
        nodes: Mapping[str, float] | None = None,
        switches: Mapping[str, Switch] | None = None,
    ) -> Network:
        """This network with more in it."""
        return Network(
            {**self.nodes, **(nodes or {})}, (*self.laws, *laws), {**self.switches, **(switches or {})}
        )

    def changed(self, change: Callable[[Law], Law | None]) -> Network:
        """This network with every law changed, or left out where `change` gives None."""
        return replace(self, laws=tuple(new for law in self.laws if (new := change(law)) is not None))


def heat(name: str, into: str, size: float, gate: Gate | None = None) -> Law:
    """A heat flow `size` times `gate` [W] into a node."""
    return Law(name, Form.HEAT, into, size=size, gate=gate)


def link(name: str, into: str, source: str, size: float, gate: Gate | None = None) -> Law:
    """Conduction `size` [W/K] between two nodes, or between a node and a series of the inputs."""
    return Law(name, Form.LINK, into, source, size, gate, leaves=source)


def stream(name: str, into: str, source: str, size: float, gate: Gate | None = None) -> Law:
    """A flow of matter that carries heat from `source` into `into`, `size` = mass flow x specific heat [W/K].

    It does not cool its source: what flows out of a volume is as warm as the volume.
    """
    return Law(name, Form.LINK, into, source, size, gate)


def natural(name: str, into: str, source: str, size: float, exponent: float) -> Law:
    """Natural convection, `size` [W/K at 1 K] |dT|^exponent dT: 1/4 laminar, 1/3 turbulent."""
    return Law(name, Form.POWER, into, source, size, shape=(exponent,), leaves=source)


def linear(law: Law) -> Law:
    """A law of convection or radiation as a conductance: its slope at a difference of 5 K, or at 22 degC."""
    size = 5.0 ** law.shape[0] if law.form == Form.POWER else 4.0 * STEFAN_BOLTZMANN * (22.0 + KELVIN) ** 3
    return replace(law, form=Form.LINK, size=size * law.size, shape=())


def gate_values(gate: Gate | None, inputs: Inputs, n: int) -> Array:
    """The factor of a law over the recording, (n,)."""
    if gate is None:
        return np.ones(n)
    value = inputs[gate] if isinstance(gate, str) else gate(inputs)
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, dtype=np.float64), (n,)))


def times(gate: Gate | None, factor: Gate) -> Gate:
    """Product of two gates."""

    def product(u: Inputs) -> Array:
        n = len(next(iter(u.values())))
        return np.asarray(gate_values(gate, u, n) * gate_values(factor, u, n))

    return product
