"""Model files: read, and write back with the values found."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from itertools import count
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator

from discovery.errors import UserError
from discovery.files import dotted, locate, read_text, read_toml, write_toml
from discovery.models.memory import check_memory, check_start
from discovery.models.model import TIME_UNITS, Model, Parameter, State, in_time_unit
from discovery.naming import is_taken, is_word
from discovery.schema import Strict
from discovery.terms import Expression, Term, parse, text


class ParameterForm(Strict):
    """One line of [parameters]."""

    start: float = Field(1.0, description="start value; in a fitted model the value found")
    unit: str = Field("1", description="unit that pint knows")
    min: float = Field(-math.inf, allow_inf_nan=True, description="smallest value that a fit may give")
    max: float = Field(math.inf, allow_inf_nan=True, description="largest value that a fit may give")
    fixed: bool = Field(False, description="true: given, not fitted")
    per: Literal["recording"] | None = Field(
        None, description='"recording": a value of its own in each recording'
    )
    prior: Annotated[tuple[float, Annotated[float, Field(gt=0)]], Field(strict=False)] | None = Field(
        None, description="mean and standard deviation known before a fit; default nothing but the limits"
    )
    low: float | dict[str, float] | None = Field(
        None, description="lower end of the 95 % interval, by recording where values are (written by a fit)"
    )
    high: float | dict[str, float] | None = Field(
        None, description="upper end of the 95 % interval, by recording where values are (written by a fit)"
    )
    values: dict[str, float] = Field(
        default_factory=dict, description="values by recording (written by a fit)"
    )
    spread: float = Field(
        0.0, ge=0, description="standard deviation about start in a recording that no fit has seen (by a fit)"
    )


class StateForm(Strict):
    """One line of [states]."""

    unit: str = Field("degC", description="unit of the state")
    capacity: float | None = Field(
        None, gt=0, description="heat capacity in J/K; its terms are then heat flows in W"
    )
    start: float | str | None = Field(
        None, description="number or expression; without it the balance of the first inputs"
    )
    start_sd: float | None = Field(
        None,
        ge=0,
        description="spread of the start value; without it a state that is read starts at its first reading, "
        "and the spread of any other is found by the fit",
    )
    start_with: dict[str, float] = Field(
        default_factory=dict,
        description="by a state listed above: share of its start offset that this state has, too; start_sd "
        "is then the spread of the rest (written by a discovery)",
    )
    memory: bool = Field(False, description="true: what a lag() remembers, no body (written by a fit)")

    @field_validator("capacity", mode="before")
    @classmethod
    def _is_number(cls, capacity: object) -> object:
        if isinstance(capacity, str):
            raise ValueError(
                f"should be a number of J/K, not '{capacity}': a fit finds heat flows, not capacities; "
                "give mass times specific heat, or leave `capacity` out and write each term as a rate, as P/C"
            )
        return capacity


class TermForm(Strict):
    """One [[terms]] entry."""

    name: str = Field("", description="how reports call it")
    into: str = Field(description="the state it enters")
    source: str | None = Field(None, alias="from", description="the state it leaves")
    expression: str | float = Field(description="formula")
    effect: str = Field("", description="word of the catalogue (written by a diagnosis)")


class ModelForm(Strict):
    """A model file."""

    name: str = ""
    time_unit: Literal["s", "min", "h", "d"] = "s"
    guessed: bool = Field(
        False,
        description="true: the start values are guesses, and a diagnosis believes them within a factor of "
        "nine (written by `discovery new`)",
    )
    parameters: dict[str, ParameterForm] = Field(default_factory=dict)
    states: dict[str, StateForm]
    terms: list[TermForm] = Field(default_factory=list)
    outputs: dict[str, str | float] = Field(default_factory=dict)


def read_model(path: Path) -> Model:
    """Read a model file; `docs/own_model.md` describes its form.

    Args:
        path: the model file (TOML).

    Returns:
        The model: parameters, states, terms and outputs. Its parameters have their start values.

    Raises:
        UserError: a mistake in the file, with file, line and key.
    """
    form = read_toml(path, ModelForm)
    source = read_text(path)

    def at(*key: str | int) -> str:
        line = locate(source, key)
        return f"{path}{f', line {line}' if line else ''}, key {dotted(key)}"

    _check_names(form, at)
    parameters = {name: _parameter(entry, at("parameters", name)) for name, entry in form.parameters.items()}
    per_unit = 1.0 / TIME_UNITS[form.time_unit]
    states = {
        name: _state(name, entry, per_unit, at("states", name, "start"))
        for name, entry in form.states.items()
    }
    _check_start_with(states, at)
    terms: list[Term] = []
    taken: set[str] = set()
    for i, entry in enumerate(form.terms):
        term = _term(i, entry, states, at)
        if term.name in taken:
            raise UserError(
                f"{at('terms', i, 'name')}: another term is named '{term.name}'; name it differently"
            )
        check_memory(term.expression, parameters, states, at("terms", i, "expression"))
        taken.add(term.name)
        terms.append(term)
    outputs = {}
    for name, formula in form.outputs.items():
        outputs[name] = parse(formula, place := at("outputs", name))
        check_memory(outputs[name], parameters, states, place)
    name = form.name or Path(path).stem
    return Model(name, parameters, states, tuple(terms), outputs, form.time_unit, form.guessed)


def _check_names(form: ModelForm, at: Callable[..., str]) -> None:
    """Refuse names that expressions cannot use, and one name for two things."""
    for kind in ("parameters", "states"):
        for name in getattr(form, kind):
            if not is_word(name) or is_taken(name):
                raise UserError(
                    f"{at(kind, name)}: '{name}' cannot name a {kind[:-1]}; "
                    "use letters (a to z), digits and _ and no word that expressions know"
                )
    for name in form.parameters.keys() & form.states.keys():
        raise UserError(f"{at('parameters', name)}: '{name}' is also a state; rename one of them")


def _parameter(entry: ParameterForm, place: str) -> Parameter:
    if entry.min > entry.max:
        raise UserError(f"{place}: min {entry.min:g} is above max {entry.max:g}")
    if not entry.min <= entry.start <= entry.max and not entry.fixed:
        raise UserError(
            f"{place}: start {entry.start:g} lies outside min {entry.min:g} and max {entry.max:g}"
        )
    return Parameter(
        entry.start,
        entry.unit,
        entry.min,
        entry.max,
        entry.fixed,
        entry.per == "recording",
        None if isinstance(entry.low, dict) else entry.low,
        None if isinstance(entry.high, dict) else entry.high,
        entry.values,
        _intervals(entry),
        entry.prior,
        entry.spread,
    )


def _intervals(entry: ParameterForm) -> dict[str, tuple[float, float]]:
    low, high = entry.low, entry.high
    if not isinstance(low, dict) or not isinstance(high, dict):
        return {}
    return {recording: (low[recording], high[recording]) for recording in low if recording in high}


def _state(name: str, entry: StateForm, per_unit: float, place: str) -> State:
    """A state; `per_unit`: what turns a rate per time unit of the model into one per second."""
    start: Expression | None = None
    if entry.start is not None:
        start = parse(entry.start, place)
        check_start(start, place)
    scale = 1.0 / entry.capacity if entry.capacity else per_unit
    return State(
        name, entry.unit, entry.capacity, start, entry.start_sd, scale, entry.memory, entry.start_with
    )


def _check_start_with(states: Mapping[str, State], at: Callable[..., str]) -> None:
    above: list[str] = []
    for name, state in states.items():
        for other in state.start_with:
            if other not in above:
                raise UserError(
                    f"{at('states', name, 'start_with')}: '{other}' is not a state above '{name}' "
                    f"({', '.join(above) or 'there is none'}); name one, or leave it out"
                )
        above.append(name)


def _term(i: int, entry: TermForm, states: Mapping[str, State], at: Callable[..., str]) -> Term:
    if entry.source == entry.into:
        raise UserError(
            f"{at('terms', i, 'from')}: '{entry.into}' is also into; what leaves it enters another"
        )
    for key, state in (("into", entry.into), ("from", entry.source)):
        if state is not None and state not in states:
            raise UserError(
                f"{at('terms', i, key)}: '{state}' is not a state; states are {', '.join(states)}"
            )
    expression = parse(entry.expression, at("terms", i, "expression"))
    return Term(entry.name or f"term {i + 1}", entry.into, expression, entry.source, entry.effect)


def model_document(model: Model) -> dict[str, Any]:
    """The model as the nested mapping that its file holds."""
    model = in_time_unit(model)
    distinct = zip(_distinct([term.name for term in model.terms]), model.terms, strict=True)
    return {
        "name": model.name,
        "time_unit": model.time_unit,
        **({"guessed": True} if model.guessed else {}),
        "parameters": {name: _parameter_entry(p) for name, p in model.parameters.items()},
        "states": {name: _state_entry(state) for name, state in model.states.items()},
        "terms": [_term_entry(name, term) for name, term in distinct],
        "outputs": {name: text(expression) for name, expression in model.outputs.items()},
    }


def _parameter_entry(p: Parameter) -> dict[str, Any]:
    def number(value: float) -> float:  # value and bounds alike, so that a value on its bound stays there
        return float(f"{value:.10g}")

    entry = _finite({"start": number(p.value), "unit": p.unit, "min": number(p.min), "max": number(p.max)})
    entry |= {"fixed": True} if p.fixed else {}
    entry |= {"prior": [number(one) for one in p.prior]} if p.prior else {}
    entry |= {"per": "recording"} if p.per_recording else {}
    entry |= {"spread": number(p.spread)} if p.spread else {}
    entry |= _finite({"low": p.low and number(p.low), "high": p.high and number(p.high)})
    entry |= {"values": {key: number(value) for key, value in p.values.items()}} if p.values else {}
    for end, key in enumerate(("low", "high") if p.intervals else ()):
        entry[key] = {recording: number(ends[end]) for recording, ends in p.intervals.items()}
    return entry


def _state_entry(state: State) -> dict[str, Any]:
    return _finite(
        {
            "unit": state.unit,
            "capacity": state.capacity,
            "start": state.start and text(state.start),
            "start_sd": state.start_sd,
            "start_with": dict(state.start_with) or None,
            "memory": state.memory or None,
        }
    )


def _term_entry(name: str, term: Term) -> dict[str, Any]:
    source = {"from": term.source} if term.source else {}
    effect = {"effect": term.effect} if term.effect else {}
    return {"name": name, "into": term.into, **source, "expression": text(term.expression), **effect}


def _finite(entries: dict[str, Any]) -> dict[str, Any]:
    """What a file holds: neither None nor a number that is infinite or none."""
    return {
        key: value
        for key, value in entries.items()
        if value is not None and not (isinstance(value, float) and not math.isfinite(value))
    }


def _distinct(names: list[str]) -> list[str]:
    """Names with a number behind those that came before: an effect may be found twice at one body.

    >>> _distinct(["air", "radiation", "air"])
    ['air', 'radiation', 'air (2)']
    """
    found: list[str] = []
    for name in names:
        tries = (name if k == 1 else f"{name} ({k})" for k in count(1))
        found.append(next(one for one in tries if one not in found))
    return found


def write_model(path: Path, model: Model) -> None:
    """Write a model file that `read_model` reads back to the same model.

    Args:
        path: the file to write (TOML). An existing file is replaced.
        model: any model, for example `fit_model(...).model`; fitted values become start values.
    """
    write_toml(path, model_document(model))
