"""Inputs as they were recorded: their values, integrals and means."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.recordings import Campaign

Array = NDArray[np.float64]

_SAME = 1e-6  # of its span: means of a held input that differ by less are one


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
        return self.value[np.maximum(index, 0)]

    def smooth(self, time: Array) -> Array:
        """Values of a straight channel at instants, by a curve through its stamps without corners, and within
        the values on either side (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5, 1984). Where a channel is
        shifted in time, corners would be kinks of the cost, and a fit would end at the next one.
        """
        k = np.clip(np.searchsorted(self.time, time, side="right") - 1, 0, max(len(self.time) - 2, 0))
        if len(self.time) < 2:
            return self.at(time)
        h = self.time[k + 1] - self.time[k]
        s = np.clip((time - self.time[k]) / h, 0.0, 1.0)
        low, high = self.value[k], self.value[k + 1]
        rise = high - low
        left, right = h * self._slopes[k], h * self._slopes[k + 1]
        return np.asarray(
            low + s * (left + s * (3 * rise - 2 * left - right + s * (left + right - 2 * rise)))
        )

    @cached_property
    def _slopes(self) -> Array:
        """Slope of `smooth` at each stamp (N,): zero at a peak, else a mean of those on either side in which
        the smaller one weighs more.
        """
        h, out = np.diff(self.time), np.zeros(len(self.time))
        rise = np.diff(self.value) / h
        before, after = rise[:-1], rise[1:]
        near = (h[:-1] + 2 * h[1:]) / (3 * (h[:-1] + h[1:]))
        with np.errstate(divide="ignore", invalid="ignore"):
            mean = before * after / (near * after + (1 - near) * before)
        out[1:-1] = np.where(before * after > 0, mean, 0.0)
        out[0], out[-1] = rise[0], rise[-1]
        return out

    def integral(self, time: Array) -> Array:
        """Integral of a channel from its first stamp."""
        return self._integral(time, np.searchsorted(self.time, time, side="right"))

    def _integral(self, time: Array, passed: NDArray[np.intp]) -> Array:
        """`integral` at instants up to which so many stamps have passed."""
        index = np.maximum(passed - 1, 0)
        last = 0.5 * (self.value[index] + self.at(time)) if self.linear else self.value[index]
        return np.asarray(self._sums[index] + last * (time - self.time[index]))

    @cached_property
    def _sums(self) -> Array:
        """Integral up to each stamp (N,)."""
        mean = 0.5 * (self.value[:-1] + self.value[1:]) if self.linear else self.value[:-1]
        return np.concatenate(([0.0], np.cumsum(mean * np.diff(self.time))))

    @cached_property
    def _changes(self) -> NDArray[np.intp]:
        """How often the value has changed up to each stamp (N,)."""
        return np.concatenate(([0], np.cumsum(np.diff(self.value) != 0)))

    def averaged(self, nodes: Array, shown: Callable[[Samples], Array] | None = None) -> Samples:
        """The channel by its means: over each interval between nodes (T,) where it is held, around each node
        where it runs straight. One that runs straight between fewer stamps than nodes is not changed.

        Args:
            shown: the integral (T,) at the nodes as readings show it; default the exact one.
        """
        if self.linear:
            if len(self.time) <= len(nodes):
                return self
            return Samples(
                nodes, self.means(np.r_[nodes[0], 0.5 * (nodes[1:] + nodes[:-1]), nodes[-1]]), True
            )
        mean = self.means(nodes)
        if shown is not None:
            seen = np.clip(np.diff(shown(self)) / np.diff(nodes), self.value.min(), self.value.max())
            mean = np.where(np.abs(seen - mean) < _SAME * np.ptp(self.value), mean, seen)
        return Samples(nodes[:-1], mean, False)

    def means(self, edges: Array) -> Array:
        """Mean between each two edges; exactly the value where it stays one, so that what is constant in the
        recording is constant to the last bit and equal intervals share their transition matrices.
        """
        changes = self._changes
        passed = np.searchsorted(self.time, edges, side="right")
        index = np.maximum(passed - 1, 0)
        first, at_end = index[:-1], self.time[index[1:]] == edges[1:]
        # straight lines reach to the stamp behind the edge
        last = passed[1:] - at_end - (0 if self.linear else 1)
        same = changes[first] == changes[np.clip(last, 0, len(changes) - 1)]
        return np.where(same, self.value[first], np.diff(self._integral(edges, passed)) / np.diff(edges))


def read_samples(campaign: Campaign, recording: str, inputs: Iterable[str]) -> dict[str, Samples]:
    """Inputs of a recording by name. Raises UserError: an input without any value."""
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
