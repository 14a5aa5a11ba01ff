"""Normal equations of a linear regression, added up block by block.

After one pass over the readings, everything works on these small matrices. Paths, folds and block bootstraps
cost the same for recordings of any length:

    cost(theta) = square - 2 vector' theta + theta' matrix theta = |target - columns theta|^2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ints = NDArray[np.intp]

RIDGE = 1e-7  # on columns scaled to unit length: keeps twins solvable, moves nothing else


@dataclass(frozen=True)
class Gram:
    """`matrix` (M, M) = X'X, `vector` (M,) = X'y, `square` = y'y, `count` rows."""

    matrix: Array
    vector: Array
    square: float
    count: int

    @property
    def length(self) -> Array:
        """Lengths of the columns (M,), at least a tiny number so that one can divide by them."""
        return np.sqrt(np.maximum(np.diag(self.matrix), 1e-300))

    def cost(self, theta: Array) -> float:
        """Sum of squares that coefficients leave."""
        return float(self.square - 2 * self.vector @ theta + theta @ self.matrix @ theta)


def gram(columns: Array, target: Array) -> Gram:
    """Normal equations of rows: columns (N, M), target (N,)."""
    return Gram(columns.T @ columns, columns.T @ target, float(target @ target), len(target))


def total(grams: Sequence[Gram], weights: Sequence[float] | None = None) -> Gram:
    """Sum of blocks; `weights` say how often a bootstrap drew each of them."""
    w = np.ones(len(grams)) if weights is None else np.asarray(weights, dtype=float)
    matrix, vector = np.zeros_like(grams[0].matrix), np.zeros_like(grams[0].vector)
    for g, times in zip(grams, w, strict=True):  # without a stack of them: they may be large
        matrix += g.matrix if times == 1.0 else times * g.matrix
        vector += times * g.vector
    return Gram(
        matrix,
        vector,
        float(w @ [g.square for g in grams]),
        int(w @ [g.count for g in grams]),
    )


def project_out(g: Gram, nuisance: Ints, precision: Array) -> Gram:
    """Normal equations of the other columns with the nuisance columns projected out.

    Args:
        nuisance: indices of the columns to take out.
        precision: (len(nuisance),) inverse variances of their priors, in units of the noise; 0: free.
    """
    others = np.setdiff1d(np.arange(len(g.vector)), nuisance)
    inner = g.matrix[np.ix_(nuisance, nuisance)] + np.diag(precision)
    scale = np.sqrt(np.maximum(np.diag(inner), 1e-300))
    inner = inner / np.outer(scale, scale) + RIDGE * np.eye(len(nuisance))
    across = g.matrix[np.ix_(nuisance, others)] / scale[:, None]
    target = g.vector[nuisance] / scale
    solved = np.linalg.solve(inner, np.column_stack([across, target]))
    return Gram(
        g.matrix[np.ix_(others, others)] - across.T @ solved[:, :-1],
        g.vector[others] - across.T @ solved[:, -1],
        float(g.square - target @ solved[:, -1]),
        g.count,
    )


def solve(g: Gram, support: Sequence[int], low: Array | None = None, high: Array | None = None) -> Array:
    """Least squares on the columns of `support`, zero elsewhere (M,).

    Bounds (M,) are kept by bounded least squares on the Cholesky factor when the free solution breaks them.
    """
    s = np.asarray(support, dtype=int)
    theta = np.zeros(len(g.vector))
    if not len(s):
        return theta
    scale = g.length[s]
    a = g.matrix[np.ix_(s, s)] / np.outer(scale, scale) + RIDGE * np.eye(len(s))
    b = g.vector[s] / scale
    found = np.linalg.solve(a, b)
    if low is not None and high is not None:
        below, above = low[s] * scale, high[s] * scale
        if (found < below).any() or (found > above).any():
            from scipy.optimize import lsq_linear

            r = np.linalg.cholesky(a)
            found = lsq_linear(r.T, np.linalg.solve(r, b), bounds=(below, above), method="bvls").x
    theta[s] = found / scale
    return theta


def factor(g: Gram) -> tuple[Array, Array]:
    """Rows R (M, M) and z (M,) with the same normal equations: what an optimiser that wants rows is given.

    |z - R theta|^2 differs from the cost by a constant, so any least-squares optimiser finds on these M rows
    what it would find on all readings.
    """
    scale = g.length
    values, vectors = np.linalg.eigh(g.matrix / np.outer(scale, scale))
    root = np.sqrt(np.maximum(values, 1e-14 * values[-1]))
    return (vectors * root).T * scale, (vectors / root).T @ (g.vector / scale)
