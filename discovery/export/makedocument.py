"""A fitted model as targets see it, and the document that says so."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from typing import Any

from discovery import __version__
from discovery.errors import UserError
from discovery.export.compiled import compile_model, model_inputs
from discovery.export.document import FORMAT, VERSION
from discovery.export.guessed import START_SD
from discovery.export.knowledge import knowledge
from discovery.export.ranges import OutputRange, input_range, output_ranges
from discovery.export.stepper import INTEGRATOR
from discovery.models import Model, Parameter, State, expanded
from discovery.models.model import with_settled_memories
from discovery.recordings import Campaign
from discovery.terms import Expression, Name, Number, Term, names, substitute, text


def exportable(model: Model, campaign: Campaign) -> Model:
    """The model as targets see it: lags as states, every measured state an output of its own, and start
    values that need no reading, since a controller has none: errors count from 0, bodies begin at the
    temperature of the room.

    Outputs that are no channel are left out: nothing says what they are, and nobody may compensate them.

    Raises:
        UserError: no output is a channel, or a measured body and no room temperature.
    """
    model = with_settled_memories(expanded(model, campaign.channels))
    own = {
        name: Name(name) for name in model.states if name in campaign.channels and name not in model.outputs
    }
    outputs = {name: e for name, e in model.outputs.items() if name in campaign.channels} | own
    if not outputs:
        raise UserError(
            f"model '{model.name}': no output is a channel of campaign {campaign.path}; name the errors "
            "under [outputs] as their channels"
        )
    unread: dict[str, Expression] = {
        name: Number(0.0) for name, channel in campaign.channels.items() if channel.role == "error"
    }
    room = [name for name, channel in campaign.channels.items() if channel.role == "ambient temperature"]
    bodies = [name for name, channel in campaign.channels.items() if channel.role == "temperature"]
    unread |= {name: Name(room[0]) for name in bodies if room}
    states = {}
    for name, state in model.states.items():
        start = Name(name) if state.start is None and name in campaign.channels else state.start
        read = sorted(names(start) & {*unread, *bodies}) if start is not None else []
        if set(read) & set(bodies) and not room:
            raise UserError(
                f"model '{model.name}': state '{name}' starts at the reading of {read[0]}, which a "
                "controller does not have, and no channel is an ambient temperature; give it a start value"
            )
        spread = START_SD if state.start_sd is None else state.start_sd
        if start is not None and read:
            state, spread = replace(state, start=substitute(start, unread)), max(spread, START_SD)
        states[name] = replace(state, start_sd=spread)
    return replace(model, outputs=outputs, states=states)


def make_document(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    step_s: float = 10.0,
    provenance: Mapping[str, Any] | None = None,
    revision: int = 1,
    changelog: Sequence[Mapping[str, Any]] = (),
) -> dict[str, Any]:
    """The document of a fitted model.

    Args:
        recordings: those of the fit; trained ranges and limits come from them alone.
        step_s: fixed internal step [s].
        provenance: what else should be known about where it comes from.

    Raises:
        UserError: a model that cannot be exported (with the reason), or inputs that the recordings do not
        hold.
    """
    model = exportable(model, campaign)
    known = set(campaign.channels) | set(model.states) | set(model.parameters) | {"time"}
    for expression in model.expressions():
        for name in sorted(names(expression) - known):
            raise UserError(
                f"model '{model.name}': '{name}' is not a channel of campaign "
                f"{campaign.path}; it cannot be exported"
            )
    compiled = compile_model(model, step_s)
    limits = output_ranges(compiled, campaign, recordings)
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": model.name,
        "revision": revision,
        "step_s": float(step_s),
        "integrator": list(INTEGRATOR),
        **described(model, campaign, recordings),
        "outputs": [_output(campaign, name, e, limits[name]) for name, e in model.outputs.items()],
        "knowledge": knowledge(model, campaign, recordings).document(),
        "provenance": {
            "tool": f"discovery {__version__}",
            "campaign": campaign.name,
            "recordings": list(recordings),
            **(provenance or {}),
        },
        "changelog": [dict(entry) for entry in changelog],
    }


def described(model: Model, campaign: Campaign, recordings: Sequence[str]) -> dict[str, Any]:
    """Inputs, with the ranges of some recordings, parameters, states and terms of a model, as a document has
    them.
    """
    return {
        "inputs": [_input(campaign, recordings, name) for name in model_inputs(model)],
        "parameters": [_parameter(name, p) for name, p in model.parameters.items()],
        "states": [_state(state) for state in model.states.values()],
        "terms": [_term(term) for term in model.terms],
    }


def _input(campaign: Campaign, recordings: Sequence[str], name: str) -> dict[str, Any]:
    channel = campaign.channels[name]
    entry = {"name": name, "role": channel.role, "unit": channel.unit, "between": channel.between}
    return entry | asdict(input_range(campaign, recordings, name))


def _output(campaign: Campaign, name: str, expression: Expression, limits: OutputRange) -> dict[str, Any]:
    channel = campaign.channels[name]
    entry = {"name": name, "role": channel.role, "unit": channel.unit, "expression": text(expression)}
    return entry | asdict(limits)


def _state(state: State) -> dict[str, Any]:
    entry = {
        "name": state.name,
        "unit": state.unit,
        "scale": state.scale,
        "start": text(state.start) if state.start is not None else None,
        "start_sd": state.start_sd or 0.0,  # a memory starts with what it is fed with
    }
    body = {"capacity": state.capacity} if state.capacity else {}
    follows = {"start_with": dict(state.start_with)} if state.start_with else {}
    return entry | body | follows | ({"memory": True} if state.memory else {})


def _term(term: Term) -> dict[str, Any]:
    return {
        "name": term.name,
        "into": term.into,
        "from": term.source,
        "expression": text(term.expression),
        "effect": term.effect,
    }


def _parameter(name: str, p: Parameter) -> dict[str, Any]:
    def finite(value: float | None) -> float | None:
        return value if value is not None and math.isfinite(value) else None

    entry = {"name": name, "value": p.value, "unit": p.unit, "fixed": p.fixed}
    return entry | {"min": finite(p.min), "max": finite(p.max), "low": finite(p.low), "high": finite(p.high)}
