"""An own effect, as lines of an experiment file ([[mismatch.effects]])."""

from __future__ import annotations

from math import inf
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from discovery.effects.form import (
    INPUT,
    LEVEL,
    OF_INPUTS,
    RATE,
    REPLACED,
    ROLE_OF,
    TERM,
    TERM_PLACES,
    Acts,
    Amplitude,
    Effect,
    Place,
    Shape,
)
from discovery.errors import UserError
from discovery.models import Parameter
from discovery.models.memory import check_memory
from discovery.models.units import known as known_unit
from discovery.models.units import same_dimension
from discovery.recordings.roles import Role
from discovery.schema import Strict
from discovery.terms import Expression, degree, evaluate, names, parse
from discovery.terms.expression import rewrite

_BODIES: tuple[Place, ...] = ("body", "fluid-free body", "wet body", "driven body", "air body")
# places of effects by how many instants are searched for: when something begins, and when it ends
_SEARCHED: dict[int, tuple[Place, ...]] = {
    1: ("output of a recording", "recording", *_BODIES),
    2: (*_BODIES, "driving input"),
}


def _unit(text: str) -> str:
    if not known_unit(text):
        raise ValueError(f"the unit '{text}' is not known; write one that pint knows, as W/K")
    return text


Unit = Annotated[str, AfterValidator(_unit)]


def _is_a_factor(amplitude: str, formula: Expression) -> bool:
    """Whether a formula is zero where an amplitude is, and linear in it, at some values of the rest."""
    if degree(formula, frozenset({amplitude})) > 1:
        return False
    still = rewrite(formula, lambda a: a.arguments[0] if a.function in ("lag", "delay", "play") else None)
    values = {name: 1.3 + 0.37 * i for i, name in enumerate(sorted(names(formula)))}
    return not np.any(evaluate(still, {**values, amplitude: 0.0}).value)


class ShapeForm(Strict):
    """A parameter inside the formula, with its prior.

    With `factor`: 68 % of values lie within this factor of `middle`. With `spread`: within so much of it.
    Neither: any time that the recordings can show. `instant`: a time in the recording, found by search.
    `or_at_once`: a time constant whose shortest value stands for none at all.
    """

    unit: Unit = "1"
    middle: float | None = Field(None, description="a usual value")
    factor: float | None = Field(None, gt=1, description="68 % of values lie within this factor of it")
    spread: float | None = Field(None, gt=0, description="68 % of values lie within this distance of it")
    instant: bool = Field(False, description="a time in the recording, which the search finds")
    or_at_once: bool = Field(False, description="its shortest value stands for no delay at all")

    @model_validator(mode="after")
    def _is_a_prior(self) -> Self:
        given = {name for name in ("middle", "factor", "spread") if getattr(self, name) is not None}
        if given and (self.instant or "middle" not in given or len(given) != 2):
            raise ValueError("give a middle with a factor or a spread, or instant = true, or none of them")
        if self.factor and not (self.middle or 0.0) > 0:
            raise ValueError(f"a middle with a factor is more than zero, not {self.middle:g}; give a spread")
        if not (given or self.instant) and not same_dimension(self.unit, "s"):
            raise ValueError(f"in {self.unit} it needs a middle with a factor or with a spread")
        if not given and self.unit != "s":
            raise ValueError("a time that is searched for has the unit s")
        return self

    def shape(self, name: str) -> Shape:
        """The shape as the catalogue holds it."""
        middle = 0.0 if self.instant else self.middle
        return Shape(
            name,
            self.unit,
            middle,
            self.factor or 0.0,
            self.spread or 0.0,
            self.instant,
            or_at_once=self.or_at_once,
        )


