"""An effect of the user's own, as lines of an experiment file ([[mismatch.effects]])."""

from __future__ import annotations

from math import inf
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, model_validator

from discovery.effects.form import ROLE_OF, Amplitude, Effect, Place, Shape
from discovery.errors import UserError
from discovery.models import Parameter
from discovery.models.memory import check_memory
from discovery.models.units import known as known_unit
from discovery.schema import Strict
from discovery.terms import Expression, degree, evaluate, names, parse
from discovery.terms.expression import rewrite

# places where the formula is what a channel becomes, not a flow that comes in addition
REPLACING = ("fluid terms", "cooling terms", "inputs of a recording")


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
    """A parameter inside the formula."""

    unit: Unit = "1"
    grid: list[float] = Field(min_length=1, description="values that the search tries")
    low: float = Field(description="smallest value that the refit may give")
    high: float = Field(description="largest value that the refit may give")

    @model_validator(mode="after")
    def _grid_lies_within(self) -> Self:
        outside = [value for value in self.grid if not self.low <= value <= self.high]
        if outside:
            raise ValueError(
                f"{outside[0]:g} of its grid does not lie within low {self.low:g} and high {self.high:g}; "
                "mend one of the three"
            )
        return self


class EffectForm(Strict):
    """One effect.

    `formula` is a heat flow into `body` (out of `other`, for two bodies) with `amplitude` as a factor; the
    variables are body, other, y (for outputs), ambient, fluid, flow, speed, load, cooling, coolant, height
    and other_input.
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
        description="largest size that is physical, 1 for a share; default no limit",
    )
    sign: Literal[-1, 0, 1] = Field(1, description="sign of the amplitude, 0 where physics leaves it open")
    shapes: dict[str, ShapeForm] = {}
    source: str = "given in the experiment file"

    def effect(self) -> Effect:
        """The effect as the catalogue holds it.

        Raises:
            UserError: a formula that does not parse or that delays by no constant, or a name in it that means
            nothing here.
        """
        where = f"effect '{self.word}'"
        known = {self.amplitude, *self.shapes, *ROLE_OF, "body", "other", "y", "time"}
        formula = parse(self.formula, where)
        for name in sorted(names(formula) - known):
            raise UserError(
                f"{where}: '{name}' means nothing in its formula; known: {', '.join(sorted(known))}"
            )
        if self.amplitude not in names(formula):
            raise UserError(f"{where}: the amplitude '{self.amplitude}' does not stand in the formula")
        formula = parse(self.formula, where)
        if self.place not in REPLACING and not _is_a_factor(self.amplitude, formula):
            raise UserError(
                f"{where}: its formula has to be zero where {self.amplitude} is zero, and linear in it; "
                f"write it as {self.amplitude}*(...)"
            )
        if self.plausible > self.most:
            raise UserError(
                f"{where}: its usual size {self.plausible:g} is more than {self.most:g}, its most; "
                "give a smaller one"
            )
        own = self.place.endswith("of a recording")
        shapes = {
            name: Parameter(s.grid[0], s.unit, s.low, s.high, per_recording=own)
            for name, s in self.shapes.items()
        }
        check_memory(formula, shapes, ("body", "other", "y"), where)
        return Effect(
            word=self.word,
            title=self.title or self.word.replace("_", " "),
            group="user",
            place=self.place,
            formula=self.formula,
            amplitude=Amplitude(self.amplitude, self.unit, self.plausible, self.sign, most=self.most),
            shapes=tuple(
                Shape(name, s.unit, tuple(s.grid), s.low, s.high) for name, s in self.shapes.items()
            ),
            source=self.source,
            signature="given by the user",
        )
