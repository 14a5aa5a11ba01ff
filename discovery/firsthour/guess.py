"""What a column probably is: role and unit from its name and its values, with the reason."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.table import Column
from discovery.firsthour.words import (
    A_ROOM,
    CURRENTS,
    DEGREES,
    TEMPERATURES,
    VOLTAGES,
    Named,
    electric,
    role_of,
    surroundings,
    unit_of,
)
from discovery.recordings.correction import corrected_by_name
from discovery.recordings.units import UnitError, conversion
from discovery.recordings.valuecheck import below_zero

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Guess:
    """Role and unit of a column, and why; `sure` is False where a person should look."""

    role: str
    unit: str
    why: str
    sure: bool = True
    corrects: str | None = None  # of an applied correction
    below_zero: float = 0.0  # of a heat load: the share of its readings


_USUAL = {
    "rotation speed": "rpm",
    "error": "um",
    "applied correction": "um",
    "nozzle height": "mm",
    "nozzle side": "1",
}
_ROOM_F = (55.0, 100.0)  # a machine starts near room temperature: 13 to 38 degC


def guess_all(columns: Sequence[Column]) -> dict[str, Guess]:
    """Role and unit of each column by name, and which error a correction belongs to."""
    fahrenheit = _fahrenheit(columns)
    guesses = {column.name: guess(column, fahrenheit=fahrenheit) for column in columns}
    stated, on = {c.name: c.unit for c in columns}, {c.name: np.nan_to_num(c.values).any() for c in columns}
    told = [one.unit for name, one in guesses.items() if _is_load(one) and on[name]]
    for name, one in guesses.items():  # a load that is never on has the unit of its neighbour
        if told and _is_load(one) and not stated[name] and not on[name]:
            guesses[name] = replace(one, unit=told[0], why=f"{one.why}, in {told[0]} as the others")
    guesses = _signed(columns, _the_fluid(_one_room(_one_unit(columns, guesses))))
    guesses = _corrections(columns, guesses)
    if any(one.role == "error" for one in guesses.values()) and not _stated(guesses):
        for name, one in guesses.items():
            if one.role == "temperature" and one.unit in DEGREES:
                why = f"{one.why}; an input of the errors, since nothing else says what heats the machine"
                guesses[name] = replace(one, role="other input", why=why, sure=False)
    return guesses


def drives(guesses: Mapping[str, Guess]) -> list[str]:
    """What warms a machine: its heat loads, else its currents and speeds, else its voltages."""
    return _stated(guesses) or [name for name, one in guesses.items() if one.unit in VOLTAGES]


def _stated(guesses: Mapping[str, Guess]) -> list[str]:
    loads = [name for name, one in guesses.items() if one.role == "heat load"]
    likely = [n for n, one in guesses.items() if one.role == "rotation speed" or one.unit in CURRENTS]
    return loads or likely


def guess(column: Column, *, fahrenheit: bool = False) -> Guess:
    """Role and unit of a column. `fahrenheit`: other columns speak for it."""
    spelled, named = unit_of(column.unit)
    name = role_of(column.name, named, column.values)
    role, why = name.role, name.why
    if named:
        if role in TEMPERATURES and named not in DEGREES:
            role, why = "other input", f"the unit {column.unit} is none of a temperature"
        return Guess(
            role, named, f"{why}; the header says {column.unit}", name.sure and role != "other input"
        )
    if not spelled and role in ("heat load", "other input") and (unit := electric(column.name)):
        word = {"A": "current", "V": "voltage"}[unit]
        return Guess(
            "other input", unit, f"a {word} by its name, taken in {unit}; its square warms", sure=False
        )
    if not spelled:
        return _by_values(name, column.values, fahrenheit=fahrenheit)
    # a unit that the role cannot have is worth more than the word that suggested the role
    for likely in dict.fromkeys((role, "other input")):
        if _known(spelled, likely):
            return Guess(
                likely, spelled, f"{why}; the header says {spelled}, which was left as it is", sure=False
            )
    return Guess(
        "other input", "1", f"{why}; the header says {column.unit}, which is no known unit", sure=False
    )


def _is_load(one: Guess) -> bool:
    return one.role in ("heat load", "cooling power")


def _known(unit: str, role: str) -> bool:
    try:
        conversion(unit, role)
    except UnitError:
        return False
    return True


def _one_room(guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Of several columns that may be the air around, the clearest is; the other rooms are what is measured.

    So are rooms beside which nothing else is measured.
    """
    air = {name: surroundings(name) for name, one in guesses.items() if one.role == "ambient temperature"}
    found = dict(guesses)
    if not air:
        return found
    clearest = min(air, key=lambda name: air[name])
    measured = any(one.role in ("temperature", "error") for one in guesses.values())
    all_alike = len(set(air.values())) == 1
    why = f"{clearest} is the air around"
    if not measured and all_alike and air[clearest][0] >= A_ROOM:
        clearest, why = "", "nothing else is measured"
    for name, (rank, more_words) in air.items():
        one = guesses[name]
        if name != clearest and rank > 0:
            found[name] = replace(one, role="temperature", why=f"{one.why}; {why}", sure=False)
        elif rank > 0:
            found[name] = replace(one, sure=one.sure and rank >= A_ROOM and not more_words)
    return found