class EffectForm(Strict):
    """One effect.

    `formula` is a heat flow into `body` (out of `other`, for two bodies) with `amplitude` as a factor; the
    variables are body, other, y (for outputs), ambient, fluid, flow, speed, load, cooling, coolant, height
    and other_input; `input` (its value) and `level` (its share of the largest value) are any recorded input
    of the `roles`, `rate` the level of a flow. At terms of the model, `term` is the term that changes.
    """

    word: str = Field(pattern="^[a-z][a-z0-9_]*$", description="its name in results")
    title: str = ""
    place: Place = Field("body", description="where it can act")
    formula: str
    amplitude: str = Field(description="the name in the formula that switches it on")
    unit: Unit = Field("W", description="unit of the amplitude")
    plausible: float = Field(gt=0, description="usual size of the amplitude")
    most: float = Field(
        inf,
        gt=0,
        allow_inf_nan=True,
        description="largest size that is physical, 1.25 for a share that may be all; default no limit",
    )
    sign: Literal[-1, 0, 1] = Field(1, description="sign of the amplitude, 0 where physics leaves it open")
    shapes: dict[str, ShapeForm] = {}
    roles: list[Role] = Field([], description="of the inputs that `input` and `level` may be")
    acts: Acts | None = Field(
        None, description="default: in one recording where its place or an instant says so, else always"
    )
    shared: bool = Field(False, description="also with one size at all its bodies at once")
    spreads: bool = Field(False, description="also at two linked bodies at once, with a size at each")
    source: str = "given in the experiment file"

    def effect(self) -> Effect:
        """The effect as the catalogue holds it.

        Raises:
            UserError: a formula that does not parse or that delays by no constant, or a name in it that means
            nothing here.
        """
        where = f"effect '{self.word}'"
        formula = self._formula(where)
        if self.plausible > self.most:
            raise UserError(
                f"{where}: its usual size {self.plausible:g} is more than {self.most:g}, its most; "
                "give a smaller one"
            )
        shapes = tuple(form.shape(name) for name, form in self.shapes.items())
        instants = sum(shape.instant for shape in shapes)
        of_one = bool(instants) or self.place.endswith("recording")
        if instants and self.place not in _SEARCHED.get(instants, ()):
            raise UserError(
                f"{where}: one instant is when an output jumps or something comes to a body, two are when "
                f"something begins and ends at a body or an input; with {instants} it cannot act at the "
                f"place '{self.place}'"
            )
        given = {s.name: Parameter(s.middle or 1.0, s.unit, s.ends[0], per_recording=of_one) for s in shapes}
        check_memory(formula, given, ("body", "other", "y"), where)
        return Effect(
            word=self.word,
            title=self.title or self.word.replace("_", " "),
            group="user",
            place=self.place,
            formula=self.formula,
            amplitude=Amplitude(self.amplitude, self.unit, self.plausible, self.sign, most=self.most),
            source=self.source,
            signature="given by the user",
            shapes=shapes,
            search=("shapes", "step", "window")[instants],
            acts=self.acts or ("in one recording" if of_one else "always"),
            shared=self.shared,
            spreads=self.spreads,
            roles=tuple(self.roles),
        )

    def _formula(self, where: str) -> Expression:
        """The formula, of names that mean something, zero where its amplitude is."""
        variables = {*ROLE_OF, INPUT, LEVEL, RATE, TERM, "body", "other", "y", "time"}
        known = {self.amplitude, *self.shapes} | variables
        formula = parse(self.formula, where)
        used = names(formula)
        for name in sorted(used - known):
            raise UserError(
                f"{where}: '{name}' is not known in its formula; known are {', '.join(sorted(known))}"
            )
        if self.amplitude not in used:
            raise UserError(f"{where}: the amplitude '{self.amplitude}' is not in the formula")
        at_terms = self.place in (*TERM_PLACES, *OF_INPUTS)
        replaces = at_terms and TERM not in used  # then it is what a channel becomes, no change
        if not replaces and not _is_a_factor(self.amplitude, formula):
            raise UserError(
                f"{where}: its formula has to be zero where {self.amplitude} is zero, and linear in it; "
                f"write it as {self.amplitude}*(...)"
            )
        if replaces and self.place not in OF_INPUTS and used.isdisjoint(REPLACED):
            raise UserError(
                f"{where}: at the place '{self.place}' its formula needs `{TERM}`, the term that changes, or "
                f"the channel that it replaces there: {', '.join(REPLACED)}"
            )
        if used & {INPUT, LEVEL} and not at_terms and not self.roles:
            raise UserError(f"{where}: say under `roles` which inputs '{INPUT}' and '{LEVEL}' may be")
        return formula
