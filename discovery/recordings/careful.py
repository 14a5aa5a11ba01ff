"""The careful way into a CSV file: cell by cell, and everything that is wrong with its text is found."""

import codecs
import csv
import io
import math
import re
from array import array
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path

import numpy as np

from discovery.recordings.clock import is_instant, parse_instant, seconds_between
from discovery.recordings.columns import EMPTY_CELLS, TIME, Array, Columns
from discovery.recordings.finding import Finding, more

_SEPARATORS = {",": "a comma", ";": "a semicolon", "\t": "a tab", "|": "a bar"}
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+([eE][-+]?\d+)?")
_NAME = re.compile(r"[^\W_][\w .%°/()\[\]-]{0,40}")
_EXPORT = "export it with a comma between the columns and a point in numbers, or let `discovery new` read it"


@dataclass
class _Troubles:
    """Findings about one file; the same trouble in many cells is one finding, with a count."""

    file: Path
    found: list[Finding] = field(default_factory=list)
    cells: dict[str, Finding] = field(default_factory=dict)
    counts: Counter[str] = field(default_factory=Counter)

    def error(self, line: int | None, what: str, do: str) -> None:
        self.found.append(Finding("error", self.file, line, what, do))

    def cell(self, kind: str, line: int, what: str, do: str) -> None:
        self.counts[kind] += 1
        if kind not in self.cells:
            self.cells[kind] = Finding("error", self.file, line, what, do)

    def all(self) -> list[Finding]:
        counted = [replace(one, what=one.what + more(self.counts[kind])) for kind, one in self.cells.items()]
        return self.found + counted


def read_careful_csv(
    path: Path, data: bytes, wanted: Collection[str]
) -> tuple[Columns | None, list[Finding]]:
    """What can be read of a CSV text whatever it holds, and all that is wrong with its text.

    The columns are None when there is no header with a time column or no row. Never raises.
    """
    troubles = _Troubles(path)
    rows = _rows(_decode(data, troubles), troubles)
    line, cells = next(rows, (0, []))
    if not cells:
        troubles.error(None, "the file is empty", "record again, or take the recording out of the campaign")
        return None, troubles.all()
    header = tuple(name.strip() for name in cells)
    for name in dict.fromkeys(header):
        if header.count(name) > 1:
            troubles.error(line, f"{header.count(name)} columns are named '{name}'", "rename or delete one")
    if TIME not in header:
        do = f"name the column of stamps '{TIME}'; it counts in s (`discovery new` converts minutes)"
        troubles.error(line, f"no column '{TIME}'", do + _named(header))
        return None, troubles.all()
    whole = (row for row in rows if _is_whole(row, header, troubles))
    columns = _columns(header, whole, [name for name in wanted if name in header], troubles)
    return columns, troubles.all()


def _named(header: Sequence[str]) -> str:
    """The names of the columns; nothing of a file that is no table, since reports are passed on."""
    if len(header) < 2 or not all(
        re.fullmatch(r"[^\W_][\w .%°/()\[\]-]{0,40}", name) for name in header[:20]
    ):
        return ""
    return f"; the columns are {', '.join(header)[:200]}"


