"""The exported model: one JSON document that is the master of every target, and the `Model` it stands for."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery import __version__
from discovery.errors import UserError
from discovery.export.compiled import Compiled, compile_model, model_inputs
from discovery.export.knowledge import knowledge
from discovery.export.ranges import InputRange, OutputRange, input_range, output_ranges
from discovery.export.seal import Seal, open_seal, seal_bytes
from discovery.export.stepper import INTEGRATOR
from discovery.files import write_atomic
from discovery.models import Model, Parameter, State, expanded
from discovery.recordings import Campaign
from discovery.terms import Expression, Name, Number, Term, names, parse, substitute, text

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

FORMAT, VERSION = "discovery-model", 1
MAX_BYTES = 20_000_000
START_SD = 2.0  # um or K: of a start value that was a reading and is a guess now


@dataclass(frozen=True)
class Input:
    """An input of an exported model."""

    name: str
    role: str
    unit: str
    between: str
    range: InputRange


@dataclass(frozen=True)
class Output:
    """An output of an exported model; those of role `error` are compensated."""

    name: str
    role: str
    unit: str
    range: OutputRange


@dataclass(frozen=True)
class Exported:
    """A model as it was exported, read back."""

    model: Model
    compiled: Compiled
    inputs: tuple[Input, ...]
    outputs: tuple[Output, ...]
    revision: int
    provenance: Mapping[str, Any]
    changelog: tuple[Mapping[str, Any], ...]
    document: Mapping[str, Any]
    seal: Seal


def exportable(model: Model, campaign: Campaign) -> Model:
    """The model as targets see it: lags as states, every measured state an output of its own, and start
    values that need no reading, since a controller has none: errors count from 0, bodies begin at the
    temperature of the room.

    Raises:
        UserError: a model without outputs, or a measured body and no room temperature.
    """
    model = expanded(model)
    own = {
        name: Name(name) for name in model.states if name in campaign.channels and name not in model.outputs
    }
    outputs = {**model.outputs, **own}
    if not outputs:
        raise UserError(f"model '{model.name}' has no outputs; give it some under [outputs]")
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
                f"controller does "
                "not have, and no channel is an ambient temperature; give it a start value"
            )
        if start is not None and read:
            spread = max(state.start_sd, START_SD)
            state = replace(state, start=substitute(start, unread), start_sd=spread)
        states[name] = state
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
    if not 0.001 <= step_s <= 3600.0:
        raise UserError(
            f"a step of {step_s:g} s is not possible; give one between 0.001 and 3600, usually 1 to 10"
        )
    model = exportable(model, campaign)
    known = set(campaign.channels) | set(model.states) | set(model.parameters) | {"time"}
    for expression in model.expressions():
        for name in sorted(names(expression) - known):
            raise UserError(
                f"model '{model.name}': '{name}' is no channel of campaign {campaign.path}; it cannot be "
                f"exported"
            )
    compiled = compile_model(model, step_s)
    limits = output_ranges(compiled, campaign, recordings)
    known_by = knowledge(model, campaign, recordings)
    inputs = []
    for name in compiled.inputs:
        channel = campaign.channels[name]
        inputs.append(
            {"name": name, "role": channel.role, "unit": channel.unit, "between": channel.between}
            | asdict(input_range(campaign, recordings, name))
        )
    outputs = []
    for name, expression in model.outputs.items():
        found = campaign.channels.get(name)
        outputs.append(
            {
                "name": name,
                "role": found.role if found else "temperature" if name in model.states else "error",
                "unit": found.unit if found else "um",
                "expression": text(expression),
            }
            | asdict(limits[name])
        )
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": model.name,
        "revision": revision,
        "step_s": float(step_s),
        "integrator": list(INTEGRATOR),
        "inputs": inputs,
        "parameters": [_parameter(name, p) for name, p in model.parameters.items()],
        "states": [
            {
                "name": name,
                "unit": s.unit,
                "scale": s.scale,
                "start": text(s.start) if s.start is not None else None,
                "start_sd": s.start_sd,
            }
            for name, s in model.states.items()
        ],
        "terms": [
            {
                "name": t.name,
                "into": t.into,
                "from": t.source,
                "expression": text(t.expression),
                "effect": t.effect,
            }
            for t in model.terms
        ],
        "outputs": outputs,
        "knowledge": {
            "residual": dict(known_by.residual),
            "slow_share": known_by.slow_share,
            "parameters": list(known_by.parameters),
            "covariance": known_by.covariance.tolist(),
            "first": np.sqrt(np.diag(known_by.covariance)).tolist(),
        },
        "provenance": {
            "tool": f"discovery {__version__}",
            "campaign": campaign.name,
            "recordings": list(recordings),
            **(provenance or {}),
        },
        "changelog": [dict(entry) for entry in changelog],
    }


def _parameter(name: str, p: Parameter) -> dict[str, Any]:
    def finite(value: float | None) -> float | None:
        return value if value is not None and math.isfinite(value) else None

    entry = {"name": name, "value": p.value, "unit": p.unit, "fixed": p.fixed}
    return entry | {"min": finite(p.min), "max": finite(p.max), "low": finite(p.low), "high": finite(p.high)}


def render(document: Mapping[str, Any], key: Ed25519PrivateKey | None = None) -> bytes:
    """The bytes of a sealed document; signed when a key is given."""
    return seal_bytes(json.dumps(document, indent=1, ensure_ascii=True, allow_nan=False).encode(), key)


def write_document(path: Path, document: Mapping[str, Any], key: Ed25519PrivateKey | None = None) -> None:
    """Write a sealed document; signed when a key is given."""
    write_atomic(path, render(document, key))


def read_document(path: Path) -> Exported:
    """An exported model; every number and formula in it is checked before it is used.

    Raises:
        UserError: not sealed, changed, of another version, not of the schema, or with a formula outside the
        grammar.
    """
    if not path.is_file():
        raise UserError(f"{path}: there is no such file; name the .json that `discovery export` wrote")
    if path.stat().st_size > MAX_BYTES:
        raise UserError(f"{path}: larger than {MAX_BYTES} bytes; this is no exported model")
    document, seal = open_seal(path.read_bytes(), path)
    return from_document(document, seal, path)


def from_document(document: Mapping[str, Any], seal: Seal, place: str | Path) -> Exported:
    """The model of a document (see `read_document`)."""
    if document.get("format") != FORMAT:
        raise UserError(
            f"{place}: format {document.get('format')!r} is not '{FORMAT}'; this is no exported model"
        )
    if document.get("version") != VERSION:
        raise UserError(
            f"{place}: version {document.get('version')!r} is not {VERSION}, the one this program reads; "
            f"update it"
        )
    _check_schema(document, place)
    parameters = {
        p["name"]: Parameter(
            p["value"],
            p["unit"],
            -math.inf if p["min"] is None else p["min"],
            math.inf if p["max"] is None else p["max"],
            p["fixed"],
            low=p["low"],
            high=p["high"],
        )
        for p in document["parameters"]
    }
    states = {
        s["name"]: State(
            s["name"],
            s["unit"],
            None,
            None if s["start"] is None else parse(s["start"], f"{place}, start of {s['name']}"),
            s["start_sd"],
            s["scale"],
        )
        for s in document["states"]
    }
    terms = tuple(
        Term(
            t["name"],
            t["into"],
            parse(t["expression"], f"{place}, term '{t['name']}'"),
            t["from"],
            t["effect"],
        )
        for t in document["terms"]
    )
    outputs = {o["name"]: parse(o["expression"], f"{place}, output {o['name']}") for o in document["outputs"]}
    model = Model(document["name"], parameters, states, terms, outputs)
    for term in terms:
        if term.into not in states or (term.source is not None and term.source not in states):
            raise UserError(
                f"{place}: term '{term.name}' enters or leaves a state that is not listed; export the "
                f"model again"
            )
    if model_inputs(model) != tuple(i["name"] for i in document["inputs"]):
        raise UserError(f"{place}: the inputs listed are not those of its formulas; export the model again")
    ranges = InputRange.__dataclass_fields__
    return Exported(
        model,
        compile_model(model, document["step_s"]),
        tuple(
            Input(i["name"], i["role"], i["unit"], i["between"], InputRange(**{k: i[k] for k in ranges}))
            for i in document["inputs"]
        ),
        tuple(
            Output(o["name"], o["role"], o["unit"], OutputRange(o["limit"], o["rate"]))
            for o in document["outputs"]
        ),
        document["revision"],
        document["provenance"],
        tuple(document["changelog"]),
        document,
        seal,
    )


@cache
def _schema() -> Any:
    return json.loads((Path(__file__).parent / "document.schema.json").read_text())


def _check_schema(document: Mapping[str, Any], place: str | Path) -> None:
    try:
        from jsonschema import Draft202012Validator
        from jsonschema.exceptions import best_match
    except ImportError:
        raise UserError(
            "exported models need the extra 'export'; install discovery-workbench[export]"
        ) from None
    mistake = best_match(Draft202012Validator(_schema()).iter_errors(document))
    if mistake is not None:
        key = ".".join(str(part) for part in mistake.absolute_path)
        raise UserError(f"{place}: key '{key}': {mistake.message[:200]}; export the model again")
