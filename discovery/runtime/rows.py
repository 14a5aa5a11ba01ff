"""Readings from CSV text in the order of time, and the ticks between them. What is left out is counted."""

from __future__ import annotations

import csv
import math
from collections import Counter, deque
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC

from discovery.errors import UserError
from discovery.recordings.clock import parse_instant
from discovery.runtime.guards import Reading

LONGEST_SILENCE_S = 3600.0  # a longer gap in the rows: the machine, and its runtime, were off
SUSPECT = 10.0  # times the usual spacing ahead of the row before: a gap, or a damaged stamp
AGREE = 3  # rows in a row that agree on a new time
REMEMBERED = 5000  # rows that a row is compared with, to know one that comes twice
EPOCH_LIMIT = 1e11  # s; an instant beyond is not in seconds
Row = tuple[float, dict[str, Reading]]


@dataclass
class Dropped:
    """Rows left out: how many for which reason, and the line of the first one."""

    counts: Counter[str] = field(default_factory=Counter)
    first: dict[str, int] = field(default_factory=dict)

    def add(self, why: str, line: int) -> None:
        """Count a row."""
        self.counts[why] += 1
        self.first.setdefault(why, line)

    def __str__(self) -> str:
        each = (f"{n} {why} (the first in line {self.first[why]})" for why, n in self.counts.items())
        total = self.counts.total()
        return f"{total} {'row was' if total == 1 else 'rows were'} left out: {', '.join(each)}"


def csv_rows(
    lines: Iterable[str],
    needed: Collection[str] = (),
    say: Callable[[str], None] = lambda _: None,
    dropped: Dropped | None = None,
    oldest_s: float = math.inf,
) -> Iterator[Row]:
    """Instant [s] and readings by name of each row; an empty cell is no reading, a damaged one is a bad
    reading. Cells are separated by commas, semicolons or tabs; with the latter two a decimal comma is read.

    Args:
        needed: columns that are needed; `say` reports those that are missing.
        dropped: counts the rows that are left out: no time, damaged, out of order, doubled.
        oldest_s: age [s] at which a value is too old for the model; rows further apart are not in seconds.

    Raises:
        UserError: no column `time`, none of those `needed`, decimal commas between commas, times that are not
        in seconds.
    """
    source = iter(lines)
    header, separator = _header(next(source, ""))
    if missing := [name for name in needed if name not in header]:
        without = f"the inputs have no column {', '.join(missing)}, which the model needs"
        if len(missing) == len(needed):
            raise UserError(f"{without}; name a file with its inputs")
        say(f"{without}; without them there is no offset")
    dropped = dropped if dropped is not None else Dropped()
    found = _in_order(_parsed(source, header, separator, dropped), dropped, say)
    return _in_seconds(found, oldest_s)


def _header(line: str) -> tuple[list[str], str]:
    for separator in (",", ";", "\t"):
        names = [cell.strip() for cell in next(csv.reader([line], delimiter=separator), [])]
        if names and names[0].startswith("\ufeff"):
            names[0] = names[0].removeprefix("\ufeff")
        if "time" in names:
            return names, separator
    raise UserError(f"the inputs have no column 'time'; their first line is {line.strip()[:80]!r}")


def _parsed(
    lines: Iterator[str], header: list[str], separator: str, dropped: Dropped
) -> Iterator[tuple[int, Row]]:
    """Line number, stamp and readings of each row whose time can be read."""
    place = header.index("time")
    for line, text in enumerate(lines, start=2):
        if not text.strip():
            continue
        try:
            cells = next(csv.reader([text], delimiter=separator))
        except csv.Error:
            dropped.add("damaged", line)
            continue
        if len(cells) > len(header) and any(cell.strip() for cell in cells[len(header) :]):
            if line == 2:
                raise UserError(
                    f"line 2 of the inputs has {len(cells)} cells, the header {len(header)} names; are its "
                    "numbers written with decimal commas? Then separate the cells by semicolons"
                )
            dropped.add("with more cells than the header", line)
            continue
        stamp = _time(cells[place], separator) if place < len(cells) else math.nan
        if not math.isfinite(stamp):
            dropped.add("without a time", line)
            continue
        if abs(stamp) > EPOCH_LIMIT and line == 2:
            raise UserError(
                f"time {cells[place].strip()} of the inputs is not an instant in seconds; give seconds "
                f"or ISO 8601 "
                "instants, not milliseconds or nanoseconds"
            )
        read = {
            name: Reading(_number(cell, separator), stamp)
            for name, cell in zip(header, cells, strict=False)
            if name != "time" and cell.strip()
        }
        yield line, (stamp, read)


