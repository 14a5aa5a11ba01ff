"""Free runs on recordings left out of the fit: what evidence on the recordings themselves cannot say."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.dynamics.system import predict
from discovery.errors import UserError
from discovery.evaluation.crossvalidation import Fold, folds
from discovery.fitting import Noise, predict_recording
from discovery.mismatch.assess import Assessment, refit
from discovery.mismatch.context import Context

BLOCKS = 4  # of a single recording


def left_out(context: Context, answer: Assessment, noise: Noise) -> float:
    """rms of free runs, in units of the reading noise, with the effects of an answer.

    Each recording of the diagnosis in turn (or a quarter of them) is left out, the model fitted anew to the
    others under a noise setting, and run freely on what was left out; of a single recording, each quarter of
    its time. A recording with an event of its own cannot be predicted and is not run. nan where nothing can
    be left out, inf where a fit runs away.
    """
    events = {h.recording for h in answer.hypotheses if h.recording}
    white = np.array(noise.white)
    squares, count = 0.0, 0
    alone = len(context.recordings) == 1
    for fold in folds(context.campaign, context.recordings, blocks=BLOCKS if alone else 0):
        kept = tuple(r for r in context.recordings if r not in fold.recordings)
        grids = {r: _without(context.grids[r], fold) for r in kept}
        seen = replace(context, recordings=kept, grids=grids)
        chosen = [h for h in answer.hypotheses if h.recording is None or h.recording in kept]
        try:
            model = refit(seen, chosen, noise, answer).model
        except UserError:  # the others alone do not hold it: it runs away
            return inf
        for name in (r for r in fold.windows or fold.recordings if r not in events):
            grid = context.grids[name]
            run = predict_recording(model, context.campaign, name, context.outputs, noise.white, grid)
            z = (run.system.grid.readings - predict(run)) / white
            if fold.windows:
                z = z[_inside(grid, fold.windows[name])]
            squares, count = squares + float(np.nansum(z**2)), count + int(np.isfinite(z).sum())
    return float(np.sqrt(squares / count)) if count else float("nan")


def _inside(grid: Grid, window: tuple[float, float]) -> NDArray[np.bool_]:
    """Which readings (R,) lie in a window of time."""
    at = grid.time[grid.read]
    return np.asarray((at >= window[0]) & (at < window[1]))


def _without(grid: Grid, fold: Fold) -> Grid:
    """The grid without the readings of a fold."""
    if not fold.windows:
        return grid
    out = _inside(grid, fold.windows[grid.recording])
    return replace(grid, readings=np.where(out[:, None], np.nan, grid.readings))
