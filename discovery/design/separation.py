"""How well a future experiment would separate two models: log evidence as its readings come in."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, predict, sensitivities
from discovery.dynamics.trajectory import flows
from discovery.evidence.events import heat_steps
from discovery.fitting import Noise

Array = NDArray[np.float64]

BLOCKS = 36  # of a recording, in each of which process noise is one number


def separation(
    right: Trajectory, wrong: Trajectory, noise: Noise, believed: Mapping[str, float] | None = None
) -> Array:
    """Log evidence (R,) for the right model that the readings up to each instant are expected to give.

    Nothing that noise, process noise, the start of the wrong model or its own parameters would explain as
    well counts: each of `believed` is known within a standard deviation.
    """
    white = np.array(noise.white)
    gap = ((predict(right) - predict(wrong)) / white).ravel()
    known = {n: sd for n, sd in (believed or {}).items() if n in wrong.values and sd > 0}
    states = wrong.system.model.states
    spreads = {n: sd for n in wrong.system.states if (sd := states[n].start_sd) is not None and sd > 0}
    sizes = [*known.values(), *spreads.values()]
    absorbed = sensitivities(wrong, list(known), list(spreads)) / white[None, :, None] * np.array(sizes)
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
    """Covariance of what process noise shows over reading noise, (R*Y, R*Y)."""
    white, time = np.array(noise.white), run.system.grid.time
    edges = np.linspace(time[0], time[-1], BLOCKS + 1)
    over = np.exp(-np.abs(np.subtract.outer(edges[:-1], edges[:-1])) / noise.heat_time)
    count = len(run.system.grid.read) * len(white)
    total = np.zeros((count, count))
    size = flows(run).mean(axis=0)
    for state, floor in (noise.heat or {}).items():
        if state in run.system.states:
            sd = float(np.hypot(floor, noise.share * size[run.system.states.index(state)]))
            steps = heat_steps(run, state, edges)
            blocks = ((steps[:, :, :-1] - steps[:, :, 1:]) / white[None, :, None] * sd).reshape(count, -1)
            total += blocks @ over @ blocks.T
    return total
