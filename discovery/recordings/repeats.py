"""Rows that a logger sent again: same stamp, same values, in order or not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.columns import Array, Columns

Mask = NDArray[np.bool_]


def repeated(time: Array, values: Mapping[str, Array]) -> Mask:
    """Which rows (T,) have the stamp and all values of a row before them; an empty cell equals an empty cell.

    >>> repeated(np.array([0.0, 1.0, 0.0, 1.0]), {"x": np.array([5.0, 6.0, 5.0, 7.0])}).tolist()
    [False, False, True, False]
    """
    found = np.zeros(len(time), dtype=bool)
    if not (np.diff(time) <= 0).any():
        return found
    _, place, counts = np.unique(time, return_inverse=True, return_counts=True)
    again = np.flatnonzero((counts[place] > 1) & np.isfinite(time))
    rows = np.column_stack([time[again], *(column[again] for column in values.values())]) + 0.0
    rows[np.isnan(rows)] = np.nan
    seen: set[bytes] = set()
    for k, row in zip(again.tolist(), rows, strict=True):
        key = row.tobytes()
        found[k] = key in seen
        seen.add(key)
    return found


def without_repeats(columns: Columns) -> Columns:
    """The columns without rows that repeat one before them."""
    double = repeated(columns.time, columns.values)
    if not double.any():
        return columns
    return replace(
        columns,
        time=columns.time[~double],
        values={name: column[~double] for name, column in columns.values.items()},
        lines=columns.lines[~double],
        repeated=columns.repeated + int(double.sum()),
    )


@dataclass
class Recent:
    """Rows of a file that is read piece by piece; each is compared with its piece and the one before."""

    time: Array = field(default_factory=lambda: np.zeros(0))
    values: Mapping[str, Array] = field(default_factory=dict)
    count: int = 0  # rows that repeated one before them

    def new(self, time: Array, values: Mapping[str, Array]) -> tuple[Array, dict[str, Array]]:
        """The rows of the next piece that repeat none before them."""
        before = len(self.time)
        both = {n: np.concatenate([self.values.get(n, v[:0]), v]) for n, v in values.items()}
        keep = ~repeated(np.concatenate([self.time, time]), both)[before:]
        self.count += int((~keep).sum())
        self.time, self.values = time[keep], {n: v[keep] for n, v in values.items()}
        return self.time, {n: v.copy() for n, v in self.values.items()}
