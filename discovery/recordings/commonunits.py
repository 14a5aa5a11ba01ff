"""Units that stand in almost every file, and products of them, without a look into pint's tables, which take
a third of a second to load. The names, dimensions and sizes are those of pint: a test compares each.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from types import MappingProxyType

SIZE = "size"  # decimal logarithm of a unit in SI

_LENGTH = {"[length]": 1.0}
_TIME = {"[time]": 1.0}
_MASS = {"[mass]": 1.0}
_HEAT = {"[mass]": 1.0, "[length]": 2.0, "[time]": -2.0}
_POWER = {"[mass]": 1.0, "[length]": 2.0, "[time]": -3.0}
_VOLUME = {"[length]": 3.0}
_DEGREES = {"[temperature]": 1.0}

# spelling: pint's name, dimension, size in SI
_UNITS: dict[str, tuple[str, Mapping[str, float], float]] = {
    "percent": ("percent", {}, 1e-2),
    "%": ("percent", {}, 1e-2),
    "degC": ("degree_Celsius", _DEGREES, 1.0),
    "K": ("kelvin", _DEGREES, 1.0),
    "W": ("watt", _POWER, 1.0),
    "kW": ("kilowatt", _POWER, 1e3),
    "J": ("joule", _HEAT, 1.0),
    "kJ": ("kilojoule", _HEAT, 1e3),
    "kg": ("kilogram", _MASS, 1.0),
    "g": ("gram", _MASS, 1e-3),
    "m": ("meter", _LENGTH, 1.0),
    "mm": ("millimeter", _LENGTH, 1e-3),
    "um": ("micrometer", _LENGTH, 1e-6),
    "s": ("second", _TIME, 1.0),
    "min": ("minute", _TIME, 60.0),
    "h": ("hour", _TIME, 3600.0),
    "d": ("day", _TIME, 86400.0),
    "l": ("liter", _VOLUME, 1e-3),
    "rpm": ("revolutions_per_minute", {"[time]": -1.0, "[angle]": 1.0}, math.pi / 30),
    "A": ("ampere", {"[current]": 1.0}, 1.0),
    "V": ("volt", {**_POWER, "[current]": -1.0}, 1.0),
    "N": ("newton", {"[mass]": 1.0, "[length]": 1.0, "[time]": -2.0}, 1.0),
    "Pa": ("pascal", {"[mass]": 1.0, "[length]": -1.0, "[time]": -2.0}, 1.0),
    "bar": ("bar", {"[mass]": 1.0, "[length]": -1.0, "[time]": -2.0}, 1e5),
}
SPELT: Mapping[str, str] = MappingProxyType({spelt: name for spelt, (name, _, _) in _UNITS.items()})
FACTS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {name: {**of, SIZE: math.log10(size)} for name, of, size in _UNITS.values()}
)
_PIECE = re.compile(r"([*/])(1(?![\d.])|[A-Za-z%]+)(?:\*\*([1-9])(?![\d.]))?")
_ALONE = ("degC",)  # in a product pint makes a difference of it


def parts(unit: str) -> dict[str, float] | None:
    """The units that a unit is made of, by pint's names, with their exponents; None for what is not common.

    >>> parts("W/K"), parts("um/m**2"), parts("furlong")
    ({'watt': 1.0, 'kelvin': -1.0}, {'micrometer': 1.0, 'meter': -2.0}, None)
    """
    found: dict[str, float] = {}
    text, end = f"*{unit}", 0
    while end < len(text):
        piece = _PIECE.match(text, end)
        if piece is None:
            return None
        sign, spelt, power = piece.groups()
        if spelt != "1":
            if spelt not in SPELT or (spelt in _ALONE and unit != spelt):
                return None
            name = SPELT[spelt]
            found[name] = found.get(name, 0.0) + (-1.0 if sign == "/" else 1.0) * float(power or 1)
        end = piece.end()
    return {name: power for name, power in found.items() if power}
