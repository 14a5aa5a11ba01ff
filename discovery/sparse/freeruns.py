"""Free runs on data that a fit has not seen: mean squared error of each block."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import predict
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Noise, predict_recording
from discovery.models import Model
from discovery.sparse.folds import make_folds
from discovery.sparse.ratedata import RateData
from discovery.sparse.rates import masked, refit

Array = NDArray[np.float64]

RAN_AWAY = 1e12  # instead of the squared error of a model that runs away


def left_out(data: RateData, model: Model, noise: Noise, rounds: int, whole: bool = True) -> Array:
    """Mean squared error (B,) of the free run on each block, over outputs, by fits that have not seen its
    fold.

    They begin at the numbers of the model. Where parts of recordings are left out, so may the first readings
    be, which alone show where hidden states begin: these starts stay.

    Args:
        rounds: of each fit.
        whole: leave whole recordings out, where there are several.
    """
    blocks = data.blocks
    errors = np.full(blocks.count, np.nan)
    for fold in make_folds(blocks, whole):
        keep = {r: ~np.isin(block, fold) for r, block in zip(data.recordings, blocks.of, strict=True)}
        train = {r: masked(data.grids[r], keep[r]) for r in data.recordings if keep[r].any()}
        in_parts = any(some.any() and not some.all() for some in keep.values())
        start = model.with_starts_held() if in_parts else model
        try:
            fit = refit(start, data.campaign, list(train), data.outputs, {}, train, noise, rounds)
            errors[fold] = block_errors(data, fit)[fold]
        except RunsAwayError:  # a sparse model that runs away is a bad model
            errors[fold] = RAN_AWAY
    return errors


def block_errors(data: RateData, fit: Fit) -> Array:
    """Mean squared error (B,) of the free run of a fit on each block, over outputs; of recordings that it was
    not fitted to as well.

    Raises:
        RunsAwayError: the model runs away on such a recording.
    """
    size, errors = np.array(data.size), np.ones(data.blocks.count)
    trajectories = {t.system.grid.recording: t for t in fit.trajectories}
    for r, block in zip(data.recordings, data.blocks.of, strict=True):
        trajectory = trajectories.get(r) or predict_recording(
            fit.model, data.campaign, r, data.outputs, fit.noise.white, data.grids[r]
        )
        left = ((data.grids[r].readings - predict(trajectory)) / size) ** 2
        for b in np.unique(block):
            here = left[block == b]
            errors[b] = np.nanmean(here) if np.isfinite(here).any() else RAN_AWAY
    return np.where(np.isfinite(errors), errors, RAN_AWAY)
