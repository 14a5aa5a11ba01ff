"""Readings from CSV text, and the ticks between them."""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from datetime import UTC

from discovery.errors import UserError
from discovery.recordings.clock import parse_instant
from discovery.runtime.guards import Reading

LONGEST_SILENCE_S = 3600.0  # a longer gap in the rows: the machine, and its runtime, were off
LONGEST_JUMP_S = 400 * 24 * 3600.0  # a row that claims to be later than this is damaged


def csv_rows(
    lines: Iterable[str], needed: Collection[str] = (), say: Callable[[str], None] = lambda _: None
) -> Iterator[tuple[float, dict[str, Reading]]]:
    """Instant [s] and readings by name of each row; an empty cell is no reading, a damaged one is a bad
    reading.

    A row whose time cannot be read or runs backwards is left out. Where columns that are `needed` are missing
    `say` is told.

    Raises:
        UserError: no column `time`, or none of those `needed`.
    """
    reader = csv.reader(lines)
    header = [cell.strip() for cell in next(reader, [])]
    if "time" not in header:
        raise UserError(f"the inputs have no column 'time'; their first line is {','.join(header)[:80]!r}")
    if missing := [name for name in needed if name not in header]:
        without = f"the inputs have no column {', '.join(missing)}, which the model needs"
        if len(missing) == len(needed):
            raise UserError(f"{without}; name a file with its inputs")
        say(f"{without}; without a reading of each no offset is given out")
    place, last = header.index("time"), -math.inf
    while True:
        try:
            row = next(reader)
        except StopIteration:
            return
        except csv.Error:
            continue
        stamp = _time(row[place]) if place < len(row) else math.nan
        if not stamp >= last or (last > -math.inf and stamp - last > LONGEST_JUMP_S):
            continue
        last = stamp
        cells = {
            name: cell for name, cell in zip(header, row, strict=False) if name != "time" and cell.strip()
        }
        yield stamp, {name: Reading(_number(cell), stamp) for name, cell in cells.items()}


def ticks(
    rows: Iterable[tuple[float, Mapping[str, Reading]]], tick_s: float, after: float | None = None
) -> Iterator[tuple[float, dict[str, Reading]]]:
    """Instants of the ticks with the newest reading of each column.

    Args:
        tick_s: time between ticks [s].
        after: the first tick comes after this instant (a restart); rows before it fill in what is known.
    """
    newest: dict[str, Reading] = {}
    following: float | None = None if after is None else after + tick_s
    for time, readings in rows:
        if following is None:
            following = time
        if time - following > LONGEST_SILENCE_S:
            if newest:
                yield following, newest
            following = time
        while following < time:
            yield following, newest
            following += tick_s
        newest.update(readings)
    if following is not None and newest:
        yield following, newest


def _time(cell: str) -> float:
    """Seconds; an instant without a zone is taken as UTC, so that no clock of a computer comes into it."""
    try:
        return float(cell)
    except ValueError:
        pass
    try:
        instant = parse_instant(cell)
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return math.nan


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan
