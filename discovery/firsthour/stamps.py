"""The clock of an engineer's table: seconds, minutes, instants of many spellings, a date and a time apart."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.firsthour.rows import Row, is_number, is_stamp, number
from discovery.firsthour.words import plain

Array = NDArray[np.float64]

_FORMS = (
    "%d.%m.%Y %H:%M:%S.%f",
    "%d.%m.%Y %H:%M:%S",
    "%d.%m.%Y %H:%M",
    "%d.%m.%y %H:%M:%S",
    "%Y/%m/%d %H:%M:%S.%f",
    "%Y/%m/%d %H:%M:%S",
    "%Y/%m/%d %H:%M",
    "%d/%m/%Y %H:%M:%S.%f",
    "%d/%m/%Y %H:%M:%S",
    "%d/%m/%Y %H:%M",
    "%m/%d/%Y %H:%M:%S.%f",
    "%m/%d/%Y %H:%M:%S",
    "%m/%d/%Y %H:%M",
    "%m/%d/%Y %I:%M:%S %p",
    "%m/%d/%Y %I:%M %p",
    "%m/%d/%y %H:%M:%S",
    "%m/%d/%y %H:%M",
    "%m/%d/%y %I:%M:%S %p",
    "%d-%m-%Y %H:%M:%S",
    "%d-%m-%Y %H:%M",
)
_DATE = r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}"
_TIME_OF_DAY = re.compile(r"(\d{1,3}):(\d{2})(?::(\d{2}(?:[.,]\d+)?))?")
# what a clock is called: a plain name before one that only holds the word
CLOCK_NAMES = (
    r"(time|zeit|datetime|timestamp|zeitstempel|date|datum|elapsed|seconds|minutes|hours|clock|stamp)\b",
    r"(\w+ )*(time|zeit|stamp|timestamp|elapsed|seconds)\b",
    r"t$",
)
TIME_UNITS = {
    "ns": 1e-9,
    "us": 1e-6,
    "µs": 1e-6,
    "μs": 1e-6,
    "ms": 1e-3,
    "s": 1.0,
    "sec": 1.0,
    "seconds": 1.0,
    "min": 60.0,
    "minutes": 60.0,
    "h": 3600.0,
    "hr": 3600.0,
    "hours": 3600.0,
    "d": 86400.0,
    "days": 86400.0,
}
# seconds since 1970 in finer steps, where no unit says so: the year 2001 and later
_SINCE_1970 = ((1e18, "ns"), (1e15, "us"), (1e12, "ms"))
_DAY = 86400.0
_FEWEST = 5  # different stamps


@dataclass(frozen=True)
class Clock:
    """`columns`: where the stamps stand; `seconds` (N,) since the first row; `about`: how they were read."""

    columns: tuple[int, ...]
    seconds: Array
    about: str
    notes: tuple[str, ...] = ()


def find_clock(path: Path, names: Sequence[str], units: Sequence[str], body: Sequence[Row]) -> Clock:
    """Which column is time.

    Raises:
        UserError: no column is, or the one that should be does not run forward.
    """
    words = [plain(name) for name in names]
    named = list(
        dict.fromkeys(k for form in CLOCK_NAMES for k in range(len(names)) if re.match(form, words[k]))
    )
    backwards = None
    for columns, seconds, how in _candidates(path, [*named, 0], names, units, body):
        steps = np.diff(seconds)
        sure = columns[0] in named
        about = f"{how}, from column '{names[columns[0]]}'" + ("" if sure else ", since none is called time")
        if np.isfinite(seconds).all() and (steps >= 0).all() and np.sum(steps > 0) >= _FEWEST:
            same = int(np.sum(steps == 0))
            if same and not sure:
                continue
            notes = (f"{same} rows bear the stamp of the row before: spread evenly",) if same else ()
            return Clock(columns, np.round(_spread(seconds), 6), about, notes)
        if backwards is None and columns[0] in named and (steps < 0).any():
            backwards = (body[int(np.flatnonzero(steps < 0)[0]) + 1][0], names[columns[0]])
    if backwards:
        raise UserError(
            f"{path}, line {backwards[0]}: the time does not run forward in column "
            f"'{backwards[1]}'; sort the rows"
        )
    raise UserError(
        f"{path}: no column of time was found; call one 'time' (seconds, or instants as 2026-03-01T08:00:00)"
        ", or add one if the file has none"
    )


def _candidates(
    path: Path, order: Sequence[int], names: Sequence[str], units: Sequence[str], body: Sequence[Row]
) -> Iterator[tuple[tuple[int, ...], Array, str]]:
    for at in dict.fromkeys(order):
        cells = [row[at] for _, row in body]
        if is_stamp(cells[0]) and not is_number(cells[0]):
            yield from _instants(at, cells, order, body)
            continue
        try:
            values = np.array(
                [number(cell, path, line, names[at]) for cell, (line, _) in zip(cells, body, strict=True)]
            )
        except UserError:
            continue
        unit = _unit(names[at], units[at], values)
        yield (at,), (values - values[0]) * TIME_UNITS[unit], f"counted in {unit}"


def _unit(name: str, unit: str, values: Array) -> str:
    word = unit.strip().lower()
    if word in TIME_UNITS:
        return word
    named = next((u for u in ("minutes", "hours", "days", "ms", "ns") if u in name.lower()), None)
    return named or next((u for least, u in _SINCE_1970 if values[0] > least), "s")


def _instants(
    at: int, cells: Sequence[str], order: Sequence[int], body: Sequence[Row]
) -> Iterator[tuple[tuple[int, ...], Array, str]]:
    """A column of stamps; a column of dates with the one of the time of day."""
    if re.fullmatch(_DATE, cells[0]):
        for other in [k for k in dict.fromkeys([*order, at + 1]) if k != at and k < len(body[0][1])]:
            joined = [f"{cell} {row[other]}" for cell, (_, row) in zip(cells, body, strict=True)]
            if _TIME_OF_DAY.match(body[0][1][other]) and (found := _parsed(joined)) is not None:
                yield (at, other), *found
    if (found := _parsed(cells)) is not None:
        yield (at,), *found
    if (seconds := _of_day(cells)) is not None:
        yield (at,), seconds, "time of day"


def _parsed(cells: Sequence[str]) -> tuple[Array, str] | None:
    """Seconds, and how they were read: by the spelling in which all cells run forward, else by any.

    03/01 is the third of January or the first of March: the spelling with the most even steps counts.
    """
    forward: list[tuple[str, Array]] = []
    backward = None
    for form in ("", *_FORMS):
        try:
            stamps = [
                datetime.strptime(cell.replace(",", "."), form) if form else datetime.fromisoformat(cell)
                for cell in cells
            ]
            seconds = np.array([(stamp - stamps[0]).total_seconds() for stamp in stamps])
        except (ValueError, TypeError):
            continue
        if (np.diff(seconds) >= 0).all():
            forward.append((form, seconds))
        elif backward is None:
            backward = seconds
    if not forward:
        return None if backward is None else (backward, "instants")
    form, best = min(forward, key=lambda one: _unevenness(one[1]))
    others = [one for one in forward if not np.array_equal(one[1], best)]
    if not others:
        return best, "instants"
    other = min(others, key=lambda one: _unevenness(one[1]))[0]
    return best, f"instants (? dates read as {_order(form)}, the most even; {_order(other)} runs forward too)"


def _unevenness(seconds: Array) -> float:
    """Spread of the steps against their mean: 0 where all are alike."""
    steps = np.diff(seconds)
    return float(np.std(steps) / np.mean(steps)) if steps.any() else math.inf


def _order(form: str) -> str:
    """Day, month and year of a spelling, as a person writes them."""
    date = form.split(" ")[0] or "%Y-%m-%d"
    for mark, word in (("%d", "day"), ("%m", "month"), ("%Y", "year"), ("%y", "year")):
        date = date.replace(mark, word)
    return date


def _of_day(cells: Sequence[str]) -> Array | None:
    """Hours and minutes (and seconds) without a date; past midnight the next day begins."""
    parts = [_TIME_OF_DAY.fullmatch(cell) for cell in cells]
    if not all(parts):
        return None
    seconds = np.array(
        [int(p[1]) * 3600.0 + int(p[2]) * 60.0 + float((p[3] or "0").replace(",", ".")) for p in parts if p]
    )
    days = np.concatenate(([0], np.cumsum(np.diff(seconds) < -_DAY / 2)))
    return np.asarray(seconds + _DAY * days - seconds[0], dtype=np.float64)


def _spread(seconds: Array) -> Array:
    """Rows of one stamp, evenly up to the next stamp: a clock of whole seconds, a faster logger."""
    starts = np.flatnonzero(np.concatenate(([True], np.diff(seconds) > 0)))
    if len(starts) == len(seconds):
        return seconds
    last = float(seconds[starts[-1]] + (seconds[starts[-1]] - seconds[starts[-2]]))
    places, stamps = np.append(starts, len(seconds)), np.append(seconds[starts], last)
    return np.asarray(np.interp(np.arange(len(seconds)), places, stamps), dtype=np.float64)
