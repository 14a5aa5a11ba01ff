"""What the recordings of a fit say about the fitted model, kept with it: the residual it leaves, and how well
its parameters are known. An update weighs new readings against it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.fitting.problem import Problem, make_problem
from discovery.models import Model
from discovery.recordings import Campaign

Array = NDArray[np.float64]

SLOW_S = 7200.0  # for which slow noise of sensors and small random heat stay alike


@dataclass(frozen=True)
class Knowledge:
    """`residual`: rms of readings minus model by output (None: not read), `slow_share` of its variance is
    slow noise. `covariance` (P, P) of `parameters`, wide enough for that."""

    residual: Mapping[str, float | None]
    slow_share: float
    parameters: tuple[str, ...]
    covariance: Array


def knowledge(model: Model, campaign: Campaign, recordings: Sequence[str]) -> Knowledge:
    """What the recordings say of a model fitted to them; parameters of one recording alone are left out."""
    outputs = [
        name for name in model.outputs if name in campaign.channels and _read(campaign, recordings, name)
    ]
    free = tuple(name for name in model.free if not model.parameters[name].per_recording)
    if not outputs:
        return Knowledge(dict.fromkeys(model.outputs), 0.0, (), np.zeros((0, 0)))
    problem = make_problem(model, campaign, recordings, outputs)
    residuals, jacobians = settle_starts(problem)
    level, share = {}, 0.0
    for j, name in enumerate(outputs):
        series = np.concatenate([r[:, j][np.isfinite(r[:, j])] for r in residuals])
        level[name] = max(float(np.sqrt(np.mean(series**2))), 1e-6)
        rho = (
            float(np.corrcoef(series[1:], series[:-1])[0, 1])
            if len(series) > 10 and series.std() > 0
            else 0.0
        )
        share = min(max(share, rho), 0.9)
    times = [system.grid.time[system.grid.read] for system in problem.systems]
    factor = max(stretch(share, time) for time in times)
    information = prior_information(problem)
    for residual, jacobian in zip(residuals, jacobians, strict=True):
        seen = np.isfinite(residual)
        rows = (jacobian / np.array([level[name] for name in outputs])[None, :, None])[seen]
        information += rows.T @ rows / factor
    index = [i for i, u in enumerate(problem.unknowns) if not u.is_start and u.name in free]
    covariance = np.linalg.pinv(information, rcond=1e-13, hermitian=True)[np.ix_(index, index)]
    names = tuple(problem.unknowns[i].name for i in index)
    return Knowledge(
        {name: level.get(name) for name in model.outputs}, share, names, 0.5 * (covariance + covariance.T)
    )


def stretch(slow_share: float, times: Array) -> float:
    """Readings that count as one independent reading: those close together share the slow part of the noise.

    1 + 2 sum_k rho(k gap) for rho(t) = slow_share exp(-t/SLOW_S): how much slow noise widens the variance of
    a mean.
    """
    if len(times) < 2:
        return 1.0
    decay = float(np.exp(-np.median(np.diff(times)) / SLOW_S))
    return 1.0 + 2.0 * slow_share * decay / (1.0 - decay)


def settle_starts(problem: Problem) -> tuple[list[Array], list[Array]]:
    """Two Gauss-Newton steps on the start values alone: residuals (R, Y) and Jacobians (R, Y, U)."""
    theta = problem.start
    starts = [i for i, u in enumerate(problem.unknowns) if u.is_nuisance]
    for last in (False, False, True):
        trajectories = [problem.run(system, theta) for system in problem.systems]
        residuals = [problem.residual(t) for t in trajectories]
        jacobians = [problem.jacobian(t) for t in trajectories]
        if last or not starts:
            break
        information, pull = prior_information(problem)[np.ix_(starts, starts)], np.zeros(len(starts))
        pull -= np.diag(information) * (theta - problem.start)[starts]
        for residual, jacobian in zip(residuals, jacobians, strict=True):
            seen = np.isfinite(residual)
            rows = jacobian[seen][:, starts]
            information = information + rows.T @ rows
            pull += rows.T @ residual[seen]
        theta = theta.copy()
        theta[starts] += np.linalg.solve(information, pull)
    return residuals, jacobians


def prior_information(problem: Problem) -> Array:
    """(U, U) of start values before any reading; a little for the rest, so that it can be inverted."""
    sizes = [1.0 / u.prior[1] ** 2 if u.prior else 1e-12 / max(u.start**2, 1e-6) for u in problem.unknowns]
    return np.diag(np.array(sizes))


def _read(campaign: Campaign, recordings: Sequence[str], name: str) -> bool:
    return any(
        name in campaign.recordings[r].values and np.isfinite(campaign.recordings[r].values[name]).any()
        for r in recordings
    )
