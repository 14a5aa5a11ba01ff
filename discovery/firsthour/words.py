"""What the name of a column says: its role, whether it is a set point, how clearly it is the room."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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
    (r"pump|flow|volume stream", "fluid flow"),  # before the coolant that flows
    (r"(t|temp(erature)?)? *(coolant|chiller|cool(er|ing)?)", "coolant temperature"),
    (
        r"(t|temp(erature)?)? *(fluid|emulsion|kss|sump|tank|cutting fluid)( *t(emp(erature)?)?)?$",
        "fluid temperature",
    ),
    (
        r"(t|temp(erature)?)? *"
        r"(amb(ient)?|env(ironment)?|outside|outdoors?|ext(ern(al)?)?|surroundings?|(umgebung|au(ss|ß)en)(s?(luft)?temp(eratur)?)?)",
        "ambient temperature",
    ),
    (r"ta|(t|temp(erature)?)? *(air|hall|room|raum(temperatur)?)", "ambient temperature"),
    (r"speed|rpm|spindle|n|rev(olution)?s?|drehzahl", "rotation speed"),
    (
        r"heater\w*|p|ph(?= ?\d)|power|load|drive|torque|loss(es)?|q|heat(ing)?|"
        r"heizung|current|motor|leistung",
        "heat load",
    ),
    (r"t|ti|temp(erature)?s?|\w*temperatur(en)?|thermo(couple)?|pt\d*|tc\d*|indoors?", "temperature"),
    (r"sensor|housing|bearing|plate|body|bed|table", "temperature"),
)
# what a controller sends to a heater: a share of full power, or the steps of a pulse width
_SHARE = r"duty( ?cycle)?|pwm|ssr|control(ler)?|valve|stell\w*|u"
_STEPS = 255.0  # of a pulse width
# what warms with its square; such a word at the end, "current step" is no current
_ELECTRIC = (
    (r"(current|strom)( ?[a-z]? ?\d*)?$", "A"),
    (r"(volts?|voltage|spannung)( ?[a-z]? ?\d*)?$", "V"),
)
_SET_POINT = r"set ?points?|set|targets?|soll(wert)?"
_SET_POINT_ALONE = r"sp( ?\d+)?|sp temp(erature)?|temp(erature)? sp"
_TEMPERATURE = r"t(?![a-z])|(.* )?(temp(erature)?s?|\w*temperatur(en)?)( |$)"
# how clearly a column is the temperature around the machine; a room may be what is measured
_SURROUNDINGS = (
    r"amb(ient)?|env(ironment)?|outside|outdoors?|ext(ern(al)?)?|surroundings?|(umgebung|au(ss|ß)en)(s?(luft)?temp(eratur)?)?",
    r"ta",
    r"air|hall",
    r"room|raum(temperatur)?",
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
CURRENTS, VOLTAGES = ("A", "mA", "kA"), ("V", "mV", "kV")
DEGREES = ("degC", "degF", "K")
TEMPERATURES = ("ambient temperature", "fluid temperature", "coolant temperature", "temperature")


A_ROOM = 2  # the first of `_SURROUNDINGS` that may be what is measured


@dataclass(frozen=True)
class Named:
    """What the name of a column says; `sure` is False where the word is a weak one."""

    role: str
    why: str
    sure: bool = True


def plain(name: str) -> str:
    """A name in small letters, its words apart: "DutyCycle_1" is "duty cycle 1"."""
    return re.sub(r"[\W_]+", " ", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)).lower().strip()


def unit_of(written: str) -> tuple[str, str | None]:
    """A unit as it is written, mended where loggers leave out a sign (W/m2), and as a known one, or None."""
    spelled = written.strip().translate(_DEGREES)
    return re.sub(r"(?<=[a-zA-Z])(?=[2-4](?!\w))", "**", spelled), _UNITS.get(spelled.lower())


def role_of(name: str, unit: str | None, values: Array) -> Named:
    """Role of a column and why. `unit`: a known one, or None."""
    words = plain(name)
    # a name that says temperature is that of no power or speed, whatever else stands in it
    limits = "degC" if unit is None and re.match(_TEMPERATURE, words) else unit
    for pattern, role in _WORDS:
        found = _found(pattern, words)
        if found and (limits is None or _fits(limits, role)):
            return Named(role, f"'{_spelled(found, name)}' in its name")
    if unit in _ROLE_OF_UNIT:
        return Named(_ROLE_OF_UNIT[unit], "by its unit")
    if share := _share(words, limits, values):
        return Named(
            "heat load", f"'{_spelled(share, name)}' in its name, as of what goes to a heater", sure=False
        )
    return Named("other input", "nothing in its name says what it is")


def electric(name: str) -> str:
    """A or V where the name is that of a current or a voltage, or ""."""
    words = plain(name)
    if re.fullmatch(r"v ?\d*", words):
        return "V"
    return next((unit for form, unit in _ELECTRIC if re.search(rf"(?<![a-z]){form}", words)), "")


def is_set_point(name: str, unit: str | None, values: Array) -> bool:
    """Whether a column is the temperature that a controller is told to hold: no measurement."""
    words = plain(name)
    if re.fullmatch(_SET_POINT_ALONE, words):
        return unit is None or unit in DEGREES
    if not (found := _found(_SET_POINT, words)):
        return False
    if unit:
        return unit in DEGREES
    rest = re.sub(r"[\d ]+", " ", words.replace(found, " ")).strip()
    return not rest or role_of(rest, None, values).role in TEMPERATURES


def surroundings(name: str) -> tuple[int, int]:
    """How clearly a column is the temperature around the machine, the clearest is (0, 0)."""
    words = plain(name)
    for rank, pattern in enumerate(_SURROUNDINGS):
        if found := _found(pattern, words):
            rest = re.sub(rf"\b(t|temp(erature)?|{re.escape(found)})\b|\d", " ", words)
            return rank, len(rest.split())
    return len(_SURROUNDINGS), 0


def _found(pattern: str, words: str) -> str:
    """The word of a name that a pattern finds, also where its number stands apart, or ""."""
    whole = rf"(?<![a-z0-9])(?:{pattern})(?![a-z])"
    spaced = re.sub(r"(?<=[a-z])(?=\d)", " ", words)
    found = re.search(whole, words) or re.search(whole, spaced)
    return found[0].strip() if found else ""


def _spelled(found: str, name: str) -> str:
    """What was found in small letters, as the name spells it."""
    spelled = re.search(r"[\W_]*".join(map(re.escape, found.split())), name, re.IGNORECASE)
    return spelled[0] if spelled else found


def _share(words: str, unit: str | None, values: Array) -> str:
    if unit == "percent":
        return _found(f"{_SHARE}|output", words)  # without a unit, an output is anything
    known = values[np.isfinite(values)]
    fits = bool(known.size) and known.min() >= -1e-9 and known.max() <= _STEPS
    return _found(_SHARE, words) if fits and unit in (None, "1") else ""


def _fits(unit: str, role: str) -> bool:
    if role in TEMPERATURES:
        return unit in DEGREES
    if role in ("error", "applied correction"):
        return unit in ("um", "mm", "um/m")
    if role in ("heat load", "cooling power"):
        return unit in ("W", "kW", "percent", "1")
    if role == "rotation speed":
        return unit == "rpm"
    if role == "fluid flow":
        return unit in ("l/min", "percent", "1")
    return unit not in DEGREES
