"""Weighted least squares over some unknowns of a problem, with correlated beliefs about its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.fitting.problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Minimum:
    """Where the sum of squares is least, and what the readings determine there."""

    theta: Array
    cost: float  # weighted squares plus priors
    rms: float  # of the weighted residual
    covariance: Array  # of the unknowns with a prior covariance
    effective: float  # directions of the parameters that the readings determine


def minimise(
    problem: Problem, weights: Array, unknowns: Sequence[int], starts: Sequence[int], prior: Array
) -> Minimum:
    """Weighted least squares over some unknowns, with the priors of the start values and of the parameters
    before them.
    """
    from scipy.optimize import least_squares

    origin, system = problem.start, problem.systems[0]
    seen = np.isfinite(system.grid.readings)
    index, count = list(unknowns), len(prior)
    root = np.zeros((count, count))
    if count:
        values, vectors = np.linalg.eigh(0.5 * (prior + prior.T))
        keep = np.sqrt(np.maximum(values, 1e-12 * max(values.max(), 1e-300)))
        root = vectors * keep  # theta = origin + root @ z with z ~ N(0, 1)
    spread = np.array([p[1] if (p := problem.unknowns[i].prior) else 1.0 for i in starts])
    low, high = problem.bounds

    def place(z: Array) -> Array:
        theta = origin.copy()
        if count:
            parameters = index[:count]
            theta[parameters] = np.clip(
                origin[parameters] + root @ z[:count], low[parameters], high[parameters]
            )
        theta[list(starts)] = origin[list(starts)] + spread * z[count:]
        return theta

    def residual(z: Array) -> Array:
        trajectory = problem.run(system, place(z))
        return np.concatenate([(problem.residual(trajectory) * weights)[seen], z])

    def jacobian(z: Array) -> Array:
        slopes = -(problem.jacobian(problem.run(system, place(z))) * weights[None, :, None])[seen]
        columns = [slopes[:, index[:count]] @ root] if count else []
        return np.vstack(
            [np.hstack([*columns, slopes[:, list(starts)] * spread]), np.eye(count + len(starts))]
        )

    found = least_squares(
        residual, np.zeros(count + len(starts)), jac=jacobian, method="trf", max_nfev=12, xtol=1e-6, ftol=1e-6
    )
    readings = int(seen.sum())
    r, j = np.asarray(found.fun), jacobian(found.x)
    posterior = np.linalg.inv(j.T @ j)[:count, :count]
    return Minimum(
        place(found.x),
        float(r @ r),
        float(np.sqrt(np.mean(r[:readings] ** 2))),
        root @ posterior @ root.T,
        float(count - np.trace(posterior)) if count else 0.0,
    )
