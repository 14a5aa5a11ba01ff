"""The rows of an engineer's text table: encoding, separator, what stands above the header, header, units."""

from __future__ import annotations

import csv
import gzip
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from discovery.errors import UserError

Row = tuple[int, list[str]]
"""Number of the line, and its cells."""

_EMPTY = {"", "nan", "inf", "-inf", "na", "n/a", "null", "none", "nil", "-", "--", "---", "?", "ol"}
_EMPTY |= {"#n/a", "#nv", "#value!", "#div/0!", "<na>", "nat", "-nan", "undefined", "unknown", "unavailable"}
_SWITCH = {"true": 1.0, "on": 1.0, "yes": 1.0, "false": 0.0, "off": 0.0, "no": 0.0}
_FEWEST = 10  # rows of a recording
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")


@dataclass(frozen=True)
class Sheet:
    """`header` and `units` (or empty words), the rows of data, and what a person should know.

    `line`: of the header. `mark`: what separates its cells, "" for blanks.
    """

    header: list[str]
    units: list[str]
    body: list[Row]
    notes: tuple[str, ...]
    line: int
    mark: str


def read_sheet(path: Path) -> Sheet:
    """Read a text table (plain or gzip).

    Raises:
        UserError: no such file, no text, no header, fewer than ten rows, or a ragged row.
    """
    rows, mark = _cut(path, _text(path))
    rows = _one_mark_less(rows)
    width = _width(rows)
    first = next((k for k, (_, cells) in enumerate(rows) if len(cells) == width and _is_data(cells)), None)
    if first == 0:
        raise UserError(
            f"{path}, line {rows[0][0]}: numbers where the names of the columns should stand; "
            f"put a line of {width} names above them, such as time,heater,T1"
        )
    above = [k for k in range(len(rows) if first is None else first) if len(rows[k][1]) == width]
    if not above:
        _compare(path, rows[: len(rows) if first is None else first], width)
        raise UserError(
            f"{path}: no header above the rows of {width} cells; write {width} names, starting with time"
        )
    at = max(above, key=lambda k: (sum(map(bool, rows[k][1])), -k))
    units = _units(rows[at + 1][1]) if first is not None and at + 1 < first else [""] * width
    body = rows[first:] if first is not None else rows[at + 1 :]
    if len(body) < _FEWEST:
        raise UserError(
            f"{path}: only {len(body)} rows of data below the header; a recording needs at least {_FEWEST}"
        )
    for line, cells in body:
        if len(cells) != width:
            raise UserError(
                f"{path}, line {line}: {len(cells)} cells where the header has {width}; mend the row"
            )
    notes = (f"{at} lines above the header were passed over",) if at else ()
    units = units if len(units) == width else [""] * width
    return Sheet(rows[at][1], units, body, notes, rows[at][0], mark)


def _width(rows: Sequence[Row]) -> int:
    """Cells of most rows; what stands above the header has its own."""
    return Counter(len(cells) for _, cells in rows[len(rows) // 2 :]).most_common(1)[0][0]


def _one_mark_less(rows: list[Row]) -> list[Row]:
    """A mark behind the last name alone, or behind the last number alone, ends no column."""
    width = _width(rows)
    names = next((cells for _, cells in rows if len(cells) > 1 and all(map(holds_word, cells))), [])
    if len(names) == width - 1 and not any(cells[-1] for _, cells in rows if len(cells) == width):
        return [(line, cells[: width - 1] if len(cells) == width else cells) for line, cells in rows]
    ended = [
        len(cells) == width + 1 and cells[-1] == "" and all(map(holds_word, cells[:-1])) for _, cells in rows
    ]
    return [(line, cells[:-1] if cut else cells) for cut, (line, cells) in zip(ended, rows, strict=True)]


def _compare(path: Path, above: Sequence[Row], width: int) -> None:
    """Raise a UserError where the line above the rows is a header with more or fewer names than they have."""
    line, names = above[-1] if above else (0, [])
    if len(names) > 1 and all(holds_word(name) for name in names):
        raise UserError(
            f"{path}, line {line}: the header has {len(names)} names, the rows {width} cells; "
            f"{'add the missing names' if len(names) < width else 'a name too many or a column is missing'}"
        )


def is_number(cell: str) -> bool:
    """Whether a cell is a number, with a decimal point or comma."""
    return bool(_NUMBER.fullmatch(cell))


def is_stamp(cell: str) -> bool:
    """Whether a cell holds a date or a time of day."""
    return bool(re.match(r"\d{1,4}[-./]\d{1,2}[-./]\d{1,4}(?!\d)|\d{1,3}:\d{2}(:\d{2})?", cell))


def holds_word(cell: str) -> bool:
    """Whether a cell holds neither a number nor a switch nor a word for "not measured"."""
    return not is_number(cell) and cell.lower() not in _EMPTY and cell.lower() not in _SWITCH


def number(cell: str, path: Path, line: int, column: str) -> float:
    """A cell as a number: NaN where nothing was measured, 1 or 0 for on or off.

    Raises:
        UserError: the cell holds something else.
    """
    if is_number(cell):
        return float(cell.replace(",", "."))
    if cell.lower() in _EMPTY:
        return math.nan
    if cell.lower() in _SWITCH:
        return _SWITCH[cell.lower()]
    raise UserError(f"{path}, line {line}, column '{column}': '{cell}' is not a number; empty it or mend it")


def _text(path: Path) -> str:
    try:
        data = path.read_bytes()
        data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    except (OSError, EOFError) as error:
        why = getattr(error, "strerror", None) or "the archive is damaged"
        raise UserError(f"{path}: cannot be read ({why}); name a CSV file") from None
    for encoding in ("utf-16",) if data[:2] in (b"\xff\xfe", b"\xfe\xff") else ("utf-8-sig", "latin-1"):
        try:
            text = data.decode(encoding)
            break
        except UnicodeDecodeError:
            continue
    else:
        text = "\0"
    if "\0" in text:
        raise UserError(f"{path}: this is no text; save the table as CSV")
    return text


def _cut(path: Path, text: str) -> tuple[list[Row], str]:
    """Lines that hold something and are no remark, cut into cells, and the mark between these."""
    lines = [(k, line) for k, line in enumerate(text.splitlines(), start=1) if line.strip(" \t;,")]
    lines = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise UserError(f"{path}: a header and rows of numbers are expected")
    tail = [line for _, line in lines[-20:]] if len(lines) > 20 else [line for _, line in lines[1:]]
    # a semicolon stands in no number, a comma may: the first mark that all lines have
    mark = next((m for m in ";\t,|" if sum(m in line for line in tail) > len(tail) / 2), None)
    if mark is None:
        return [(k, line.split()) for k, line in lines], ""
    rows = [(k, [cell.strip() for cell in next(csv.reader([line], delimiter=mark))]) for k, line in lines]
    return rows, mark


def _units(cells: Sequence[str]) -> list[str]:
    """A row of units; "-" is one, other words for "nothing here" are none."""
    return [cell if cell == "-" or cell.lower() not in _EMPTY else "" for cell in cells]


def _is_data(cells: Sequence[str]) -> bool:
    """More numbers, stamps and switches than words; a header or a row of units has none.

    Words for "not measured" count for neither: a logger often has nothing yet in its first row.
    """
    known = [cell for cell in cells if cell.lower() not in _EMPTY]
    readable = [c for c in known if is_number(c) or is_stamp(c) or c.lower() in _SWITCH]
    return len(readable) > len(known) / 2
