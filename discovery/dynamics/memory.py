"""What an expression remembers of its recording: delays, lags and plays along a grid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import series
from discovery.dynamics.grid import Grid, interleaved

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

_SLOPE_WIDTH = 30.0  # s on each side, over which the slope of a delayed linear channel is taken


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
        samples = self.grid.samples[channel]
        time = self.grid.time + self.grid.late.get(channel, 0.0) - seconds
        offset = self.grid.offset.get(channel, 0.0)
        if samples.linear:
            values = samples.at(time) + offset
            before, after = samples.at(time - _SLOPE_WIDTH), samples.at(time + _SLOPE_WIDTH)
            slope = (before - after) / (2 * _SLOPE_WIDTH)
            if not self.at_ends:
                return values, slope
            return interleaved(values[:-1], values[1:]), interleaved(slope[:-1], slope[1:])
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
            return np.asarray(series.lag_ends(ends, step, time_constant))
        nodes = np.broadcast_to(value, (len(self.grid.time),)).astype(float)
        lagged = series.lag_ends(interleaved(nodes[:-1], nodes[1:]), step, time_constant)
        return np.concatenate((lagged[:1], lagged[1::2]))

    def play(self, value: Array, width: float) -> tuple[Array, Ints, Array]:
        """Play operator along the instants of this memory."""
        count = 2 * len(self.grid.step) if self.at_ends else len(self.grid.time)
        y, follows, contact = series.play(np.ascontiguousarray(np.broadcast_to(value, (count,))), abs(width))
        return y, follows, contact
