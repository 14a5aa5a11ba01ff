"""What the columns of a table probably are: each by itself (`guess`), then by what else is in the table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.answering import explained_by
from discovery.firsthour.evidence import OTHER, Evidence, is_set_point_word
from discovery.firsthour.guess import (
    CURRENTS,
    NEXT,
    TEMPERATURES,
    VOLTAGES,
    Guess,
    drives,
    evidence_of,
    guess,
    guessed,
)
from discovery.firsthour.measures import DEGREES, unit_in
from discovery.firsthour.odds import likely, probabilities
from discovery.firsthour.shapes import HELD, shape
from discovery.firsthour.table import Column
from discovery.firsthour.unitodds import temperature_odds
from discovery.firsthour.vocabulary import SET_POINT, fold, words_of
from discovery.recordings.correction import corrected_by_name
from discovery.recordings.valuecheck import below_zero

Array = NDArray[np.float64]
Hints = Mapping[str, Sequence[tuple[str, Mapping[str, float]]]]

_ONE_OF_SEVERAL = re.compile(r"\d+|(?<![^\W\d_])(d ?)?[xyz](?![^\W\d_])")
MOSTLY = 0.3  # share of a fluid temperature that loads and flows explain where they warm it
_ELSE = 0.8  # probability from which a correction without an error is something else
_CLEARLY = 0.2  # more: what answers to what
_PUSHES = ("torque", "current", "signal", "flow", "power", "speed")
_SAME = 10.0  # log odds that a set point has the quantity of what follows it
_MOVED = ("rotation speed", "fluid flow")  # may be set, or answer to what is
_OF_STEPS = 0.954  # median step of white noise over its standard deviation
_STEP, _CALM = 6.0, 1.3  # times the noise: a step of what is set, and the scatter between two steps


def guess_all(columns: Sequence[Column], hints: Hints | None = None) -> dict[str, Guess]:
    """Role and unit of each column by name, and which error a correction belongs to."""
    hints = hints or {}
    found = {column.name: evidence_of(column, hints.get(column.name, ())) for column in columns}
    for name, (reading, quantity) in _set_points(columns, found).items():
        found[name].add(f"the set point of {reading}", {quantity: _SAME})
    guesses = {
        column.name: guessed(
            column, found[column.name], [found[other.name] for other in _alike(column, columns)]
        )
        for column in columns
    }
    guesses = _one_scale(columns, guesses)
    guesses = _one_unit(columns, guesses)
    guesses = _the_fluid(_one_room(columns, _warmed_fluid(columns, guesses)))
    guesses = _corrections(columns, _signed(columns, _answers(columns, guesses)), found)
    return sensors_as_inputs(guesses)


def sensors_as_inputs(guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Where an error is measured, temperatures of the machine are inputs of it, unless a person said so."""
    found = dict(guesses)
    if any(one.role == "error" for one in guesses.values()):
        for name, one in guesses.items():
            if one.role == "temperature" and one.unit in DEGREES and not one.said:
                why = f"{one.why}; a sensor on the machine is an input of the errors"
                found[name] = replace(one, role=OTHER, why=why)
    return found


def _set_points(columns: Sequence[Column], found: Mapping[str, Evidence]) -> dict[str, tuple[str, str]]:
    """The reading that each set point belongs to by its name, and the quantity of both."""

    def plain(header: str) -> str:
        name, _ = unit_in(header) or (header, "")
        said = [word.said for word in words_of(name) if word.gloss == SET_POINT]
        return " ".join(word for word in fold(name).split() if word not in said)

    readings = {plain(c.header): c for c in columns if not is_set_point_word(c.header)}
    pairs = {c.name: readings.get(plain(c.header)) for c in columns if is_set_point_word(c.header)}
    return {name: (one.header, found[one.name].quantity()) for name, one in pairs.items() if one is not None}


def _alike(column: Column, columns: Sequence[Column]) -> list[Column]:
    """Columns of one unit whose names, and what explains them, differ in a number or an axis alone."""

    def kind(one: Column) -> tuple[str, ...]:
        return (*(_ONE_OF_SEVERAL.sub("#", fold(words)) for words in (one.header, one.about)), one.unit)

    return [other for other in columns if kind(other) == kind(column)]


