"""The published method for a discrepancy: differentiate the residual, regress it on a library, threshold.

Kaheman et al. (arXiv:1909.08574, 2019). It serves for comparison: the workbench takes no derivative of a
reading.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.sparse.borrowed import fit_quietly
from discovery.sparse.gram import Gram, factor, gram, solve, total

Array = NDArray[np.float64]
Support = tuple[int, ...]

_WINDOW = 11  # readings that the smoother sees
_RIDGE = 0.05  # PySINDy's own default
_THRESHOLDS = 16
_WORTH = 0.98  # share of the cost without any column that a choice must stay below


def smoothed_derivative(time: Array, series: Array) -> Array:
    """Derivative (N,) of a series (N,) with PySINDy's smoothed finite differences.

    Args:
        time: (N,) s, as good as evenly spaced.
    """
    import pysindy

    method = pysindy.SmoothedFiniteDifference(
        smoother_kws={"window_length": min(_WINDOW, len(series) - 1 | 1), "polyorder": 2}
    )
    return np.asarray(method(series[:, None], time)[:, 0])


def discrepancy_terms(blocks: Sequence[tuple[Array, Array]], most: int = 6) -> list[tuple[int, float]]:
    """Columns that STLSQ of PySINDy keeps, largest contribution first, each with its share of them all.

    The threshold is the one that predicts blocks left out best; no column at all wins unless the cost of the
    blocks left out falls by 2 %.

    Args:
        blocks: library (N, M) and target (N,) of each stretch of time.
        most: columns that may be kept.
    """
    whole = total([gram(x, y) for x, y in blocks])
    moving = np.flatnonzero(np.diag(whole.matrix) > 0)
    grams = [gram(x[:, moving], y) for x, y in blocks]
    whole = total(grams)

    def left_out(support: Sequence[int]) -> float:
        rest = (total([g for g in grams if g is not block]) for block in grams)
        return sum(block.cost(solve(r, support)) for block, r in zip(grams, rest, strict=True))

    cost = {support: left_out(support) for support in _supports(whole) if 0 < len(support) <= most}
    best = min(cost, key=lambda s: cost[s], default=())
    if not best or cost[best] > _WORTH * left_out(()):
        return []
    size = np.abs(solve(whole, best)) * whole.length
    order = sorted(best, key=lambda k: -size[k])
    return [(int(moving[k]), float(size[k] / size.sum())) for k in order]


def _supports(g: Gram) -> set[Support]:
    """What STLSQ keeps over a range of thresholds, on columns of unit length."""
    import pysindy

    rows, target = factor(g)
    rows = rows / g.length
    largest = float(np.max(np.abs(rows.T @ target)))
    found: set[Support] = set()
    for level in np.geomspace(0.02, 1.0, _THRESHOLDS):
        optimiser = pysindy.STLSQ(threshold=float(level * largest), alpha=_RIDGE)
        fit_quietly(optimiser, rows, target)
        found.add(tuple(np.flatnonzero(np.ravel(optimiser.coef_)).tolist()))
    return found
