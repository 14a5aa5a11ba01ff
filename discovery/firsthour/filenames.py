"""What the names of files say: `2000rpm` is a speed, `0-20C` the range of a chamber."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from discovery.firsthour.measures import dimension_of, known_unit
from discovery.firsthour.odds import likely
from discovery.firsthour.table import OwnTable

_NUMBER = re.compile(
    r"(?<![\d.,])(?P<low>-?\d+(?:[.,]\d+)?)(?:\s*(?:-|_|to|bis|–)\s*(?P<high>\d+(?:[.,]\d+)?))?\s*_?"
    r"(?P<unit>rpm|u_?min|umin|r_?min|°?c|deg_?c|°?f|kw|w|l_?min|lpm|pct|percent|%|hz)(?![^\W_])",
    re.IGNORECASE,
)
_NEAR = 0.03  # of a number: a column that stands so near is what the name says
_RANGE = 0.3  # of a range: so near its ends
_SPELLED = {
    "umin": "u/min",
    "u_min": "u/min",
    "rmin": "r/min",
    "r_min": "r/min",
    "l_min": "l/min",
    "lmin": "l/min",
}

Said = tuple[float, float, str]
"""Low, high (or the same), unit."""


def numbers_in(stem: str) -> list[Said]:
    """The quantities that the name of a file holds.

    >>> numbers_in("lathe_2000rpm_0-20C")
    [(2000.0, 2000.0, 'rpm'), (0.0, 20.0, 'degC')]
    >>> numbers_in("test2_20rpm"), numbers_in("03_500rpm"), numbers_in("n1500rpm")
    ([(20.0, 20.0, 'rpm')], [(500.0, 500.0, 'rpm')], [(1500.0, 1500.0, 'rpm')])
    """
    found = []
    for one in _NUMBER.finditer(stem := stem.replace("__", "_")):
        written = _SPELLED.get(one["unit"].lower(), one["unit"])
        unit = known_unit(written.replace("_", ""))
        low = float(one["low"].replace(",", "."))
        high = float(one["high"].replace(",", ".")) if one["high"] else low
        counted = one.start() > 0 and stem[one.start() - 1].isalpha()  # the number of a test
        between = stem[one.end("low") : one.start("high")].strip() if one["high"] else ""
        if between == "_" and (counted or high <= low or unit not in ("degC", "degF")):
            low, between = high, ""
        if unit and (not between or high > low):
            found.append((low, high, unit))
    return found


def file_hints(runs: Mapping[str, OwnTable]) -> dict[str, list[tuple[str, Mapping[str, float]]]]:
    """Evidence for each column out of the names of its files, by the name of the column."""
    found: dict[str, list[tuple[str, Mapping[str, float]]]] = {}
    for stem, table in runs.items():
        for low, high, unit in numbers_in(stem):
            for column in table.columns:
                known = column.values[np.isfinite(column.values)]
                if not known.size or any("file name" in why for why, _ in found.get(column.name, ())):
                    continue
                if (
                    low == high
                    and low
                    and np.mean(np.abs(known / low - 1) < _NEAR) > 0.5
                    and unit not in ("degC", "degF")
                ):
                    says = {key: odds / 2 for key, odds in dimension_of(unit).items()}
                    found.setdefault(column.name, []).append(
                        (f"it stands at {low:g} {unit} as the file name says", says)
                    )
                elif high > low and unit in ("degC", "degF"):
                    wide = _RANGE * (high - low)
                    if abs(known.min() - low) < wide and abs(known.max() - high) < wide:
                        says = {"air": 3.0, "temperature": 2.0}
                        found.setdefault(column.name, []).append(
                            (f"it runs through {low:g} to {high:g} {unit} as the file name says", says)
                        )
    return found


def constants(stems: Sequence[str], present: Sequence[str]) -> dict[str, tuple[str, dict[str, float]]]:
    """Quantities that differ between the names of files and that no column holds: unit, and value by file.

    Args:
        present: quantities of the columns.
    """
    said = {stem: {unit: low for low, high, unit in numbers_in(stem) if low == high} for stem in stems}
    found = {}
    for unit in dict.fromkeys(unit for one in said.values() for unit in one):
        quantity = likely(dimension_of(unit))[0]
        values = {stem: one[unit] for stem, one in said.items() if unit in one}
        new = quantity in ("speed", "flow", "power") and quantity not in present
        if new and len(values) == len(stems) and len(set(values.values())) > 1:
            found[quantity] = (unit, values)
    return found
