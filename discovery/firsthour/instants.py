"""Dates and times of day as people and loggers write them, as seconds."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.cells import duration

Array = NDArray[np.float64]

DAY = 86400.0
_MONTHS = (
    "jan januar january janvier gennaio enero jän",
    "feb februar february février fevrier febbraio febrero fév",
    "mar märz maerz march mars marzo mär mrz",
    "apr april avril aprile abril avr",
    "may mai maggio mayo mag",
    "jun juni june juin giugno junio giu",
    "jul juli july juillet luglio julio lug",
    "aug august août aout agosto ago",
    "sep sept september septembre settembre septiembre set",
    "oct okt oktober october octobre ottobre octubre ott",
    "nov november novembre noviembre",
    "dec dez dezember december décembre decembre dicembre diciembre dic déc",
)
_MONTH = {name: k for k, names in enumerate(_MONTHS, start=1) for name in names.split()}
_TIME = (
    r"(?P<h>\d{1,2})\s*[:時h时.]\s*(?P<m>\d{1,2})(?:\s*[:分m.]\s*(?P<s>\d{1,2}(?:[.,:]\d{1,9})?))?\s*秒?"
    r"\s*(?P<half>[ap]\.?\s?m\.?|午前|午後|上午|下午)?\s*(?P<zone>z|utc|gmt|[+-]\d{2}:?\d{2})?"
)
_DATE = (
    r"(?P<a>\d{1,4}|[^\W\d]+)\.?\s*[-./年 ]\s*(?P<b>\d{1,2}|[^\W\d]+)\.?,?\s*[-./月 ]\s*(?P<c>\d{1,4})\s*日?"
)
_INSTANT = re.compile(
    rf"(?:[^\W\d]{{2,10}}[.,]?\s+(?=\d|[^\W\d]))?{_DATE}"
    rf"(?:\s*(?:\([^\W\d]{{1,3}}\))?[ tT_,\-]*(?P<early>午前|午後|上午|下午)?\s*{_TIME})?",
    re.IGNORECASE,
)
_CTIME = re.compile(
    r"(?:[^\W\d]{2,4} )?([^\W\d]{3,9} +\d{1,2}) ([\d:.]+) (\d{4})"
)  # Fri Mar 27 20:00:00 2026
_COMPACT = re.compile(r"(\d{4})(\d{2})(\d{2})[ T_-]?(\d{2})(\d{2})(\d{2}(?:[.,]\d+)?)?")
_OF_DAY = re.compile(
    r"(?:(?P<d>\d{1,3})\s*(?:days?|d|Tage?)[ ,]*)?"
    r"(?P<early>午前|午後|上午|下午)?\s*(?P<h>\d{1,4})\s*[:時时h]\s*(?P<m>\d{1,2})(?:\s*[:分]\s*(?P<s>\d{1,2}(?:[.,]\d+)?))?\s*秒?"
    r"\s*(?P<half>[ap]\.?\s?m\.?)?",
    re.IGNORECASE,
)
_DOTTED_TIME = re.compile(r"\d{1,2}\.\d{2}\.\d{2}([.,]\d+)?")
_ORDERS = ("DMY", "MDY", "YMD", "YDM")  # of 13.6.21 the first is the usual one
_HALF = re.compile(r"\d\s*[ap]\.?\s?m\b", re.IGNORECASE)
_LONGEST = 60  # letters of a stamp
_NAMED = re.compile(r"[^\W\d]{3}|[./-]\s")  # a month, or marks with a blank behind
_SAID = {"Y": "year", "M": "month", "D": "day"}


@dataclass(frozen=True)
class Instants:
    """`seconds` (N,) since the first; `first`: ISO 8601; `about`: how they were read; `sure`; `zoned`: they
    name their time zone. `others`: the first in other orders of day and month that have the same steps.
    """

    seconds: Array
    first: str
    about: str
    sure: bool = True
    zoned: bool = False
    others: tuple[str, ...] = ()


def read_instants(cells: Sequence[str]) -> Instants | None:
    """Dates with or without a time of day, in the order of day, month and year in which they run forward.

    03/01 is the third of January or the first of March: the order with the most even steps counts, and of
    equal ones that of countries that write a.m. and p.m. None where a cell is none.
    """
    parts = [_parts(cell) for cell in cells]
    if any(one is None for one in parts):
        return None
    found: list[tuple[str, Array, datetime]] = []
    halves = bool(_HALF.search(cells[0]))
    for order in sorted(_ORDERS, key=lambda one: halves and one != "MDY"):
        try:
            stamps = [_instant(one, order) for one in parts if one is not None]
        except (ValueError, OverflowError):
            continue
        seconds = np.array([(stamp - stamps[0]).total_seconds() for stamp in stamps])
        found.append((order, seconds, stamps[0]))
    forward = [one for one in found if (np.diff(one[1]) >= 0).all()] or found
    if not forward:
        return None
    zoned = bool((one := _INSTANT.fullmatch(cells[0][:_LONGEST])) and one["zone"])
    order, best, first = min(forward, key=lambda one: unevenness(one[1]))
    others = [one for one in forward if not np.array_equal(one[1], best)]
    same = (one[2].isoformat() for one in forward if np.array_equal(one[1], best) and one[2] != first)
    also = tuple(dict.fromkeys(same))
    if (
        not others
        or not (np.diff(best) >= 0).all()
        or (unbroken(best) and not any(unbroken(one[1]) for one in others))
    ):
        return Instants(best, first.isoformat(), "instants", zoned=zoned, others=also)
    other = min(others, key=lambda one: unevenness(one[1]))[0]
    about = f"instants (? dates read as {_order(order)}, the most even; {_order(other)} runs forward too)"
    return Instants(best, first.isoformat(), about, sure=False, zoned=zoned, others=also)


def summer_time_begins(before: datetime, after: datetime) -> bool:
    """Whether clocks on a wall skip an hour between two instants of one night, in Europe or North America.

    >>> summer_time_begins(datetime(2026, 3, 29, 1, 59), datetime(2026, 3, 29, 3, 0))
    True
    """
    sunday = before.weekday() == 6 and before.month == 3 and (before.day > 24 or 8 <= before.day <= 14)
    hours = (before.replace(hour=hour, minute=0, second=0, microsecond=0) for hour in (1, 2, 3))
    return sunday and any(before < hour and after >= hour + timedelta(hours=1) for hour in hours)


def read_times_of_day(cells: Sequence[str]) -> Array | None:
    """Hours and minutes (and seconds) without a date; past midnight the next day begins. None: a cell is
    none.

    >>> read_times_of_day(["23:59:30", "0:00:10"]).tolist()
    [0.0, 40.0]
    """
    read = [_since_midnight(cell) for cell in cells]
    seconds = np.array([math.nan if one is None else one for one in read])
    if not np.isfinite(seconds).all():
        return None
    days = np.concatenate(([0], np.cumsum(np.diff(seconds) < -DAY / 2)))
    return np.asarray(seconds + DAY * days - seconds[0], dtype=np.float64)


def _since_midnight(cell: str) -> float | None:
    """Return a time of day, or a length of time, in seconds."""
    found = _OF_DAY.fullmatch(cell)
    if not found:
        return duration(cell)
    return (
        int(found["d"] or 0) * DAY
        + _hour(found["h"], found["half"] or found["early"]) * 3600.0
        + int(found["m"]) * 60.0
        + float((found["s"] or "0").replace(",", "."))
    )


def of_two_parts(cells: Sequence[str]) -> bool:
    """Whether times have two parts and begin at zero: 0:00, 0:30 are minutes and seconds, or hours and
    minutes since the start.
    """
    return (
        all(re.fullmatch(r"\d{1,4}:\d{2}", cell) for cell in cells) and float(cells[0].replace(":", "")) == 0
    )


def is_date(cell: str) -> bool:
    """Whether a cell is a date without a time of day."""
    found = _INSTANT.fullmatch(cell)
    return bool(found and found["h"] is None)


def is_instant(cell: str) -> bool:
    """Whether a cell is a date, with or without a time of day.

    >>> is_instant("27.03.2026 20.00.00"), is_instant("20260327T200000"), is_instant("12.5"), is_instant("T1")
    (True, True, False, False)
    """
    return _parts(cell) is not None


def is_time_of_day(cell: str, dated: bool = False) -> bool:
    """Whether a cell is a time of day without a date.

    Args:
        dated: the date stands in another column, so 06.12.30 is none.
    """
    return bool(_OF_DAY.fullmatch(cell) or (dated and _DOTTED_TIME.fullmatch(cell)))


def unevenness(seconds: Array) -> float:
    """Spread of the steps against their mean: 0 where all are alike."""
    steps = np.diff(seconds)
    return float(np.std(steps) / np.abs(np.mean(steps))) if steps.any() and np.mean(steps) else math.inf


def unbroken(seconds: Array) -> bool:
    """Whether a logger wrote stamps (N,) without a pause: no step is longer than two usual ones.

    >>> unbroken(np.array([0.0, 300.0, 600.0])), unbroken(np.array([0.0, 300.0, 600.0, 86400.0]))
    (True, False)
    """
    steps = np.diff(seconds)
    return bool(steps.size and steps.max() <= 2.0 * np.median(steps))


_Parts = tuple[tuple[str, str, str], float, float]


def _parts(cell: str) -> _Parts | None:
    """The three numbers of a date, seconds of the day, and seconds of the time zone."""
    if found := _COMPACT.fullmatch(cell):
        seconds = int(found[4]) * 3600 + int(found[5]) * 60 + float((found[6] or "0").replace(",", "."))
        return (found[1], found[2], found[3]), seconds, 0.0
    cell = _CTIME.sub(r"\1 \3 \2", cell) if len(cell) <= _LONGEST else ""
    found = _INSTANT.fullmatch(cell)
    if not found or (" " in cell[found.start("a") : found.end("b")] and not _NAMED.search(cell)):
        return None
    seconds = 0.0
    if found["h"]:
        last = (found["s"] or "0").replace(",", ".").replace(":", ".")
        seconds = (
            _hour(found["h"], found["half"] or found["early"]) * 3600 + int(found["m"]) * 60 + float(last)
        )
    zone = (found["zone"] or "z").lower().replace(":", "")
    away = 0.0 if zone[0] not in "+-" else (int(zone[1:3]) * 60 + int(zone[3:5])) * 60.0
    return (found["a"], found["b"], found["c"]), seconds, -away if zone[0] == "-" else away


def _instant(parts: _Parts, order: str) -> datetime:
    """Return the instant of a date in this order of day, month and year. Raises ValueError if the date does
    not exist.
    """
    date, seconds, away = parts
    found = {}
    for letter, text in zip(order, date, strict=True):
        if text.isdecimal():
            if letter != "Y" and len(text) > 2:
                raise ValueError(text)
            found[letter] = int(text)
        elif (month := _MONTH.get(text.casefold())) and "M" not in found:
            if letter != "M" and order != "MDY":
                raise ValueError(text)
            found["M"] = month
        else:
            raise ValueError(text)
    year = found["Y"]
    if year < 100:
        if order[0] == "Y" and len(date[0]) != 2:
            raise ValueError(date[0])
        year += 2000 if year < 80 else 1900
    if year < 1900:
        raise ValueError(year)
    return datetime(year, found["M"], found["D"]) + timedelta(seconds=seconds - away)


def _hour(hour: str, half: str | None) -> int:
    """Return the hour on a clock of 24 hours."""
    if not half:
        return int(hour)
    late = half[0] in "pP" or half in ("午後", "下午")
    return int(hour) % 12 + 12 * late


def _order(order: str) -> str:
    """Day, month and year as a person writes them."""
    return "/".join(_SAID[letter] for letter in order)
