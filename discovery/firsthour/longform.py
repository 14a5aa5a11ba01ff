"""Tables in long format: the readings of several sensors below each other, made a column of each."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from discovery.firsthour.cells import holds_word, is_empty, is_number, is_stamp, read_numbers
from discovery.firsthour.sheets import Sheet
from discovery.firsthour.vocabulary import fold

Array = NDArray[np.float64]

_MOST = 200  # sensors
_TURNS = 3  # of each sensor at least, on average
_NAMES = r"(.* )?(id|nr|no|number|address|addr)|node|device|channel|station|sensor|kanal|messstelle|ch"
_UNITS = r"(.* )?(unit|units|einheit|einheiten|単位)"


@dataclass(frozen=True)
class Long:
    """`names`: the column that says whose reading a row is; `series` (N,): its words."""

    names: int
    series: list[str]


def find_long(sheet: Sheet) -> Long | None:
    """Whether the rows of a table are those of several sensors in turn, or one sensor after the other."""
    known = {k: sheet.cells(k) for k in range(len(sheet.header))}
    found = [
        (all(map(_is_name, set(cells))), len(set(cells)), -k)
        for k, cells in known.items()
        if _alternate(cells) or _stacked(cells, known, k)
    ]
    found = [one for one in found if one[0] or _numbered(sheet.header[-one[2]], known[-one[2]])]
    if not found:
        return None
    names = -max(found)[2]
    moving = [k for k, cells in known.items() if k != names and _moves(cells, known[names])]
    return Long(names, known[names]) if moving else None


@dataclass(frozen=True)
class Wide:
    """`rows` (T,): the row of the long table that gives each stamp; columns: header, unit, values (T,)."""

    rows: NDArray[np.intp]
    columns: list[tuple[str, str, Array]]
    note: str


def widen(
    sheet: Sheet,
    long: Long,
    seconds: Array,
    order: NDArray[np.intp],
    names: Sequence[str],
    units: Sequence[str],
    clock: Sequence[int],
    comma: bool | None,
) -> Wide:
    """A column of each sensor and quantity; an empty cell where a sensor has no reading at a stamp.

    Args:
        seconds: (N,) in the order of time. order: (N,) rows of the table in that order.
        clock: columns of the stamps.
    """
    series = np.array(long.series)[order]
    starts = np.flatnonzero(np.concatenate(([True], np.diff(seconds) > 0)))
    stamp = np.cumsum(np.concatenate(([0], (np.diff(seconds) > 0).astype(np.intp))))
    who = list(dict.fromkeys(series.tolist()))
    unit_column = next((k for k, name in enumerate(names) if re.fullmatch(_UNITS, fold(name))), None)
    said = dict(zip(long.series, sheet.cells(unit_column), strict=True)) if unit_column is not None else {}
    columns = []
    values_of = [
        k for k in range(len(names)) if k not in (long.names, *clock) and _moves(sheet.cells(k), long.series)
    ]
    for k in values_of:
        values = read_numbers(sheet.cells(k), comma).values[order]
        for one in who:
            mine = (series == one) & np.isfinite(values)
            column = np.full(len(starts), np.nan)
            column[stamp[mine][::-1]] = values[mine][::-1]
            header = one if len(values_of) == 1 and not one.isdecimal() else f"{names[k]} {one}"
            if np.isfinite(column).any():
                columns.append((header, units[k] or said.get(one, ""), column))
    note = (
        f"the table is long: column '{sheet.header[long.names]}' names {len(who)} sensors; "
        f"a column was made of each reading of {', '.join(names[k] for k in values_of)}"
    )
    return Wide(order[starts], columns, note)


def _is_name(cell: str) -> bool:
    return holds_word(cell) and not is_stamp(cell)


def _alternate(cells: Sequence[str]) -> bool:
    """Return whether a few values alternate from row to row. A state of a machine would stay for a while."""
    count = len(set(cells[: _MOST * 20]))
    if not 2 <= count <= _MOST or not 2 <= len(set(cells)) <= min(_MOST, len(cells) / _TURNS):
        return False
    return sum(a != b for a, b in pairwise(cells)) > len(cells) / 2


def _stacked(cells: Sequence[str], known: Mapping[int, Sequence[str]], at: int) -> bool:
    """Return whether each word fills one block of rows, and the stamps start again with each block."""
    if not 2 <= len(set(cells[:20_000])) <= _MOST and len(set(cells)) != len(
        set(cells[-20_000:]) | {cells[0]}
    ):
        return False
    changes = [k + 1 for k, (a, b) in enumerate(pairwise(cells)) if a != b]
    if not changes or len(changes) != len(set(cells)) - 1 or not all(map(_is_name, set(cells))):
        return False
    first = [0, *changes]
    return any(
        len({column[k] for k in first}) == 1 and len(set(column)) > len(first)
        for k, column in known.items()
        if k != at
    )


def _numbered(name: str, cells: Sequence[str]) -> bool:
    return bool(re.fullmatch(_NAMES, fold(name))) and all(cell.isdecimal() for cell in set(cells))


def _moves(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Return whether a column holds readings: its numbers differ for one name, and it is no counter and no
    clock.
    """
    numbers = [cell for cell in cells if is_number(cell)]
    if len(numbers) < len(cells) / 2 or any(is_stamp(c) for c in cells[:20] if not is_empty(c)):
        return False
    values = read_numbers(cells, None).values
    if (np.diff(values) >= 0).all():
        return False
    return len(set(zip(names, cells, strict=True))) > len(set(names))
