"""Free forcing: smooth heat of unknown cause at one body, and what the readings say of it.

The heat is piecewise constant over blocks with a first-order covariance of unknown size; evidence and the
curve follow in closed form. It asks for no catalogue: it says where something is missing, when, and how much
any explanation can gain.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.events import heat_steps
from discovery.mismatch.lens import log_mean_exp

Array = NDArray[np.float64]

BLOCKS = 72  # per recording
LEVELS = (2.5, 8.0, 25.0, 80.0)  # free heat over the everyday limit, rms
MEMORY_BLOCKS = 3.0  # correlation length of the free heat


@dataclass(frozen=True)
class Forcing:
    """Free heat at one body: log evidence over none, and its curve by recording.

    `edges` (B + 1,) in s, `heat` and `sd` (B,) in W (or rate) by recording.
    """

    state: str
    gain: float
    edges: Mapping[str, Array]
    heat: Mapping[str, Array]
    sd: Mapping[str, Array]
    signature: Array  # (N,) whitened response to the curve


def free_forcing(context: Context, current: Assessment) -> list[Forcing]:
    """Free forcing at every body, the best first."""
    view = current.best_view
    base = np.array([v.level for v in current.views])
    # relative to the best everyday setting: a body must need more than everyday heat
    offset = float(np.max(base) - log_mean_exp(base))
    found = []
    for state in context.heat_limit:
        limit = context.heat_limit[state]
        if limit <= 0 or state not in current.fit.trajectories[0].system.states:
            continue
        columns, edges = [], {}
        for trajectory in current.fit.trajectories:
            time = trajectory.system.grid.time
            run = trajectory.system.grid.recording
            edges[run] = np.linspace(time[0], time[-1], BLOCKS + 1)
            steps = heat_steps(trajectory, state, edges[run])
            columns.append(steps[:, :, :-1] - steps[:, :, 1:])
        padded = []
        for k, column in enumerate(columns):
            full = np.zeros((*column.shape[:2], BLOCKS * len(columns)))
            full[:, :, k * BLOCKS : (k + 1) * BLOCKS] = column
            padded.append(full)
        white, _ = current.lens.whiten(view.noise, padded)
        z = view.project(white)
        gram, dot = z.T @ z, z.T @ view.residual
        lag = np.abs(np.subtract.outer(np.arange(BLOCKS), np.arange(BLOCKS)))
        kernel = np.kron(np.eye(len(columns)), np.exp(-lag / MEMORY_BLOCKS))
        root = np.linalg.cholesky(kernel + 1e-9 * np.eye(len(kernel)))
        gains, curves = [], []
        for level in LEVELS:
            half = level * limit * root
            inner = np.eye(len(kernel)) + half.T @ gram @ half
            chol = np.linalg.cholesky(inner)
            solved = np.linalg.solve(chol, half.T @ dot)
            gains.append(0.5 * float(solved @ solved) - float(np.sum(np.log(np.diag(chol)))))
            inverse = np.linalg.solve(chol, half.T)
            curves.append((inverse.T @ solved, np.sqrt(np.sum(inverse**2, axis=0))))
        best = int(np.argmax(gains))
        heat, sd = curves[best]
        split = {run: slice(k * BLOCKS, (k + 1) * BLOCKS) for k, run in enumerate(edges)}
        found.append(
            Forcing(
                state,
                float(log_mean_exp(np.array(gains))) + offset,
                edges,
                {run: heat[s] for run, s in split.items()},
                {run: sd[s] for run, s in split.items()},
                z @ heat,
            )
        )
    return sorted(found, key=lambda f: -f.gain)


def alike(forcings: list[Forcing], limit: float = 0.9) -> list[tuple[str, ...]]:
    """Bodies whose free heat looks the same in the readings, as places that cannot be told apart."""
    groups: list[list[Forcing]] = []
    for f in forcings:
        for group in groups:
            cosine = abs(float(f.signature @ group[0].signature))
            cosine /= float(np.linalg.norm(f.signature) * np.linalg.norm(group[0].signature)) or 1.0
            if cosine > limit:
                group.append(f)
                break
        else:
            groups.append([f])
    return [tuple(f.state for f in group) for group in groups]
