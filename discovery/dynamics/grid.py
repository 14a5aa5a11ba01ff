"""The instants at which a recording is integrated, and its inputs on them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import series
from discovery.errors import UserError
from discovery.recordings import Campaign

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

MOST_NODES = 30_000  # of a recording as it is; beyond, it is coarsened
COARSE_NODES = 8_000  # of a coarsened one, about; as many at most for its inputs' switches
MOVED = 0.1  # of its span: a held input that moves so far within an interval of a coarsened grid divides it


@dataclass(frozen=True)
class Samples:
    """A channel as it was recorded: stamps (N,) in s, values (N,), whether it runs straight between them."""

    time: Array
    value: Array
    linear: bool

    def at(self, time: Array, side: str = "right") -> Array:
        """Values at instants; `side` says on which side of a jump of a held channel to stand."""
        if self.linear:
            return np.interp(time, self.time, self.value)
        index = np.searchsorted(self.time, time, side="right" if side == "right" else "left") - 1
        return self.value[np.clip(index, 0, None)]

    def integral(self, time: Array) -> Array:
        """Integral of a channel from its first stamp."""
        mean = 0.5 * (self.value[:-1] + self.value[1:]) if self.linear else self.value[:-1]
        sums = np.concatenate(([0.0], np.cumsum(mean * np.diff(self.time))))
        index = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, None)
        last = 0.5 * (self.value[index] + self.at(time)) if self.linear else self.value[index]
        return np.asarray(sums[index] + last * (time - self.time[index]))

    def averaged(self, nodes: Array) -> Samples:
        """The channel by its means: over each interval between nodes (T,) where it is held, around each node
        where it runs straight. One that runs straight between fewer stamps than nodes is left as it is.
        """
        if self.linear:
            if len(self.time) <= len(nodes):
                return self
            return Samples(
                nodes, self.means(np.r_[nodes[0], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1]]), True
            )
        return Samples(nodes[:-1], self.means(nodes), False)

    def means(self, edges: Array) -> Array:
        """Mean between each two edges; exactly the value where it stays one, so that what is constant in the
        recording is constant to the last bit and equal intervals share their transition matrices.
        """
        changes = np.concatenate(([0], np.cumsum(np.diff(self.value) != 0)))
        first = np.clip(np.searchsorted(self.time, edges[:-1], side="right") - 1, 0, None)
        # straight lines reach to the stamp behind the edge
        last = np.searchsorted(self.time, edges[1:], side="left") - (0 if self.linear else 1)
        same = changes[first] == changes[np.clip(last, 0, len(changes) - 1)]
        return np.where(same, self.value[first], np.diff(self.integral(edges)) / np.diff(edges))


@dataclass(frozen=True)
class Grid:
    """Nodes of a recording, inputs on them, and the readings.

    `ends` holds each channel at both ends of every interval, interleaved in time: entries 2k and 2k+1 belong
    to interval k, so a held input keeps its value to the end of the interval and no step is smeared.
    """

    recording: str
    time: Array  # (T,) s
    samples: Mapping[str, Samples]
    outputs: tuple[str, ...]
    read: Ints  # (R,) nodes at which at least one output was read
    readings: Array  # (R, Y), NaN where an output was not read
    spread: Mapping[str, float] = field(default_factory=dict)  # of channels known only within one
    offset: Mapping[str, float] = field(default_factory=dict)  # what `ends` and `nodes` have on the samples
    unsure: Mapping[str, float] = field(default_factory=dict)  # s, of held channels perhaps logged late
    late: Mapping[str, float] = field(default_factory=dict)  # s, which `ends` has them earlier than stamped
    instants: int = 0  # nodes that there were before it was coarsened; 0: it was not
    logged: Mapping[str, float] = field(default_factory=dict)  # s, median distance of the stamps of a channel

    def shifted(self, offset: Mapping[str, float], late: Mapping[str, float] | None = None) -> Grid:
        """The grid with channels moved by constants from what was recorded, in value and, held ones, in time
        (whatever moved them before).
        """
        return replace(self, offset=dict(offset), late=dict(late or {}))

    @cached_property
    def step(self) -> Array:
        """Interval lengths (T - 1,) in s."""
        return np.diff(self.time)

    @cached_property
    def ends(self) -> dict[str, Array]:
        """Channels and `time` at the interval ends, each (2(T - 1),)."""
        left, right = self.time[:-1], self.time[1:]
        values = {
            name: np.repeat(s.means(self.time + self.late[name]), 2)
            if name in self.late
            else interleaved(s.at(left), s.at(right, "left"))
            for name, s in self.samples.items()
        }
        return {**self._moved(values), "time": interleaved(left, right)}

    @cached_property
    def nodes(self) -> dict[str, Array]:
        """Channels and `time` at the nodes, each (T,)."""
        values = {name: s.at(self.time) for name, s in self.samples.items()}
        return {**self._moved(values), "time": self.time}

    def _moved(self, values: dict[str, Array]) -> dict[str, Array]:
        return values | {name: values[name] + by for name, by in self.offset.items()}

    @cached_property
    def measured(self) -> NDArray[np.bool_]:
        """Which readings exist (R, Y)."""
        return np.isfinite(self.readings)


def first_interval(grid: Grid) -> Grid:
    """The grid cut down to its first interval, for what is asked of the first instant alone."""
    none = np.full((0, len(grid.outputs)), np.nan)
    return replace(grid, time=grid.time[:2], read=np.zeros(0, dtype=np.intp), readings=none)


def interleaved(left: Array, right: Array) -> Array:
    """Values at the left and right ends of intervals (K,) as one series (2K,)."""
    out = np.empty(2 * len(left))
    out[0::2], out[1::2] = left, right
    return out


def make_grid(
    campaign: Campaign,
    recording: str,
    inputs: Iterable[str],
    outputs: Iterable[str],
    max_step: float = 600.0,
    coarse: int = COARSE_NODES,
    most: int = MOST_NODES,
) -> Grid:
    """Grid of a recording: every stamp of an input or a reading is a node, long intervals are divided.

    With more than `most` nodes it is coarsened: a body of minutes or hours answers to the mean of what
    came within seconds. Every so many-th reading is taken, as a single reading still, so that stated
    noise, steps of quantised numbers and wrong readings keep their meaning; nodes are these, every so
    many-th stamp, and the stamps at which a held input has switched. Inputs are their means in between.

    Args:
        inputs: channels that the model uses.
        outputs: channels that were measured and are to be compared with the model.
        max_step: longest interval [s]; linear terms are exact whatever it is.
        coarse: nodes, about, where there are more than `most`.
        most: nodes of a grid that is left as it is.

    Raises:
        UserError: an input without any value in the recording.
    """
    data = campaign.recordings[recording]
    outputs = tuple(outputs)
    samples = _samples(campaign, recording, inputs)
    stamps = np.zeros(len(data.time), dtype=bool)
    for name, one in samples.items():
        if np.ptp(one.value) > 0:
            stamps |= np.isfinite(data.values[name])
    missing = np.full(len(data.time), np.nan)
    table = (
        np.column_stack([data.values.get(name, missing) for name in outputs]) if outputs else missing[:, None]
    )
    taken = np.isfinite(table).any(axis=1)
    stamps |= taken
    stamps[[0, -1]] = True
    read = np.flatnonzero(taken)
    rows = np.flatnonzero(stamps)
    instants = len(rows) if len(rows) > most else 0
    if instants:
        read = read[:: _every(len(read), coarse, most)]
        base = np.isin(rows, np.concatenate([rows[:: _every(len(rows), coarse, most)], rows[-1:], read]))
        rows = _coarse_rows(rows, base, data.time, samples.values(), coarse)
    time = _divided(data.time[rows], max_step)
    logged = {n: float(np.median(np.diff(s.time))) for n, s in samples.items() if len(s.time) > 1}
    if instants:
        samples = {name: s.averaged(time) for name, s in samples.items()}
    spread = {name: s for name in samples if (s := campaign.channels[name].spread) > 0}
    index = np.searchsorted(time, data.time[read])
    return Grid(
        recording, time, samples, outputs, index, table[read], spread, instants=instants, logged=logged
    )


def _samples(campaign: Campaign, recording: str, inputs: Iterable[str]) -> dict[str, Samples]:
    """Inputs as they were recorded. Raises UserError: one without any value."""
    data, samples = campaign.recordings[recording], {}
    for name in inputs:
        values = data.values.get(name)
        known = np.isfinite(values) if values is not None else np.zeros(len(data.time), dtype=bool)
        if values is None or not known.any():
            raise UserError(
                f"{campaign.path}: recording '{recording}' has no value of '{name}', "
                "which the model needs as an input"
            )
        samples[name] = Samples(data.time[known], values[known], campaign.channels[name].between == "linear")
    return samples


def _divided(time: Array, max_step: float) -> Array:
    """Nodes (T,) with further ones between those that are more than `max_step` apart."""
    gaps = np.diff(time)
    long = gaps > max_step
    extra = [
        np.linspace(t, t + gap, int(np.ceil(gap / max_step)) + 1)[1:-1]
        for t, gap in zip(time[:-1][long], gaps[long], strict=True)
    ]
    return np.sort(np.concatenate([time, *extra])) if extra else time


def _every(count: int, coarse: int, most: int) -> int:
    """Of so many, every which one is taken in a grid coarsened to about `coarse` nodes."""
    return -(-count // coarse) if count > most else 1


def _coarse_rows(
    rows: Ints, base: NDArray[np.bool_], stamps: Array, samples: Iterable[Samples], coarse: int
) -> Ints:
    """Rows of the stamps (N,) that stay nodes: those of `base`, and those at which a held input is far from
    what it was at the node before.

    What switches more often than the nodes allow (a heater on a pulsed supply) is averaged.
    """
    held = [s.at(stamps[rows]) for s in samples if not s.linear and np.ptp(s.value) > 0]
    if not held:
        return rows[base]
    share = np.column_stack([values / np.ptp(values) for values in held])
    far = MOVED
    while (kept := series.moved(share, base, far)).sum() > base.sum() + coarse:
        far *= 2
    return np.asarray(rows[kept])
