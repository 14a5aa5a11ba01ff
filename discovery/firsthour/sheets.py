"""Tables as they come: text of any encoding and mark, Excel, Parquet; what stands above the header, units."""

from __future__ import annotations

import csv
import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery.errors import UserError
from discovery.firsthour.cells import holds_word, is_empty, is_number, is_stamp, is_switch
from discovery.firsthour.encodings import decode
from discovery.firsthour.header import Row, begin, explained, find_header, fitted, is_data
from discovery.firsthour.instants import is_time_of_day
from discovery.firsthour.workbooks import is_workbook, read_workbook
from discovery.limits import check_shape, read_table
from discovery.recordings.columns import Lines

if TYPE_CHECKING:
    import pyarrow as pa

FEWEST = 10  # rows of a recording
_HEAD = 400  # lines in which the first reading has to stand
_TAIL = 50
_CHUNK = 20_000  # rows that are words in memory at once
_MARKS = (";", "\t", ",", "|", "  ", "")  # "  ": two blanks or more; "": any blanks
_TRAILER = 12  # lines below the readings that hold something else, at most


@dataclass(frozen=True)
class Sheet:
    """A table cut into cells.

    `header`, `units` (or ""), `groups` (words that stand over a name, or explain it further up), each (C,);
    `columns`: C columns of words. `lines` (N,): where each row stands. `above`: the lines over the header.
    `name`: of a worksheet. `line`: of the header. `mark`: between its cells, "" for blanks.
    """

    path: Path
    name: str
    header: tuple[str, ...]
    units: tuple[str, ...]
    groups: tuple[str, ...]
    columns: tuple[pa.ChunkedArray, ...]
    lines: Lines
    above: tuple[str, ...]
    notes: tuple[str, ...]
    line: int
    mark: str

    @property
    def rows(self) -> int:
        """How many rows of readings there are."""
        return len(self.lines)

    def cells(self, column: int) -> list[str]:
        """The words of a column, (N,)."""
        found: list[str] = self.columns[column].to_pylist()
        return found

    def at(self, row: int) -> str:
        """File and line of a row, for messages."""
        return f"{self.path}, line {self.lines[row]}"


def read_sheets(path: Path) -> list[Sheet]:
    """The tables of a file: one of a text, one for each worksheet of the same columns.

    Raises:
        UserError: no regular file, no text, no header, fewer than ten rows, or a ragged row.
    """
    if is_workbook(path):
        return _worksheets(path)
    text, notes = decode(read_table(path), path)
    lines = [
        (k, line.rstrip(" \r\n"))
        for k, line in enumerate(io.StringIO(text), start=1)
        if line.strip(" \t;,\r\n")
    ]
    remarks = [line.lstrip("# ") for _, line in lines if line.lstrip().startswith("#")]
    kept = [(k, line) for k, line in lines if not line.lstrip().startswith("#")]
    if len(kept) < 2:
        raise UserError(f"{path}: a header and rows of numbers are expected")
    mark = _mark([line for _, line in kept])
    first = _split(kept[0][1], mark)
    if remarks and is_data(first) and len(_split(remarks[-1], mark)) == len(first):
        kept.insert(0, (kept[0][0] - 1, remarks[-1]))  # the header is a remark
    return [_sheet(path, "", _Lines(kept, mark), mark, tuple(remarks), notes)]


def _worksheets(path: Path) -> list[Sheet]:
    found, refused = [], []
    for name, rows in read_workbook(path).items():
        try:
            found.append(_sheet(path, name, _Lines(rows, None), "", (), ()))
        except UserError as error:
            refused.append(error)
    if not found:
        raise refused[0] if refused else UserError(f"{path}: no worksheet holds anything")
    largest = max(found, key=lambda sheet: sheet.rows)
    return [sheet for sheet in found if sheet.header == largest.header]


@dataclass(frozen=True)
class _Lines:
    """Lines of a table, cut into cells when they are asked for; `mark` None: they are cut already."""

    lines: Sequence[tuple[int, Any]]
    mark: str | None

    def __len__(self) -> int:
        return len(self.lines)

    def cut(self, first: int, last: int | None = None) -> Iterator[Row]:
        """The rows from one up to another."""
        for number, line in islice(self.lines, first, last):
            yield number, line if self.mark is None else _split(line, self.mark)


