"""What a column probably is: role and unit from its name and its values, with the reason."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.table import Column
from discovery.recordings.correction import corrected_by_name
from discovery.recordings.units import UnitError, conversion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Guess:
    """Role and unit of a column, and why; `sure` is False where a person should look."""

    role: str
    unit: str
    why: str
    sure: bool = True
    corrects: str | None = None  # of an applied correction


# words of a name -> role; the first match counts
_WORDS: tuple[tuple[str, str], ...] = (
    (r"corr(ection)?|comp(ensation)?|offset|applied", "applied correction"),
    (
        r"e [xyzabcr]\d?[0a-z]*|e[xyzabc]\d[abct]|error|dev(iation)?|displacement",
        "error",
    ),
    (r"probe|r test|growth|shift|drift", "error"),
    (r"eff(iciency)?|status|state|mode|fault|set ?point", "other input"),
    (r"nozzle.*(height|h)|h nozzle", "nozzle height"),
    (r"nozzle.*side|side.*nozzle", "nozzle side"),
    (r"(p|power|q|heat).*cool(ing|er)?|cool(ing|er)? *(power|p)|chiller *(power|p)", "cooling power"),
    (r"(t|temp(erature)?)? *(coolant|chiller|cool(er|ing)?)", "coolant temperature"),
    (
        r"(t|temp(erature)?)? *(fluid|emulsion|kss|sump|tank|cutting fluid)( *t(emp(erature)?)?)?$",
        "fluid temperature",
    ),
    (
        r"(t|temp(erature)?)? *"
        r"(amb(ient)?|env(ironment)?|room|air|hall|outside|outdoor|ext(ern(al)?)?|surroundings?|umgebung|raum)",
        "ambient temperature",
    ),
    (r"pump|flow|volume stream", "fluid flow"),
    (r"speed|rpm|spindle|n|rev(olution)?s?|drehzahl", "rotation speed"),
    (r"heater\w*|p|power|load|drive|torque|loss(es)?|q|heat|current|motor|leistung", "heat load"),
    (r"t|temp(erature)?s?|thermo(couple)?|pt\d*|tc\d*", "temperature"),
    (r"sensor|housing|bearing|plate|body|bed|table", "temperature"),
)
_ROLE_OF_UNIT = {
    "degC": "temperature",
    "degF": "temperature",
    "K": "temperature",
    "rpm": "rotation speed",
    "W": "heat load",
    "kW": "heat load",
    "um": "error",
    "um/m": "error",
    "l/min": "fluid flow",
}
_UNITS = {
    "°c": "degC",
    "c": "degC",
    "degc": "degC",
    "celsius": "degC",
    "deg c": "degC",
    "°f": "degF",
    "f": "degF",
    "degf": "degF",
    "fahrenheit": "degF",
    "deg f": "degF",
    "k": "K",
    "kelvin": "K",
    "%": "percent",
    "pct": "percent",
    "percent": "percent",
    "rpm": "rpm",
    "1/min": "rpm",
    "u/min": "rpm",
    "min-1": "rpm",
    "w": "W",
    "watt": "W",
    "kw": "kW",
    "um": "um",
    "µm": "um",
    "μm": "um",
    "micron": "um",
    "mm": "mm",
    "um/m": "um/m",
    "µm/m": "um/m",
    "l/min": "l/min",
    "lpm": "l/min",
    "a": "A",
    "v": "V",
    "-": "1",
    "1": "1",
}
_DEGREES = str.maketrans("º˚", "°°")  # what passes for the sign of degrees
_TEMPERATURES = ("ambient temperature", "fluid temperature", "coolant temperature", "temperature")
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
    guesses, stated = {column.name: guess(column) for column in columns}, {c.name: c.unit for c in columns}
    told = [g.unit for c, g in zip(columns, guesses.values(), strict=True) if _is_load(g) and c.values.any()]
    for column in columns:  # a load that is never on has the unit of its neighbour
        one = guesses[column.name]
        if told and _is_load(one) and not column.unit and not column.values.any():
            guesses[column.name] = replace(one, unit=told[0], why=f"{one.why}, in {told[0]} as the others")
    errors = [name for name, one in guesses.items() if one.role == "error"]
    corrections = [name for name, one in guesses.items() if one.role == "applied correction"]
    for name in corrections:
        one, error = guesses[name], corrected_by_name(name, errors, only=len(corrections) == 1)
        if not errors:
            why = f"{one.why}, but there is no error that it could correct"
            guesses[name] = replace(one, role="other input", why=why, sure=False)
        elif error is None:
            why = f'{one.why}; say which error it corrects: corrects = "{errors[0]}"'
            guesses[name] = replace(one, why=why, sure=False)
        else:
            why = f"{one.why}; it is added to {error} (what was added to the position needs sign = -1)"
            unit = one.unit if stated[name] else guesses[error].unit
            guesses[name] = replace(one, unit=unit, why=why, sure=False, corrects=error)
    if errors and not drives(guesses):
        for name, one in guesses.items():
            if one.role == "temperature" and one.unit in ("degC", "K"):
                why = f"{one.why}; an input of the errors, since nothing else says what heats the machine"
                guesses[name] = replace(one, role="other input", why=why, sure=False)
    return guesses


def drives(guesses: Mapping[str, Guess]) -> list[str]:
    """What warms a machine: its heat loads; where none is recorded, its currents and speeds."""
    loads = [name for name, one in guesses.items() if one.role == "heat load"]
    likely = [n for n, one in guesses.items() if one.role == "rotation speed" or one.unit == "A"]
    return loads or likely


def guess(column: Column) -> Guess:
    """Role and unit of a column."""
    spelled = column.unit.strip().translate(_DEGREES)
    named = _UNITS.get(spelled.lower())
    role, why = _role(column, named)
    if named:
        if role in _TEMPERATURES and named not in ("degC", "degF", "K"):
            role, why = "other input", f"the unit {column.unit} is none of a temperature"
        return Guess(role, named, f"{why}; the header says {column.unit}", role != "other input")
    if not spelled:
        return _by_values(role, why, column.values)
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


def _role(column: Column, unit: str | None) -> tuple[str, str]:
    words = re.sub(r"[\W_]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", column.name)).lower().strip()
    spaced = re.sub(r"(?<=[a-z])(?=\d)", " ", words)
    for pattern, role in _WORDS:
        found = re.search(rf"(?<![a-z0-9])(?:{pattern})(?![a-z])", words) or re.search(
            rf"(?<![a-z0-9])(?:{pattern})(?![a-z])", spaced
        )
        if found and (unit is None or _fits(unit, role)):
            return role, f"'{found[0].strip()}' in its name"
    if unit in _ROLE_OF_UNIT:
        return _ROLE_OF_UNIT[unit], "by its unit"
    return "other input", "nothing in its name says what it is"


def _fits(unit: str, role: str) -> bool:
    if role in _TEMPERATURES:
        return unit in ("degC", "degF", "K")
    if role in ("error", "applied correction"):
        return unit in ("um", "mm", "um/m")
    if role in ("heat load", "cooling power"):
        return unit in ("W", "kW", "percent", "1")
    if role == "rotation speed":
        return unit == "rpm"
    return unit not in ("degC", "degF", "K")


def _by_values(role: str, why: str, values: Array) -> Guess:
    known = values[np.isfinite(values)]
    if not len(known):
        return Guess(role, _USUAL.get(role, "1"), f"{why}; it holds no value", sure=False)
    low, high, first = float(known.min()), float(known.max()), float(known[0])
    span = f"from {low:.4g} to {high:.4g}"
    if role in _TEMPERATURES:
        if low > 200:
            return Guess(role, "K", f"{why}; values {span} can only be kelvin")
        if low > _ROOM_F[0] - 5 and _ROOM_F[0] <= first <= _ROOM_F[1]:
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
        return Guess(role, "W", f"{why}; values {span} taken as watts", sure=False)
    if role == "fluid flow":
        return Guess(role, "1" if high <= 1 else "l/min", f"{why}; values {span}", sure=high <= 1)
    if role in _USUAL:
        return Guess(role, _USUAL[role], f"{why}; {_USUAL[role]} is usual", sure=False)
    return Guess(role, "1", why, sure=False)
