"""Steps that are short enough: for what a model predicts, and for how that moves with its parameters.

Linear laws are integrated exactly, others with an error of second order. Slopes have such an error in any
case: the state that a parameter multiplies is a straight line within a step. Where readings come as slowly as
a body answers, a fit would follow slopes that are not those of its cost, and stop away from the optimum.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory, make_system, predict, sensitivities, simulate
from discovery.errors import RunsAwayError

Array = NDArray[np.float64]

UNRESOLVED = 0.05  # times the noise by which half the steps move what a model predicts
SLOPES = 0.005  # share by which they move how that answers to a parameter: several answer alike
MOST_PARTS, MOST_STEPS = 8, 40_000  # of a step; of a recording, about


def parts_needed(run: Trajectory, white: Sequence[float] | Array, free: Sequence[str] = ()) -> int:
    """In how many parts each step of a free run has to be divided: then half the steps would move what it
    predicts by less than UNRESOLVED of the noise, and its slopes by less than SLOPES of what they are. What
    they err by is a third of this.

    Means of readings are of steps that are short in any case.

    Args:
        white: (Y,) reading noise.
        free: parameters whose slopes are needed.
    """
    grid = run.system.grid
    exact = run.system.affine and not free
    if exact or grid.means is not None or not len(grid.read):
        return 1
    parts, now = 1, _shown(run, white, free)
    while parts < MOST_PARTS and len(grid.time) * parts < MOST_STEPS:
        half = make_system(run.system.model, grid.divided(2 * parts))
        try:
            then = _shown(simulate(half, run.values, run.x[0]), white, free)
        except RunsAwayError:  # shorter steps do not resolve what runs away
            break
        if not _moved(now, then):
            break
        now, parts = then, 2 * parts
    return parts


def resolved(
    runs: Sequence[Trajectory], white: Sequence[float], free: Sequence[str] = ()
) -> Mapping[str, Grid] | None:
    """Grids with steps that are short enough, by recording; None where all are."""
    parts = [parts_needed(run, white, free) for run in runs]
    if max(parts, default=1) == 1:
        return None
    grids = [run.system.grid for run in runs]
    return {g.recording: g.divided(n) for g, n in zip(grids, parts, strict=True)}


def _shown(run: Trajectory, white: Sequence[float] | Array, free: Sequence[str]) -> Array:
    """What a run predicts (R, Y, 1 + P), and its slopes, over the noise; zero where nothing was measured."""
    shown = np.concatenate([predict(run)[:, :, None], sensitivities(run, free)], axis=2)
    return np.where(run.system.grid.measured[:, :, None], shown / np.asarray(white)[:, None], 0.0)


def _moved(now: Array, then: Array) -> bool:
    """Whether half the steps move a prediction or a slope by too much."""
    off = np.linalg.norm((then - now).reshape(-1, now.shape[2]), axis=0)
    size = np.linalg.norm(then.reshape(-1, now.shape[2]), axis=0)
    unresolved = off[0] > UNRESOLVED * np.sqrt(now[:, :, 0].size)
    return bool(unresolved or np.any(off[1:] > SLOPES * size[1:]))
