"""What a column is, as log odds: its name, its unit and its values, added up in one table.

A column has a quantity and a place (`vocabulary`); both together are a role. Each piece of evidence raises or
lowers the odds of some of them, and none decides alone: a motor that stands between 17 and 42 and answers
slowly is a temperature whatever it is called, and a column in degC is one whatever its values are.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.measures import dimension_of
from discovery.firsthour.shapes import Shape, shape
from discovery.firsthour.unitodds import error_odds
from discovery.firsthour.vocabulary import PLACES, QUANTITIES, SET_POINT, Word, words_of
from discovery.recordings.units import UnitError, conversion

Array = NDArray[np.float64]

_PRIOR = {
    "temperature": 0.5,
    "displacement": -0.5,
    "correction": -2.0,
    "nozzle height": -4.0,
    "nozzle side": -4.0,
    "flow": -1.0,
    "speed": -0.5,
    "power": 0.0,
    "signal": -0.8,
    "current": -1.0,
    "voltage": -1.0,
    "torque": -1.0,
    "position": -1.0,
    "other": 0.7,
    "state": -0.5,
    "fan": -3.0,
}
_PLACE_PRIOR = {"body": 0.0, "air": -4.0, "fluid": -4.5, "coolant": -4.5}
_HEAD = 1.25  # the last word of a name is what the others describe: a coolant flow is a flow
_ROLES = {
    ("temperature", "body"): "temperature",
    ("temperature", "air"): "ambient temperature",
    ("temperature", "fluid"): "fluid temperature",
    ("temperature", "coolant"): "coolant temperature",
    ("power", "coolant"): "cooling power",
    ("power", ""): "heat load",
    ("signal", ""): "heat load",
    ("displacement", ""): "error",
    ("correction", ""): "applied correction",
    ("nozzle height", ""): "nozzle height",
    ("nozzle side", ""): "nozzle side",
    ("flow", ""): "fluid flow",
    ("speed", ""): "rotation speed",
}
OTHER = "other input"
_FASTEST_RPM = 1e6  # dental turbines reach half of it
_STEPS = 255.0  # of a pulse width
# a word that names a quantity, and one for a thing that usually has some: the current of a load is a current
_NAMES, _HAS = 5.0, 3.0


@dataclass
class Evidence:
    """Log odds of quantities and places, and the sentence behind each piece."""

    odds: dict[str, float] = field(default_factory=lambda: {**_PRIOR, **_PLACE_PRIOR})
    reasons: list[tuple[str, Mapping[str, float]]] = field(default_factory=list)

    def add(self, why: str, says: Mapping[str, float]) -> None:
        """One piece of evidence."""
        for key, value in says.items():
            if key in self.odds:
                self.odds[key] += value
        if says:
            self.reasons.append((why, says))

    def roles(self) -> dict[str, float]:
        """Log odds of the roles."""
        places = {p: self.odds[p] for p in PLACES}
        most = max(places.values())
        norm = most + math.log(sum(math.exp(v - most) for v in places.values()))
        found: dict[str, float] = {}
        for quantity in QUANTITIES:
            for place in PLACES:
                role = _ROLES.get((quantity, place)) or _ROLES.get((quantity, "")) or OTHER
                score = self.odds[quantity] + places[place] - norm
                found[role] = float(np.logaddexp(found.get(role, -math.inf), score))
        return found

    def quantity(self) -> str:
        """The likeliest quantity."""
        return max(QUANTITIES, key=lambda q: self.odds[q])

    def why(self, role: str) -> str:
        """The two strongest pieces of evidence for a role."""
        keys = {key for pair, of in _ROLES.items() if of == role for key in pair} or {"other", "state", "fan"}
        if role == OTHER:
            keys |= {"current", "voltage", "torque", "position"}
        scored = [
            (max((v for k, v in says.items() if k in keys), default=0.0), why) for why, says in self.reasons
        ]
        best = sorted((one for one in scored if one[0] > 0.9), key=lambda one: -one[0])[:2]
        return ", ".join(why for _, why in best) or "nothing says what it is"


def evidence(
    name: str,
    about: str,
    unit: str | None,
    values: Array,
    hints: Sequence[tuple[str, Mapping[str, float]]] = (),
) -> Evidence:
    """All that is known of a column.

    Args:
        name: its header without the unit. about: further words of the file. unit: as pint knows it, or None.
        values: (N,). hints: what its file and its neighbours say.
    """
    found = Evidence()
    of_name = words_of(name)
    clearest: dict[str, Word] = {}  # of words that say the same
    for word in [*of_name, *words_of(about)]:
        if word.gloss not in clearest or _clear(word) > _clear(clearest[word.gloss]):
            clearest[word.gloss] = word
    named = max((_of_quantity(word) for word in of_name), default=0.0) >= _NAMES
    for word in clearest.values():
        head = _HEAD if of_name and word is of_name[-1] else 1.0
        says = {key: head * odds for key, odds in word.says.items()}
        if named and _of_quantity(word) <= _HAS:
            says = {key: odds for key, odds in says.items() if key in PLACES}
        found.add(f"'{_spelled(word, name)}' in its name", says)
    if of_name and all(_only_a_place(word) for word in of_name):
        found.add("nothing but a place in its name", {"temperature": 3.0})
    if unit is not None:
        odds = dict(dimension_of(unit))
        if odds and max(odds.values()) > 4:  # a quantity that cannot have the unit is out
            odds = {**dict.fromkeys((q for q in QUANTITIES if q not in odds), -12.0), **odds}
        found.add(f"its unit {unit}", odds)
    form = shape(values)
    if form is not None and unit is not None and (turns := _in_rpm(form.high, unit)) > _FASTEST_RPM:
        found.add(f"up to {turns:.1g} rpm, and nothing turns so fast", {"speed": -24.0})
    if form is not None:
        for why, more in value_odds(form, unit):
            found.add(why, more)
        if form.binary and max(found.odds["coolant"], found.odds["fluid"]) > 0.0:
            found.add("a fluid that is on or off flows", {"flow": 3.0})
    for why, more in hints:
        found.add(why, more)
    return found


def _in_rpm(value: float, unit: str) -> float:
    """A value in rpm; zero where its unit is none of a speed.

    >>> round(_in_rpm(50.0, "Hz")), _in_rpm(50.0, "W")
    (3000, 0.0)
    """
    try:
        return float(conversion(unit, "rotation speed").factor * value)
    except UnitError:
        return 0.0


def _only_a_place(word: Word) -> bool:
    """Whether a word says where, and nothing of what is measured there: room, ambient, hall."""
    return set(word.says) <= {*PLACES, "temperature"} and _of_quantity(word) < _HAS


def _clear(word: Word) -> float:
    return max(word.says.values(), default=0.0)


def _of_quantity(word: Word) -> float:
    """How clearly a word names one quantity."""
    return max((odds for key, odds in word.says.items() if key in QUANTITIES), default=0.0)


def is_set_point_word(name: str) -> bool:
    """Whether a name says that a column is the set point of a controller."""
    return any(word.gloss == SET_POINT for word in words_of(name))


def value_odds(form: Shape, unit: str | None) -> list[tuple[str, Mapping[str, float]]]:
    """What the values say. `unit`: where it is known, their size says nothing of the quantity."""
    found: list[tuple[str, Mapping[str, float]]] = []
    span = f"{form.low:.4g} to {form.high:.4g}"
    if form.binary:
        says = {
            "temperature": -8.0,
            "displacement": -6.0,
            "correction": -5.0,
            "speed": -4.0,
            "current": -2.0,
            "voltage": -2.0,
            "flow": 1.0,
            "power": 0.5,
            "state": 1.5,
            "signal": -0.5,
        }
        return [("it is 0 or 1", says)]
    if form.slow:
        found.append(
            (
                "it answers slowly",
                {
                    "temperature": 1.5,
                    "displacement": 1.0,
                    "speed": -2.5,
                    "power": -1.0,
                    "signal": -1.0,
                    "flow": -1.0,
                    "torque": -1.5,
                    "voltage": -0.5,
                    "position": -2.0,  # an axis is driven from place to place
                    "other": 0.2,
                },
            )
        )
    elif form.jump > 0.4:
        says = {
            "temperature": -3.0,
            "displacement": -2.0,
            "speed": 1.0,
            "power": 1.0,
            "signal": 1.0,
            "current": 1.0,
            "flow": 0.5,
        }
        found.append(("it jumps", says))
    if unit is not None:
        return found
    if form.low >= 5.0 and form.high <= 70.0 and form.slow:
        found.append(
            (
                f"{span}, as temperatures around a machine",
                {"temperature": 2.5, "displacement": -0.5, "speed": -4.0, "voltage": -0.5},
            )
        )
    elif form.low < -60.0 or form.high > 400.0:
        found.append((f"{span}, no temperature", {"temperature": -6.0, "air": -5.0}))
    elif form.low < -30.0 or form.high > 200.0:
        found.append((f"{span}, hardly a temperature", {"temperature": -1.5, "air": -5.0, "fluid": -3.0}))
    if form.high > 60.0:
        found.append((f"up to {form.high:.4g}", {"air": -0.5}))
    travel = max(error_odds(form, turns=False).values()) if form.span > 0 else 0.0
    if travel < -0.5:
        found.append((f"a span of {form.span:.3g}", {"displacement": max(travel, -6.0)}))
    if form.span > 0 and abs(form.first) < 0.03 * form.span and form.slow and not form.whole:
        found.append(("it starts at zero and answers slowly", {"displacement": 1.5, "temperature": -1.0}))
    if form.low < -0.02 * max(abs(form.high), abs(form.low)):
        found.append(
            (
                "it goes below zero",
                {
                    "displacement": 1.0,
                    "correction": 0.5,
                    "speed": -0.5,
                    "flow": -3.0,
                    "power": -1.0,
                    "signal": -5.0,
                    "other": 0.3,
                },
            )
        )
    if form.high >= 200.0 and form.whole and form.jump > 0.05:
        found.append((f"whole numbers up to {form.high:.0f}", {"speed": 1.5, "power": 0.5}))
    if form.high > _STEPS:
        found.append((f"up to {form.high:.4g}", {"signal": -3.0}))
    if form.high < 20.0:
        found.append((f"never above {form.high:.3g}", {"speed": -2.0, "temperature": -0.5}))
    return found


def _spelled(word: Word, name: str) -> str:
    """A word as the name spells it."""
    found = re.search(r"[\W_]*".join(map(re.escape, word.said.split())), name, re.IGNORECASE)
    return found[0].strip() if found else word.said
