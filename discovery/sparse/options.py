"""Options of a discovery in an experiment file: `discovered = { kind = "sindy", ... }`."""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal, Self

from pydantic import Field, WithJsonSchema, field_validator, model_validator

from discovery.schema import Strict
from discovery.sparse.laws import LAWS

THERMAL = ("wet", "rotation", "coupling", "radiation", "natural", "load", "second mass")
FAMILIES = (*LAWS, "threshold", "product", *THERMAL)
HIDDEN = ("own", "rate", "upstream")

OPTIMISER = r"^(search|pysindy:\w+)$"  # in a file, which never runs the code of a user

FROM_LIST = Field(strict=False)  # a file has lists where options have tuples
Words = Annotated[tuple[str, ...], FROM_LIST]
Numbers = Annotated[tuple[float, ...], FROM_LIST]
Bound = Annotated[float, Field(allow_inf_nan=True)]


class SparseOptions(Strict):
    """Options of one discovered model; the defaults serve a machine tool and two heaters alike."""

    kind: Literal["sindy"] = "sindy"
    inputs: Words | None = Field(
        None,
        description="channels that terms may use; default every input that moves in the recordings to fit",
    )
    baseline: str = Field("eq9", description='"eq9", or a model file to which terms are added')
    keep_baseline: bool | None = Field(
        None,
        description="true: the terms of the baseline always stay; false: the search may remove them; default "
        "true for a file, false for eq9",
    )
    form: Literal["auto", "masses", "rates"] = Field(
        "auto",
        description='"masses": hidden thermal masses driven by the inputs; "rates": terms in the rates of '
        'the outputs (or of the states of a baseline file); "auto": masses for errors, rates for '
        "anything else",
    )
    library: Words | None = Field(
        None,
        description=f"families ({', '.join(FAMILIES)}) or expressions of channels and states; y is the "
        "output itself",
    )
    into: Words | None = Field(
        None, description="states of a baseline file that candidates may enter; default all"
    )
    max_terms: int = Field(15, ge=1, le=60, description="largest number of terms of one output")
    time_constants: Annotated[tuple[float, float], FROM_LIST] | None = Field(
        None,
        description="smallest and largest time constant of the hidden masses [s]; default from the sampling",
    )
    hidden: Literal["auto", "own", "rate", "upstream"] = Field(
        "auto",
        description='hidden state behind an output in rates: "own": none; "rate": the rate of the output (a '
        'mass on a spring); "upstream": a body that empties into it (a tank above a tank); "auto": the one '
        "that predicts best",
    )
    stable: bool | None = Field(
        None,
        description="true: no pole in the right half plane, every state returns to rest; false: it may swing "
        "by itself; default true for errors and temperatures, false for anything else",
    )
    keep: Words = Field((), description="terms that always stay")
    forbid: Words = Field((), description="terms that the search must not use")
    bounds: dict[str, Annotated[tuple[Bound, Bound], FROM_LIST]] = Field(
        default_factory=dict,
        description="smallest and largest coefficient of a term, by its expression; [0, inf] fixes the sign; "
        "units are those of the equations (rates of errors and temperatures: per hour)",
    )
    optimiser: Annotated[Any, WithJsonSchema({"type": "string", "pattern": OPTIMISER})] = Field(
        "search",
        description='"search": our own search; "pysindy:SR3": an optimiser of PySINDy by its name; from '
        "Python also an object",
    )
    optimiser_arguments: dict[str, Any] = Field(
        default_factory=dict, description="arguments of the optimiser of PySINDy, as { threshold = 0.1 }"
    )
    tolerance: float | None = Field(
        None,
        ge=0,
        description="a sparser model may be worse on left-out data by so many standard errors; default 1 for "
        "masses, 2 for rates, 3 for terms that are added to a baseline file",
    )
    blocks: int = Field(24, ge=4, le=500, description="number of blocks of the recordings for bootstraps")
    bootstraps: int = Field(
        40, ge=0, le=1000, description="number of block bootstraps for the stability of each term"
    )
    refine: bool = Field(
        True, description="fit all parameters of the chosen model by output error at the end"
    )
    seed: int = Field(0, ge=0, description="seed of the bootstraps")
    also: Words = Field((), description="recordings that this model is fitted to in addition to `fit`")

    @field_validator("optimiser")
    @classmethod
    def _optimiser_of_pysindy(cls, one: Any) -> Any:
        if isinstance(one, str):
            good = re.fullmatch(OPTIMISER, one) is not None
        else:
            from pysindy.optimizers.base import BaseOptimizer  # takes seconds, and a file has only names

            good = isinstance(one, BaseOptimizer)
        if not good:
            raise ValueError(
                f"{one!r} is not an optimiser of PySINDy; give 'search' or a name, as in 'pysindy:SR3'. An "
                "object works from Python, if its class is derived from pysindy.optimizers.BaseOptimizer "
                "(docs/discovery.md)"
            )
        return one

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        for name, (low, high) in self.bounds.items():
            if not low <= high:
                raise ValueError(
                    f"the bounds of '{name}' are {low:g} and {high:g}; write the smaller one first"
                )
        if self.time_constants and not 0 < self.time_constants[0] < self.time_constants[1]:
            raise ValueError("time_constants: write two positive times in s, the shorter one first")
        if self.form == "masses" and self.baseline != "eq9":
            raise ValueError('terms are added to a baseline file in rates; remove form = "masses"')
        return self

    @property
    def built_on_file(self) -> bool:
        """Whether the baseline is a model file."""
        return self.baseline != "eq9"
