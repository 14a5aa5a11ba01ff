"""Sequential thresholding on normal equations, and PySINDy's own optimisers on the same matrices.

PySINDy is imported here and in `derivative.py` alone. Its optimisers want rows; they are given the M rows of
`gram.factor`, which hold all that the readings say, so an optimiser costs the same for a day and for a year
of recordings.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from discovery.sparse.gram import Gram, factor, solve
from discovery.sparse.path import Support, backward

Array = NDArray[np.float64]
Optimiser = Literal["stlsq", "ssr", "sr3"]

_ROUNDS = 20


def stlsq(g: Gram, threshold: float, alpha: float = 0.05) -> Array:
    """Coefficients (M,) by sequentially thresholded ridge regression (Brunton, Proctor & Kutz, PNAS 113,
    2016).

    The same as `pysindy.STLSQ(threshold, alpha)` on the rows behind `g`, coefficient by coefficient.
    """
    kept = np.ones(len(g.vector), dtype=bool)
    theta = np.zeros(len(g.vector))
    for _ in range(_ROUNDS):
        s = np.flatnonzero(kept)
        theta = np.zeros(len(g.vector))
        if not len(s):
            return theta
        theta[s] = np.linalg.solve(g.matrix[np.ix_(s, s)] + alpha * np.eye(len(s)), g.vector[s])
        big = np.abs(theta) >= threshold
        if (big == kept).all():
            break
        kept = big
    s = np.flatnonzero(kept)
    theta = np.zeros(len(g.vector))
    theta[s] = np.linalg.lstsq(g.matrix[np.ix_(s, s)], g.vector[s], rcond=None)[0]
    return theta


def fit_quietly(optimiser: Any, rows: Array, target: Array) -> None:
    """Fit an optimiser of PySINDy without its warnings."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # "sparsity parameter is too big": an empty support is no fault
        optimiser.fit(rows, target[:, None])


def pysindy_path(g: Gram, kind: Optimiser, always: Sequence[int] = (), points: int = 25) -> list[Support]:
    """Supports that an optimiser of PySINDy finds over a range of thresholds: one of every size, smallest
    first.

    Columns are scaled to unit length first. `always` columns are added to every support. Sizes that no
    threshold gives are filled by elimination.

    Args:
        kind: "stlsq", "ssr" (one term less in each step) or "sr3" (l0, `always` columns weigh nothing).
        points: thresholds, spread evenly over the logarithm of the coefficients' sizes.
    """
    scale = g.length
    rows, target = factor(g)
    rows = rows / scale
    full = solve(g, range(len(scale))) * scale
    top = np.max(np.abs(full))
    found: set[Support] = set()
    for optimiser in _optimisers(kind, len(scale), always, np.geomspace(1e-4 * top, top, points)):
        fit_quietly(optimiser, rows, target)
        history = optimiser.history_ if kind == "ssr" else [optimiser.coef_]
        for theta in history:
            chosen = set(np.flatnonzero(np.abs(np.ravel(theta)) > 0).tolist())
            found.add((*always, *sorted(chosen - set(always))))
    best: dict[int, tuple[float, Support]] = {}
    for support in found:
        entry = (g.cost(solve(g, support)), support)
        best[len(support)] = min(best.get(len(support), entry), entry)
    path: list[Support] = []
    for size in range(max(best), max(len(always), 0), -1):
        if size in best:
            path.append(best[size][1])
        else:  # no threshold gives this size: the next larger one loses its weakest member
            path.append(backward(g, always, within=path[-1])[-2])
    return path[::-1]


def _optimisers(kind: Optimiser, count: int, always: Sequence[int], levels: Array) -> list[Any]:
    import pysindy

    if kind == "ssr":
        return [pysindy.SSR(alpha=1e-8, criteria="model_residual", max_iter=count)]
    if kind == "stlsq":
        return [pysindy.STLSQ(threshold=float(level), alpha=1e-8) for level in levels]
    weight = np.ones((1, count))
    weight[0, list(always)] = 0.0
    return [
        pysindy.SR3(
            regularizer="weighted_l0", reg_weight_lam=weight * level**2, relax_coeff_nu=1.0, max_iter=1000
        )
        for level in levels
    ]
