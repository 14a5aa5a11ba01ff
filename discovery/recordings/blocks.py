"""Means over blocks of rows: what a long recording is reduced to where it is finer than the physics.

A body of minutes answers to the mean of what came within seconds, and the mean of n readings has the noise of
one over the root of n. Nothing is thrown away.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.int64]


class BlockMeans(NamedTuple):
    """Of one channel by block (B,): readings in it, the mean of their stamps [s], the mean square of these
    about it [s^2], the mean of their values; NaN where nothing was read.
    """

    counts: Array
    stamp: Array
    square: Array
    mean: Array


def block_means(time: Array, values: Array, first: Ints, counts: Array | None = None) -> BlockMeans:
    """Means of the readings (N,) of a channel in blocks of rows.

    Args:
        time, values: (N,), NaN where not measured.
        first: (B + 1,) first row of each block, and the row behind the last.
        counts: (N,) readings that each value is a mean of, at even stamps; default one.
    """
    weights, within = np.ones(len(time)), np.zeros(len(time))
    if counts is not None and (counts > 1).any():
        weights = counts
        width = float(np.median(np.diff(time[counts > 1]))) if (counts > 1).sum() > 1 else 0.0
        within[counts > 1] = width**2 / 12
    return BlockMeans(*_means(time, values, weights, first.astype(np.int64), within))


@njit(cache=True, nogil=True)
def _means(time, values, weights, first, within):  # type: ignore[no-untyped-def]
    """Return the means of blocks, as sums of differences from the first reading: a constant stays exactly
    constant.
    """
    blocks = first.shape[0] - 1
    counts, square = np.zeros(blocks), np.zeros(blocks)
    stamp, mean = np.full(blocks, np.nan), np.full(blocks, np.nan)
    for b in range(blocks):
        n = t = tt = v = at = value = 0.0
        for k in range(first[b], first[b + 1]):
            if not np.isfinite(values[k]):
                continue
            if n == 0.0:
                at, value = time[k], values[k]
            w, d = weights[k], time[k] - at
            n += w
            t += w * d
            tt += w * (d * d + within[k])
            v += w * (values[k] - value)
        if n > 0.0:
            counts[b], stamp[b], mean[b] = n, at + t / n, value + v / n
            square[b] = max(tt / n - (t / n) ** 2, 0.0)
    return counts, stamp, square, mean


@njit(cache=True, nogil=True)
def held_means(time, values, first, before, end):  # type: ignore[no-untyped-def]
    """Means (B,) over time of a held channel (N,) in blocks of rows, each up to the stamp behind it; NaN
    where nothing is known yet.

    Args:
        first: (B + 1,) as in `block_means`.
        before: the last value known before the first row, NaN where none is.
        end: stamp behind the last row [s].

    Returns:
        The means, and the last value known.
    """
    blocks = first.shape[0] - 1
    mean, last = np.full(blocks, np.nan), before
    for b in range(blocks):
        length, sum_, value = 0.0, 0.0, np.nan
        for k in range(first[b], first[b + 1]):
            if np.isfinite(values[k]):
                last = values[k]
            if not np.isfinite(last):
                continue
            if not np.isfinite(value):
                value = last
            d = (time[k + 1] if k + 1 < time.shape[0] else end) - time[k]
            length += d
            sum_ += d * (last - value)
        mean[b] = value + sum_ / length if length > 0.0 else value
    return mean, last
