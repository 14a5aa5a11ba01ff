"""The clock of an engineer's table: which columns hold the time, and in which unit.

Where nothing says the unit, evidence does: how long thermal recordings last, how often loggers read, how
quickly temperatures move. What is left open is asked (see `asking`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.firsthour.cells import is_duration, is_empty, is_number, is_stamp, read_numbers
from discovery.firsthour.instants import (
    Instants,
    is_date,
    is_instant,
    is_time_of_day,
    of_two_parts,
    read_instants,
    read_times_of_day,
    summer_time_begins,
)
from discovery.firsthour.measures import CLOCKS, TIME_UNITS, is_dated, time_unit
from discovery.firsthour.sheets import Sheet
from discovery.firsthour.vocabulary import fold
from discovery.recordings.timeunit import time_odds

Array = NDArray[np.float64]

_FEWEST = 5  # different stamps
_EVEN, _MOST = 0.02, 0.5  # a clock's step is its usual one within this share, in so many of the rows
_EPOCH = (7e8, 4.2e9)  # s since 1970: 1992 to 2103
# what programs count since a day of their own -> unit [s], that day in s since 1970
_COUNTED_SINCE = {
    "100 ns since 1601": (1e-7, -11644473600.0),  # the file time of Windows
    "100 ns since the year 1": (1e-7, -62135596800.0),  # the ticks of .NET
    "days as spreadsheets count them": (86400.0, -25569 * 86400.0),
    "days since the year 0": (86400.0, -719529 * 86400.0),  # the date numbers of MATLAB
}
_YEAR = 366.0 * 86400.0  # s
_HOUR = 3600.0
_STOPWATCHES = {
    "minutes and seconds": r"m{1,2}:s{1,2}|min:s(ec)?",
    "hours and minutes": r"h{1,2}:m{1,2}|h:min",
}
_INTERVAL = re.compile(
    r"(?:interval|abtast|sampling|sample|rate|takt|scan|cycle|周期|間隔|间隔)[^\d\[]{0,20}?"
    r"(?:\[(?P<before>[^\W\d]{1,12})\]\D{0,5}(?P<value>\d+(?:[.,]\d+)?)"
    r"|(?P<number>\d+(?:[.,]\d+)?)\s*(?P<unit>[^\W\d]{1,12}))",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class Clock:
    """`columns`: where the stamps stand; `seconds` (N,) since the first row; `about`: how they were read.

    `order`: the rows as they follow each other in time, None: as in the file. `first`: ISO 8601 of the first
    row, or "". `counted`: nothing says the unit of its numbers, they are not converted. `wall`: dates without
    a time zone, as of a clock on a wall. `others`: the first row, if day and month are read otherwise.
    """

    columns: tuple[int, ...]
    seconds: Array
    about: str
    notes: tuple[str, ...] = ()
    order: NDArray[np.intp] | None = None
    first: str = ""
    counted: bool = False
    wall: bool = False
    others: tuple[str, ...] = ()


def find_clock(
    sheet: Sheet, names: Sequence[str], units: Sequence[str], series: Sequence[str] | None = None
) -> Clock:
    """Which column is time.

    Args:
        names, units: of the columns, apart.
        series: (N,) of a table whose rows are those of several sensors: time runs forward in each.

    Raises:
        UserError: no column is, or the one that should be does not run forward.
    """
    named = [k for k, name in enumerate(names) if CLOCKS.search(fold(name))]
    named.sort(key=lambda k: (not _stated(sheet, k, names[k], units[k]), not CLOCKS.match(fold(names[k])), k))
    backwards = ""
    others = [k for k in range(len(names)) if k not in named]
    others.sort(key=lambda k: not _holds_stamps(sheet, k))  # before numbers of rows
    order_of_columns = [*named, *others]
    for one in _candidates(sheet, order_of_columns, names, units):
        sure = one.columns[0] in named
        about = f"{one.about}, from column '{names[one.columns[0]]}'"
        about += "" if sure else ", since none is called time"
        seconds, order, notes = _forward(sheet, one.seconds, series)
        if one.wall and order is None:
            seconds, said = _summer(seconds, one.first)
            notes = [*notes, *said]
        steps = np.diff(seconds)
        if np.isfinite(seconds).all() and (steps >= 0).all() and np.sum(steps > 0) >= _FEWEST:
            if not sure and ((steps == 0).any() or (one.counted and (backwards or not _ticks(steps)))):
                continue  # a temperature that only rises is no clock, least of all where one is called time
            return replace(one, seconds=seconds, about=about, order=order, notes=tuple(notes))
        if not backwards and sure and (steps < 0).any():
            backwards = _backwards(sheet, seconds, names[one.columns[0]])
    if backwards:
        raise UserError(backwards)
    raise UserError(
        f"{sheet.path}: no column of time was found; call one 'time' (seconds, or instants as "
        "2026-03-01T08:00:00), or add one if the file has none"
    )


def _ticks(steps: Array) -> bool:
    """Whether most of the steps (N - 1,) are alike, as those of a logger are.

    >>> _ticks(np.array([10.0, 10.0, 11.0, 10.0])), _ticks(np.array([0.06, 0.10, 0.09, 0.14]))
    (True, False)
    """
    usual = float(np.median(steps))
    return bool(np.mean(np.abs(steps - usual) <= _EVEN * usual) >= _MOST)


def _stated(sheet: Sheet, column: int, name: str, unit: str) -> bool:
    """Whether a column says that it is a clock by more than one of its words: `Data_Point` does not."""
    alone = bool(CLOCKS.fullmatch(fold(name)))
    return alone or time_unit(unit) is not None or _holds_stamps(sheet, column)


def _holds_stamps(sheet: Sheet, column: int) -> bool:
    head = sheet.columns[column].slice(0, 5).to_pylist()
    return all(is_stamp(cell) and not is_number(cell) for cell in head)


def _candidates(
    sheet: Sheet, order: Sequence[int], names: Sequence[str], units: Sequence[str]
) -> Iterator[Clock]:
    for at in order:
        head = [cell for cell in sheet.columns[at].slice(0, 50).to_pylist() if not is_empty(cell)]
        if not head:
            continue
        cells = sheet.cells(at)
        if any(map(is_duration, head)):  # the first may be 0s
            if (seconds := read_times_of_day(cells)) is not None:
                yield Clock((at,), seconds, "as time since the start")
            continue
        dated = is_instant(head[0]) and not head[0].isdecimal()
        if dated or (is_stamp(head[0]) and not is_number(head[0].replace(" ", ""))):
            yield from _stamped(sheet, at, cells, names, units)
            continue
        if not is_number(head[0]):
            if is_time_of_day(head[0]) and (seconds := read_times_of_day(cells)) is not None:
                yield Clock((at,), seconds, "as time since the start")
            continue
        read = read_numbers(cells, None)
        if read.wrong is None and np.isfinite(read.values).all():
            yield _counted(at, cells, read.values, names[at], units[at] or read.unit)


def _stamped(
    sheet: Sheet, at: int, cells: list[str], names: Sequence[str], units: Sequence[str]
) -> Iterator[Clock]:
    """Yield clocks from a column of stamps, from a date with a time of day, and with a column of
    milliseconds.
    """
    fine = next(
        (k for k, name in enumerate(names) if k != at and _are_milliseconds(sheet, k, name, units[k])), None
    )
    others = [k for k in range(len(names)) if k != at and is_time_of_day(sheet.columns[k][0].as_py(), True)]
    pairs: list[tuple[tuple[int, ...], list[str]]] = [((at,), cells)]
    if is_date(cells[0]) and others:
        time = sheet.cells(others[0])
        pairs.insert(0, ((at, others[0]), [f"{a} {b}" for a, b in zip(cells, time, strict=True)]))
    for columns, stamps in pairs:
        found = read_instants(stamps)
        if found is None:
            continue
        if fine is not None and not np.any(np.mod(found.seconds, 1.0)):
            milliseconds = read_numbers(sheet.cells(fine), None).values / 1e3
            whole = found.seconds + milliseconds - milliseconds[0]
            if (np.diff(whole) >= 0).all():
                about = f"{found.about} and milliseconds"
                yield replace(
                    _of_instants(columns, found), columns=(*columns, fine), seconds=whole, about=about
                )
        yield _of_instants(columns, found)
    if (seconds := read_times_of_day(cells)) is not None:
        if of_two_parts(cells):
            yield _of_two_parts(at, seconds, f"{sheet.header[at]} {units[at]}")
        else:
            yield Clock((at,), seconds, "as time of day")


def _of_instants(columns: tuple[int, ...], found: Instants) -> Clock:
    return Clock(
        columns, found.seconds, found.about, first=found.first, wall=not found.zoned, others=found.others
    )


def _of_two_parts(at: int, seconds: Array, header: str) -> Clock:
    """A stopwatch: hours and minutes, or minutes and seconds, as its header says or as recordings last.

    Args:
        seconds: (N,) read as hours and minutes.
    """
    forms = _STOPWATCHES.items()
    said = next((words for words, form in forms if re.search(rf"\b({form})\b", header.lower())), "")
    odds = time_odds(seconds / _HOUR, [])
    short = said == "minutes and seconds" or (not said and odds["min"] > odds["h"])
    about = "minutes and seconds" if short else "hours and minutes"
    doubt = "" if said else " (? the header does not say; write mm:ss or hh:mm under its name)"
    return Clock((at,), seconds / 60.0 if short else seconds, f"as {about}{doubt}")


def _are_milliseconds(sheet: Sheet, column: int, name: str, unit: str) -> bool:
    if time_unit(name) != "ms" and time_unit(unit) != "ms":
        return False
    values = read_numbers(sheet.cells(column), None).values
    return bool(np.isfinite(values).all() and values.min() >= 0 and values.max() < 1000)


def _counted(at: int, cells: Sequence[str], values: Array, name: str, unit: str) -> Clock:
    """A column of numbers as a clock."""
    first = float(values[0])
    if re.fullmatch(r"(19|20)\d{12}", cells[0]) and (found := read_instants(cells)):
        return Clock((at,), found.seconds, found.about, first=found.first)
    given = time_unit(unit) or named_time_unit(name)
    if given and _EPOCH[0] < first * TIME_UNITS[given] < _EPOCH[1]:
        since: str | None = given
    else:
        since = next(
            (u for u in TIME_UNITS if _EPOCH[0] < first * TIME_UNITS[u] < _EPOCH[1] and u in "ns us ms s"),
            None,
        )
    if since and (given is None or first > _EPOCH[0]):
        return Clock((at,), (values - first) * TIME_UNITS[since], f"counted in {since} since 1970")
    if given:
        return Clock((at,), (values - first) * TIME_UNITS[given], f"counted in {given}")
    for about, (unit_s, day) in _COUNTED_SINCE.items():
        lasts = (values[-1] - first) * unit_s
        in_days = unit_s == TIME_UNITS["d"]
        if (
            _EPOCH[0] < first * unit_s + day < _EPOCH[1]
            and lasts < _YEAR
            and (not in_days or np.any(np.mod(values, 1.0)))
        ):
            return Clock((at,), (values - first) * unit_s, about if in_days else f"counted in {about}")
    return Clock((at,), values - first, "counted", counted=True)


def named_time_unit(name: str) -> str | None:
    """The unit of time that the name of a clock holds.

    >>> [named_time_unit(name) for name in ("Minuten", "経過分", "Time", "t_min", "Data e ora")]
    ['min', 'min', None, 'min', None]
    """
    if is_dated(name):
        return None
    words = fold(name).split()
    found = [unit for word in words[::-1] if len(word) > 1 and (unit := time_unit(word))]
    if found and fold(name) != "時間":
        return found[0]
    ends = re.search(r"(分|秒|経過時間)$", fold(name))
    return time_unit(ends[1]) if ends else None


def stated_interval(above: Sequence[str]) -> float | None:
    """The interval of the logger [s] that stands over the table."""
    for line in above:
        if (found := _INTERVAL.search(line)) and (unit := time_unit(found["before"] or found["unit"])):
            return float((found["value"] or found["number"]).replace(",", ".")) * TIME_UNITS[unit]
    return None


def _forward(
    sheet: Sheet, seconds: Array, series: Sequence[str] | None
) -> tuple[Array, NDArray[np.intp] | None, list[str]]:
    """Rows in the order of time: a log with its newest row on top, a clock that was put back in autumn,
    sensors one after the other, rows that were sent again.
    """
    steps = np.diff(seconds)
    if not np.isfinite(seconds).all() or not (steps < 0).any():
        return seconds, None, []
    if (steps <= 0).all():
        order = np.arange(len(seconds))[::-1]
        return seconds[::-1] - seconds[-1], order, ["the newest row came first: the rows were reversed"]
    if series is not None:
        order = np.argsort(seconds, kind="stable")
        return seconds[order] - seconds[order[0]], order, []
    back = np.flatnonzero(steps < 0)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    if back.size == 1 and _moves_by(-_HOUR, steps, usual)[back[0]]:
        moved = seconds.copy()
        moved[back[0] + 1 :] += _HOUR
        return (
            moved,
            None,
            ["the clock was put back by an hour (end of summer time): the hour was added again"],
        )
    kept = np.flatnonzero(~repeated_rows(sheet, seconds))
    if (np.diff(seconds[kept]) >= 0).all():
        return seconds[kept], kept, [f"{len(seconds) - len(kept)} rows repeat an earlier row: left out"]
    return seconds, None, []


def _backwards(sheet: Sheet, seconds: Array, name: str) -> str:
    """What is wrong where time does not run forward, even without rows that were sent again."""
    kept = np.flatnonzero(~repeated_rows(sheet, seconds))
    row = int(np.flatnonzero(np.diff(seconds[kept]) < 0)[0]) + 1
    same = np.flatnonzero(seconds[kept[:row]] == seconds[kept[row]])
    falls = int(np.sum(np.diff(seconds[kept]) < 0))
    do = "sort the rows"
    if falls > 1:
        do = f"it falls {falls} times: sort the rows, or let it run on if the counter starts again there"
    if same.size:
        first = sheet.lines[kept[same[0]]]
        do = f"its stamp stands in line {first} already, with other values: delete the wrong rows"
    return f"{sheet.at(int(kept[row]))}: the time does not run forward in column '{name}'; {do}"


def repeated_rows(sheet: Sheet, seconds: Array) -> NDArray[np.bool_]:
    """Which rows (N,) have the stamp and all cells of a row before them."""
    _, place, counts = np.unique(seconds, return_inverse=True, return_counts=True)
    again = np.flatnonzero(counts[place] > 1)
    found, seen = np.zeros(len(seconds), dtype=bool), set()
    cells = [sheet.cells(k) for k in range(len(sheet.header))]
    for k in again.tolist():
        row = seconds[k], *(column[k] for column in cells)
        found[k] = row in seen
        seen.add(row)
    return found


def _moves_by(seconds: float, steps: Array, usual: float) -> NDArray[np.bool_]:
    """Which steps (N,) are a usual one and these seconds, but for a missing row: stamps once a day are
    far apart without any clock that was moved.
    """
    return np.asarray(np.abs(steps - seconds - usual) <= max(min(usual, _HOUR / 2), 1.0))


def _summer(seconds: Array, first: str) -> tuple[Array, list[str]]:
    """The time without the hour that a clock on a wall skips where summer time begins.

    Args:
        first: ISO 8601 of the first row.
    """
    steps = np.diff(seconds)
    usual = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
    begin = datetime.fromisoformat(first)
    for row in np.flatnonzero(_moves_by(_HOUR, steps, usual)).tolist():
        before, after = (begin + timedelta(seconds=float(seconds[k])) for k in (row, row + 1))
        if summer_time_begins(before, after):
            moved = seconds.copy()
            moved[row + 1 :] -= _HOUR
            return moved, [
                "the clock was put forward by an hour (start of summer time): the hour was taken out"
            ]
    return seconds, []


def spread_evenly(seconds: Array) -> Array:
    """Rows of one stamp, evenly up to the next stamp: a clock of whole seconds, a faster logger.

    None is moved further than stamps usually are apart: a pause stays empty.
    """
    starts = np.flatnonzero(np.concatenate(([True], np.diff(seconds) > 0)))
    if len(starts) == len(seconds):
        return seconds
    gaps = np.diff(seconds[starts])
    widths = np.minimum(np.append(gaps, gaps[-1]), np.median(gaps))
    rows = np.diff(np.append(starts, len(seconds)))
    within = np.arange(len(seconds)) - np.repeat(starts, rows)
    return np.asarray(seconds + within * np.repeat(widths / rows, rows), dtype=np.float64)
