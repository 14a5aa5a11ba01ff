"""A latent force: smooth heat of unknown cause at one body, and its curve over time.

The heat is piecewise constant over blocks with a first-order covariance of unknown size; its curve follows in
closed form. It needs no catalogue: it shows where and when something is missing, and how much any explanation
can gain (Alvarez, Luengo & Lawrence, Latent force models, AISTATS 2009).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.evidence.bayes import project
from discovery.evidence.events import heat_steps
from discovery.evidence.settings import Setting
from discovery.evidence.whitening import Whitened, log_sum_exp

Array = NDArray[np.float64]

BLOCKS = 72  # per recording
SIZES = (2.5, 8.0, 25.0, 80.0)  # rms of the heat, over the process noise that every body has
MEMORY_BLOCKS = 3.0  # correlation length of the heat


@dataclass(frozen=True)
class Force:
    """Heat of unknown cause at one state: log evidence over none, and its curve by recording.

    `edges` (B + 1,) in s, `heat` and `sd` (B,) in W (or rate) by recording.
    """

    state: str
    gain: float
    edges: Mapping[str, Array]
    heat: Mapping[str, Array]
    sd: Mapping[str, Array]
    signature: Array  # (N,) whitened response to the curve


def latent_forces(seen: Whitened, setting: Setting, floor: Mapping[str, float]) -> list[Force]:
    """The latent force at every state, the most likely one first.

    Args:
        seen: what a fit leaves.
        setting: noise under which it is sought; level one of the process noise counts as usual.
        floor: by state, the process noise at level one.
    """
    found = [_at(seen, setting, state, size) for state, size in floor.items() if size > 0]
    return sorted(found, key=lambda f: -f.gain)


def _at(seen: Whitened, setting: Setting, state: str, usual: float) -> Force:
    trajectories = seen.fit.trajectories
    count, edges, columns = len(trajectories), {}, []
    for k, run in enumerate(trajectories):
        time = run.system.grid.time
        edge = edges[run.system.grid.recording] = np.linspace(time[0], time[-1], BLOCKS + 1)
        steps = heat_steps(run, state, edge)
        full = np.zeros((*steps.shape[:2], BLOCKS * count))
        full[:, :, k * BLOCKS : (k + 1) * BLOCKS] = steps[:, :, :-1] - steps[:, :, 1:]
        columns.append(full)
    part = project(seen, setting, columns)
    gram, dot = part.block(range(BLOCKS * count)), part.dot
    lag = np.abs(np.subtract.outer(np.arange(BLOCKS), np.arange(BLOCKS)))
    kernel = np.kron(np.eye(count), np.exp(-lag / MEMORY_BLOCKS))
    root = np.linalg.cholesky(kernel + 1e-9 * np.eye(len(kernel)))
    gains, curves = [], []
    for size in SIZES:
        half = size * usual * root
        chol = np.linalg.cholesky(np.eye(len(kernel)) + half.T @ gram @ half)
        solved = np.linalg.solve(chol, half.T @ dot)
        gains.append(0.5 * float(solved @ solved) - float(np.sum(np.log(np.diag(chol)))))
        inverse = np.linalg.solve(chol, half.T)
        curves.append((inverse.T @ solved, np.sqrt(np.sum(inverse**2, axis=0))))
    heat, sd = curves[int(np.argmax(gains))]
    split = {run: slice(k * BLOCKS, (k + 1) * BLOCKS) for k, run in enumerate(edges)}
    return Force(
        state,
        float(log_sum_exp(np.array(gains)) - np.log(len(SIZES))),
        edges,
        {run: heat[s] for run, s in split.items()},
        {run: sd[s] for run, s in split.items()},
        part.columns @ heat,
    )


def alike(forces: Sequence[Force], limit: float = 0.9) -> list[tuple[str, ...]]:
    """States that these readings cannot separate: their latent forces look the same."""
    groups: list[list[Force]] = []
    for f in forces:
        for group in groups:
            cosine = abs(float(f.signature @ group[0].signature))
            cosine /= float(np.linalg.norm(f.signature) * np.linalg.norm(group[0].signature)) or 1.0
            if cosine > limit:
                group.append(f)
                break
        else:
            groups.append([f])
    return [tuple(f.state for f in group) for group in groups]


def heat_over_time(
    force: Force, offsets: Mapping[str, float], recordings: Collection[str]
) -> dict[str, dict[str, list[float]]]:
    """The heat by recording: block centres [s], mean and standard deviation."""
    out = {}
    for run in recordings:
        centre = offsets[run] + 0.5 * (force.edges[run][1:] + force.edges[run][:-1])
        out[run] = {
            "time_s": [round(float(v), 1) for v in centre],
            "heat": [float(f"{v:.4g}") for v in force.heat[run]],
            "sd": [float(f"{v:.4g}") for v in force.sd[run]],
        }
    return out
