"""The instants at which a recording is integrated, and its inputs on them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import series
from discovery.dynamics.averaging import Means, as_readings_show, averaged, independent, some_of
from discovery.dynamics.gaps import unknown_in_gaps
from discovery.dynamics.samples import Samples, read_samples
from discovery.recordings import Campaign, Recording
from discovery.recordings.blocks import block_means

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
T = TypeVar("T")

MOST_NODES = 30_000  # of a recording; with more, it is coarsened
COARSE_NODES = 8_000  # of a coarsened one, about; as many at most for its inputs' switches
LONGEST_BLOCK = 120.0  # s, about; a recording of weeks has more nodes than these for its sake
USUAL = 0.25  # of the time: it passes in steps up to the usual one
LONGEST_STEP, STEPS = 600.0, 8  # s, and a share of the usual distance of stamps where that is longer
LONG = 2.0  # times the usual step: a longer one is divided for laws that are not linear
MOVED = 0.1  # of its span: a held input that moves so far within a block of a coarsened grid divides it


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
    # what `ends` and `nodes` have on the samples, and readings of an output on what a model shows
    offset: Mapping[str, float] = field(default_factory=dict)
    unsure: Mapping[str, float] = field(default_factory=dict)  # s, of channels perhaps logged late
    late: Mapping[str, float] = field(default_factory=dict)  # s, which `ends` has them earlier than stamped
    noisy: Mapping[str, Samples] = field(default_factory=dict)  # noise of channels: its sd, per root of Hz
    silent: Mapping[str, Samples] = field(default_factory=dict)  # the same of channels with gaps, in these
    instants: int = 0  # nodes that there were before it was coarsened; 0: it was not
    logged: Mapping[str, float] = field(default_factory=dict)  # s, median distance of the stamps of a channel
    means: Means | None = None  # where readings are means of several
    known: dict[str, tuple[Any, ...]] = field(default_factory=dict, repr=False, compare=False)

    def shifted(self, offset: Mapping[str, float], late: Mapping[str, float] | None = None) -> Grid:
        """The grid with channels moved by constants from what was recorded, in value and in time (whatever
        moved them before).
        """
        return replace(self, offset=dict(offset), late=dict(late or {}))

    def part(self, rows: slice = slice(None), outputs: Sequence[str] | None = None) -> Grid:
        """The grid with some of its readings, those of some outputs alone."""
        kept = self.outputs if outputs is None else tuple(outputs)
        columns = [self.outputs.index(name) for name in kept]
        return replace(
            self,
            outputs=kept,
            read=self.read[rows],
            readings=self.readings[rows][:, columns],
            means=self.means.part(rows, columns) if self.means else None,
        )

    def between(self, begin: int, end: int) -> Grid:
        """The grid from one node to another, both of them in it, without readings."""
        time = self.time[begin : end + 1]
        return replace(self, time=time, read=self.read[:0], readings=self.readings[:0], means=None, known={})

    def divided(self, parts: int) -> Grid:
        """The grid with each interval in so many equal parts; one of means of readings stays as it is."""
        if parts == 1 or self.means is not None:
            return self
        share = np.arange(parts) / parts
        inner = self.time[:-1, None] + share * self.step[:, None]
        return replace(self, time=np.append(inner, self.time[-1]), read=self.read * parts, known={})

    def evened(self) -> Grid:
        """The grid with steps divided that are far longer than those of a quarter of the time, as where
        readings are missing and no input moves. At most twice as many nodes are added as there are. One of
        means of readings stays as it is.
        """
        order = np.argsort(self.step)
        passed = np.cumsum(self.step[order])
        if self.means is not None or not passed.size:
            return self
        usual = float(self.step[order][np.searchsorted(passed, USUAL * passed[-1])])
        time = _divided(self.time, LONG * usual)
        if len(time) == len(self.time):
            return self
        return replace(self, time=time, read=np.searchsorted(time, self.time[self.read]), known={})

    @cached_property
    def step(self) -> Array:
        """Interval lengths (T - 1,) in s."""
        return np.diff(self.time)

    @cached_property
    def ends(self) -> dict[str, Array]:
        """Channels and `time` at the interval ends, each (2(T - 1),)."""
        late = {name: self.logged_late(name, by) for name, by in self.late.items() if name in self.samples}
        return self._moved(self._once("ends", _at_ends, self.time, self.samples) | late)

    def logged_late(self, name: str, by: float) -> Array:
        """A channel at the interval ends (2(T - 1),), logged seconds late: its mean over each interval
        where it is held, else a curve without corners.
        """
        samples, time = self.samples[name], self.time + by
        if samples.linear:
            return interleaved(samples.smooth(time[:-1]), samples.smooth(time[1:]))
        return np.repeat(samples.means(time), 2)

    @cached_property
    def nodes(self) -> dict[str, Array]:
        """Channels and `time` at the nodes, each (T,)."""
        return self._moved(self._once("nodes", _at_nodes, self.time, self.samples))

    def _once(self, what: str, make: Callable[..., T], *given: Any) -> T:
        """What is made of some parts of a grid, once for all grids that share them: those that are `shifted`
        from one.
        """
        found = self.known.get(what)
        if found is None or any(a is not b for a, b in zip(found[0], given, strict=True)):
            found = self.known[what] = (given, make(*given))
        made: T = found[1]
        return made

    def _moved(self, values: dict[str, Array]) -> dict[str, Array]:
        return values | {name: values[name] + by for name, by in self.offset.items() if name in values}

    @cached_property
    def first(self) -> dict[str, float]:
        """Channels at the first instant, outputs at their first reading, counted from their zero."""
        found = {name: float(series[0]) for name, series in self.nodes.items()}
        for i, name in enumerate(self.outputs):
            if (there := self.measured[:, i]).any():
                read = float(self.readings[np.argmax(there), i])
                found[name] = read - self.offset.get(name, 0.0)
        return found

    @property
    def single(self) -> Array:
        """Single readings (N, Y), to see the steps of their numbers."""
        return self.means.single if self.means else self.readings

    def sd(self, white: Sequence[float]) -> Array:
        """Standard deviations (R, Y) of the readings, where single ones have `white` (Y,)."""
        return np.array(white) / self.per_reading

    @cached_property
    def per_reading(self) -> Array:
        """Of each reading (R, Y), the noise of a single one over its own: 1 where it is a single one."""
        if self.means is None:
            return np.ones(self.readings.shape)
        return np.sqrt(np.maximum(self.means.counts, 1.0))

    @cached_property
    def _spread_out(self) -> bool:
        """Whether a reading shows something of nodes beside its own: not where a block has one at most."""
        return self.means is not None and bool(self.means.neighbours.any())

    @cached_property
    def looked_at(self) -> Ints:
        """Nodes (N,) that the readings show something of, ascending."""
        if not self._spread_out:
            return self.read
        return self._once("looked at", _looked_at, self.time, self.read)[0]

    def at_readings(self, shown: Array) -> Array:
        """Outputs at the readings, (R, Y, ...), of what they are at the nodes `looked_at`, (N, Y, ...)."""
        if self.means is None or not self._spread_out:
            return shown
        before, here, behind = (
            shown[place] for place in self._once("looked at", _looked_at, self.time, self.read)[1]
        )
        shares = self.means.neighbours.reshape(2, *here.shape[:2], *[1] * (here.ndim - 2))
        for share, other in zip(shares, (before, behind), strict=True):  # large: without a sum beside them
            other -= here
            other *= share
        here += before
        here += behind
        return np.asarray(here)

    @cached_property
    def measured(self) -> NDArray[np.bool_]:
        """Which readings exist (R, Y)."""
        return np.isfinite(self.readings)


def _at_ends(time: Array, samples: Mapping[str, Samples]) -> dict[str, Array]:
    left, right = time[:-1], time[1:]
    values = {name: interleaved(s.at(left), s.at(right, "left")) for name, s in samples.items()}
    return {**values, "time": interleaved(left, right)}


def _at_nodes(time: Array, samples: Mapping[str, Samples]) -> dict[str, Array]:
    return {**{name: s.at(time) for name, s in samples.items()}, "time": time}


def _looked_at(time: Array, read: Ints) -> tuple[Ints, list[Ints]]:
    """Nodes that means of readings show something of, ascending, and where among them stand those before, of
    and behind each reading.
    """
    three = [np.clip(read + k, 0, len(time) - 1) for k in (-1, 0, 1)]
    nodes = np.unique(np.concatenate(three))
    return nodes, [np.searchsorted(nodes, some) for some in three]


def first_interval(grid: Grid) -> Grid:
    """The grid cut down to its first interval, for what is asked of the first instant alone."""
    none = np.full((0, len(grid.outputs)), np.nan)
    read = np.zeros(0, dtype=np.intp)
    return replace(grid, time=grid.time[:2], read=read, readings=none, means=None, known={})


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
    coarse: int | None = None,
    most: int = MOST_NODES,
) -> Grid:
    """Grid of a recording: every stamp of an input or a reading is a node, long intervals are divided (linear
    terms are exact however long they are): to 600 s, or to an eighth of the usual distance of stamps, for
    what is read once a day shows nothing of minutes.

    With more than `most` nodes it is coarsened: a body of minutes or hours answers to the mean of what
    came within seconds. Stamps are taken together in blocks, which end where an input switches or jumps. All
    readings count: they are their means over a block, at the mean of their stamps. Nodes are these instants,
    the switches, and the bounds of blocks without a reading. Inputs are their means in between.

    Args:
        inputs: channels that the model uses.
        outputs: channels that were measured and are to be compared with the model.
        coarse: blocks, about, where there are more nodes than `most`; default COARSE_NODES, and as many as
            keep a block within LONGEST_BLOCK.
        most: nodes of a grid that is not coarsened.

    Raises:
        UserError: an input without any value in the recording.
    """
    data = campaign.recordings[recording]
    outputs = tuple(outputs)
    samples = read_samples(campaign, recording, inputs)
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
    rows = np.flatnonzero(stamps)
    stamped_at = {n: s.time for n, s in samples.items()}
    stamped_at |= {n: data.time[np.isfinite(read)] for n, read in zip(outputs, table.T, strict=False)}
    logged = {n: float(np.median(np.diff(at))) for n, at in stamped_at.items() if len(at) > 1}
    spread = {name: s for name in (*samples, *outputs) if (s := campaign.channels[name].spread) > 0}
    read = np.flatnonzero(taken[rows])
    usual = float(np.median(np.diff(data.time[rows]))) if len(rows) > 1 else 0.0
    max_step = max(LONGEST_STEP, usual / STEPS)
    stamped = Grid(recording, data.time[rows], samples, outputs, read, table[taken], spread, logged=logged)
    unknown = {name: unknown_in_gaps(one) for name, one in samples.items()}
    stamped = replace(stamped, silent={name: one for name, one in unknown.items() if one})
    if len(rows) > most:
        if coarse is None:
            coarse = max(COARSE_NODES, round(float(np.ptp(data.time)) / LONGEST_BLOCK))
        return _coarsened(stamped, data, rows, table, coarse, max_step)
    time, means = _divided(stamped.time, max_step), None
    if data.counts:
        counts = [data.counts.get(name, np.ones(len(taken))) for name in outputs]
        number = np.column_stack(counts)[taken]
        means = Means(number, np.zeros((2, *number.shape)), table[taken])
    return replace(stamped, time=time, read=np.searchsorted(time, data.time[taken]), means=means)


def _coarsened(
    stamped: Grid, data: Recording, rows: Ints, table: Array, coarse: int, max_step: float
) -> Grid:
    """The grid with readings and inputs as means over blocks of rows.

    Args:
        stamped: the grid with a node at each of `rows`, the stamps of inputs and readings.
        table: (N, Y) of the outputs at all stamps of the recording.
        coarse: blocks, about.
    """
    samples, taken = stamped.samples, np.isfinite(table).any(axis=1)
    base = np.isin(rows, np.append(rows[:: -(-len(rows) // coarse)], rows[-1]))
    switched = _switches(rows, base, samples.values(), data.time, coarse)
    first = rows[base | switched]
    read = np.where(taken, 0.0, np.nan)  # as one more output, read whenever any is
    counts = [data.counts.get(name) for name in stamped.outputs] or [None]
    found = averaged(data.time, np.column_stack([table, read]), first, [*counts, None])
    empty = ~np.isin(np.arange(len(first)), found.blocks)
    bound = switched[base | switched] | empty | np.append(True, empty[:-1])
    bound[-1] = True
    time = _divided(np.union1d(data.time[first[bound]], found.time), max_step)
    index = np.searchsorted(time, found.time)
    neighbours = found.weights(time, index)

    def shown(one: Samples) -> Array:
        integral = one.integral(data.time) + read
        means = block_means(data.time, integral, np.append(first, len(table))).mean[found.blocks]
        return as_readings_show(time, one.integral(time), index, means, neighbours[:, :, -1])

    single, number = some_of(table[taken]), found.counts[:, :-1]
    return replace(
        stamped,
        time=time,
        samples={name: s.averaged(time, shown) for name, s in samples.items()},
        read=index,
        readings=found.readings[:, :-1],
        instants=len(rows),
        means=Means(number if data.counts else independent(number, single), neighbours[:, :, :-1], single),
    )


def _divided(time: Array, max_step: float) -> Array:
    """Nodes (T,) with further ones between those that are more than `max_step` apart."""
    gaps = np.diff(time)
    long = gaps > max_step
    extra = [
        np.linspace(t, t + gap, int(np.ceil(gap / max_step)) + 1)[1:-1]
        for t, gap in zip(time[:-1][long], gaps[long], strict=True)
    ]
    return np.sort(np.concatenate([time, *extra])) if extra else time


def _switches(
    rows: Ints, base: NDArray[np.bool_], samples: Iterable[Samples], stamps: Array, coarse: int
) -> NDArray[np.bool_]:
    """Which rows of the stamps (N,) bound a block because a held input is far from what it was at the last
    bound, or another input jumps between two rows; all of `base` are bounds.

    What switches more often than the nodes allow (a heater on a pulsed supply) is averaged.
    """
    moving = [s for s in samples if np.ptp(s.value) > 0]
    jumps = np.zeros(len(rows), dtype=bool)
    for one in moving:
        far_apart = np.abs(np.diff(one.at(stamps[rows]))) > MOVED * np.ptp(one.value)
        if one.linear and far_apart.sum() < coarse:  # a valve that changes over to warm water
            jumps[:-1] |= far_apart
            jumps[1:] |= far_apart
    held = [s.at(stamps[rows]) for s in moving if not s.linear]
    if not held:
        return jumps
    share = np.column_stack([values / np.ptp(values) for values in held])
    far = MOVED
    while ((found := series.moved(share, base, far)) & ~base).sum() > coarse:
        far *= 2
    return np.asarray(found | jumps)