def _one_scale(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Give all temperatures without a unit the same one: the unit of those that have one, else the
    likeliest.
    """
    found = dict(guesses)
    heat = [c for c in columns if guesses[c.name].role in TEMPERATURES]
    named = {guesses[c.name].unit for c in heat if c.unit}
    bare = [c for c in heat if not c.unit]
    if not bare:
        return found
    forms = {c.name: form for c in bare if (form := shape(c.values)) is not None}
    rooms = [f for n, f in forms.items() if guesses[n].role == TEMPERATURES[0]]
    odds = temperature_odds([f for n, f in forms.items() if guesses[n].role != TEMPERATURES[0]])
    for unit, value in temperature_odds(rooms, air=True).items():
        odds[unit] += value if rooms else 0.0
    for unit in named:
        odds[unit] = odds.get(unit, 0.0) + 3.0
    shares = probabilities(odds)
    unit, chance = likely(odds)
    for name in forms:
        form, one = forms[name], guesses[name]
        alone = temperature_odds([form], air=one.role == TEMPERATURES[0])
        if alone[unit] < max(alone.values()) - 8.0:  # one of several in kelvin
            continue
        why = f"{one.why.rpartition('; ')[0] or one.why}; {form.low:.4g} to {form.high:.4g} taken in {unit}"
        rivals = tuple((u, p) for u, p in shares.items() if u != unit and p > NEXT)
        found[name] = replace(one, unit=unit, unit_chance=chance, unit_rivals=rivals, why=why)
    return found


def _one_unit(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Loads that differ in their number alone have one unit, guessed from all their values; so has one
    that is never on that of its neighbour.
    """
    found = dict(guesses)
    bare = [column for column in columns if _is_load(guesses[column.name]) and not column.unit]
    for column in bare:
        alike = [c.values for c in bare if re.sub(r"\d", "", c.name) == re.sub(r"\d", "", column.name)]
        one, other = guesses[column.name], guess(replace(column, values=np.concatenate(alike)))
        if other.unit != one.unit and _is_load(other):
            why = f"{one.why}, but {other.unit} with those of its kind"
            found[column.name] = replace(one, unit=other.unit, unit_chance=other.unit_chance, why=why)
    on = {c.name: np.nan_to_num(c.values).any() for c in columns}
    units = [found[name].unit for name, one in found.items() if _is_load(one) and on[name]]
    for column in bare:
        if units and not on[column.name]:
            one = found[column.name]
            found[column.name] = replace(one, unit=units[0], why=f"{one.why}, in {units[0]} as the others")
    return found


def _is_load(one: Guess) -> bool:
    return one.role in ("heat load", "cooling power")


def _answers(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """What answers to what somebody sets is an output: an error that nothing warms, the voltage of a current
    that alone is set, and, where no error and no temperature is measured, whatever never holds its value.

    There, what a controller sends is no heat.
    """
    found = _unwarmed(guesses)
    holds = _holds([c for c in columns if found[c.name].role != "applied correction"])
    if any(one.role in TEMPERATURES or one.role == "error" for one in found.values()):
        return _voltage(found, holds)
    for name, one in found.items():
        if one.quantity == "signal" and one.role == "heat load" and not any(map(_is_heat, found.values())):
            found[name] = replace(one, role=OTHER, why=f"{one.why}; nothing here is heated")
    if True not in holds.values():  # all move: what pushes drives what moves
        pushes = [n for n, one in found.items() if one.quantity in _PUSHES and one.role in (OTHER, *_MOVED)]
        for name, one in found.items():
            if pushes and one.role == OTHER and one.quantity not in _PUSHES and holds.get(name) is False:
                found[name] = one.doubtful(f"taken to answer to {pushes[0]}", role="other output")
        return found if pushes else _explained(columns, found)
    for name, held in holds.items():
        if held is False and found[name].role in (OTHER, *_MOVED):
            why = "it never holds its value, so nobody sets it; nothing else is measured"
            found[name] = found[name].doubtful(why, role="other output")
    return found


def _explained(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """If nothing says which of several inputs is an output, then the one that the others explain clearly
    better than it and the rest explain them.
    """
    found = dict(guesses)
    values = {c.name: c.values for c in columns if guesses[c.name].role == OTHER and not guesses[c.name].said}
    shares = {
        name: explained_by(mine, [other for o, other in values.items() if o != name])
        for name, mine in values.items()
        if len(values) > 1
    }
    best, *rest = sorted(shares, key=lambda name: -shares[name]) or [""]
    if best and shares[best] > max(MOSTLY, shares[rest[0]] + _CLEARLY):
        why = f"the other columns explain {shares[best]:.0%} of it, and it {shares[rest[0]]:.0%} of them"
        found[best] = guesses[best].doubtful(why, role="other output")
    return found


def _is_heat(one: Guess) -> bool:
    return one.role == "heat load" and one.quantity != "signal"


def _unwarmed(guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """If nothing here warms, but a force, a flow or the like is recorded, a displacement is no thermal error:
    it may be the way of a mass on a spring, or the level of a tank.
    """
    found = dict(guesses)
    warm = drives({name: one for name, one in found.items() if one.unit not in VOLTAGES})
    thermal = warm or any(one.role in TEMPERATURES for one in found.values())
    pushed = [
        name
        for name, one in found.items()
        if (one.role == OTHER and one.unit not in ("1", *DEGREES)) or one.role == "fluid flow"
    ]
    if not thermal and pushed:
        for name, one in found.items():
            if one.role == "error" and not one.said:
                why = f"{one.why}; {pushed[0]} moves it, nothing warms it"
                found[name] = replace(one, role="other output", why=why)
    return found


def _voltage(guesses: Mapping[str, Guess], holds: Mapping[str, bool | None]) -> dict[str, Guess]:
    """If a current is set, a voltage is not, and nothing else drives, then the voltage answers, as that of a
    battery does.
    """
    found = dict(guesses)
    currents = [n for n, one in guesses.items() if one.unit in CURRENTS and holds.get(n)]
    voltages = [n for n, one in guesses.items() if one.unit in VOLTAGES and holds.get(n) is False]
    if currents == drives(guesses) and not any(one.role == "error" for one in guesses.values()):
        for name in voltages:
            why = f"it answers to {currents[0]}, which is set"
            found[name] = guesses[name].doubtful(why, role="other output")
    return found


def _holds(columns: Sequence[Column]) -> dict[str, bool | None]:
    """Whether each column holds its value between steps, so that somebody sets it. None: it never moves.

    Most readings repeat the one before; where this is so for no column, it counts up to the noise.
    """
    found = {c.name: _held(c.values) for c in columns}
    return found if True in found.values() else {c.name: _held_noisily(c.values) for c in columns}


def _held(values: Array) -> bool | None:
    known = values[np.isfinite(values)]
    if not known.size or known.min() == known.max():
        return None
    return bool(np.mean(np.diff(known) == 0) > HELD)


def _held_noisily(values: Array) -> bool | None:
    """Return whether readings scatter between steps no more than from one to the next. None: there is no
    step.
    """
    known = values[np.isfinite(values)]
    steps = np.abs(np.diff(known))
    noise = float(np.median(steps)) / _OF_STEPS if steps.size else 0.0
    if noise == 0.0:
        return _held(values)
    levels = np.split(known, np.flatnonzero(steps > _STEP * noise) + 1)
    inside = np.concatenate([level - level.mean() for level in levels])
    if float(np.sqrt(np.mean(inside**2))) > _CALM * noise:
        return False
    return True if len(levels) > 1 else None


def _air(column: Column) -> tuple[float, int]:
    """Return how clearly a column is the air around the machine. The smallest value is the clearest."""
    words = words_of(column.header)
    says = max((word.says.get("air", 0.0) for word in words), default=0.0)
    more = sum("air" not in word.says and word.gloss != "temp" for word in words)
    named = sum(len(word.said) for word in words)
    header, _ = unit_in(column.header) or (column.header, "")  # a unit is no further word
    rest = max(0, len(re.sub(r"[\W\d_]", "", fold(header))) - named)
    return -says, more + (rest > 0)


def _one_room(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Of several columns that may be the air around, the clearest is; the other rooms are what is measured.

    So are rooms if nothing else is measured.
    """
    air = {c.name: _air(c) for c in columns if guesses[c.name].role == "ambient temperature"}
    found = dict(guesses)
    if not air:
        return found
    clear = {name for name, (says, _) in air.items() if says <= -8.0}
    clearest = min(air, key=lambda name: air[name])
    measured = any(one.role in ("temperature", "error") for one in guesses.values())
    why = f"{clearest} is the air around"
    if (not measured and not clear and len(set(air.values())) == 1 and len(air) > 1) or (
        not measured and not clear and len(air) == 1
    ):
        clearest, why = "", "nothing else is measured"
    for name, (_, more) in air.items():
        if name in clear:
            continue
        if name != clearest:
            found[name] = guesses[name].doubtful(why, role="temperature")
        elif more:
            found[name] = guesses[name].doubtful("other words in its name may mean another place")
    return found


def _warmed_fluid(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """If no body and no error is measured, then the fluid that loads and flows explain is what is warmed, as
    that of a boiler. Another one is only brought along.
    """
    found = dict(guesses)
    if any(one.role in ("temperature", "error") for one in guesses.values()):
        return found
    values = {column.name: column.values for column in columns}
    drivers = [values[n] for n, one in guesses.items() if one.role in ("heat load", "fluid flow")]
    fluids = [n for n, one in guesses.items() if one.role in ("fluid temperature", "coolant temperature")]
    shares = {name: explained_by(values[name], drivers) for name in fluids} if drivers else {}
    warmed = max(shares, key=lambda name: shares[name], default="")
    if warmed and shares[warmed] > MOSTLY:
        why = f"loads and flows explain {shares[warmed]:.0%} of it, and nothing else is measured"
        found[warmed] = guesses[warmed].doubtful(why, role="temperature")
    return found


def _the_fluid(guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """If a flow is recorded, but no fluid temperature, then the only coolant is that fluid.

    Apart, the two would never meet: no convection to the fluid could be offered.
    """
    found = dict(guesses)
    flows, fluids, coolants = (
        [name for name, one in guesses.items() if one.role == role]
        for role in ("fluid flow", "fluid temperature", "coolant temperature")
    )
    if flows and not fluids and len(coolants) == 1:
        [name] = coolants
        why = f"assumed to be the fluid of {flows[0]}, as the file has no other"
        found[name] = guesses[name].doubtful(why, role="fluid temperature")
    return found


def _corrections(
    columns: Sequence[Column], guesses: Mapping[str, Guess], evidence: Mapping[str, Evidence]
) -> dict[str, Guess]:
    """Which error each applied correction belongs to; without an error it is an input like others, or the
    error itself.
    """
    found, stated = dict(guesses), {column.name: column.unit for column in columns}
    errors = [name for name, one in guesses.items() if one.role == "error"]
    corrections = [name for name, one in guesses.items() if one.role == "applied correction"]
    for name in corrections:
        one, error = guesses[name], corrected_by_name(name, errors, only=len(corrections) == 1)
        if not errors:  # what it is else
            others = {role: odds for role, odds in evidence[name].roles().items() if role != one.role}
            role, chance = likely(others)
            found[name] = one.doubtful(
                "but there is no error that it could correct", role=role if chance > _ELSE else OTHER
            )
        elif error is None:
            found[name] = one.doubtful(f'say which error it corrects: corrects = "{errors[0]}"')
        else:
            why = f"it is added to {error} (what was added to the position needs sign = -1)"
            unit = one.unit if stated[name] else guesses[error].unit
            found[name] = one.doubtful(why, unit=unit, corrects=error)
    return found


def _signed(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Mark heat loads with readings below zero: a discharge, a brake, or cooling."""
    found = dict(guesses)
    for column in columns:
        one, known = guesses[column.name], column.values[np.isfinite(column.values)]
        if one.role == "heat load" and (rows := below_zero(known)).size:
            found[column.name] = one.doubtful("below zero", below_zero=rows.size / known.size)
    return found
