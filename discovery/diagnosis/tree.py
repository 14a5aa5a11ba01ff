"""A small regression tree (Breiman et al., Classification and Regression Trees, 1984): each split is the one
that leaves the least variance.

A rule has two conditions at most, and to load a library of trees takes longer than a diagnosis grows them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SAME = 1e-7  # values of a variable that are no further apart are not parted


@dataclass(frozen=True)
class Tree:
    """A node: the mean of its instants and, unless it is a leaf, the split, with what is up to `edge` below
    and the rest above.
    """

    value: float
    feature: int = -1
    edge: float = 0.0
    below: Tree | None = None
    above: Tree | None = None

    def predict(self, x: Array) -> Array:
        """Values (N,) at instants (N, F)."""
        if self.below is None or self.above is None:
            return np.full(len(x), self.value)
        return np.where(x[:, self.feature] <= self.edge, self.below.predict(x), self.above.predict(x))

    def score(self, x: Array, target: Array) -> float:
        """Share of the variance of a target (N,) that the tree explains."""
        left = np.sum((target - self.predict(x)) ** 2)
        return float(1.0 - left / np.sum((target - target.mean()) ** 2))


def grown(x: Array, target: Array, least: int, depth: int) -> Tree:
    """The tree of a target (N,) over variables (N, F).

    Args:
        least: instants in a leaf.
        depth: splits on the way to a leaf, at most.
    """
    value, count = float(target.mean()), len(target)
    split = _split(x, target, least) if depth and count >= 2 * least and np.ptp(target) > 0 else None
    if split is None:
        return Tree(value)
    feature, edge = split
    under = x[:, feature] <= edge
    sides = [grown(x[side], target[side], least, depth - 1) for side in (under, ~under)]
    return Tree(value, feature, edge, *sides)


def _split(x: Array, target: Array, least: int) -> tuple[int, float] | None:
    """Variable and edge of the best split; None where no variable moves enough."""
    order = np.argsort(x, axis=0, kind="stable")
    values = np.take_along_axis(x, order, axis=0)
    sums = np.cumsum(target[order], axis=0)[:-1]
    count, total = len(target), float(target.sum())
    left = np.arange(1, count)[:, None]
    apart = (np.diff(values, axis=0) > _SAME) & (left >= least) & (count - left >= least)
    if not apart.any():
        return None
    gain = np.where(apart, sums**2 / left + (total - sums) ** 2 / (count - left), -np.inf)
    row, feature = np.unravel_index(np.argmax(gain.T), gain.T.shape)[::-1]
    return int(feature), float(0.5 * (values[row, feature] + values[row + 1, feature]))
