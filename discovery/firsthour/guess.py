"""What a column probably is: its role and unit, how sure that is, and why."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.evidence import OTHER, Evidence, evidence
from discovery.firsthour.measures import unit_of
from discovery.firsthour.odds import likely, probabilities
from discovery.firsthour.shapes import Shape, shape
from discovery.firsthour.table import Column
from discovery.firsthour.unitodds import error_odds, flow_odds, load_odds, speed_odds, temperature_odds, usual
from discovery.firsthour.vocabulary import fold, words_of
from discovery.recordings.units import UnitError, conversion, parse_unit

Array = NDArray[np.float64]

SURE = 0.9  # probability below which a guess is asked about
_SENT = 0.85  # that what a controller sends is what heats
NEXT = 0.02  # of an answer worth offering
FLUIDS = ("fluid temperature", "coolant temperature")
TEMPERATURES = ("ambient temperature", *FLUIDS, "temperature")
SUN = "sun"  # irradiance: it warms what it falls on
CURRENTS, VOLTAGES = ("A", "mA", "kA"), ("V", "mV", "kV")


@dataclass(frozen=True)
class Guess:
    """Role and unit of a column, why, and the probability of each of both.

    `rivals`: other roles with their probabilities. `corrects`: of an applied correction, its error.
    `below_zero`: of a heat load, the share of its readings. `said`: a person said so.
    """

    role: str
    unit: str
    why: str
    chance: float = 1.0
    unit_chance: float = 1.0
    rivals: tuple[tuple[str, float], ...] = ()
    unit_rivals: tuple[tuple[str, float], ...] = ()
    corrects: str | None = None
    below_zero: float = 0.0
    quantity: str = ""
    said: bool = False

    @property
    def sure(self) -> bool:
        """Whether nobody needs to look."""
        return self.said or min(self.chance, self.unit_chance) >= SURE

    def doubtful(self, why: str, **changes: object) -> Guess:
        """This guess with a further reason, for a person to look at."""
        return replace(self, why=f"{self.why}; {why}", chance=min(self.chance, 0.7), **changes)  # type: ignore[arg-type]


def is_irradiance(name: str, unit: str) -> bool:
    """Whether a channel is the power of the sun on an area, by its name or its unit.

    >>> is_irradiance("poa_irradiance", ""), is_irradiance("roof", "W/m²"), is_irradiance("humidity", "%")
    (True, True, False)
    """
    if any(word.gloss == "irradiance" for word in words_of(name)):
        return True
    try:
        return parse_unit(unit).is_compatible_with(parse_unit("W/m**2"))
    except ValueError:
        return False


def guess(column: Column, hints: Sequence[tuple[str, Mapping[str, float]]] = ()) -> Guess:
    """Role and unit of a column by itself."""
    found = evidence_of(column, hints)
    return guessed(column, found, [found])


def evidence_of(column: Column, hints: Sequence[tuple[str, Mapping[str, float]]]) -> Evidence:
    """What name, remarks, unit and values of a column say of its role."""
    return evidence(column.header, column.about, _unit_read(column), column.values, hints)


def _unit_read(column: Column) -> str | None:
    """Return the unit in the header, if it is one."""
    spelled, named = unit_of(column.unit)
    return named or (spelled if spelled and _known(spelled, OTHER) else None)


def guessed(column: Column, found: Evidence, alike: Sequence[Evidence]) -> Guess:
    """Role and unit. `alike`: evidence of all columns of its kind, which have one role: the mean counts."""
    spelled, named = unit_of(column.unit)
    unit = _unit_read(column)
    of_each = [one.roles() for one in alike]
    roles = probabilities({role: float(np.mean([one[role] for one in of_each])) for role in of_each[0]})
    role, chance = next(iter(roles.items()))
    rivals = tuple((other, p) for other, p in roles.items() if other != role and p > NEXT)
    why = found.why(role)
    if found.quantity() == "signal":  # what a controller sends may heat, or not
        chance = min(chance, _SENT)
    quantity = SUN if is_irradiance(column.header, unit or "") else found.quantity()
    one = Guess(role, "1", why, chance, rivals=rivals, quantity=quantity)
    if unit is not None:
        return _with_unit(one, unit, named is not None, column.unit)
    if spelled:
        return replace(
            one, role=OTHER, chance=0.5, why=f"{why}; the header says {column.unit}, no known unit"
        )
    return _by_values(one, column)


def drives(guesses: Mapping[str, Guess]) -> list[str]:
    """What warms a machine: its heat loads, else its currents and speeds, else its voltages; and the sun."""
    causes = {name: one for name, one in guesses.items() if one.role not in ("error", "other output")}
    machine = _stated(causes) or [name for name, one in causes.items() if one.unit in VOLTAGES]
    return machine + [name for name, one in causes.items() if one.role == OTHER and one.quantity == SUN]


def squared(one: Guess) -> bool:
    """Whether heat goes with the square of a channel: copper warms with that of its current."""
    return one.unit in (*CURRENTS, *VOLTAGES)


def _stated(guesses: Mapping[str, Guess]) -> list[str]:
    loads = [name for name, one in guesses.items() if one.role == "heat load"]
    likely_ones = [n for n, one in guesses.items() if one.role == "rotation speed" or one.unit in CURRENTS]
    return loads or likely_ones


def _with_unit(one: Guess, unit: str, listed: bool, written: str) -> Guess:
    """Return the guess with the likeliest role that can have the unit of the header."""
    for role, chance in ((one.role, one.chance), *one.rivals, (OTHER, one.chance)):
        if _known(unit, role):
            said = "" if listed and unit == written else f"; the header says {written}"
            return replace(one, role=role, chance=chance, unit=unit, why=f"{one.why}{said}")
    return replace(one, role=OTHER, unit="1", chance=0.5, why=f"{one.why}; the header says {written}")


def _by_values(one: Guess, column: Column) -> Guess:
    """The unit of a column that names none."""
    form = shape(column.values)
    if form is None:
        return replace(one, unit_chance=0.5, why=f"{one.why}; it holds no value")
    if one.quantity in ("current", "voltage") and one.role == OTHER:
        unit = {"current": "A", "voltage": "V"}[one.quantity]
        return replace(one, unit=unit, unit_chance=0.8, why=f"{one.why}, taken in {unit}; its square warms")
    odds = _unit_odds(one, form, column.header)
    shares = probabilities(odds)
    unit, chance = likely(odds)
    rivals = tuple((other, p) for other, p in shares.items() if other != unit and p > NEXT)
    why = f"{one.why}; {form.low:.4g} to {form.high:.4g} taken in {unit}" if len(odds) > 1 else one.why
    return replace(one, unit=unit, unit_chance=chance, unit_rivals=rivals, why=why)


def _unit_odds(one: Guess, form: Shape, header: str) -> Mapping[str, float]:
    if one.role in TEMPERATURES:
        return temperature_odds([form], air=one.role == TEMPERATURES[0])
    if one.role in ("error", "applied correction"):
        return error_odds(form, turns=bool(re.search(r"\be ?[abc]\d", fold(header))))
    if one.role in ("heat load", "cooling power"):
        return load_odds(form, signal=one.quantity == "signal")
    if one.role == "rotation speed":
        return speed_odds(form)
    return flow_odds(form) if one.role == "fluid flow" else usual(one.role)


def _known(unit: str, role: str) -> bool:
    try:
        conversion(unit, role)
    except UnitError:
        return False
    return True
