"""An engineer's CSV as it is: any separator, decimal commas, a row of units, stamps of many kinds."""

from __future__ import annotations

import csv
import gzip
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError

Array = NDArray[np.float64]

_STAMPS = (
    "%d.%m.%Y %H:%M:%S",
    "%d.%m.%Y %H:%M",
    "%Y/%m/%d %H:%M:%S",
    "%d/%m/%Y %H:%M:%S",
    "%m/%d/%Y %H:%M:%S",
)
_TIME_NAME = re.compile(
    r"^(time|t|date|datum|zeit|zeitstempel|stamp|timestamp|datetime|elapsed|seconds|minutes|hours|clock)\b"
)
_TIME_UNITS = {
    "ms": 1e-3,
    "s": 1.0,
    "sec": 1.0,
    "seconds": 1.0,
    "min": 60.0,
    "minutes": 60.0,
    "h": 3600.0,
    "hr": 3600.0,
    "hours": 3600.0,
}
_EMPTY = {"", "nan", "na", "n/a", "null", "none", "-"}


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
    """`time` (N,) in s since the first row; `about_time`: how the stamps were read."""

    path: Path
    time: Array
    about_time: str
    columns: tuple[Column, ...]


def read_own(path: Path) -> OwnTable:
    """Read a CSV (plain or gzip).

    Raises:
        UserError: no such file, no header, a ragged row, no column of time, or cells that are no numbers.
    """
    rows = _rows(path)
    header, units, body = rows[0][1], [""] * len(rows[0][1]), rows[1:]
    if body and not any(map(_is_number, body[0][1])) and not any(map(_is_stamp, body[0][1])):
        units, body = body[0][1], body[1:]
    if len(body) < 10:
        raise UserError(
            f"{path}: only {len(body)} rows of data below the header; a recording needs at least 10"
        )
    for line, row in body:
        if len(row) != len(header):
            raise UserError(
                f"{path}, line {line}: {len(row)} cells where the header has {len(header)}; mend the row"
            )
    parts = [_split(name, unit) for name, unit in zip(header, units, strict=True)]
    at, time, about = _time(path, [p[0] for p in parts], [p[1] for p in parts], body)
    taken: set[str] = {"time"}
    columns = []
    for index, (words, unit) in enumerate(parts):
        if index != at:
            name = _identifier(words, taken)
            values = np.array([_number(row[index], path, line, header[index]) for line, row in body])
            columns.append(Column(header[index], name, unit, values))
    if not columns:
        raise UserError(f"{path}: there is no column besides time")
    return OwnTable(path, time, about, tuple(columns))


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Rows with their lines; separator and encoding as the file has them."""
    try:
        data = path.read_bytes()
        data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); name a CSV file") from None
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if "\0" in text:
        raise UserError(f"{path}: this is no text; save the table as CSV")
    lines = [line for line in text.splitlines() if line.strip()]
    if len(lines) < 2:
        raise UserError(f"{path}: a header and rows of numbers are expected")
    separator = max(";\t,", key=lambda mark: min(lines[0].count(mark), lines[-1].count(mark)))
    numbered = [
        (k, line)
        for k, line in enumerate(text.splitlines(), start=1)
        if line.strip() and not line.startswith("#")
    ]
    return [
        (k, [cell.strip() for cell in next(csv.reader([line], delimiter=separator))]) for k, line in numbered
    ]


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
    while name in taken or name in (
        "lambda",
        "in",
        "is",
        "if",
        "or",
        "as",
        "min",
        "max",
        "abs",
        "exp",
        "log",
        "lag",
    ):
        count += 1
        name = f"{base}_{count}"
    taken.add(name)
    return name


def _time(
    path: Path, names: Sequence[str], units: Sequence[str], body: list[tuple[int, list[str]]]
) -> tuple[int, Array, str]:
    """Which column is time, its seconds since the first row, and how it was read."""
    named = [k for k, name in enumerate(names) if _TIME_NAME.match(name.lower().replace("_", " "))]
    for at in dict.fromkeys([*named, 0]):
        cells = [row[at] for _, row in body]
        if _is_stamp(cells[0]) and not _is_number(cells[0]):
            seconds = _instants(cells)
            if seconds is None:
                continue
            about = "instants"
        else:
            try:
                values = np.array(
                    [
                        _number(cell, path, line, names[at])
                        for cell, (line, _) in zip(cells, body, strict=True)
                    ]
                )
            except UserError:
                continue
            spelled = units[at].lower() or next(
                (u for u in ("minutes", "hours", "ms") if u in names[at].lower()), "s"
            )
            factor = _TIME_UNITS.get(spelled, 1.0)
            seconds, about = (
                (values - values[0]) * factor,
                f"counted in {spelled if spelled in _TIME_UNITS else 's'}",
            )
        if np.isfinite(seconds).all() and (np.diff(seconds) > 0).all():
            return at, np.round(seconds, 6), f"{about}, from column '{names[at]}'"
        backwards = np.flatnonzero(~(np.diff(seconds) > 0))
        if at in named and len(backwards):
            line = body[int(backwards[0]) + 1][0]
            raise UserError(
                f"{path}, line {line}: the time does not run forward in column '{names[at]}'; sort the rows"
            )
    raise UserError(
        f"{path}: no column of time was found; call one 'time' (seconds, or instants as 2026-03-01T08:00:00)"
    )


def _is_stamp(cell: str) -> bool:
    return bool(re.match(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}", cell))


def _instants(cells: Sequence[str]) -> Array | None:
    for form in ("", *_STAMPS):
        try:
            stamps = [
                datetime.strptime(cell, form) if form else datetime.fromisoformat(cell) for cell in cells
            ]
            return np.array([(stamp - stamps[0]).total_seconds() for stamp in stamps])
        except (ValueError, TypeError):
            continue
    return None


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", "."))
    except ValueError:
        return False
    return True


def _number(cell: str, path: Path, line: int, column: str) -> float:
    if cell.lower() in _EMPTY:
        return math.nan
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        raise UserError(
            f"{path}, line {line}, column '{column}': '{cell}' is not a number; empty it or mend it"
        ) from None
