"""Tables in long format: the readings of several sensors below each other, in one column."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

from discovery.errors import UserError
from discovery.firsthour.rows import Sheet, holds_word, is_number
from discovery.firsthour.words import TEMPERATURES, plain, role_of

_MOST = 50  # sensors
_TURNS = 3  # of each sensor at least, on average
_SHARED = 0.7  # stamps a row at most, where sensors share them
_NAMES = r"(.* )?(id|nr|no|number|address|addr)|node|device|channel|station|sensor"
_VALUES = r"(.* )?(value|wert|messwert|istwert|reading|measurement|state)"


def long_notes(path: Path, sheet: Sheet, clock: Sequence[int]) -> list[str]:
    """What a person should know of a table whose rows are those of several sensors in turn.

    Args:
        path: of the file.
        sheet: its rows.
        clock: columns that tell the time.

    Raises:
        UserError: sensors share their stamps, so that no row stands for an instant.
    """
    columns = {k: [row[k] for _, row in sheet.body] for k in range(len(sheet.header)) if k not in clock}
    names = _names(sheet.header, columns)
    value = None if names is None else _value(sheet.header, columns, names)
    if names is None or value is None:
        return []
    count, of, values = len(set(columns[names])), sheet.header[names], sheet.header[value]
    stamps = [tuple(row[k] for k in clock) for _, row in sheet.body]
    shared = len(set(stamps)) <= _SHARED * len(stamps)
    one_of_each = len(set(zip(stamps, columns[names], strict=True))) > 0.9 * len(stamps)
    do = f"make a column of each with pandas and take wide.csv: {_pivot(path, sheet, clock, of, values)}"
    if shared and one_of_each:
        raise UserError(
            f"{path}: the table is long: column '{of}' names {count} quantities in turn, and the readings of "
            f"all stand in '{values}'; {do}"
        )
    return [
        f"column '{of}' takes {count} values in turn: if so many sensors share the column '{values}', {do}"
    ]


def _names(header: Sequence[str], columns: dict[int, list[str]]) -> int | None:
    """The column that says whose reading a row is: words before numbers, the most different ones first."""
    found = [(_is_words(cells), len(set(cells)), -k) for k, cells in columns.items() if _in_turn(cells)]
    known = [one for one in found if one[0] or _numbered(header[-one[2]], columns[-one[2]])]
    return -max(known)[2] if known else None


def _in_turn(cells: Sequence[str]) -> bool:
    """Whether few values alternate: those of a state stay for a while."""
    count = len(set(cells[: _MOST * 20]))
    if not 2 <= count <= _MOST or not 2 <= len(set(cells)) <= min(_MOST, len(cells) / _TURNS):
        return False
    changes = sum(a != b for a, b in pairwise(cells))
    return changes > len(cells) / 2


def _is_words(cells: Sequence[str]) -> bool:
    return all(holds_word(cell) for cell in set(cells))


def _numbered(name: str, cells: Sequence[str]) -> bool:
    return bool(re.fullmatch(_NAMES, plain(name))) and all(cell.isdecimal() for cell in set(cells))


def _value(header: Sequence[str], columns: dict[int, list[str]], names: int) -> int | None:
    """The column of the readings: by its name, else a temperature, else the first that could be one."""
    could_be = [k for k, cells in columns.items() if k != names and _moves(cells, columns[names])]
    named = [k for k in could_be if re.fullmatch(_VALUES, plain(header[k]))]
    hot = [
        k for k in could_be if role_of(re.sub(r"\W.*", "", header[k]), None, np.empty(0)).role in TEMPERATURES
    ]
    return next(iter([*named, *hot, *could_be]), None)


def _moves(cells: Sequence[str], names: Sequence[str]) -> bool:
    """Whether a column holds numbers that differ for one name and neither count nor tell the time."""
    numbers = [float(cell.replace(",", ".")) for cell in cells if is_number(cell)]
    if len(numbers) < len(cells) / 2 or all(a <= b for a, b in pairwise(numbers)):
        return False
    return len(set(zip(names, cells, strict=True))) > len(set(names))


def _pivot(path: Path, sheet: Sheet, clock: Sequence[int], names: str, values: str) -> str:
    """Python that makes the table wide; rows stay in the order of the file, whatever its stamps look like."""
    index = [sheet.header[k] for k in clock]
    sep = {",": "", "": r', sep=r"\s+"'}.get(sheet.mark, f", sep={sheet.mark!r}".replace("'", '"'))
    skip = f", skiprows={sheet.line - 1}" if sheet.line > 1 else ""
    how = f"index={index}, columns='{names}', values='{values}', aggfunc='first', sort=False"
    how = how.replace("'", '"')
    # a header of numbers would be taken for a row
    numbers = all(row[sheet.header.index(names)].isdecimal() for _, row in sheet.body[:_MOST])
    prefix = re.sub(r"[^a-zA-Z0-9]+", "_", re.sub(r"[\[(].*", "", values)).strip("_")
    named = f'.add_prefix("{prefix}_")' if numbers else ""
    table = f'pd.read_csv("{path.name}"{sep}{skip}).pivot_table({how}){named}'
    return f'import pandas as pd; {table}.to_csv("wide.csv")'
