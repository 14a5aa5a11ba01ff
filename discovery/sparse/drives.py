"""What can drive a model, from the roles of the recorded channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.recordings import Campaign
from discovery.sparse.laws import laws, products
from discovery.sparse.options import FAMILIES
from discovery.terms import names, parse, text

AMBIENT = "ambient temperature"
FLOW = "fluid flow"
TEMPERATURES = (AMBIENT, "fluid temperature", "coolant temperature")


@dataclass(frozen=True)
class Inputs:
    """Channels that may drive a model, by role, and the temperature that is their zero."""

    by_role: dict[str, tuple[str, ...]]
    reference: float  # degC
    gates: tuple[str, ...]  # an expression, 0 to 1, of each flow that goes on and off in these recordings
    bodies: tuple[str, ...] = ()  # inputs of no special role that are temperatures

    @property
    def gate(self) -> str | None:
        """The expression of the first flow."""
        return next(iter(self.gates), None)

    @property
    def names(self) -> tuple[str, ...]:
        """All of them."""
        return tuple(name for names in self.by_role.values() for name in names)

    def of(self, *roles: str) -> tuple[str, ...]:
        """Channels of some roles."""
        return tuple(name for role in roles for name in self.by_role.get(role, ()))


def make_inputs(campaign: Campaign, recordings: Sequence[str], asked: Sequence[str] | None) -> Inputs:
    """Inputs that were asked for, or every one that moves within or between the recordings.

    Raises:
        UserError: an input that the campaign does not have, or that is an output.
    """
    for name in asked or ():
        if name not in campaign.channels:
            raise UserError(
                f"{campaign.path}: the discovery asks for the input '{name}', which is not a channel "
                f"of the campaign ({', '.join(campaign.channels)}); correct the name under inputs"
            )
        if not campaign.channels[name].is_input:
            raise UserError(
                f"{campaign.path}: '{name}' has the role {campaign.channels[name].role} and cannot drive "
                "a model; take it out of inputs"
            )
    values = {}
    for name, channel in campaign.channels.items():
        if not channel.is_input or (asked is not None and name not in asked):
            continue
        found = [_known(campaign, recording, name) for recording in recordings]
        if all(len(piece) for piece in found):
            values[name] = np.concatenate(found)
    moving = {name for name, series in values.items() if np.ptp(series) > 0}
    by_role: dict[str, tuple[str, ...]] = {}
    for name in values:
        role = campaign.channels[name].role
        if name in moving or (asked is not None and role != FLOW):
            by_role[role] = (*by_role.get(role, ()), name)
    air = [series for name, series in values.items() if campaign.channels[name].role == AMBIENT]
    flow = by_role.get(FLOW, ())
    most = [float(np.max(values[name])) for name in flow]
    gates = tuple(n if top <= 1.0 else f"{n}/{top:g}" for n, top in zip(flow, most, strict=True))
    others = by_role.get("other input", ())
    bodies = tuple(name for name in others if campaign.channels[name].unit in ("degC", "K"))
    reference = float(np.round(np.mean(air[0]), 1)) if air else 20.0
    return Inputs(by_role, reference, gates, bodies)


def _known(campaign: Campaign, recording: str, name: str) -> NDArray[np.float64]:
    series = campaign.recordings[recording].values.get(name)
    return np.empty(0) if series is None else series[np.isfinite(series)]


@dataclass(frozen=True)
class Drives:
    """What may drive a hidden mass."""

    inputs: tuple[str, ...]
    expressions: tuple[str, ...]
    linear: tuple[str, ...]  # inputs that run straight between their stamps
    settled: tuple[str, ...]  # expressions whose mass begins in balance with them: temperatures
    integrals: tuple[str, ...] = ()  # expressions that may add up without bound
    passing: tuple[str, ...] = ()  # expressions of no air and no body: a machine need not have stood in them
    gate: str | None = None  # a flow that goes on and off: bodies that it reaches forget faster with it


def make_drives(inputs: Inputs, campaign: Campaign, library: Sequence[str] | None = None) -> Drives:
    """Drives of hidden masses: inputs by the words of a library, and expressions of the user.

    Raises:
        UserError: an expression of a name that is no input.
    """
    words = library or ("linear", "wet")
    expressions = mass_drives(inputs, words)
    for word in words:
        if word in FAMILIES and word not in inputs.names:
            continue
        expression = parse(word, "library of the discovery")
        for name in sorted(names(expression) - {*inputs.names, "time"}):
            raise UserError(
                f"{campaign.path}: the library of the discovery names '{name}' in '{word}', which is neither "
                f"a family ({', '.join(FAMILIES)}) nor made of inputs ({', '.join(inputs.names)}); terms of "
                'states need form = "rates"'
            )
        expressions.append(text(expression))
    air = frozenset((*inputs.of(*TEMPERATURES), *inputs.bodies))
    gate = names(parse(inputs.gate)) if inputs.gate else frozenset()
    settled = [e for e in expressions if names(parse(e)) & air and not names(parse(e)) & gate]
    stood = {*inputs.of(AMBIENT), *inputs.bodies}
    passing = [e for e in expressions if not names(parse(e)) & stood or names(parse(e)) & gate]
    linear = [name for name in inputs.names if campaign.channels[name].between == "linear"]
    charges = [name for name in inputs.of("other input") if name not in inputs.bodies]
    return Drives(
        inputs.names,
        tuple(dict.fromkeys(expressions)),
        tuple(linear),
        tuple(settled),
        tuple(charges),
        tuple(passing),
        inputs.gate if "wet" in words else None,
    )


def mass_drives(inputs: Inputs, words: Sequence[str] = ("linear", "wet")) -> list[str]:
    """Expressions of the inputs: temperatures from the reference, the others unchanged; heat gated by the
    pump.
    """
    warm = [f"{name} - {inputs.reference:g}" for name in (*inputs.of(*TEMPERATURES), *inputs.bodies)]
    others = [
        name
        for role, named in inputs.by_role.items()
        if role not in (*TEMPERATURES, FLOW)
        for name in named
        if name not in inputs.bodies
    ]
    found = [
        text(parse(law))
        for one in (*warm, *others)
        for law in laws(words, one if one in others else f"({one})")
    ]
    found += products(words, others)
    if inputs.gate and "wet" in words:
        found += [f"{inputs.gate}*({name} - {inputs.reference:g})" for name in inputs.of(*TEMPERATURES)]
        found += [f"{inputs.gate}*{name}" for name in inputs.of("heat load")]
        found.append(inputs.gate)
    return list(dict.fromkeys(found))
