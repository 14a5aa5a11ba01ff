"""Sensors that stand still: they repeat one reading far longer than elsewhere in the recording.

When a reading differs from the one before with probability p, the longest run of equal readings among n is
about ln(n)/p (Erdos and Renyi 1970); several times that is a sensor that stands still. Less is enough where
the readings behind it go on far from where they stood, and as slowly as before: it hung.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from discovery.recordings.columns import FEW, Array

_STANDS = 5.0  # a sensor that stands still so many times longer than chance explains
_CHANCE = 2.0  # times what chance explains, where a jump shows that the body went on
_CAUGHT_UP = 4.0  # times nearly all of the steps around: readings that come back from where they stood
_NEARLY_ALL = 0.9  # a machine that switches makes a large step now and then
_AROUND = 10  # steps on each side


@dataclass(frozen=True)
class Run:
    """The longest run of equal readings: its first and last, and how often the others change."""

    first: int
    last: int
    changes: float  # share of the other readings
    stands: bool  # longer than chance explains, whatever comes behind it
    hung: bool  # the readings behind it show that the body went on

    @property
    def count(self) -> int:
        """How many readings are equal."""
        return self.last - self.first + 1


def longest_run(readings: Array) -> Run | None:
    """The longest run of equal readings (N,), none missing; None where they are too few or all equal."""
    ends = np.append(np.flatnonzero(np.diff(readings) != 0.0), readings.size - 1)
    lengths = np.diff(ends, prepend=-1)
    if readings.size < FEW or lengths.size == 1:
        return None
    longest = int(np.argmax(lengths))
    count, last = int(lengths[longest]), int(ends[longest])
    changes = (lengths.size - 1) / max(readings.size - count, 1)
    chance = np.log(readings.size) / changes
    hung = count > _CHANCE * chance and _catches_up(readings, last - count + 1, last)
    return Run(last - count + 1, last, changes, count > _STANDS * chance + FEW, hung)


def stood_before(readings: Array, at: int) -> bool:
    """Whether readings (R,) are equal for longer just before one of them than ever else."""
    seen = np.flatnonzero(np.isfinite(readings))
    shown, place = readings[seen], int(np.searchsorted(seen, at))
    ends = [0, *(1 + np.flatnonzero(np.diff(shown) != 0)).tolist(), len(shown)]
    runs = {end: end - start for start, end in pairwise(ends)}
    before = runs.pop(place, 0)
    return before > max(runs.values(), default=0)


def _catches_up(readings: Array, first: int, last: int) -> bool:
    """Whether the readings (N,) jump behind a run of equal ones, and mostly move far less around."""
    steps = np.abs(np.diff(readings))
    if last == steps.size:  # nothing was read behind it
        return False
    around = np.concatenate([steps[max(first - _AROUND, 0) : first], steps[last + 1 : last + 1 + _AROUND]])
    usual = np.quantile(around[around > 0.0], _NEARLY_ALL) if around.any() else 0.0
    return around.size >= _AROUND and bool(steps[last] > _CAUGHT_UP * usual)
