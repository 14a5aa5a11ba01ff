"""Units of a model as numbers that can be compared: dimension, and what one of it is in SI."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from discovery.recordings.commonunits import FACTS, SIZE, parts
from discovery.recordings.units import parse_unit

# Exponents of the base quantities, and the decimal logarithm of the unit in SI; None: a wildcard.
Dimension = Mapping[str, float] | None
_TURNS = ("revolutions_per_minute", "revolution", "turn", "radian", "degree")
_CLOSE = 1e-6
# Units that a sentence begins with
_LEADS = ("", "W", "W**2", "J", "um", "mm", "rpm", "l/min", "V", "N", "Pa")
_SI = {
    "[length]": "m",
    "[mass]": "kg",
    "[time]": "s",
    "[temperature]": "K",
    "[current]": "A",
    "[angle]": "rad",
}


@lru_cache(maxsize=512)
def dimension(unit: str) -> Dimension:
    """Dimension and size of a unit; None where it is not known.

    An angle counts as a dimension (rpm is not 1/s), a temperature as a difference (degC is K).

    >>> dimension("kW/K") == {**dimension("W/K"), SIZE: 3.0}
    True
    """
    if unit == "" or not known(unit):
        return None
    found: dict[str, float] = {}
    for name, power in atoms(unit).items():
        for base, n in of_atom(name).items():
            found[base] = found.get(base, 0.0) + power * n
    return times(found, 1.0)


def known(unit: str) -> bool:
    """Whether a unit has a meaning; an empty one is a wildcard."""
    if parts(unit or "1") is not None:
        return True
    try:
        parse_unit(unit)
    except ValueError:
        return False
    return True


def atoms(unit: str) -> dict[str, float]:
    """The units that a known unit is made of, by pint's names, with their exponents."""
    if (common := parts(unit)) is not None:
        return common
    of: Mapping[str, Any] = parse_unit(unit)._units
    return {str(name): float(power) for name, power in of.items()}


@lru_cache(maxsize=512)
def of_atom(atom: str) -> dict[str, float]:
    """Dimension and size of one of the units that `atoms` gives."""
    if atom in FACTS:
        return times(FACTS[atom], 1.0)
    difference = f"delta_{atom}" if atom in ("degree_Celsius", "degree_Fahrenheit") else atom
    parsed: Any = parse_unit(difference)
    found = {str(base): float(n) for base, n in parsed.dimensionality.items()}
    if atom in _TURNS:  # pint holds turns for pure numbers
        found["[angle]"] = 1.0
    return times(found | {SIZE: math.log10((1.0 * parsed).to_base_units().magnitude)}, 1.0)


def times(a: Mapping[str, float], power: float) -> dict[str, float]:
    """A dimension to a power; what vanishes is left out."""
    return {base: round(power * n, 9) for base, n in a.items() if abs(power * n) > 1e-9}


def plain(a: Mapping[str, float]) -> dict[str, float]:
    """The dimension alone."""
    return {base: n for base, n in a.items() if base != SIZE}


def ratio(a: Mapping[str, float], b: Mapping[str, float]) -> float | None:
    """How many of b one of a is, exactly 1 within rounding; None where they measure different things."""
    if plain(a) != plain(b):
        return None
    apart = a.get(SIZE, 0.0) - b.get(SIZE, 0.0)
    return 1.0 if abs(apart) < _CLOSE else float(10.0**apart)


def same_dimension(first: str, other: str) -> bool:
    """Whether two units measure the same quantity; False for a unit that is not known."""
    a, b = dimension(first), dimension(other)
    return a is not None and b is not None and plain(a) == plain(b)


def differences(unit: str) -> str:
    """The unit of a difference: K for degC.

    >>> differences("degC"), differences("W/degC"), differences("delta_degF/s")
    ('K', 'W/K', 'delta_degF/s')
    """
    bare = unit.replace("delta_deg", "deg")
    return bare.replace("degC", "K").replace("degF", "delta_degF")


def per(unit: str) -> str:
    """What stands behind a unit that is per another one.

    >>> per("K"), per("1"), per("l/min")
    ('/K', '', '/(l/min)')
    """
    return "" if unit == "1" else f"/({unit})" if set("/* ") & set(unit) else f"/{unit}"


def spell(measured: Dimension, exact: bool = False) -> str:
    """A dimension as a unit, with the fewest parts; `exact`: of that size, too, or nothing.

    >>> spell(dimension("W*K")), spell(dimension("kW/m**2")), spell({})
    ('W*K', 'W/m**2', 'a pure number')
    """
    if not measured or not plain(measured):
        return "a pure number"
    found = []
    for k, lead in enumerate(_LEADS):
        rest = dict(measured)
        for base, n in (dimension(lead) or {}).items():
            rest[base] = rest.get(base, 0.0) - n
        rest = times(rest, 1.0)
        if not exact or abs(rest.get(SIZE, 0.0)) < _CLOSE:
            parts = [(_SI.get(base, base), n) for base, n in plain(rest).items()]
            parts = sorted(parts, key=lambda p: -p[1])
            found.append((bool(lead) + sum(abs(n) for _, n in parts), k, parts))
    if not found:
        return ""
    _, k, parts = min(found)
    above = "*".join([*filter(None, [_LEADS[k]]), *(_power(unit, n) for unit, n in parts if n > 0)])
    return "/".join([above or "1", *(_power(unit, -n) for unit, n in parts if n < 0)])


def _power(unit: str, n: float) -> str:
    return unit if n == 1 else f"{unit}**{n:g}"
