"""Readings as means over blocks of rows, and what a model shows of its course in such a mean."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import series
from discovery.recordings.blocks import block_means

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

PIECES, PIECE = 20, 1_000  # rows in a row that are looked at one by one for noise and steps of numbers
_HARMONICS = np.arange(1, 200)  # of the error of a step: without noise they add up to 1/12 within 0.3 %


@dataclass(frozen=True)
class Means:
    """How readings (R, Y) are means of several.

    `counts` (R, Y): independent readings in each. `neighbours` (2, R, Y): weights of the model at the nodes
    before and behind in its mean over their stamps; the rest is of the node itself. `single` (N, Y): some of
    the readings themselves.
    """

    counts: Array
    neighbours: Array
    single: Array

    def part(self, rows: slice, columns: Sequence[int]) -> Means:
        """Of some readings and outputs alone."""
        return Means(
            self.counts[rows][:, columns], self.neighbours[:, rows][:, :, columns], self.single[:, columns]
        )


@dataclass(frozen=True)
class Averaged:
    """Readings by block in which something was read: the mean of their stamps (R,), their means (R, Y), and
    of each the readings in it, the mean (R, Y) and the mean square of their stamps about that instant.
    """

    blocks: Ints
    time: Array
    readings: Array
    counts: Array
    first: Array
    square: Array

    def weights(self, nodes: Array, index: Ints) -> Array:
        """Weights (2, R, Y) of the nodes before and behind those of the readings, `index` (R,), in the mean
        over the stamps of a parabola through the three; zero at the ends of a recording.
        """
        a = (self.time - nodes[np.maximum(index - 1, 0)])[:, None]
        b = (nodes[np.minimum(index + 1, len(nodes) - 1)] - self.time)[:, None]
        there = (a > 0) & (b > 0)
        a, b = np.where(there, a, 1.0), np.where(there, b, 1.0)
        left = (self.square - b * self.first) / (a * (a + b))
        right = (self.square + a * self.first) / (b * (a + b))
        return np.where(there & (self.counts > 0), np.stack([left, right]), 0.0)


def averaged(time: Array, table: Array, first: Ints, counts: Sequence[Array | None]) -> Averaged:
    """Readings (N, Y) at stamps (N,) averaged over blocks of rows.

    Args:
        first: (B,) first row of each block.
        counts: by output, readings (N,) that each of its values is a mean of; None where it is one.
    """
    bounds = np.append(first, len(time))
    parts = [block_means(time, column, bounds, n) for column, n in zip(table.T, counts, strict=True)]
    number = np.column_stack([part.counts for part in parts])
    stamp = np.column_stack([part.stamp for part in parts])
    rows = np.flatnonzero(number.any(axis=1))
    number, stamp = number[rows], stamp[rows]
    begin = np.nanmin(stamp, axis=1)
    late = np.nan_to_num(stamp - begin[:, None])
    middle = begin + (number * late).sum(axis=1) / number.sum(axis=1)
    square = np.column_stack([part.square for part in parts])[rows]
    mean = np.column_stack([part.mean for part in parts])[rows]
    off = np.where(number > 0, stamp - middle[:, None], 0.0)
    return Averaged(rows, middle, mean, number, off, square + off**2)


def some_of(table: Array) -> Array:
    """Unchanged pieces of rows (N, Y) from all over a recording."""
    begins = np.linspace(0, max(len(table) - PIECE, 0), PIECES).astype(int)
    return table[np.unique((begins[:, None] + np.arange(min(PIECE, len(table)))).ravel())]


def independent(counts: Array, single: Array) -> Array:
    """Readings (R, Y) that means of `counts` are worth, by single ones (N, Y).

    A sensor whose noise d is below the steps s of its numbers is off by the same in all readings of a
    block: of the variance d^2 + s^2/12 of one, the mean of many keeps
    s^2 / (2 pi^2) sum exp(-4 pi^2 k^2 d^2 / s^2) / k^2 (Widrow & Kollar, Quantization Noise, 2008, ch. 16).
    What it does not keep is seen from one reading to the next, and says how large d is.
    """
    out = counts.copy()
    for y, column in enumerate(single.T):
        read = column[np.isfinite(column)]
        steps = np.diff(np.unique(read))
        steps = steps[steps > 1e-9 * np.abs(read).max(initial=0.0)]
        if not len(steps) or len(read) < 3:
            continue
        seen = float(np.mean(np.diff(read, 2) ** 2)) / 6.0 / float(steps.min()) ** 2
        noise = _noise_seen(seen) if seen > 1e-6 else 0.0
        share = min(_kept(noise) / (noise**2 + 1 / 12), 1.0)
        out[:, y] = counts[:, y] / (1.0 + np.maximum(counts[:, y] - 1.0, 0.0) * share)
    return out


def _noise_seen(seen: float) -> float:
    """The noise with which so much of the variance of a reading is seen from one to the next, all in steps;
    what is seen grows with it.
    """
    low, high = 0.0, float(np.sqrt(seen)) + 1.0
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if middle**2 + 1 / 12 - _kept(middle) < seen else (low, middle)
    return middle


def _kept(noise: float) -> float:
    """What the mean of many readings keeps of the variance of one, noise and result in steps."""
    fade = np.exp(-4 * np.pi**2 * _HARMONICS**2 * noise**2) / _HARMONICS**2
    return float(fade.sum()) / (2 * np.pi**2)


def as_readings_show(nodes: Array, integral: Array, index: Ints, shown: Array, neighbours: Array) -> Array:
    """The integral (T,) of an input at the nodes, moved so that it shows in means as it does in the readings.

    An input that moves within a block shows in a mean of readings as the mean of its integral over their
    stamps, and not as its integral at the mean of the stamps.

    Args:
        nodes: (T,) s.
        integral: (T,) at the nodes.
        index: (R,) nodes of the readings.
        shown: (R,) means of the integral over the stamps of the readings.
        neighbours: (2, R) weights of the nodes before and behind.
    """
    below, own, above = np.zeros(len(nodes)), np.ones(len(nodes)), np.zeros(len(nodes))
    own[index] = 1.0 - neighbours.sum(axis=0)
    left, right = neighbours[0] != 0, neighbours[1] != 0
    below[index[left]] = neighbours[0, left]
    above[index[right]] = neighbours[1, right]
    wanted = integral.copy()
    wanted[index] = shown
    return np.asarray(series.tridiagonal(below, own, above, wanted))
