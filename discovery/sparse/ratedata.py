"""What a choice of terms in rates works on: grids, thinned readings, blocks of time, and a rough noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discovery.dynamics import Grid, make_grid
from discovery.dynamics.system import predict
from discovery.errors import RunsAwayError
from discovery.fitting import Noise, predict_recording
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.sparse.folds import Blocks, make_blocks

_READINGS = 250  # of one output in one recording: more say nothing new about hours or minutes
_FAR = 3.0  # times the rms: start values that are no use


@dataclass(frozen=True)
class RateData:
    """What the choice works on."""

    campaign: Campaign
    recordings: tuple[str, ...]
    outputs: tuple[str, ...]
    grids: Mapping[str, Grid]
    blocks: Blocks


def make_rate_data(
    campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], inputs: Sequence[str], blocks: int
) -> RateData:
    """Grids of the recordings with all inputs that any candidate may use, dense readings thinned."""
    campaign = thinned(campaign, recordings, outputs, inputs)
    grids = {r: make_grid(campaign, r, inputs, outputs, coarse=8 * _READINGS) for r in recordings}
    times = [grids[r].time[grids[r].read] for r in recordings]
    return RateData(campaign, tuple(recordings), tuple(outputs), grids, make_blocks(times, blocks))


def thinned(
    campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], inputs: Sequence[str]
) -> Campaign:
    """The campaign with at most about `_READINGS` evenly chosen readings of each output in a recording.

    Held inputs keep the stamps at which they change alone, which says the same; both spare nodes of the grid.
    """
    made = {}
    for name in recordings:
        recording = campaign.recordings[name]
        values = dict(recording.values)
        for output in outputs:
            known = np.flatnonzero(np.isfinite(values[output]))
            if len(known) >= 2 * _READINGS:
                few = np.full(len(recording.time), np.nan)
                few[known[:: len(known) // _READINGS]] = values[output][known[:: len(known) // _READINGS]]
                values[output] = few
        for channel in set(inputs) & set(values):
            known = np.flatnonzero(np.isfinite(values[channel]))
            if campaign.channels[channel].between == "held" and len(known) > 1:
                same = known[1:][np.diff(values[channel][known]) == 0]
                values[channel] = values[channel].copy()
                values[channel][same] = np.nan
        made[name] = replace(recording, values=values)
    return replace(campaign, recordings=made)


def stated_noise(data: RateData) -> dict[str, float | None]:
    """Reading noise of each output as the campaign states it; None where it does not."""
    return {name: data.campaign.channels[name].noise for name in data.outputs}


def rough_noise(data: RateData) -> Noise:
    """Noise that weighs the outputs before anything is fitted: the stated one, else 2 % of the readings'
    spread.
    """
    spread = np.nanstd(np.concatenate([data.grids[r].readings for r in data.recordings]), axis=0)
    stated = stated_noise(data).values()
    return Noise(
        data.outputs, tuple(n or max(0.02 * float(s), 1e-9) for n, s in zip(stated, spread, strict=True))
    )


def has_reading(data: RateData, block: int) -> bool:
    """Whether any output was read in a block of time."""
    of, readings = zip(data.blocks.of, data.recordings, strict=True), data.grids
    return any(np.isfinite(readings[r].readings[b == block]).any() for b, r in of)


def nearer(data: RateData, first: Model, second: Model) -> Model:
    """The first model unless the second one, as they stand, runs far nearer to the readings.

    Start values from the weak form may belong to a model that runs away: no fit comes back from there.
    """
    return second if _missed(data, first) > _FAR**2 * _missed(data, second) else first


def _missed(data: RateData, model: Model) -> float:
    """Mean squared error of free runs over the rough noise; infinite where one runs away."""
    noise = rough_noise(data).white
    squares = []
    for r in data.recordings:
        try:
            run = predict_recording(model, data.campaign, r, data.outputs, noise, data.grids[r])
            squares.append((((data.grids[r].readings - predict(run)) / noise) ** 2).ravel())
        except RunsAwayError:
            return float("inf")
    missed = float(np.nanmean(np.concatenate(squares)))
    return missed if np.isfinite(missed) else float("inf")
