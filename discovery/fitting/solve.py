"""Least squares on the whitened residual of a problem: what a fit does once its noise is given."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.errors import RunsAwayError
from discovery.fitting.kalman import Filter, make_filter, whiten
from discovery.fitting.noise import Noise
from discovery.fitting.problem import Problem

Array = NDArray[np.float64]
Loss = Literal["linear", "soft_l1", "huber", "cauchy"]


@dataclass(frozen=True)
class Solution:
    """Where a search ended."""

    theta: Array  # (U,)
    trajectories: tuple[Trajectory, ...]
    jacobian: Array  # (N, U) of whitened residuals and priors
    cost: float  # half the sum of their squares


def solve(
    problem: Problem,
    theta: Array,
    noise: Noise,
    loss: Loss,
    max_rounds: int,
    tolerance: float,
    together: float = 1.0,
) -> Solution:
    """The unknowns (U,) with the least cost under a noise, sought from `theta` (U,).

    Args:
        loss: bounds the pull of outliers, as in scipy.optimize.least_squares.
        max_rounds: of Levenberg-Marquardt.
        tolerance: relative change of the cost that ends them.
        together: readings that count as one against the priors of offsets (`Problem.prior_rows`).

    Raises:
        RunsAwayError: the model does not stay finite where the search begins.
    """
    from scipy.optimize import least_squares

    low, high = problem.bounds
    guesses: dict[str, Array] = {}
    last: dict[bytes, tuple[Array, tuple[tuple[Trajectory, Filter | None], ...]]] = {}

    def run(x: Array) -> tuple[Array, tuple[tuple[Trajectory, Filter | None], ...]]:
        key = x.tobytes()
        if key not in last:
            trajectories = tuple(problem.run(s, x, guesses.get(s.grid.recording)) for s in problem.systems)
            for t in trajectories:
                guesses[t.system.grid.recording] = t.x
            runs = tuple((t, None if noise.is_white else make_filter(t)) for t in trajectories)
            parts = [whiten(t, noise, problem.residual(t)[:, :, None], part)[:, 0] for t, part in runs]
            last.clear()
            last[key] = (np.concatenate([*parts, problem.prior_rows(x, together)[0]]), runs)
        return last[key]

    def jacobian(x: Array) -> Array:
        parts = [whiten(t, noise, -problem.jacobian(t), part) for t, part in run(x)[1]]
        return np.concatenate([*parts, problem.prior_rows(x, together)[1]])

    def residual(x: Array) -> Array:
        try:
            return run(x)[0]
        except RunsAwayError:  # a trial step: the solver takes a shorter one
            return np.full(rows, np.inf)

    # scipy refuses a start on the bound's wrong side by rounding, and moves one that lies on it inside
    x0 = np.clip(theta, low, high)
    rows = len(run(x0)[0])
    if len(x0):
        result = least_squares(
            residual,
            x0,
            jac=jacobian,
            bounds=(low, high),
            x_scale="jac",
            loss=loss,
            max_nfev=max_rounds,
            ftol=tolerance,  # alone: scipy's xtol measures all unknowns on one scale, W/K and seconds alike
            xtol=1e-13,
            gtol=1e-12,
        )
        x0 = result.x
    left, runs = run(x0)
    return Solution(x0, tuple(t for t, _ in runs), jacobian(x0), 0.5 * float(left @ left))
