"""Columns that repeat the time or number things: counters, numbers of rows and devices."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.measures import CLOCKS, TIME_UNITS, is_unit, time_unit
from discovery.firsthour.vocabulary import fold

Array = NDArray[np.float64]

_FEWEST = 5  # readings, to call two columns proportional
_EXACT = 0.01  # of a step
_STEADY = 0.999  # correlation with the time
_NAMED = 0.99  # the same, where the name says that it is a clock: it may be rounded
_MOSTLY = 0.8  # of the steps of a clock that starts anew
# an integral of a current or power: it only rises, as the time does
_COUNTER = re.compile(
    r"\b((milli)?amp(ere)?s?|(kilo)?watts?) ?(hours?|h|seconds?)\b|"
    r"\b(m?ah|[km]?wh|energy|capacity|odometer)\b"
)
_COUNTER_UNITS = {"ah", "mah", "wh", "kwh", "mwh", "j", "kj", "mj"}
_THINGS = r"(row|entry|record|sample|scan|sweep|point|data|line|reading|step|cycle|loop|test|probe)s?"
_ID = re.compile(
    r"(.* )?u?u?id( ?\d+)?|" + _THINGS + r" ?(point )?(no|nr|num|number|idx|index|count|counter)( ?\d+)?"
)


def is_clock(name: str, values: Array, seconds: Array) -> bool:
    """Whether a column repeats the time, or counts the rows."""
    words = fold(name)
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
    if not _says_time(words):
        return False
    return bool(np.corrcoef(values, seconds)[0, 1] > 0.999)


def tells_time(name: str, unit: str, values: Array, seconds: Array, role: str) -> bool:
    """Whether a column rises in exact proportion to the time: a clock, whatever it is called.

    A ramp does so, too: one whose header names its unit, or whose name says what it is (its `role`) and
    whose slope is that of no clock, is none.
    """
    known = np.isfinite(values)
    if (is_unit(unit) and time_unit(unit) is None) or np.sum(known) < _FEWEST:
        return False
    values, seconds = values[known] - values[known][0], seconds[known] - seconds[known][0]
    steps = np.diff(values)
    slope = values[-1] / seconds[-1]
    if not (steps > 0).all() or np.abs(values - slope * seconds).max() > _EXACT * np.median(steps):
        return False
    counts = any(abs(slope * one - 1) < 1e-3 for one in TIME_UNITS.values()) or (steps == 1).all()
    return bool(time_unit(unit) or counts or role == "other input" or CLOCKS.search(fold(name)))


def counts_up(name: str) -> bool:
    """Whether a name is that of a counter: an integral of a current or power.

    >>> counts_up("Amp-Hours"), counts_up("Amps")
    (True, False)
    """
    return bool(_COUNTER.search(fold(name)))


def _says_time(words: str) -> bool:
    """Return whether a name is that of a clock. A t alone may be a temperature."""
    return bool(CLOCKS.search(re.sub(r"\bt\b", "", words)))


def bookkeeping(name: str, unit: str, values: Array, seconds: Array, role: str) -> str:
    """What a column does that is neither measured nor acts on a machine, or "". A temperature never is such.

    A column whose header names another unit than that of a time or a counter is not one.
    """
    known = np.isfinite(values)
    unit, words = unit.strip().lower(), fold(name)
    values, seconds = values[known], seconds[known]
    if (
        len(values) < _FEWEST
        or np.ptp(values) == 0.0
        or (is_unit(unit) and unit not in _COUNTER_UNITS and time_unit(unit) is None)
    ):
        return ""
    steps = np.diff(values)
    only_one_way = bool((steps >= 0).all() or (steps <= 0).all())
    counts = unit in _COUNTER_UNITS or (not unit and _COUNTER.search(words))
    if counts and only_one_way and role in ("other input", "heat load", "cooling power"):
        return "is a counter that only runs on"
    if role != "other input" or unit in _COUNTER_UNITS:
        return ""
    whole = bool((values == np.round(values)).all())
    one_by_one = bool(np.isin(steps, (0.0, 1.0)).all())
    named = _ID.fullmatch(words) or (one_by_one and re.fullmatch(_THINGS, words))
    if not is_unit(unit) and whole and (named or (steps == 1.0).all()):
        return "numbers rows or devices"
    clock = time_unit(unit) is not None or _says_time(words)
    steady = float(np.corrcoef(values, seconds)[0, 1])
    if ((steps > 0).all() and steady > _STEADY) or (clock and (steps >= 0).all() and steady > _NAMED):
        return "rises steadily with the time, as a second clock"
    return "is a clock that starts anew" if clock and _starts_anew(steps, np.diff(seconds)) else ""


def _starts_anew(steps: Array, seconds: Array) -> bool:
    """Return whether a column rises as a clock does, except for the places where it starts again."""
    slopes = steps[steps > 0] / seconds[steps > 0]
    return len(slopes) >= _MOSTLY * len(steps) and any(
        np.mean(np.abs(slopes * one - 1) < _EXACT) >= _MOSTLY for one in TIME_UNITS.values()
    )
