"""An engineer's table in any form: encoding, mark and decimal sign, stamps of many kinds, wide or long."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.firsthour.cells import (
    comma_is_decimal,
    is_empty,
    is_number,
    is_stamp,
    is_switch,
    read_numbers,
)
from discovery.firsthour.clocks import is_clock
from discovery.firsthour.instants import is_instant
from discovery.firsthour.longform import find_long, widen
from discovery.firsthour.measures import steps_in, unit_in
from discovery.firsthour.sheets import Sheet, read_sheets
from discovery.firsthour.stamps import Clock, find_clock, spread_evenly
from discovery.firsthour.vocabulary import words_of
from discovery.naming import is_taken, is_word
from discovery.recordings.oddvalues import logger_words
from discovery.recordings.units import multiple

Array = NDArray[np.float64]

_GARBLED = 0.02  # words for each on or off: so few are garbled cells, not states
_SAMPLE = 2000  # cells of a column that show how decimals are written
_NOTED = re.compile(r"(.+?)\s*\(([^()]*:[^()]*)\)")  # Temp, °C (LGR S/N: 123, LBL: bed)
_UMLAUTS = str.maketrans(
    {
        "ä": "ae",
        "ö": "oe",
        "ü": "ue",
        "ß": "ss",
        "Ä": "Ae",
        "Ö": "Oe",
        "Ü": "Ue",
        "µ": "u",
        "μ": "u",
        "Δ": "d",
        "δ": "d",
        "θ": "T",
        "ϑ": "T",
        "Θ": "T",
        "λ": "l",
        "α": "a",
        "β": "b",
        "γ": "g",
        "ε": "e",
        "σ": "s",
        "φ": "phi",
        "ω": "w",
        "Ω": "Ohm",
        "ø": "o",
        "ł": "l",
        "Ł": "L",
        "°": "",
    }
)


@dataclass(frozen=True)
class Column:
    """`header`: as in the file. `name`: a word that expressions can use. `unit`: as the file names it, or "".

    `values` (N,), NaN where the cell is empty. `about`: words of the file that explain the name. `words`:
    of a switch that no list knows, the word for 0 first.
    """

    header: str
    name: str
    unit: str
    values: Array
    about: str = ""
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class OwnTable:
    """`time` (N,) in s since the first row; `about_time`: how it was read; `notes`: what else was done.

    `first`: ISO 8601 of the first row, or ""; `others`: the same, if day and month are read otherwise.
    `counted`: nothing says the unit of `time`, no conversion; `clock`: name of its column. `above`: lines
    over the table.
    """

    path: Path
    time: Array
    about_time: str
    columns: tuple[Column, ...]
    notes: tuple[str, ...] = ()
    first: str = ""
    counted: bool = False
    clock: str = ""
    above: tuple[str, ...] = ()
    name: str = field(default="")
    others: tuple[str, ...] = ()

    def values(self, name: str) -> Array | None:
        """Values of a column, (N,), or None."""
        return next((column.values for column in self.columns if column.name == name), None)


def read_own(path: Path) -> OwnTable:
    """Read a CSV (plain or gzip, any encoding), Excel workbook or Parquet file; of several sheets the first.

    Columns without any number, and columns that count the rows or repeat the time, are left out.

    Raises:
        UserError: no regular file, no header, a ragged row, no column of time, or cells that are no numbers.
    """
    return read_tables(path)[0]


def read_tables(path: Path) -> list[OwnTable]:
    """Read every sheet of a file that has the columns of its largest one. Raises UserError as `read_own`."""
    return [_table(sheet) for sheet in read_sheets(path)]


def _table(sheet: Sheet) -> OwnTable:
    parts = _names(sheet.header)
    names, units = [p[0] for p in parts], [u or p[1] for p, u in zip(parts, sheet.units, strict=True)]
    comma = comma_is_decimal(
        cell for column in sheet.columns for cell in column.slice(0, _SAMPLE).to_pylist() if is_number(cell)
    )
    long = find_long(sheet)
    clock = find_clock(sheet, names, units, long.series if long else None)
    order = np.arange(sheet.rows) if clock.order is None else clock.order
    notes = [*sheet.notes, *clock.notes]
    taken: set[str] = {"time"}
    if long is not None:
        wide = widen(sheet, long, clock.seconds, order, names, units, clock.columns, comma)
        time = clock.seconds[np.searchsorted(clock.seconds, np.unique(clock.seconds))]
        found = [
            (header, *(unit_in(header) or (header, "")), values, "", ()) for header, _, values in wide.columns
        ]
        stated = [unit for _, unit, _ in wide.columns]
        columns = [
            Column(h, identifier(w, taken), s or u, v)
            for (h, w, u, v, _, _), s in zip(found, stated, strict=True)
        ]
        notes.append(wide.note)
    else:
        clock, order, doubled = _without_doubles(sheet, clock, order)
        time, said = _spread(clock)
        columns, more = _columns(sheet, names, units, clock, order, comma, taken)
        notes += [*doubled, *said, *more]
    if not columns:
        raise UserError(f"{sheet.path}: there is no column of numbers except time")
    columns, steps = _whole_units(columns)
    notes += steps
    return OwnTable(
        sheet.path,
        np.round(time, 6),
        clock.about,
        tuple(columns),
        tuple(notes),
        clock.first,
        clock.counted,
        sheet.header[clock.columns[0]],
        sheet.above,
        sheet.name,
        clock.others,
    )


def _names(header: Sequence[str]) -> list[tuple[str, str]]:
    """Name and unit (or "") of each column. Of notes behind them a name keeps what not all notes say."""
    noted = [None if unit_in(name) else _NOTED.fullmatch(name) for name in header]
    said = [re.split(r"[\s,:]+", one[2]) for one in noted if one]
    usual = set.intersection(*map(set, said)) if said else set()
    found = []
    for name, one in zip(header, noted, strict=True):
        plain, unit = unit_in(one[1] if one else name) or (one[1] if one else name, "")
        own = [word for word in re.split(r"[\s,:]+", one[2]) if word not in usual] if one else []
        found.append((" ".join([plain, *own]), unit))
    return found


def _whole_units(columns: Sequence[Column]) -> tuple[list[Column], list[str]]:
    """Columns that count in steps of a unit, in that unit: 2.5 um, x10 mV, 1/10 °C. 10 V may be a range."""
    found, notes = list(columns), []
    for k, column in enumerate(columns):
        if (written := multiple(column.unit)) is None:
            continue
        factor, unit = written
        if steps_in(column.unit):
            found[k] = replace(column, unit=unit, values=factor * column.values)
            notes.append(
                f"column '{column.header}' counts in steps of {column.unit}: multiplied by {factor:g}"
            )
        elif factor != 1.0:
            found[k] = replace(column, unit=unit)
            notes.append(
                f"column '{column.header}': {column.unit} is taken as its range (?); if it counts in such "
                f'steps, say --is "{column.header}=x{column.unit}"'
            )
    return found, notes


def _without_doubles(
    sheet: Sheet, clock: Clock, order: NDArray[np.intp]
) -> tuple[Clock, NDArray[np.intp], list[str]]:
    """The rows without those that repeat the row before, stamp and all, if most stamps have one row alone."""
    same = np.flatnonzero(np.diff(clock.seconds) == 0) + 1
    if not same.size or same.size > 0.5 * len(clock.seconds):
        return clock, order, []
    cells = [sheet.cells(k) for k in range(len(sheet.header))]
    doubles = [k for k in same.tolist() if all(one[order[k]] == one[order[k - 1]] for one in cells)]
    if not doubles:
        return clock, order, []
    said = f"{len(doubles)} {'row repeats' if len(doubles) == 1 else 'rows repeat'} the row before: left out"
    return replace(clock, seconds=np.delete(clock.seconds, doubles)), np.delete(order, doubles), [said]


def _spread(clock: Clock) -> tuple[Array, list[str]]:
    same = int(np.sum(np.diff(clock.seconds) == 0))
    said = (
        [f"{same} {'row has' if same == 1 else 'rows have'} the time of the row before: spread evenly"]
        if same
        else []
    )
    return spread_evenly(clock.seconds), said


def _columns(
    sheet: Sheet,
    names: list[str],
    units: list[str],
    clock: Clock,
    order: NDArray[np.intp],
    comma: bool | None,
    taken: set[str],
) -> tuple[list[Column], list[str]]:
    columns, notes = [], []
    codes: Counter[float] = Counter()
    for index, header in enumerate(sheet.header):
        if index in clock.columns:
            continue
        cells = sheet.cells(index)
        read = read_numbers(cells, comma)
        if read.wrong is not None and _holds_words(cells):
            few = list(dict.fromkeys(filter(None, cells)))
            do = f" ({', '.join(few)}); write numbers for them if they matter" if 1 < len(few) <= 6 else ""
            notes.append(f"column '{header}' holds words: left out{do}")
        elif read.wrong is not None and all(is_instant(cell) for cell in set(cells) if not is_empty(cell)):
            notes.append(f"column '{header}' holds dates, and is not the clock: left out")
        elif read.wrong is not None:
            raise UserError(
                f"{sheet.at(read.wrong)}, column '{header}': '{cells[read.wrong]}' is not a number; "
                "empty it or mend it"
            )
        elif not np.isfinite(read.values).any():
            notes.append(f"column '{header}' holds nothing: left out")
        elif is_clock(names[index], read.values[order], clock.seconds):
            notes.append(f"column '{header}' only counts rows or repeats the time: not used")
        else:
            about, unit = sheet.groups[index], units[index] or read.unit
            name = identifier(names[index] or about, taken)
            values, emptied = _without_codes(read.values[order])
            codes.update(emptied.tolist())
            columns.append(Column(header, name, unit, values, about, read.words))
            if read.words:
                notes.append(
                    f"column '{header}': '{read.words[0]}' is taken as 0, '{read.words[1]}' as 1 (?)"
                )
    if codes:
        said = ", ".join(f"{code:g}" for code in sorted(codes))
        notes.append(f"{codes.total()} cells hold a logger's code for a missing value ({said}): emptied")
    return columns, notes


def _holds_words(cells: Sequence[str]) -> bool:
    """Whether a column that cannot be read holds words: no number, no stamp, and not almost only switches."""
    if any(is_number(cell) or is_stamp(cell) for cell in set(cells)):
        return False
    said = Counter(is_switch(cell) for cell in cells if not is_empty(cell))
    return said[False] > _GARBLED * said[True]


def _without_codes(values: Array) -> tuple[Array, Array]:
    """The values of a column (N,) without the codes that loggers write where nothing was measured, and these
    codes.
    """
    known = np.flatnonzero(np.isfinite(values))
    rows = known[logger_words(values[known])]
    kept = values.copy()
    kept[rows] = np.nan
    return kept, values[rows]


def ascii_of(text: str) -> str:
    """A text in ASCII letters, as a person would type it without the others.

    >>> ascii_of("Körning 1"), ascii_of("Płyta"), ascii_of("試験3")
    ('Koerning 1', 'Plyta', '3')
    """
    text = unicodedata.normalize("NFC", text).translate(_UMLAUTS)
    return unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode()


def identifier(words: str, taken: set[str]) -> str:
    """A word that expressions can use, of the words of a header; words of other scripts are translated.

    >>> identifier("Kühlmittel Temp.", set()), identifier("主軸温度1", set()), identifier("T [°C]", set())
    ('Kuehlmittel_Temp', 'spindle_temp_1', 'T_C')
    """
    text = words.translate(_UMLAUTS)
    if not unicodedata.normalize("NFKD", text).encode("ascii", "ignore").decode().strip() or any(
        unicodedata.name(c, "").startswith(("CJK", "HIRAGANA", "KATAKANA", "HANGUL", "CYRILLIC"))
        for c in text
    ):
        text = _translated(text)
    name = re.sub(r"\W+", "_", ascii_of(text), flags=re.ASCII).strip("_") or "channel"
    name = f"x_{name}" if name[0].isdigit() else name
    base, count = name, 1
    while name in taken or is_taken(name) or not is_word(name):
        count += 1
        name = f"{base}_{count}"
    taken.add(name)
    return name


def _translated(text: str) -> str:
    text = unicodedata.normalize("NFKC", text)
    for word in sorted(words_of(text), key=lambda one: -len(one.said)):
        if not word.said.isascii():
            text = re.sub(
                re.escape(word.said), f"_{word.gloss.replace(' ', '_')}_", text, flags=re.IGNORECASE
            )
    return re.sub(r"_+", "_", text)
