"""A recording as the comparison sees it: canonical units, unchanged readings, whatever is wrong with
them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array, Lines
from discovery.recordings.finding import Finding


@dataclass(frozen=True)
class Seen:
    """`time` (T,) s since the first stamp; `values`: each (T,), NaN where not measured; `lines` (T,) of
    the file.

    `constant`: channels that the campaign file sets.
    """

    name: str
    file: Path
    time: Array
    values: Mapping[str, Array]
    lines: Lines
    constant: frozenset[str] = frozenset()

    def known(self, channel: str) -> tuple[Array, Array]:
        """Stamps and values where a channel was read."""
        values = self.values[channel]
        there = np.isfinite(values)
        return self.time[there], values[there]

    def line(self, channel: str, row: int) -> int:
        """Line of the file of the row-th reading of a channel."""
        return int(self.lines[np.flatnonzero(np.isfinite(self.values[channel]))[row]])

    def having(self, values: Mapping[str, Array], time: Array | None = None) -> Seen:
        """The recording with other values, or another clock."""
        return replace(self, values={**self.values, **values}, time=self.time if time is None else time)


def inputs_of(channels: Mapping[str, Channel], recordings: Sequence[Seen]) -> list[str]:
    """Inputs that every recording knows."""
    return [n for n, c in channels.items() if c.is_input and all(_read(one, n) > 0 for one in recordings)]


def outputs_of(channels: Mapping[str, Channel]) -> list[str]:
    """Channels that are measured."""
    return [name for name, channel in channels.items() if channel.measured]


def _read(one: Seen, name: str) -> int:
    return int(np.isfinite(one.values[name]).sum()) if name in one.values else 0


def noise_of(readings: Array) -> float:
    """Standard deviation of the noise of readings, by their second differences; 0 where there are too few.

    A smooth signal has small second differences, so that what is left of them is noise: var = 6 noise^2. The
    median makes jumps of the signal count for little.
    """
    if readings.size < 8:
        return 0.0
    second = np.diff(readings, 2)
    return float(1.4826 * np.median(np.abs(second)) / np.sqrt(6.0))


def smallest_step(readings: Array) -> float:
    """The smallest step between different readings, where most steps are multiples of it."""
    different = np.diff(np.unique(readings))
    return float(np.min(different)) if different.size > 2 else 0.0


def rounding_of(readings: Array) -> float:
    """Standard deviation of what rounding to the smallest step hides: readings that stand still have no noise
    of their own.
    """
    return smallest_step(readings) / float(np.sqrt(12.0))


def warning(one: Seen, channel: Channel, row: int, what: str, do: str, kind: str, weight: float) -> Finding:
    """A finding at a reading (`row`) of a channel."""
    return Finding(
        "warning", one.file, one.line(channel.name, row), what, do, kind, channel.name, float(weight)
    )
