"""The published way to a discrepancy: differentiate what a model leaves, regress it on a library, threshold.

Kaheman et al. (arXiv:1909.08574, 2019). Kept to compare with: the workbench takes no derivative of a reading.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.sparse.gram import gram, solve, total
from discovery.sparse.optimisers import pysindy_path

Array = NDArray[np.float64]

_WINDOW = 11  # readings that the smoother sees


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

    The threshold is the one that predicts blocks left out best; no column at all is a choice too.

    Args:
        blocks: library (N, M) and target (N,) of each stretch of time.
        most: columns that may be kept.
    """
    grams = [gram(x, y) for x, y in blocks]
    whole = total(grams)
    moving = np.flatnonzero(np.diag(whole.matrix) > 0)
    grams = [gram(x[:, moving], y) for x, y in blocks]
    whole = total(grams)

    def left_out(support: Sequence[int]) -> float:
        cost = 0.0
        for k, block in enumerate(grams):
            rest = total([g for j, g in enumerate(grams) if j != k])
            cost += block.cost(solve(rest, support))
        return cost

    supports = [(), *(s for s in pysindy_path(whole, "stlsq") if len(s) <= most)]
    best = min(supports, key=left_out)
    size = np.abs(solve(whole, best)) * whole.length
    order = sorted(best, key=lambda k: -size[k])
    return [(int(moving[k]), float(size[k] / size.sum())) for k in order]