def _in_order(rows: Iterator[tuple[int, Row]], dropped: Dropped, say: Callable[[str], None]) -> Iterator[Row]:
    """Rows on a timeline that never goes back.

    A row far from the time of the one before waits for those after it: if they agree with it there was a gap,
    or the clock was set back (then the timeline goes on as if it had not been); if not, its stamp is wrong.
    """
    shift, last = 0.0, -math.inf
    usual: deque[float] = deque(maxlen=20)
    seen: deque[int] = deque(maxlen=REMEMBERED)
    known: Counter[int] = Counter()
    waiting: list[tuple[int, Row]] = []

    def far() -> float:
        """How far ahead of the last row is suspicious [s]."""
        return SUSPECT * sorted(usual)[len(usual) // 2] if usual else LONGEST_SILENCE_S

    def accept(row: Row) -> Row:
        nonlocal last
        time = row[0] + shift
        if 0.0 < time - last < math.inf:
            usual.append(time - last)
        last = time
        return time, {
            n: Reading(r.value, r.time + shift, r.good) for n, r in row[1].items()
        } if shift else row[1]

    def refuse() -> None:
        for line, row in waiting:
            dropped.add("out of order" if row[0] + shift < last else "with a time far ahead", line)
        waiting.clear()

    for line, row in rows:
        stamp = row[0]
        mark = hash((stamp, tuple((name, reading.value) for name, reading in row[1].items())))
        if known[mark] and row[1]:
            dropped.add("doubled", line)
            continue
        if len(seen) == seen.maxlen:
            known[seen[0]] -= 1
        seen.append(mark)
        known[mark] += 1
        ahead = stamp + shift - last
        if last == -math.inf or 0.0 <= ahead <= far():
            refuse()
            yield accept(row)
            continue
        most = math.inf if ahead > 0.0 else LONGEST_SILENCE_S
        if waiting and not 0.0 <= stamp - waiting[-1][1][0] <= most:
            refuse()
        waiting.append((line, row))
        if len(waiting) < AGREE:
            continue
        if ahead < 0.0:
            spacing = sorted(usual)[len(usual) // 2] if usual else 0.0
            back = last + spacing - (waiting[0][1][0] + shift)
            shift += back
            say(
                f"the clock of the inputs went back by {back:.0f} s in line {waiting[0][0]}; "
                "the new time is used"
            )
        yield from [accept(one) for _, one in waiting]
        waiting.clear()
    if waiting and waiting[0][1][0] + shift > last and len(waiting) > 1:  # the end of a recording after a gap
        yield from [accept(one) for _, one in waiting]
    else:
        refuse()


def _in_seconds(rows: Iterator[Row], oldest_s: float) -> Iterator[Row]:
    """The rows, if the first two are not further apart than any value may be old."""
    first = next(rows, None)
    if first is None:
        return
    second = next(rows, None)
    spacing = second[0] - first[0] if second is not None else 0.0
    if spacing > oldest_s:
        raise UserError(
            f"the rows of the inputs come every {spacing:g} s, but a value is too old after {oldest_s:g} s; "
            "are the times in milliseconds? Give seconds, or ISO 8601 instants"
        )
    yield first
    if second is not None:
        yield second
    yield from rows


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
        if following is None or (not newest and time > following):  # nothing is known of the time before
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


def _time(cell: str, separator: str) -> float:
    """Return seconds. An instant without a zone counts as UTC, so the time zone of the computer has no
    influence.
    """
    seconds = _number(cell, separator)
    if not math.isnan(seconds):
        return seconds
    try:
        instant = parse_instant(cell)
        return (instant if instant.tzinfo else instant.replace(tzinfo=UTC)).timestamp()
    except (ValueError, OverflowError):
        return math.nan


def _number(cell: str, separator: str) -> float:
    try:
        return float(cell)
    except ValueError:
        pass
    if separator != "," and cell.count(",") == 1 and "." not in cell:
        return _number(cell.replace(",", "."), ",")
    return math.nan
