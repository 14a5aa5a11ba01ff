"""Files that are longer than what a model can use: read piece by piece, kept as means over blocks of rows.

However long the file is, a few hundred thousand blocks stay in memory; where there are too many, two become
one. Held channels are their means over time from the first stamp of a block on; of all others the readings
of a block become their mean, at the mean of their stamps, with their number.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.columns import Array, Columns
from discovery.recordings.oddvalues import impossible_readings

if TYPE_CHECKING:
    from discovery.recordings.campaign import Channel

LONG = 2**20  # rows that are kept one by one
BLOCKS = 2**18  # of a longer file, at least, and at most twice as many
PIECE = 2**18  # rows that are read at a time


@dataclass(frozen=True)
class How:
    """What the columns of a file are.

    `held`: columns that keep their value to the next stamp. `only_at`: columns that are wanted only where
    another one was read (a correction at the readings of its error). `sensors`: channels of a column, with
    the factor and offset to their unit.
    """

    held: frozenset[str] = frozenset()
    only_at: Mapping[str, str] = field(default_factory=dict)
    sensors: Mapping[str, Sequence[tuple[Channel, float, float]]] = field(default_factory=dict)

    def clean(self, column: str, values: Array) -> int:
        """Take out lone readings (N,) that only a fault explains: they would spoil a mean. How many."""
        known = np.flatnonzero(np.isfinite(values))
        wrong = [
            known[impossible_readings(channel, factor * values[known] + offset)]
            for channel, factor, offset in self.sensors.get(column, ())
        ]
        rows = np.unique(np.concatenate(wrong)) if wrong else known[:0]
        values[rows] = np.nan
        return len(rows)


class Piece(NamedTuple):
    """Rows of a file: stamps (N,) in s on its clock, columns (N,) with NaN where not measured."""

    time: Array
    values: Mapping[str, Array]


class _Mean(NamedTuple):
    """A column over blocks (B,): readings, mean of their stamps, mean of their values."""

    counts: Array
    stamp: Array
    mean: Array


@dataclass
class Reduction:
    """Rows as they come in, and blocks of them; `held` and `only_at` as in `How`."""

    held: frozenset[str]
    only_at: Mapping[str, str]
    every: int = 1
    rows: int = 0
    waiting: list[Piece] = field(default_factory=list)
    begin: Array = field(default_factory=lambda: np.zeros(0))  # first stamp of each block
    kept: dict[str, _Mean] = field(default_factory=dict)
    last: dict[str, float] = field(default_factory=dict)  # value of each held column so far

    def add(self, piece: Piece) -> None:
        """The next rows. Raises ValueError: time does not run forward."""
        before = self.waiting[-1].time[-1:] if self.waiting else np.zeros(0)
        steps = np.diff(np.concatenate([before, piece.time]))
        if not (steps > 0).all() or not np.isfinite(piece.time).all():
            k = self.rows + int(np.argmin(steps > 0)) + (1 if len(before) == 0 else 0)
            raise ValueError(f"time does not run forward at row {k + 1}; sort the rows, one for each stamp")
        self.waiting.append(piece)
        self.rows += len(piece.time)
        if self.every == 1 and self.rows > LONG:
            self.every = LONG // BLOCKS
        if self.every > 1:
            self._reduce(whole=False)

    def _reduce(self, *, whole: bool) -> None:
        """Make blocks of the rows that wait; the last ones wait for what comes, but at the end."""
        time = np.concatenate([p.time for p in self.waiting])
        values = {n: np.concatenate([p.values[n] for p in self.waiting]) for n in self.waiting[0].values}
        used = len(time) if whole else (len(time) - 1) // self.every * self.every
        self.waiting = [] if whole else [Piece(time[used:], {n: v[used:] for n, v in values.items()})]
        if not used:
            return
        end = float(time[used]) if used < len(time) else float(time[-1])
        first = np.append(np.arange(0, used, self.every), used)
        self._block(time[:used], {n: v[:used] for n, v in values.items()}, first, end)
        while len(self.begin) > 2 * BLOCKS:
            self._halve()

    def _block(self, time: Array, values: Mapping[str, Array], first: NDArray[np.int64], end: float) -> None:
        from discovery.recordings.blocks import block_means, held_means

        new: dict[str, _Mean] = {}
        full = {n: self._filled(n, values[n]) for n in self.only_at}
        for name, column in values.items():
            if name in self.held:
                mean, last = held_means(time, column, first, self.last.get(name, np.nan), end)
                self.last[name] = float(last)
                length = np.diff(np.append(time[first[:-1]], end))
                new[name] = _Mean(np.where(np.isfinite(mean), length, 0.0), time[first[:-1]], mean)
            else:
                wanted = column
                if name in full:
                    wanted = np.where(np.isfinite(values[self.only_at[name]]), full[name], np.nan)
                counts, stamp, _, mean = block_means(time, wanted, first)
                new[name] = _Mean(counts, stamp, mean)
        self.begin = np.append(self.begin, time[first[:-1]])
        old = self.kept or {name: _Mean(*np.zeros((3, 0))) for name in new}
        self.kept = {n: _Mean(*map(np.append, old[n], one)) for n, one in new.items()}

    def _filled(self, name: str, column: Array) -> Array:
        """Return a column in which the last value fills the empty cells."""
        known = np.concatenate([[self.last.get(name, np.nan)], column])
        index = np.maximum.accumulate(np.where(np.isfinite(known), np.arange(len(known)), 0))
        self.last[name] = float(known[index[-1]])
        return np.asarray(known[index][1:])

    def _halve(self) -> None:
        """Join two blocks into one."""
        self.every *= 2
        self.begin = self.begin[::2]
        self.kept = {n: _Mean(*_paired(one, n in self.held)) for n, one in self.kept.items()}

    def columns(self, header: tuple[str, ...], origin: str | None, first_line: int) -> Columns:
        """What there is at the end: rows as they were, or means."""
        if self.every == 1:
            time = np.concatenate([p.time for p in self.waiting] or [np.zeros(0)])
            names = self.waiting[0].values if self.waiting else {}
            values = {n: np.concatenate([p.values[n] for p in self.waiting]) for n in names}
            return Columns(header, time, values, np.arange(len(time)) + first_line, origin)
        end = self.waiting[-1].time[-1:]
        self._reduce(whole=True)
        time = np.unique(np.concatenate([self.begin, end, *(one.stamp for one in self.kept.values())]))
        time = time[np.isfinite(time)]
        values, counts = {}, {}
        for name, one in self.kept.items():
            there = np.isfinite(one.mean)
            at = np.searchsorted(time, one.stamp[there])
            values[name] = np.full(len(time), np.nan)
            values[name][at] = one.mean[there]
            if name not in self.held:
                counts[name] = np.zeros(len(time))
                counts[name][at] = one.counts[there]
        row = np.searchsorted(self.begin, time, side="right") - 1
        return Columns(header, time, values, row * self.every + first_line, origin, counts, self.rows)


def _paired(one: _Mean, held: bool) -> Iterator[Array]:
    """Return the means of two blocks each. A last single block stays as it is."""
    odd = len(one.mean) % 2
    counts, stamp, mean = (np.append(a, [0.0, np.nan, np.nan][k]) if odd else a for k, a in enumerate(one))
    n, m = counts[::2], counts[1::2]
    share = np.divide(m, n + m, out=np.zeros(len(n)), where=n + m > 0)
    yield n + m
    for series, keep in ((stamp, held), (mean, False)):
        left, right = series[::2], series[1::2]
        both = left + np.where(share > 0, right - left, 0.0) * share
        yield left if keep else np.where(n == 0, right, np.where(m == 0, left, both))
