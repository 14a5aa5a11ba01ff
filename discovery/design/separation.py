"""How far an experiment to come would set two models apart: log evidence as its readings come in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, sensitivities
from discovery.dynamics.system import predict
from discovery.fitting import Noise
from discovery.mismatch.events import heat_steps

Array = NDArray[np.float64]

BLOCKS = 36  # of everyday heat


def separation(
    right: Trajectory, wrong: Trajectory, noise: Noise, believed: Mapping[str, float] | None = None
) -> Array:
    """Log evidence (R,) for the right model that the readings up to each instant are expected to give.

    Nothing that noise, everyday heat, the start of the wrong model or its own parameters would explain as
    well counts: each of `believed` is known within a standard deviation.
    """
    white = np.array(noise.white)
    gap = ((predict(right) - predict(wrong)) / white).ravel()
    known = {n: sd for n, sd in (believed or {}).items() if n in wrong.values and sd > 0}
    states = wrong.system.model.states
    starts = [n for n in wrong.system.states if states[n].start_sd > 0]
    sizes = [*known.values(), *(states[n].start_sd for n in starts)]
    absorbed = sensitivities(wrong, list(known), starts) / white[None, :, None] * np.array(sizes)
    absorbed = absorbed.reshape(len(gap), -1)
    covariance = np.eye(len(gap)) + _slow(wrong, noise) + _heat(wrong, noise) + absorbed @ absorbed.T
    z = np.linalg.solve(np.linalg.cholesky(covariance), gap)
    return np.asarray(np.cumsum(0.5 * np.sum(z.reshape(-1, len(white)) ** 2, axis=1)))


def _slow(run: Trajectory, noise: Noise) -> Array:
    """Covariance of slow sensor noise over reading noise, (R*Y, R*Y)."""
    time = run.system.grid.time[run.system.grid.read]
    share = np.array(noise.slow or np.zeros(len(noise.white))) / np.array(noise.white)
    over = np.exp(-np.abs(np.subtract.outer(time, time)) / noise.slow_time)
    return np.asarray(np.kron(over, np.diag(share**2)))


def _heat(run: Trajectory, noise: Noise) -> Array:
    """Covariance of what everyday heat shows over reading noise, (R*Y, R*Y)."""
    white, time = np.array(noise.white), run.system.grid.time
    edges = np.linspace(time[0], time[-1], BLOCKS + 1)
    over = np.exp(-np.abs(np.subtract.outer(edges[:-1], edges[:-1])) / noise.heat_time)
    size = len(run.system.grid.read) * len(white)
    total = np.zeros((size, size))
    for state, sd in (noise.heat or {}).items():
        if sd > 0 and state in run.system.states:
            steps = heat_steps(run, state, edges)
            blocks = ((steps[:, :, :-1] - steps[:, :, 1:]) / white[None, :, None] * sd).reshape(size, -1)
            total += blocks @ over @ blocks.T
    return total
