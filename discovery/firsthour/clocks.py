"""Columns that tell the time once more."""

from __future__ import annotations

import re

import numpy as np

from discovery.firsthour.stamps import CLOCK_NAMES, TIME_UNITS, Array
from discovery.firsthour.words import plain

_FEWEST = 5  # readings, to speak of a proportion
_EXACT = 0.01  # of a step


def is_clock(name: str, values: Array, seconds: Array) -> bool:
    """Whether a column tells the time once more, or counts the rows."""
    words = plain(name)
    if not np.isfinite(values).all() or not (np.diff(values) > 0).all():
        return False
    if words in (
        "",
        "index",
        "unnamed 0",
        "row",
        "nr",
        "no",
        "n",
        "id",
        "sample",
        "entry",
        "record",
        "count",
    ):
        return bool(np.ptp(np.diff(values)) < 1e-9)
    if not re.match("|".join(CLOCK_NAMES[:2]), words):
        return False
    return bool(np.corrcoef(values, seconds)[0, 1] > 0.999)


def tells_time(name: str, unit: str, values: Array, seconds: Array, role: str) -> bool:
    """Whether a column rises in exact proportion to the time: a clock, whatever it is called.

    A ramp does so, too: one whose header names its unit, or whose name says what it is (its `role`) and
    whose slope is that of no clock, is none.
    """
    known = np.isfinite(values)
    unit = unit.strip().lower()
    if (unit and unit not in TIME_UNITS) or np.sum(known) < _FEWEST:
        return False
    values, seconds = values[known] - values[known][0], seconds[known] - seconds[known][0]
    steps = np.diff(values)
    slope = values[-1] / seconds[-1]
    if not (steps > 0).all() or np.abs(values - slope * seconds).max() > _EXACT * np.median(steps):
        return False
    counts = any(abs(slope * one - 1) < 1e-3 for one in TIME_UNITS.values()) or (steps == 1).all()
    return bool(unit or counts or role == "other input" or re.match("|".join(CLOCK_NAMES), plain(name)))
