"""Candidate terms for the rates of states, in named families, from the roles of the channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discovery.errors import UserError
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.sparse.drives import AMBIENT, FLOW, TEMPERATURES, Inputs
from discovery.sparse.options import FAMILIES, SparseOptions
from discovery.sparse.rates import Candidate
from discovery.terms import Name, names, parse, substitute, text

HEAT = ("heat load", "cooling power")


def candidates(
    states: Sequence[str],
    model: Model,
    campaign: Campaign,
    inputs: Inputs,
    families: Sequence[str],
    options: SparseOptions,
    room: str | None = None,
) -> list[Candidate]:
    """Candidates that enter `states`, by family or by expression; bounds of the options applied.

    In an expression of the user `y` is the state that the term enters.

    Raises:
        UserError: an expression with a name that is neither channel nor state, a bound on an unknown term.
    """
    found: list[Candidate] = []
    known = {*inputs.names, *model.states, "y", "time"}
    for state in states:
        for word in families:
            if word in FAMILIES and word not in inputs.names:  # a channel of that name wins
                found += [_bounded(c, options) for c in _family(word, state, states, model, inputs, room)]
                continue
            expression = parse(word, "library of the discovery")
            for name in sorted(names(expression) - known):
                raise UserError(
                    f"{campaign.path}: the library of the discovery names '{name}' in '{word}', which is "
                    f"neither a family ({', '.join(FAMILIES)}) nor made of inputs and states "
                    f"({', '.join(sorted(known))})"
                )
            found.append(
                _bounded(Candidate(state, substitute(expression, {"y": Name(state)})), options, word)
            )
    unused = set(options.bounds) - {w for c in found for w in (c.label,)} - set(families)
    if unused:
        raise UserError(
            f"{campaign.path}: the discovery bounds '{sorted(unused)[0]}', which is not a term of its "
            f"library; write it as the library does: {', '.join(sorted({c.label for c in found}))}"
        )
    return [c for c in _unique(found) if c.label not in options.forbid]


def _bounded(candidate: Candidate, options: SparseOptions, word: str | None = None) -> Candidate:
    bound = options.bounds.get(candidate.label, options.bounds.get(word or ""))
    if bound is None:
        return candidate
    return replace(candidate, low=bound[0], high=bound[1], start=float(np.clip(candidate.start, *bound)))


def _unique(found: Sequence[Candidate]) -> list[Candidate]:
    return list({(c.into, text(c.expression)): c for c in found}.values())


FREE, UP = (-np.inf, np.inf), (0.0, np.inf)
_FOURTH = "(({} + 273.15)/300)**4"
_NO_RATE = (*TEMPERATURES, FLOW, "nozzle height", "nozzle side")


def _family(
    family: str, state: str, states: Sequence[str], model: Model, inputs: Inputs, room: str | None
) -> list[Candidate]:
    """Terms of a family for one state, with the sign that physics gives them.

    Heat that two bodies of known capacity exchange leaves one and enters the other, so that pair is offered
    once.
    """
    air = inputs.of(AMBIENT)
    room = room or (air[0] if air else f"{inputs.reference:g}")
    heat = inputs.of(*HEAT)
    speeds = inputs.of("rotation speed")
    sides = inputs.of("nozzle side")
    conserved = model.states[state].capacity is not None
    partners = [name for name in (states[: states.index(state)] if conserved else states) if name != state]

    def plain(*expressions: str) -> list[Candidate]:
        return [Candidate(state, parse(e), *FREE) for e in expressions]

    def towards(*pairs: tuple[str, str]) -> list[Candidate]:
        return [
            Candidate(state, parse(e), *UP, source=partner if conserved and partner in states else None)
            for partner, e in pairs
        ]

    match family:
        case "linear":
            own = [name for role in inputs.by_role if role not in _NO_RATE for name in inputs.by_role[role]]
            warm = [(name, f"{name} - {state}") for name in inputs.of(*TEMPERATURES)]
            return plain("1", *own) + towards(*warm)
        case "wet" if inputs.gate:
            fluid = inputs.of("fluid temperature")
            wet = [(name, f"{gate}*({name} - {state})") for name in fluid for gate in inputs.gates]
            wet += [
                (name, f"{inputs.gate}*(abs({n}) > 1)*({name} - {state})") for name in fluid for n in speeds
            ]
            # a jet that points aside wets more of one body and less of another
            aside = [f"{inputs.gate}*{side}*({name} - {state})" for name in fluid for side in sides]
            return towards(*wet) + plain(*aside, *(f"{inputs.gate}*{name}" for name in heat))
        case "rotation":
            powers = [f"({name}/1000)**{power:g}" for name in speeds for power in (1.5, 2, 3)]
            return plain(*powers) + towards(*((room, f"({name}/1000)*({room} - {state})") for name in speeds))
        case "coupling":
            gated = [(name, f"{inputs.gate}*({name} - {state})") for name in partners if inputs.gate]
            return towards(*((name, f"{name} - {state}") for name in partners), *gated)
        case "radiation":
            here = _FOURTH.format(state)
            return towards(*((name, f"{_FOURTH.format(name)} - {here}") for name in [room, *partners]))
        case "natural":
            return towards(
                *((name, f"({name} - {state})*abs({name} - {state})**0.25") for name in [room, *partners])
            )
        case "load":
            drawn = [*heat, *(name for name in inputs.of("other input") if name not in inputs.bodies)]
            return plain(
                *(f"{name}*({state} - {room})/100" for name in drawn), *(f"({name}/100)**2" for name in drawn)
            )
        case "second mass":
            behind = (f"{state}_mass", f"{room}_mass")
            return towards(*((name, f"{name} - {state}") for name in model.states if name.startswith(behind)))
    return []
