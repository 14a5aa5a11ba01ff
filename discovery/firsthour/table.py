"""An engineer's CSV as it is: any separator, decimal commas, a row of units, stamps of many kinds."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.firsthour.clocks import is_clock
from discovery.firsthour.longform import long_notes
from discovery.firsthour.rows import holds_word, number, read_sheet
from discovery.firsthour.stamps import find_clock
from discovery.naming import is_taken, is_word

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Column:
    """`header`: as in the file. `name`: a word that expressions can use. `unit`: as the file names it, or "".

    `values` (N,), NaN where the cell is empty.
    """

    header: str
    name: str
    unit: str
    values: Array


@dataclass(frozen=True)
class OwnTable:
    """`time` (N,) in s since the first row; `about_time`: how it was read; `notes`: what else was done."""

    path: Path
    time: Array
    about_time: str
    columns: tuple[Column, ...]
    notes: tuple[str, ...] = ()


def read_own(path: Path) -> OwnTable:
    """Read a CSV (plain or gzip).

    Columns without any number, and columns that count the rows or tell the time again, are left out.

    Raises:
        UserError: no such file, no header, a ragged row, no column of time, cells that are no numbers, or
            a long table.
    """
    sheet = read_sheet(path)
    parts = [_split(name, unit) for name, unit in zip(sheet.header, sheet.units, strict=True)]
    clock = find_clock(path, [p[0] for p in parts], [p[1] for p in parts], sheet.body)
    notes = [*sheet.notes, *clock.notes, *long_notes(path, sheet, clock.columns)]
    taken: set[str] = {"time"}
    columns = []
    for index, (words, unit) in enumerate(parts):
        if index in clock.columns:
            continue
        cells = [row[index] for _, row in sheet.body]
        header = sheet.header[index]
        if all(holds_word(cell) for cell in cells if cell) and any(cells):
            notes.append(f"column '{header}' holds words: left out")
            continue
        values = np.array(
            [number(cell, path, line, header) for cell, (line, _) in zip(cells, sheet.body, strict=True)]
        )
        if not np.isfinite(values).any():
            notes.append(f"column '{header}' holds nothing: left out")
        elif is_clock(words, values, clock.seconds):
            notes.append(f"column '{header}' counts rows or tells the time again: left out")
        else:
            columns.append(Column(header, _identifier(words, taken), unit, values))
    if not columns:
        raise UserError(f"{path}: there is no column of numbers besides time")
    return OwnTable(path, clock.seconds, clock.about, tuple(columns), tuple(notes))


def _split(header: str, unit: str) -> tuple[str, str]:
    """Name and unit of a header such as ``Bed temp [°F]``, ``P_drive (kW)`` or ``T1_degC``."""
    found = re.fullmatch(r"(.*?)\s*[\[(]([^\])]*)[\])]\s*", header) or re.fullmatch(
        r"(.*?)\s+in\s+(\S+)", header
    )
    if found and found[1]:
        return found[1], unit or found[2].strip()
    found = re.fullmatch(
        r"(.*?)[_ ](degF|degC|°F|°C|F|C|K|pct|percent|rpm|W|kW|um|µm|mm|s|min|h|ms|A|V|lpm)", header
    )
    if found and found[1]:
        return found[1], unit or found[2]
    return header, unit


def _identifier(words: str, taken: set[str]) -> str:
    name = re.sub(r"\W+", "_", words.replace("°", ""), flags=re.ASCII).strip("_") or "channel"
    name = f"x_{name}" if name[0].isdigit() else name
    base, count = name, 1
    while name in taken or is_taken(name) or not is_word(name):
        count += 1
        name = f"{base}_{count}"
    taken.add(name)
    return name
