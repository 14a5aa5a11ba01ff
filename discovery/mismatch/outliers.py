"""Single wrong readings: found on the residual of the baseline, set aside before any test, reported."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.fitting import Fit

Array = NDArray[np.float64]

FAR = 6.5  # reading noises from the mean of both neighbours
LONELY = 0.4  # the neighbours agree with each other within this share of the distance


@dataclass(frozen=True)
class Outlier:
    """One reading that its neighbours contradict: `size` in the unit of the output, time as in the grid."""

    output: str
    recording: str
    time: float
    size: float
    noise: float


def find_outliers(fit: Fit, white: Array) -> list[Outlier]:
    """Readings far from both neighbours while these agree; residuals are compared, so steps of inputs pass.

    Args:
        white: (Y,) reading noise.
    """
    found = []
    for trajectory in fit.trajectories:
        grid = trajectory.system.grid
        residual = fit.problem.residual(trajectory)
        for y, name in enumerate(grid.outputs):
            rows = np.flatnonzero(np.isfinite(residual[:, y]))
            r = residual[rows, y]
            if len(r) < 3:
                continue
            jump = r[1:-1] - 0.5 * (r[:-2] + r[2:])
            alone = np.abs(r[2:] - r[:-2]) < LONELY * np.abs(jump)
            for k in np.flatnonzero((np.abs(jump) > FAR * white[y] * np.sqrt(1.5)) & alone):
                at = float(grid.time[grid.read[rows[k + 1]]])
                found.append(
                    Outlier(name, grid.recording, at, float(jump[k]), float(white[y]) * float(np.sqrt(1.5)))
                )
    return found


def without(grids: Mapping[str, Grid], outliers: list[Outlier]) -> dict[str, Grid]:
    """The grids with these readings taken out."""
    out = dict(grids)
    for run in {o.recording for o in outliers}:
        grid = out[run]
        readings = grid.readings.copy()
        for o in outliers:
            if o.recording == run:
                row = int(np.argmin(np.abs(grid.time[grid.read] - o.time)))
                readings[row, grid.outputs.index(o.output)] = np.nan
        out[run] = replace(grid, readings=readings)
    return out
