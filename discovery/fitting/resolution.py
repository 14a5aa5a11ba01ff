"""Steps that are short enough: linear laws are integrated exactly, others with an error of second order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory, make_system, predict, simulate
from discovery.errors import RunsAwayError

UNRESOLVED = 0.05  # times the noise by which half the steps move what a model predicts
MOST_PARTS, MOST_STEPS = 8, 40_000  # of a step; of a recording, about


def parts_needed(run: Trajectory, white: Sequence[float] | NDArray[np.float64]) -> int:
    """In how many parts each step of a free run has to be divided: then half the steps would move what it
    predicts by less than UNRESOLVED of the noise, and what they err by is a third of this.

    Means of readings are of steps that are short in any case.

    Args:
        white: (Y,) reading noise.
    """
    grid = run.system.grid
    if run.system.affine or grid.means is not None or not len(grid.read):
        return 1
    parts, now = 1, predict(run)
    while parts < MOST_PARTS and len(grid.time) * parts < MOST_STEPS:
        half = make_system(run.system.model, grid.divided(2 * parts))
        try:
            then = predict(simulate(half, run.values, run.x[0]))
        except RunsAwayError:  # shorter steps do not resolve what runs away
            break
        off = np.sqrt(np.mean(((then - now) / np.asarray(white)) ** 2))
        if not off > UNRESOLVED:
            break
        now, parts = then, 2 * parts
    return parts


def resolved(runs: Sequence[Trajectory], white: Sequence[float]) -> Mapping[str, Grid] | None:
    """Grids with steps that are short enough, by recording; None where all are."""
    parts = [parts_needed(run, white) for run in runs]
    if max(parts, default=1) == 1:
        return None
    grids = [run.system.grid for run in runs]
    return {g.recording: g.divided(n) for g, n in zip(grids, parts, strict=True)}
