"""Units are met here and nowhere else: values leave as plain floats in the canonical unit of their role.

Canonical: degC, rpm, W, mm, um, um/m, l/min, 1. A heat load or cooling power without dimension (a heater in
percent) and an "other input" keep the unit they have.
"""

import math
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from discovery.recordings.commonunits import parts
from discovery.recordings.roles import ROLES

if TYPE_CHECKING:
    import pint

# Names, products, quotients and powers of one digit (and a fraction): pint would compute 9**9**9**9 for as
# long as it takes.
_POWER = r"(\*\*|\^)\s?-?\d(\.\d{1,6})?(?!\s*(\*\*|\^|[\d.]))"
_SPELLING = re.compile(rf"1?([^\W\d]|[/*() %°·²³⁻¹]|{_POWER}|(?<=[/(*])1(?![\d.]))*")
# a factor: 2.5, 1e-3, 1/10, with or without a sign of multiplication on either side; then a unit
_MULTIPLE = re.compile(
    r"[x×*·]?\s*(\d{1,12}(?:[.,]\d{1,12})?(?:[eE][-+]?\d{1,3})?|1/1\d{1,12}|10\^[-+]?\d{1,2})\s*[x×*·]?\s*((?!\d)[\w°%].{0,99})"
)
_FAHRENHEIT = ("degF", "°F", "degree_Fahrenheit", "fahrenheit")
_LONGEST = 100  # letters; the coefficient of a product of several inputs has a long one
_MISTAKEN = {"C": "degC", "c": "degC", "F": "degF", "u/min": "rpm", "U/min": "rpm", "µ": "um", "l/m": "l/min"}


class UnitError(ValueError):
    """A unit that is unknown or cannot belong to the role; the text says which are allowed."""


@dataclass(frozen=True)
class Conversion:
    """canonical value = factor * value + offset; a difference (noise, spread) takes the factor alone."""

    unit: str
    factor: float = 1.0
    offset: float = 0.0


@lru_cache(maxsize=256)
def conversion(unit: str, role: str) -> Conversion:
    """How values in `unit`, a unit or a multiple of one, become the canonical unit of `role`.

    Raises UnitError: unknown to pint, or of a dimension that the role does not have.

    >>> conversion("kW", "heat load")
    Conversion(unit='W', factor=1000.0, offset=0.0)
    >>> conversion("2.5 um", "error")
    Conversion(unit='um', factor=2.5, offset=0.0)
    >>> conversion("1/min", "rotation speed")
    Conversion(unit='rpm', factor=1.0, offset=0.0)
    >>> conversion("degF", "other input").unit, conversion("K", "other input").unit
    ('degC', 'K')
    """
    if (steps := multiple(unit)) is not None:
        one = conversion(steps[1], role)
        return Conversion(one.unit, steps[0] * one.factor, one.offset)
    facts = ROLES[role]
    if not facts.units and unit in _FAHRENHEIT:  # a temperature in any role
        return _affine(parse_unit(unit), "degC")
    if unit in facts.units or (not facts.units and parts(unit) is not None):
        return Conversion(unit)
    if facts.plain and unit in ("1", "percent", "%"):
        return Conversion("1" if unit == "1" else "percent")
    try:
        given = parse_unit(unit)
    except ValueError:
        raise UnitError(f"the unit '{unit}' is not known; {_allowed(unit, role)}") from None
    if not facts.units or (facts.plain and given.dimensionless):
        return Conversion(unit)
    if role == "rotation speed":
        given = _per_revolution(given)
    try:
        canonical = next(name for name in facts.units if given.is_compatible_with(_pint(name)))
        return _affine(given, canonical)
    except Exception:  # no canonical unit of this dimension, or a difference of temperatures
        if facts.open:
            return Conversion(unit)
        problem = f"the unit '{unit}' cannot be that of a channel of role '{role}'"
        raise UnitError(f"{problem}; {_allowed(unit, role)}") from None


def multiple(unit: str) -> tuple[float, str] | None:
    """Factor and unit of a multiple of a unit, as counters step and loggers scale; None for anything else.

    >>> multiple("2.5 um"), multiple("x10 mV"), multiple("1/10 degC"), multiple("0,1 °C"), multiple("1/min")
    ((2.5, 'um'), (10.0, 'mV'), (0.1, 'degC'), (0.1, '°C'), None)
    """
    found = _MULTIPLE.fullmatch(unit.strip())
    if found is None or len(unit) > _LONGEST:
        return None
    over, _, under = found[1].replace(",", ".").replace("10^", "1e").partition("/")
    factor = float(over) / float(under or 1.0)
    return (factor, found[2]) if 0.0 < factor < math.inf else None


def _affine(given: "pint.Unit", canonical: str) -> Conversion:
    def convert(value: float) -> float:
        return float(_registry().Quantity(value, given).to(_pint(canonical)).magnitude)

    offset = convert(0.0)
    if offset == 0.0:
        return Conversion(canonical, convert(1.0))
    # rounded: 0 degF is 255.372222... K on the way, and the last digits get lost there
    factor = (convert(1000.0) - offset) / 1000.0
    return Conversion(canonical, float(f"{factor:.12g}"), float(f"{offset:.12g}"))


def _per_revolution(given: "pint.Unit") -> "pint.Unit":
    """Return the unit of a rotation: 1/min and Hz count revolutions, pint would count radians."""
    angles = ("radian", "degree", "revolution", "turn", "grade")
    turns = any(angle in str(name) for name in given._units for angle in angles)
    return given if turns else given * _registry().Unit("revolution")


@lru_cache(maxsize=512)
def parse_unit(unit: str) -> "pint.Unit":
    """The unit of a text, as pint knows it; a mil is that of a machine tool, not the angle.

    Raises ValueError: pint does not know it, or it might never end.
    """
    unit = re.sub(r"(?<=[a-zA-Z])(?=[2-4](?!\w))", "**", re.sub(r"\bmils?\b", "thou", unit))  # W/m2
    if not unit or len(unit) > _LONGEST or not _SPELLING.fullmatch(unit):
        raise ValueError(unit)
    try:
        given: pint.Unit = _registry().Unit(_pint(unit))
    except Exception:  # pint's parser fails in many ways: tokens, recursion, attributes, division by zero
        raise ValueError(unit) from None
    return given


def short(name: str) -> str:
    """A unit as written.

    >>> short("kilowatt"), short("degree_Fahrenheit")
    ('kW', 'degF')
    """
    spelt = f"{parse_unit(name):~}"
    return spelt.replace("Δ", "delta_").replace("°", "deg").replace("µ", "u")


def _pint(unit: str) -> str:
    return "dimensionless" if unit == "1" else unit


def _allowed(unit: str, role: str) -> str:
    facts = ROLES[role]
    names = f"{facts.said}, or what converts to it" if facts.units else "any unit that pint knows"
    if unit in _MISTAKEN:
        return f"did you mean '{_MISTAKEN[unit]}'? Allowed is {names}"
    return f"allowed is {names}"


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry()
