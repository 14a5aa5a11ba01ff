"""Wear that goes on: parameters that move by date. A revision holds their trend, not only where they are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

from discovery.models import Model
from discovery.terms import Apply, Expression, Name, Number, substitute

DAY_S = 86_400.0
LONGEST_S = 30 * DAY_S  # of a trend that no later revision confirms; the parameters stand still after it


@dataclass(frozen=True)
class Trend:
    """The parameters have their values at the instant `at` [s] and move by `per_day` from then on; `sd`: the
    standard deviation of that, as a share of the parameters a day.
    """

    at: float
    per_day: Mapping[str, float]
    sd: float

    def document(self) -> dict[str, Any]:
        """As it stands in an exported model."""
        return asdict(self)

    def values(self, model: Model, now: float) -> dict[str, float]:
        """The parameters that move, at an instant [s], within their bounds."""
        days = min(max(now - self.at, 0.0), LONGEST_S) / DAY_S
        found = {}
        for name, rate in self.per_day.items():
            p = model.parameters[name]
            found[name] = min(max(p.value + rate * days, p.min), p.max)
        return found

    def moving(self, model: Model, since: float) -> Model:
        """The model on a recording that begins at an instant [s]: its parameters move with its time."""
        moved = {
            name: Apply("+", (Name(name), Apply("*", (Number(rate / DAY_S), self._passed(since)))))
            for name, rate in self.per_day.items()
        }
        terms = tuple(replace(t, expression=substitute(t.expression, moved)) for t in model.terms)
        outputs = {name: substitute(e, moved) for name, e in model.outputs.items()}
        return replace(model, terms=terms, outputs=outputs)

    def _passed(self, since: float) -> Expression:
        passed = Apply("+", (Name("time"), Number(since - self.at)))
        return Apply("min", (passed, Number(LONGEST_S)))


def read_trend(document: Mapping[str, Any]) -> Trend | None:
    """The trend of an exported model."""
    written = document.get("trend")
    return None if written is None else Trend(written["at"], written["per_day"], written["sd"])