def _the_fluid(guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Where a flow is recorded and no temperature of a fluid, the one coolant is that fluid.

    Apart, the two would never meet: no convection to the fluid could be offered.
    """
    found = dict(guesses)
    flows, fluids, coolants = (
        [name for name, one in guesses.items() if one.role == role]
        for role in ("fluid flow", "fluid temperature", "coolant temperature")
    )
    if flows and not fluids and len(coolants) == 1:
        [name] = coolants
        why = f"{guesses[name].why}; taken for the fluid of {flows[0]}, as the file has no other"
        found[name] = replace(guesses[name], role="fluid temperature", why=why, sure=False)
    return found


def _corrections(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Which error each applied correction belongs to; without an error it is an input like others."""
    found, stated = dict(guesses), {column.name: column.unit for column in columns}
    errors = [name for name, one in guesses.items() if one.role == "error"]
    corrections = [name for name, one in guesses.items() if one.role == "applied correction"]
    for name in corrections:
        one, error = guesses[name], corrected_by_name(name, errors, only=len(corrections) == 1)
        if not errors:
            why = f"{one.why}, but there is no error that it could correct"
            found[name] = replace(one, role="other input", why=why, sure=False)
        elif error is None:
            why = f'{one.why}; say which error it corrects: corrects = "{errors[0]}"'
            found[name] = replace(one, why=why, sure=False)
        else:
            why = f"{one.why}; it is added to {error} (what was added to the position needs sign = -1)"
            unit = one.unit if stated[name] else guesses[error].unit
            found[name] = replace(one, unit=unit, why=why, sure=False, corrects=error)
    return found


def _signed(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Heat loads with readings below zero: a discharge, a brake, or heat that is taken away."""
    found = dict(guesses)
    for column in columns:
        one, known = guesses[column.name], column.values[np.isfinite(column.values)]
        if one.role == "heat load" and (rows := below_zero(known)).size:
            share = rows.size / known.size
            found[column.name] = replace(one, why=f"{one.why}; below zero", sure=False, below_zero=share)
    return found


def _one_unit(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> dict[str, Guess]:
    """Loads that differ in their number alone have one unit, guessed from all their values."""
    found = dict(guesses)
    bare = [column for column in columns if _is_load(guesses[column.name]) and not column.unit]
    for column in bare:
        alike = [c.values for c in bare if re.sub(r"\d", "", c.name) == re.sub(r"\d", "", column.name)]
        one, unit = guesses[column.name], guess(replace(column, values=np.concatenate(alike))).unit
        if unit != one.unit:
            found[column.name] = replace(one, unit=unit, why=f"{one.why}, but {unit} with those of its kind")
    return found


def _fahrenheit(columns: Sequence[Column]) -> bool:
    """Whether columns without a unit are in Fahrenheit: another says so, or several start like a room in it.

    One that starts at 60 may as well be an oven in degrees Celsius.
    """
    units = {c.name: unit_of(c.unit)[1] for c in columns}
    if any(unit in DEGREES for unit in units.values()):
        return "degF" in units.values()
    bare = [c.values for c in columns if not c.unit and role_of(c.name, None, c.values).role in TEMPERATURES]
    known = [values[np.isfinite(values)] for values in bare if np.isfinite(values).any()]
    return sum(map(_may_be_f, known)) > 1 and all(values.min() > _ROOM_F[0] - 5 for values in known)


def _may_be_f(known: Array) -> bool:
    """Whether readings start like a room in Fahrenheit and stay above one."""
    return bool(known.min() > _ROOM_F[0] - 5 and _ROOM_F[0] <= known[0] <= _ROOM_F[1])


def _by_values(name: Named, values: Array, *, fahrenheit: bool) -> Guess:
    role, why = name.role, name.why
    known = values[np.isfinite(values)]
    if not len(known):
        return Guess(role, _USUAL.get(role, "1"), f"{why}; it holds no value", sure=False)
    low, high, first = float(known.min()), float(known.max()), float(known[0])
    span = f"from {low:.4g} to {high:.4g}"
    if role in TEMPERATURES:
        if low > 200:
            return Guess(role, "K", f"{why}; values {span} can only be kelvin")
        # no air around a machine is at 70 degrees Celsius
        if _may_be_f(known) and (fahrenheit or role == "ambient temperature"):
            return Guess(
                role,
                "degF",
                f"{why}; values {span}, starting at {first:.3g}: a room in Fahrenheit",
                sure=False,
            )
        return Guess(role, "degC", f"{why}; values {span} look like degrees Celsius", sure=False)
    if role in ("heat load", "cooling power"):
        if low >= -1e-9 and 10 < high <= 100:
            return Guess(role, "percent", f"{why}; values {span} look like percent", sure=False)
        if np.isin(known, (0.0, 1.0)).all() or not name.sure:
            return Guess(role, "1", f"{why}; values {span} taken as steps or a switch", sure=False)
        return Guess(role, "W", f"{why}; values {span} taken as watts", sure=False)
    if role == "fluid flow":
        on_off = bool(np.isin(known, (0.0, 1.0)).all())
        return Guess(role, "1" if high <= 1 else "l/min", f"{why}; values {span}", sure=on_off)
    if role in _USUAL:
        return Guess(role, _USUAL[role], f"{why}; {_USUAL[role]} is usual", sure=False)
    return Guess(role, "1", why, sure=False)
