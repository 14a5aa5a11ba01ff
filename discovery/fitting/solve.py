"""Least squares on the whitened residual of a problem: what a fit does once its noise is given.

Gauss-Newton on the normal equations with Marquardt's damping (Nocedal & Wright, Numerical Optimization, 2006,
ch. 10) and bounds by an active set: unknowns are few and readings many, so each step is one p x p system, and
a rejected trial step costs one free run, without sensitivities.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.errors import RunsAwayError
from discovery.fitting.kalman import Filter, is_white, make_filter, whiten
from discovery.fitting.noise import Noise
from discovery.fitting.problem import Problem

Array = NDArray[np.float64]
Loss = Literal["linear", "soft_l1", "huber", "cauchy"]

_DAMPING = 1e-4  # of the first step, relative to the diagonal of the normal equations
_EASE = 0.1  # factor of the damping after a step that is taken
_TIGHTEN = 3.0  # ... after one that is refused; each further one counts so many times more
_HOPELESS = 1e10  # damping at which no shorter step helps any more
_STILL = 1e-11  # relative change of the unknowns below which the search has ended
_SETTLED = 2  # steps after which the linear look says whether a search comes near its goal ...
_TIMES = 10.0  # ... if it would not by so many times what that look expects
_IDLE = 0.01  # of the tolerance: a step that promises no more than this is not made
_FAR = 0.5  # what a step has to take off the cost for the whitening filters to be made anew behind it


@dataclass(frozen=True)
class Solution:
    """Where a search ended."""

    theta: Array  # (U,)
    trajectories: tuple[Trajectory, ...]
    gram: Array  # (U, U) normal equations of whitened residuals and priors
    cost: float  # half the sum of their squares
    converged: bool = True  # no step helps any more; else the rounds were used up
    ended_early: bool = False  # it would not have come near its goal
    slopes: tuple[Array, ...] = ()  # by recording (R, Y, C): sensitivities of the outputs, not whitened


@dataclass(frozen=True)
class _Run:
    """The model at one place: trajectories and whitened residual with priors (N,)."""

    trajectories: tuple[Trajectory, ...]
    residual: Array


Filters = tuple[Filter | None, ...]
# the unknowns (C,) that act in each recording, and how its whitened residual (N, C) moves with them
Jacobian = list[tuple[list[int], Array]]


def solve(
    problem: Problem,
    theta: Array,
    noise: Noise,
    loss: Loss,
    max_rounds: int,
    tolerance: float,
    together: float = 1.0,
    goal: float = inf,
    last: Solution | None = None,
    runs: tuple[Trajectory, ...] = (),
) -> Solution:
    """Find the unknowns (U,) of the smallest cost under a noise, from `theta` (U,).

    The whitening filter belongs to a trajectory. It follows steps that change something and is held for the
    rest, so that the cost of the last ones is one function.

    Args:
        loss: bounds the pull of outliers, with the formulas of scipy.optimize.least_squares.
        max_rounds: of linearisation.
        tolerance: relative change of the cost that ends the search.
        together: readings that count as one against the priors (`Problem.prior_rows`).
        goal: the cost that is good enough to matter: a search ends that is far from it by all that the linear
            look expects.
        last: where the same problem ended under another noise or other priors; what stands there is used.
        runs: free runs at `theta`, where they are known.

    Raises:
        RunsAwayError: the model does not stay finite where the search begins.
    """
    low, high = problem.bounds
    x = np.clip(theta, low, high)
    known = last if last is not None and np.array_equal(last.theta, x) else None
    if known:
        runs = known.trajectories
    elif not runs or not np.array_equal(x, theta):
        runs = free_runs(problem, x)
    filters = _filters(runs, noise)
    now = _whitened(problem, x, noise, together, runs, filters)
    cost, damping = _cost(now.residual, loss), _DAMPING
    slopes = known.slopes if known else _slopes(problem, runs)
    jacobian = _jacobian(problem, x, noise, together, now, filters, slopes)
    done, late = len(x) == 0, False
    for taken in range(max_rounds if len(x) else 0):
        gram, gradient = _normal(jacobian, now.residual, len(x), loss)
        if not (np.isfinite(gram).all() and np.isfinite(gradient).all()):  # no step from here
            done = True
            break
        promised = _expected(bounded_step(x, gram, gradient, 0.0, low, high), gram, gradient)
        done = promised < _IDLE * tolerance * cost
        late = taken >= _SETTLED and cost - _TIMES * promised > goal
        if done or late:
            break
        found, tighten = None, _TIGHTEN
        while damping < _HOPELESS:
            moved = np.clip(x + bounded_step(x, gram, gradient, damping, low, high), low, high)
            change = moved - x
            expected = _expected(change, gram, gradient)
            if np.all(np.abs(change) <= _STILL * (1.0 + np.abs(x))):
                break
            try:
                runs = free_runs(problem, moved, now.trajectories)
                trial = _whitened(problem, moved, noise, together, runs, filters)
            except RunsAwayError:
                trial = None
            if trial is not None and _cost(trial.residual, loss) < cost:
                found = trial
                break
            if expected < tolerance * cost:
                break
            damping *= tighten
            tighten *= _TIGHTEN
        if found is None:
            done = True
            break
        gained = cost - _cost(found.residual, loss)
        x, now = moved, found
        if gained > 0.5 * expected:
            damping = max(damping * _EASE, 1e-12)
        done = gained < tolerance * cost
        if gained > _FAR and any(filters):
            filters = _filters(now.trajectories, noise)
            now = _whitened(problem, x, noise, together, now.trajectories, filters)
        cost = _cost(now.residual, loss)
        slopes = _slopes(problem, now.trajectories)
        jacobian = _jacobian(problem, x, noise, together, now, filters, slopes)
        if done:
            break
    square = float(now.residual @ now.residual)
    gram = _normal(jacobian, now.residual, len(x), "linear")[0]
    return Solution(x, now.trajectories, gram, 0.5 * square, done, late, slopes)


def cost_under(problem: Problem, theta: Array, trajectories: Sequence[Trajectory], noise: Noise) -> float:
    """What a search under a noise would have to beat to be better than unknowns (U,) and their free runs."""
    runs = tuple(trajectories)
    now = _whitened(problem, theta, noise, 1.0, runs, _filters(runs, noise))
    return _cost(now.residual, "linear")


def free_runs(problem: Problem, x: Array, near: tuple[Trajectory, ...] = ()) -> tuple[Trajectory, ...]:
    """Free runs at a place (U,); `near`: those of a place close by, to begin from."""
    known = {t.system.grid.recording: t for t in near}
    return tuple(problem.run(s, x, known.get(s.grid.recording)) for s in problem.systems)


def _filters(trajectories: tuple[Trajectory, ...], noise: Noise) -> Filters:
    return tuple(None if is_white(t, noise) else make_filter(t) for t in trajectories)


def _whitened(
    problem: Problem,
    x: Array,
    noise: Noise,
    together: float,
    trajectories: tuple[Trajectory, ...],
    filters: Filters,
) -> _Run:
    parts = [
        whiten(t, noise, problem.residual(t)[:, :, None], part)[:, 0]
        for t, part in zip(trajectories, filters, strict=True)
    ]
    return _Run(trajectories, np.concatenate([*parts, problem.prior_rows(x, together)[0]]))


def _slopes(problem: Problem, trajectories: tuple[Trajectory, ...]) -> tuple[Array, ...]:
    return tuple(problem.slopes(t) for t in trajectories)


def _jacobian(
    problem: Problem,
    x: Array,
    noise: Noise,
    together: float,
    run: _Run,
    filters: Filters,
    slopes: tuple[Array, ...],
) -> Jacobian:
    """How the residual moves: of each recording, then of the priors."""
    parts = [
        (problem.concerns(t.system), whiten(t, noise, -slope, part))
        for t, slope, part in zip(run.trajectories, slopes, filters, strict=True)
    ]
    return [*parts, (list(range(len(x))), problem.prior_rows(x, together)[1])]


def _normal(jacobian: Jacobian, residual: Array, unknowns: int, loss: Loss) -> tuple[Array, Array]:
    """Normal equations (U, U) and the slope (U,) of the cost; not finite where a model is so nearly unstable
    that the squares of its sensitivities overflow.
    """
    weight, slope = _weights(residual, loss)
    gram, gradient, done = np.zeros((unknowns, unknowns)), np.zeros(unknowns), 0
    with np.errstate(over="ignore", invalid="ignore"):
        for acting, rows in jacobian:
            here = slice(done, done + len(rows))
            gradient[acting] += rows.T @ slope[here]
            weighted = rows if loss == "linear" else rows * weight[here, None]
            gram[np.ix_(acting, acting)] += weighted.T @ weighted
            done = here.stop
    return gram, gradient


def _expected(change: Array, gram: Array, gradient: Array) -> float:
    """What a step takes off the cost, if residuals move in straight lines."""
    return -float(gradient @ change) - 0.5 * float(change @ gram @ change)


def bounded_step(x: Array, gram: Array, gradient: Array, damping: float, low: Array, high: Array) -> Array:
    """Damped step (U,); an unknown that would leave its range goes to the end of it, and the others are
    asked again.
    """
    free = ~(((x <= low) & (gradient > 0)) | ((x >= high) & (gradient < 0)))
    step = np.zeros(len(x))
    while free.any():
        held = gradient + gram[:, ~free] @ step[~free]
        scale = np.sqrt(np.maximum(np.diag(gram)[free], 1e-300))
        scaled = gram[np.ix_(free, free)] / np.outer(scale, scale)
        scaled[np.diag_indices_from(scaled)] = 1.0 + damping
        step[free] = -_solved(scaled, held[free] / scale) / scale
        over = free & ((x + step < low) | (x + step > high))
        if not over.any():
            break
        step[over] = np.clip(x + step, low, high)[over] - x[over]
        free &= ~over
    return step


def _solved(matrix: Array, vector: Array) -> Array:
    try:
        root = np.linalg.cholesky(matrix)
        return np.asarray(np.linalg.solve(root.T, np.linalg.solve(root, vector)))
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(matrix, vector, rcond=1e-12)[0])


def _rho(z: Array, loss: Loss) -> tuple[Array, Array, Array]:
    """rho(z) and its first two derivatives for z the squared residual."""
    match loss:
        case "linear":
            return z, np.ones_like(z), np.zeros_like(z)
        case "soft_l1":
            t = 1.0 + z
            return 2 * (np.sqrt(t) - 1), t**-0.5, -0.5 * t**-1.5
        case "huber":
            inside = z <= 1
            far = np.where(inside, 1.0, z)
            return (
                np.where(inside, z, 2 * np.sqrt(far) - 1),
                np.where(inside, 1.0, far**-0.5),
                np.where(inside, 0.0, -0.5 * far**-1.5),
            )
        case "cauchy":
            t = 1.0 + z
            return np.log1p(z), 1 / t, -1 / t**2


def _cost(residual: Array, loss: Loss) -> float:
    return 0.5 * float(np.sum(_rho(residual**2, loss)[0]))


def _weights(residual: Array, loss: Loss) -> tuple[Array, Array]:
    """Weights (N,) of the rows of the Jacobian, and the slope of the cost by each residual (N,)."""
    z = residual**2
    _, first, second = _rho(z, loss)
    return np.sqrt(np.maximum(first + 2 * second * z, 1e-10)), first * residual
