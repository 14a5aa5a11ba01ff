"""Single wrong readings: found on the residual of the baseline, set aside before any test, and reported."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_system, predict
from discovery.fitting import Fit
from discovery.recordings import Campaign

Array = NDArray[np.float64]

FAR = 6.5  # reading noises from the median of the readings around, which scatter less, too
MOST = 2  # wrong readings in a row
AROUND = MOST + 1  # readings on each side that a reading is compared with: most of them are right


@dataclass(frozen=True)
class Outlier:
    """One reading that its neighbours contradict: `size` in the unit of the output, time as in the grid."""

    output: str
    recording: str
    time: float
    size: float
    noise: float


def find_outliers(fit: Fit, grids: Mapping[str, Grid], white: Array) -> list[Outlier]:
    """Readings far from their neighbours, which agree; residuals are compared, so steps of inputs do not
    count.

    Args:
        grids: all readings of each recording, also where the fit saw only some.
        white: (Y,) reading noise.
    """
    found = []
    for grid in grids.values():
        trajectory = fit.problem.run(make_system(fit.problem.model, grid), fit.theta)
        residual = fit.problem.residual(trajectory)
        shown = predict(trajectory)
        for y, name in enumerate(grid.outputs):
            rows = np.flatnonzero(np.isfinite(residual[:, y]))
            r = residual[rows, y]
            if len(r) < 3:  # no reading has others on both sides
                continue
            middle, scatter = _around(r)
            jump = r - middle
            # whatever the model leaves out, the noise is no smaller than differences of readings show
            steps = np.diff(r)
            noise = max(float(white[y]), float(np.median(np.abs(steps - np.median(steps)))) / 0.954)
            limit = FAR * np.maximum(noise, scatter)
            # what is logged a little late shows in one reading, by what it makes of those around
            alone = _returns(r, middle, limit) & (np.abs(jump) > limit + _moved(shown[rows, y]))
            for k in np.flatnonzero(alone):
                at = float(grid.time[grid.read[rows[k]]])
                found.append(Outlier(name, grid.recording, at, float(jump[k]), noise))
    return found


def _returns(r: Array, middle: Array, limit: Array) -> NDArray[np.bool_]:
    """Which readings (N,) are far from the median of those around, while the readings next to them, on both
    sides, are near it; of at most `MOST` of about one size in a row, those next to the row. At its ends a
    recording may just have begun to move.
    """
    size = np.abs(r - middle)
    suspect = size > limit
    found = np.zeros(len(r), dtype=bool)
    for k in np.flatnonzero(suspect):
        # what fades is a response, not a row of wrong readings
        others = np.flatnonzero(~(suspect & (size > 0.4 * size[k]) & (size < 2.5 * size[k])))
        place = int(np.searchsorted(others, k))
        if place in (0, len(others)):
            continue
        before, after = int(others[place - 1]), int(others[place])
        near = max(abs(r[before] - middle[k]), abs(r[after] - middle[k])) < limit[k]
        found[k] = near and after - before - 1 <= MOST
    return found


def _around(r: Array) -> tuple[Array, Array]:
    """Median (N,) of the readings around each one, itself left out, and their median deviation from it."""
    offsets = np.array([k for k in range(-AROUND, AROUND + 1) if k])
    rows = np.arange(len(r))[:, None] + offsets
    window = np.where((rows >= 0) & (rows < len(r)), r[np.clip(rows, 0, len(r) - 1)], np.nan)
    middle = np.nanmedian(window, axis=1)
    return middle, np.nanmedian(np.abs(window - middle[:, None]), axis=1)


def _moved(shown: Array) -> Array:
    """By how much (N,) a prediction (N,) moves over the readings around each one."""
    around = sliding_window_view(np.pad(shown, MOST, mode="edge"), 2 * MOST + 1)
    return np.asarray(np.ptp(around, axis=1))


def without_wrong(campaign: Campaign, outliers: Sequence[Outlier]) -> Campaign:
    """The campaign without these readings, where each is one of its stamps: a fit that does not look at the
    readings around would follow one that is far away.
    """
    recordings = dict(campaign.recordings)
    for o in outliers:
        one = recordings[o.recording]
        kept = np.where(one.time == o.time, np.nan, one.values[o.output])
        recordings[o.recording] = replace(one, values={**one.values, o.output: kept})
    return replace(campaign, recordings=recordings)


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
