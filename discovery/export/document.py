"""The exported model: one JSON document that is the master of every target, and the `Model` in it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from discovery.errors import UserError
from discovery.export.compiled import Compiled, compile_model, model_inputs
from discovery.export.ranges import InputRange, OutputRange
from discovery.export.seal import Seal, keeping_signature, open_seal, seal_bytes
from discovery.export.trend import Trend, read_trend
from discovery.extras import need
from discovery.files import write_atomic
from discovery.models import Model, Parameter, State
from discovery.terms import Expression, Term, parse

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

FORMAT, VERSION = "discovery-model", 1
MAX_BYTES = 20_000_000


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
    trend: Trend | None = None


def render(document: Mapping[str, Any], key: Ed25519PrivateKey | None = None) -> bytes:
    """The bytes of a sealed document; signed when a key is given."""
    return seal_bytes(json.dumps(document, indent=1, ensure_ascii=True, allow_nan=False).encode(), key)


def write_document(path: Path, document: Mapping[str, Any], key: Ed25519PrivateKey | None = None) -> None:
    """Write a sealed document; signed when a key is given.

    Raises:
        UserError: no key is given, and another document stands there that is signed.
    """
    write_atomic(path, keeping_signature(path, render(document, key)))


def read_document(path: Path) -> Exported:
    """An exported model; every number and formula in it is checked before it is used.

    Raises:
        UserError: not sealed, changed, of another version, not of the schema, or with a formula outside the
        grammar.
    """
    if not path.is_file():
        raise UserError(f"{path}: there is no such file; name the .json that `discovery export` wrote")
    if path.stat().st_size > MAX_BYTES:
        raise UserError(f"{path}: larger than {MAX_BYTES} bytes; this is not an exported model")
    document, seal = open_seal(path.read_bytes(), path)
    return from_document(document, seal, path)


def from_document(document: Mapping[str, Any], seal: Seal, place: str | Path) -> Exported:
    """The model of a document (see `read_document`)."""
    if document.get("format") != FORMAT:
        raise UserError(
            f"{place}: format {document.get('format')!r} is not '{FORMAT}'; this is not an exported model"
        )
    if document.get("version") != VERSION:
        raise UserError(
            f"{place}: version {document.get('version')!r} is not {VERSION}, the one "
            "this program reads; update it"
        )
    _check_schema(document, place)
    model = _model(document, place)
    for term in model.terms:
        if term.into not in model.states or (term.source is not None and term.source not in model.states):
            raise UserError(
                f"{place}: term '{term.name}' enters or leaves a state that is not "
                "listed; export the model again"
            )
    above: set[str] = set()
    for state in model.states.values():
        if not state.start_with.keys() <= above:
            raise UserError(
                f"{place}: the start of state '{state.name}' follows one that is not listed above it; "
                "export the model again"
            )
        above.add(state.name)
    if model_inputs(model) != tuple(i["name"] for i in document["inputs"]):
        raise UserError(f"{place}: the inputs listed are not those of its formulas; export the model again")
    trend = read_trend(document)
    if trend is not None and not trend.per_day.keys() <= model.parameters.keys():
        raise UserError(f"{place}: its trend moves a parameter that is not listed; export the model again")
    ranges = InputRange.__dataclass_fields__
    return Exported(
        model,
        compile_model(model, document["step_s"]),
        tuple(
            Input(
                i["name"],
                i["role"],
                i["unit"],
                i["between"],
                InputRange(**{k: i[k] for k in ranges if k in i}),
            )
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
        trend,
    )


def _model(document: Mapping[str, Any], place: str | Path) -> Model:
    """The model that the entries of a document spell. Raises UserError: a formula outside the grammar."""

    def parsed(formula: str, what: str) -> Expression:
        return parse(formula, f"{place}, {what}")

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
            s.get("capacity"),
            None if s["start"] is None else parsed(s["start"], f"start of {s['name']}"),
            s["start_sd"],
            s["scale"],
            s.get("memory", False),
            s.get("start_with", {}),
        )
        for s in document["states"]
    }
    terms = tuple(
        Term(t["name"], t["into"], parsed(t["expression"], f"term '{t['name']}'"), t["from"], t["effect"])
        for t in document["terms"]
    )
    outputs = {o["name"]: parsed(o["expression"], f"output {o['name']}") for o in document["outputs"]}
    return Model(document["name"], parameters, states, terms, outputs)


@cache
def _schema() -> Any:
    return json.loads((Path(__file__).parent / "document.schema.json").read_text())


@cache
def _validator() -> Any:
    """A validator of the schema. It looks at lists of numbers at once: one by one, the thousands that a model
    knows of its parameters take half a second.
    """
    from jsonschema import Draft202012Validator, validators

    one_by_one = Draft202012Validator.VALIDATORS["items"]

    def items(validator: Any, items: Any, instance: Any, schema: Any) -> Iterator[Any]:
        if not _are_numbers(items, instance):
            yield from one_by_one(validator, items, instance, schema)

    return validators.extend(Draft202012Validator, {"items": items})(_schema())


def _are_numbers(items: Any, instance: Any) -> bool:
    """Whether a list holds numbers alone, all within the bounds that its schema gives them."""
    if not (isinstance(items, dict) and isinstance(instance, list) and instance):
        return False
    if items.keys() != {"type", "minimum", "maximum"} or items["type"] != "number":
        return False
    # of a bool, the type is not float; a nan is not within any bounds
    if not set(map(type, instance)) <= {int, float}:
        return False
    return all(items["minimum"] <= one <= items["maximum"] for one in instance)


def _check_schema(document: Mapping[str, Any], place: str | Path) -> None:
    need("jsonschema", "export", "exported models need")
    from jsonschema.exceptions import best_match

    mistake = best_match(_validator().iter_errors(document))
    if mistake is not None:
        key = ".".join(str(part) for part in mistake.absolute_path)
        raise UserError(f"{place}: key '{key}': {mistake.message[:200]}; export the model again")