def _decode(data: bytes, troubles: _Troubles) -> str:
    for mark, name in ((codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16")):
        if data.startswith(mark):
            troubles.error(None, "the text is UTF-16", "save the file as UTF-8")
            return data.decode(name, errors="replace")
    if b"\0" in data:
        line = data[: data.index(b"\0")].count(b"\n") + 1
        troubles.error(line, "a zero byte: not a text", "export the file again as CSV text (UTF-8)")
        return data.replace(b"\0", b"").decode("utf-8", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data[: error.start].count(b"\n") + 1
        letter = data[error.start : error.start + 1].decode("latin-1")
        what = f"not UTF-8 text (perhaps Latin-1, where the byte is '{letter}')"
        troubles.error(line, what, "save the file as UTF-8")
        return data.decode("latin-1")


def _rows(text: str, troubles: _Troubles) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that are not empty, as cells, with their numbers."""
    lines = io.StringIO(text)
    first = next((line for line in lines if line.strip()), "")
    lines.seek(0)
    separator = max(_SEPARATORS, key=first.count) if "," not in first else ","
    if separator != "," and first.count(separator):
        troubles.error(1, f"the columns are separated by {_SEPARATORS[separator]}", _EXPORT)
    reader = csv.reader(lines, delimiter=separator)
    try:
        yield from ((reader.line_num, row) for row in reader if any(cell.strip() for cell in row))
    except csv.Error as error:
        troubles.error(reader.line_num, f"cannot be divided into cells ({error})", _EXPORT)


def _is_whole(row: tuple[int, list[str]], header: Sequence[str], troubles: _Troubles) -> bool:
    line, cells = row
    if len(cells) == len(header):
        return True
    many = len(cells) > len(header)
    do = "look for a decimal comma or a comma in a text" if many else "look for an incomplete line"
    kind = "long row" if many else "short row"
    troubles.cell(kind, line, f"{len(cells)} cells under {len(header)} columns", do)
    return False


def _columns(
    header: tuple[str, ...], body: Iterable[tuple[int, list[str]]], wanted: list[str], troubles: _Troubles
) -> Columns | None:
    place = {name: header.index(name) for name in (TIME, *wanted)}
    instants: bool | None = None
    stamps: list[float | datetime] = []
    lines, values = array("q"), {name: array("d") for name in wanted}
    empty = True
    for line, cells in body:
        empty = False
        text = cells[place[TIME]].strip()
        if instants is None and text:
            instants = is_instant(text)
        stamp = _stamp(text, line, bool(instants), troubles)
        if stamp is None:
            continue
        stamps.append(stamp)
        lines.append(line)
        for name in wanted:
            values[name].append(_number(cells[place[name]].strip(), name, line, troubles))
    if empty:
        troubles.error(None, "no row with a stamp", "record again, or take the recording out of the campaign")
    if not stamps:
        return None  # what is wrong with each stamp has been said
    time, origin = _clock(stamps, lines[0], troubles)
    return Columns(
        header, time, {name: np.array(read) for name, read in values.items()}, np.array(lines), origin
    )


def _stamp(text: str, line: int, instants: bool, troubles: _Troubles) -> float | datetime | None:
    if text in EMPTY_CELLS:
        troubles.cell("no stamp", line, "no stamp in the column time", "fill it in or delete the line")
        return None
    try:
        return parse_instant(text) if instants else _finite(text)
    except ValueError:
        kind = "an ISO 8601 instant" if instants else "a number of seconds"
        do = "write all stamps as seconds, or all as instants like 2026-03-01T08:00:00"
        troubles.cell("stamp", line, f"the stamp '{_short(text)}' is not {kind}", do)
        return None


def _number(text: str, name: str, line: int, troubles: _Troubles) -> float:
    """Return a cell as a number. NaN: the cell is empty or no number."""
    if text in EMPTY_CELLS:
        return math.nan
    try:
        return _finite(text)
    except ValueError:
        if _DECIMAL_COMMA.fullmatch(text):
            do = "write numbers with a decimal point"
            troubles.cell(f"comma {name}", line, f"'{name}' is '{text}' with a decimal comma", do)
            return float(text.replace(",", "."))  # meant so: the checks that follow can go on
        do = "write a number, or leave the cell empty where nothing was measured"
        troubles.cell(f"text {name}", line, f"'{name}' is '{_short(text)}', not a number", do)
        return math.nan


def _finite(text: str) -> float:
    """A plain finite number; ValueError otherwise (Python's own 1_000 and infinity are none)."""
    value = float(text)
    if "_" in text or not math.isfinite(value):
        raise ValueError(text)
    return value


def _short(text: str) -> str:
    return text if len(text) <= 30 else f"{text[:27]}..."


def _clock(stamps: Sequence[float | datetime], line: int, troubles: _Troubles) -> tuple[Array, str | None]:
    instants = [stamp for stamp in stamps if isinstance(stamp, datetime)]
    if not instants:
        return np.array(stamps, dtype=np.float64), None
    try:
        return seconds_between(instants), instants[0].isoformat()
    except ValueError as error:
        troubles.error(line, str(error), "write the zone at every stamp, or at none")
        naive = [instant.replace(tzinfo=None) for instant in instants]
        return seconds_between(naive), naive[0].isoformat()
