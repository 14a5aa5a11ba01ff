"""The instants at which a recording is integrated, and its inputs on them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import kernel
from discovery.errors import UserError
from discovery.recordings import Campaign

Array = NDArray[np.float64]
Ints = NDArray[np.intp]


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
        """Integral of a held channel from its first stamp."""
        sums = np.concatenate(([0.0], np.cumsum(self.value[:-1] * np.diff(self.time))))
        index = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, None)
        return np.asarray(sums[index] + self.value[index] * (time - self.time[index]))


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

    def shifted(self, offset: Mapping[str, float]) -> Grid:
        """The grid with channels moved by constants from what was recorded (whatever moved them before)."""
        return replace(self, offset=dict(offset))

    @cached_property
    def step(self) -> Array:
        """Interval lengths (T - 1,) in s."""
        return np.diff(self.time)

    @cached_property
    def ends(self) -> dict[str, Array]:
        """Channels and `time` at the interval ends, each (2(T - 1),)."""
        left, right = self.time[:-1], self.time[1:]
        values = {name: _interleave(s.at(left), s.at(right, "left")) for name, s in self.samples.items()}
        return {**self._moved(values), "time": _interleave(left, right)}

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


@dataclass(frozen=True)
class Memory:
    """Delay and play on the interval ends (`at_ends`) or on the nodes of a grid."""

    grid: Grid
    at_ends: bool

    def delayed(self, channel: str, seconds: float) -> tuple[Array, Array]:
        """Channel `seconds` ago and its derivative by `seconds`.

        A held channel is averaged over each interval, which keeps switches inside an interval exact in the
        mean and the delay differentiable.
        """
        samples, time = self.grid.samples[channel], self.grid.time - seconds
        offset = self.grid.offset.get(channel, 0.0)
        if samples.linear:
            values = samples.at(time) + offset
            width = 30.0
            slope = (samples.at(time - width) - samples.at(time + width)) / (2 * width)
            if not self.at_ends:
                return values, slope
            return _interleave(values[:-1], values[1:]), _interleave(slope[:-1], slope[1:])
        if not self.at_ends:
            return samples.at(time) + offset, np.zeros_like(time)
        mean = np.diff(samples.integral(time)) / self.grid.step + offset
        now = samples.at(time)
        slope = -np.diff(now) / self.grid.step
        return np.repeat(mean, 2), np.repeat(slope, 2)

    def lagged(self, value: Array, time_constant: float) -> Array:
        """First-order lag of a series along the instants of this memory, settled at the start."""
        step = self.grid.step
        if self.at_ends:
            ends = np.ascontiguousarray(np.broadcast_to(value, (2 * len(step),)), dtype=float)
            return np.asarray(kernel.lag_ends(ends, step, time_constant))
        nodes = np.broadcast_to(value, (len(self.grid.time),)).astype(float)
        lagged = kernel.lag_ends(_interleave(nodes[:-1], nodes[1:]), step, time_constant)
        return np.concatenate((lagged[:1], lagged[1::2]))

    def play(self, value: Array, width: float) -> tuple[Array, Ints, Array]:
        """Play operator along the instants of this memory."""
        count = 2 * len(self.grid.step) if self.at_ends else len(self.grid.time)
        y, follows, contact = kernel.play(np.ascontiguousarray(np.broadcast_to(value, (count,))), abs(width))
        return y, follows, contact


def _interleave(left: Array, right: Array) -> Array:
    out = np.empty(2 * len(left))
    out[0::2], out[1::2] = left, right
    return out


def make_grid(
    campaign: Campaign,
    recording: str,
    inputs: Iterable[str],
    outputs: Iterable[str],
    max_step: float = 600.0,
) -> Grid:
    """Grid of a recording: every stamp of an input or a reading is a node, long intervals are divided.

    Args:
        inputs: channels that the model uses.
        outputs: channels that were measured and are to be compared with the model.
        max_step: longest interval [s]; linear terms are exact whatever it is.

    Raises:
        UserError: an input without any value in the recording.
    """
    data = campaign.recordings[recording]
    outputs = tuple(outputs)
    samples = {}
    stamps = np.zeros(len(data.time), dtype=bool)
    for name in inputs:
        values = data.values.get(name)
        known = np.isfinite(values) if values is not None else np.zeros(len(data.time), dtype=bool)
        if values is None or not known.any():
            raise UserError(
                f"{campaign.path}: recording '{recording}' has no value of '{name}', "
                "which the model needs as an input"
            )
        samples[name] = Samples(data.time[known], values[known], campaign.channels[name].between == "linear")
        if np.ptp(values[known]) > 0:
            stamps |= known
    missing = np.full(len(data.time), np.nan)
    table = (
        np.column_stack([data.values.get(name, missing) for name in outputs]) if outputs else missing[:, None]
    )
    taken = np.isfinite(table).any(axis=1)
    stamps |= taken
    stamps[[0, -1]] = True
    time = data.time[stamps]
    read_time = data.time[taken]
    gaps = np.diff(time)
    if (gaps > max_step).any():
        extra = [
            np.linspace(t, t + gap, int(np.ceil(gap / max_step)) + 1)[1:-1]
            for t, gap in zip(time[:-1], gaps, strict=True)
            if gap > max_step
        ]
        time = np.sort(np.concatenate([time, *extra]))
    spread = {name: s for name in samples if (s := campaign.channels[name].spread) > 0}
    return Grid(recording, time, samples, outputs, np.searchsorted(time, read_time), table[taken], spread)
