"""Sparse supports of every size, found on normal equations alone."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.sparse.gram import RIDGE, Gram, solve

Array = NDArray[np.float64]
Ints = NDArray[np.signedinteger]
Support = tuple[int, ...]

_EXCHANGES = 20  # of one member of a support, at most, before the next size
_HABIT = 0.9  # a column of a group that is not in use yet must beat one that is by this factor


def backward(
    g: Gram,
    always: Sequence[int] = (),
    low: Array | None = None,
    high: Array | None = None,
    within: Sequence[int] | None = None,
) -> list[Support]:
    """Supports from all columns (of `within`) down to `always`: at each step the column whose loss costs
    least leaves.

    The rise of the cost is theta_j^2 / (A^-1)_jj. A column whose coefficient stands at a bound of zero goes
    first.

    Returns:
        supports, smallest first.
    """
    scale = g.length
    a = g.matrix / np.outer(scale, scale) + RIDGE * np.eye(len(scale))
    support = [j for j in within or range(len(scale)) if g.matrix[j, j] > 0 or j in always]
    path = [tuple(support)]
    while len(support) > len(always):
        theta = solve(g, support, low, high)[support] * scale[support]
        inverse = np.diag(np.linalg.inv(a[np.ix_(support, support)]))
        rise = np.where([j in always for j in support], np.inf, theta**2 / inverse)
        support = [j for i, j in enumerate(support) if i != int(np.argmin(rise))]
        path.append(tuple(support))
    return path[::-1]


def forward(
    g: Gram,
    size: int,
    always: Sequence[int] = (),
    groups: Ints | None = None,
    max_groups: int | None = None,
    low: Array | None = None,
    high: Array | None = None,
) -> list[Support]:
    """Supports of growing size: the column that lowers the cost most enters, then weak members are exchanged.

    Args:
        size: largest support.
        always: columns that are always in.
        groups: (M,) group of each column (its hidden mass; -1: none). At most `max_groups` groups are used,
            so that a few masses carry several drives each.
        low, high: (M,) bounds; a column enters only with a coefficient of a sign that they allow.

    Returns:
        supports, smallest first, from len(always) + 1.
    """
    search = _Search(g, groups, max_groups, low, high)
    support = list(always)
    path: list[Support] = []
    while len(support) < size:
        new = search.best(support)
        if new is None:
            break
        support.append(new)
        for _ in range(_EXCHANGES):
            cost = search.cost(support)
            weakest = search.weakest(support, len(always))
            rest = [j for j in support if j != weakest]
            other = search.best(rest)
            if other is None or search.cost([*rest, other]) >= cost - 1e-9 * abs(cost):
                break
            support = [*rest, other]
        path.append(tuple(support))
    return path


def best_of_each_size(
    g: Gram, most: int, always: Sequence[int] = (), low: Array | None = None, high: Array | None = None
) -> list[Support]:
    """The better of `backward` and `forward` for every size up to `most`, smallest first.

    Elimination loses a term early when two others imitate it together (a square between a line and a cube);
    growth finds that term first but may pick a proxy where elimination does not.
    """
    path = {len(s): s for s in backward(g, always, low, high) if len(s) <= most}
    for support in forward(g, most, always, low=low, high=high):
        other = path.get(len(support), support)
        path[len(support)] = min(support, other, key=lambda s: g.cost(solve(g, s, low, high)))
    return [path[size] for size in sorted(path)]


class _Search:
    """Moves of the forward search on scaled normal equations."""

    def __init__(
        self, g: Gram, groups: Ints | None, max_groups: int | None, low: Array | None, high: Array | None
    ) -> None:
        count = len(g.vector)
        self.a = g.matrix / np.outer(g.length, g.length) + RIDGE * np.eye(count)
        self.b = g.vector / g.length
        self.groups = np.full(count, -1) if groups is None else np.asarray(groups, dtype=int)
        self.max_groups = count if max_groups is None else max_groups
        self.low = np.full(count, -np.inf) if low is None else low
        self.high = np.full(count, np.inf) if high is None else high
        self.usable = np.diag(g.matrix) > 0

    def cost(self, support: Sequence[int]) -> float:
        s = list(support)
        return -float(self.b[s] @ np.linalg.solve(self.a[np.ix_(s, s)], self.b[s]))

    def weakest(self, support: Sequence[int], kept: int) -> int:
        s = list(support)
        inverse = np.linalg.inv(self.a[np.ix_(s, s)])
        rise = (inverse @ self.b[s]) ** 2 / np.diag(inverse)
        return s[kept + int(np.argmin(rise[kept:]))]

    def best(self, support: Sequence[int]) -> int | None:
        """The column whose entry lowers the cost most, or None when none may enter."""
        s = list(support)
        left = self.b.copy()
        own = np.diag(self.a).copy()
        if s:
            across = self.a[s]
            solved = np.linalg.solve(self.a[np.ix_(s, s)], np.column_stack([across, self.b[s]]))
            left -= across.T @ solved[:, -1]
            own -= np.einsum("ij,ij->j", across, solved[:, :-1])
        used = set(self.groups[s]) - {-1}
        known = np.isin(self.groups, [-1, *used])
        gain = np.where(known, 1.0, _HABIT) * left**2 / np.maximum(own, 1e-6)
        allowed = self.usable & np.where(left > 0, self.high > 0, self.low < 0)
        allowed[s] = False
        if len(used) >= self.max_groups:
            allowed &= known
        if not allowed.any():
            return None
        return int(np.argmax(np.where(allowed, gain, -1.0)))