def _mark(lines: Sequence[str]) -> str:
    """Return the mark between the cells. With the right one, most lines have the same number of cells, and
    most cells can be read.
    """
    sample = [*lines[len(lines) // 2 :][:_TAIL], *lines[-_TAIL:]]

    def score(mark: str) -> tuple[float, int]:
        rows = [_split(line, mark) for line in sample]
        width, same = Counter(map(len, rows)).most_common(1)[0]
        cells = [cell for row in rows for cell in row]
        readable = sum(map(_plain, cells)) / max(1, len(cells))
        share = round(same / len(rows), 1) * (0.2 + round(readable, 1))
        return (share if width > 1 else 0.0), -_MARKS.index(mark)

    best = max(_MARKS, key=score)
    return best if score(best)[0] > 0 else ","


@lru_cache(maxsize=4096)
def _plain(cell: str) -> bool:
    """Return whether a cell is a number without blanks, a stamp, a switch or empty."""
    if is_number(cell):
        return not re.search(r"\d\s+\d", cell)
    return (
        (is_stamp(cell) and not re.search(r"[;\t|]", cell))
        or is_time_of_day(cell)
        or is_switch(cell)
        or is_empty(cell)
    )


def _split(line: str, mark: str) -> list[str]:
    if mark.strip() or mark == "\t":
        cells = line.split(mark)
        if '"' in line:
            with suppress(csv.Error):  # quotes that do not match are letters
                cells = next(csv.reader([line], delimiter=mark), [])
        return [cell.strip() for cell in cells]
    return re.split(r"\s{2,}|\t", line.strip()) if mark else line.split()


def _sheet(
    path: Path, name: str, lines: _Lines, mark: str, remarks: tuple[str, ...], notes: tuple[str, ...]
) -> Sheet:
    head = list(lines.cut(0, _HEAD))
    middle = list(lines.cut(len(lines) // 2, len(lines) // 2 + _HEAD))
    width, spare = _width(head, middle)
    first = begin([cells for _, cells in head], (width, spare))
    at, units, groups = find_header(path, head, first, width)
    body = first if first is not None else at + 1
    columns, numbers, left = _body(path, lines, body, width, spare, head[at][1])
    rows = len(numbers)
    if rows < FEWEST:
        raise UserError(
            f"{path}: only {rows} rows of data below the header; a recording needs at least {FEWEST}"
        )
    check_shape(path, rows, width)
    header = (*(fitted(head[at][1], width) or head[at][1]), *[""] * width)[:width]
    header = tuple(word or group for word, group in zip(header, groups, strict=True))  # a merged cell
    above = (*remarks, *("  ".join(filter(None, cells)) for _, cells in head[:at]))
    said = (
        *notes,
        *(
            [f"{at} line{'s' * (at > 1)} above the header {'were' if at > 1 else 'was'} passed over"]
            if at
            else ()
        ),
        *left,
    )
    groups = [group or explained(word, head[:at]) for group, word in zip(groups, header, strict=True)]
    return Sheet(
        path,
        name,
        tuple(header),
        tuple(units),
        tuple(groups),
        columns,
        numbers,
        above,
        said,
        head[at][0],
        mark,
    )


def _is_remark(cells: Sequence[str]) -> bool:
    """Whether a row below the readings is a remark or a sum: it begins with a word, not with a stamp."""
    return not is_data(cells) and holds_word(cells[0]) and not is_stamp(cells[0])


def _width(head: Sequence[Row], middle: Sequence[Row]) -> tuple[int, int]:
    """Cells of most rows, and how many a row with a mark too many at its end has.

    A mark behind the last number alone, or behind the last name alone, ends no column.
    """
    width = Counter(len(cells) for _, cells in middle).most_common(1)[0][0]
    ended = not any(cells[-1] for _, cells in middle if len(cells) == width)
    names = any(len(c) == width - 1 and len(c) > 1 and all(map(holds_word, c)) for _, c in head)
    return (width - 1, width) if ended and names else (width, width + 1)


def _body(
    path: Path, lines: _Lines, first: int, width: int, spare: int, header: list[str]
) -> tuple[tuple[pa.ChunkedArray, ...], Lines, tuple[str, ...]]:
    """Columns of words, the line of each row, and what was left out: a header once more, what stands
    below.
    """
    import pyarrow as pa

    chunks: list[list[pa.Array]] = [[] for _ in range(width)]
    numbers: list[int] = []
    kept: list[list[str]] = []
    again = 0
    ragged: tuple[int, int] | None = None
    trailer: list[int] = []

    def store() -> None:
        for column, cells in zip(chunks, zip(*kept, strict=True), strict=True):
            column.append(pa.array(cells, type=pa.string()))
        kept.clear()

    for index, (line, cells) in enumerate(lines.cut(first), start=first):
        if len(cells) == spare and (spare < width or not cells[-1]):
            cells = cells[:width] if spare > width else [*cells, ""]
        last = len(lines) - index <= _TRAILER and index > first + FEWEST
        if len(cells) != width or (last and _is_remark(cells)):
            cut_off = index == len(lines) - 1 and len(cells) < width
            if cells[:width] == header[:width]:
                again += 1
            elif last and (cut_off or not is_data(cells)):
                trailer.append(line)
            elif ragged is None:
                ragged = line, len(cells)
            continue
        if cells == header:
            again += 1
            continue
        if trailer and ragged is None:  # readings go on: what looked like the end is a broken row
            ragged = trailer[0], -1
        kept.append(cells)
        numbers.append(line)
        if len(kept) == _CHUNK:
            store()
    if ragged is not None:
        count = (
            f"{ragged[1]} cells where the header has {width}"
            if ragged[1] >= 0
            else "cells that are no readings"
        )
        raise UserError(f"{path}, line {ragged[0]}: {count}; mend the row")
    if kept:
        store()
    notes = [f"{again} rows repeat the header: left out"] if again else []
    if trailer:
        rest = f" and {len(trailer) - 1} more" if trailer[1:] else ""
        notes.append(f"line {trailer[0]}{rest} below the readings: left out")
    return (
        tuple(map(pa.chunked_array, chunks)) if numbers else (),
        np.array(numbers, dtype=np.int64),
        tuple(notes),
    )
