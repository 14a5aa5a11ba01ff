"""The one idea: a model is a sparse sum of terms."""

from __future__ import annotations

from dataclasses import dataclass

from discovery.terms.expression import Expression


@dataclass(frozen=True, slots=True)
class Term:
    """One summand of the right-hand side.

    `expression` is a heat flow in W where the state it enters has a capacity, else a rate in the state's unit
    per time unit. With `source` what enters one state leaves the other, so that conduction conserves energy.
    """

    name: str
    into: str
    expression: Expression
    source: str | None = None
    effect: str = ""  # word of the catalogue when the term was added by a diagnosis
