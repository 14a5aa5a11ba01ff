"""Data for a choice of terms in rates: grids, thinned readings, blocks of time, and a rough noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_grid, predict
from discovery.errors import RunsAwayError
from discovery.fitting import Noise, predict_recording
from discovery.fitting.noise import roughness
from discovery.fitting.resolution import resolved
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.sparse.folds import Blocks, make_blocks

_READINGS = 250  # of one output in one recording: more say little that is new about what moves slowly
_IN_TIME_SCALE = 5  # readings in the time in which the readings forget half of what they were
_MOST = 4000  # readings of one output in one recording
_NOISE_GROWS = 1.15  # mean square between two noisy readings: 3/2 in their middle, 5/3 on average
_MISSED = 0.03  # share of the spread of readings that thinning may lose
_RASTER = 4096  # points on which this time is looked for
_IN_PIECE, _PIECES = 8, 6  # readings of a piece of a recording, at least; pieces of a recording, at most
_FAR = 3.0  # times the rms: start values that are no use


@dataclass(frozen=True)
class RateData:
    """What the choice works on."""

    campaign: Campaign
    recordings: tuple[str, ...]
    outputs: tuple[str, ...]
    grids: Mapping[str, Grid]
    blocks: Blocks
    scale: float  # s, in which the readings forget half of what they were

    @property
    def size(self) -> tuple[float, ...]:
        """What errors of each output are weighed with: its stated noise, else a share of the readings'
        spread.
        """
        return rough_noise(self).white


def make_rate_data(
    campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], inputs: Sequence[str], blocks: int
) -> RateData:
    """Grids of the recordings with all inputs that any candidate may use, dense readings thinned."""
    scale = min(time_scale(campaign, recordings, [y]) for y in outputs)
    longest = max(float(campaign.recordings[r].time[-1]) for r in recordings)
    wanted = max(_IN_TIME_SCALE * longest / scale, readings_that_show(campaign, recordings, outputs))
    most = int(np.clip(wanted, _READINGS, _MOST))
    campaign = thinned(campaign, recordings, outputs, inputs, most)
    grids = {r: make_grid(campaign, r, inputs, outputs, coarse=8 * most).evened() for r in recordings}
    times = [grids[r].time[grids[r].read] for r in recordings]
    return RateData(campaign, tuple(recordings), tuple(outputs), grids, make_blocks(times, blocks), scale)


def time_scale(campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]) -> float:
    """Time [s] after which the autocorrelation of the readings is one half.

    The correlation at the smallest lag counts as one, which leaves white noise out.
    """
    found = []
    for name, output in ((r, y) for r in recordings for y in outputs):
        recording = campaign.recordings[name]
        known = np.isfinite(recording.values[output])
        time, series = recording.time[known], recording.values[output][known]
        if len(time) >= 8 and np.ptp(series) > 0:
            found.append(half_forgotten(time, series))
    return float(np.median(found)) if found else 1.0


def half_forgotten(time: NDArray[np.float64], series: NDArray[np.float64]) -> float:
    """Time [s] after which the autocorrelation of a series (N,) at instants `time` (N,) [s] is one half of
    that at the smallest lag.
    """
    raster = np.linspace(time[0], time[-1], min(_RASTER, 2 * len(time)))
    x = np.interp(raster, time, series)
    power = np.abs(np.fft.rfft(x - x.mean(), 2 * len(x))) ** 2
    rho = np.fft.irfft(power)[: len(x)]
    below = np.flatnonzero(rho[1:] < 0.5 * rho[1])
    return float((below[0] + 1 if len(below) else len(x)) * (raster[1] - raster[0]))


def readings_that_show(campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]) -> int:
    """Number of readings of a recording between which straight lines miss little more of an output than
    between all of them: a ringing spring needs more than the time in which it forgets says.
    """
    most = 0
    for name, output in ((r, y) for r in recordings for y in outputs):
        recording = campaign.recordings[name]
        known = np.isfinite(recording.values[output])
        time, series = recording.time[known], recording.values[output][known]
        noise, every = 0.0, 2
        while 8 * every < len(series):
            left_out = np.arange(len(series)) % every != 0
            off = np.interp(time, time[::every], series[::every])[left_out] - series[left_out]
            missed = float(np.mean(off**2))
            noise = missed if every == 2 else noise
            if missed > _NOISE_GROWS * noise + (_MISSED * float(np.std(series))) ** 2:
                break
            every *= 2
        most = max(most, 2 * len(series) // every)
    return most


def thinned(
    campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], inputs: Sequence[str], most: int
) -> Campaign:
    """The campaign with at most about `most` evenly chosen readings of each output in a recording.

    Held inputs keep the stamps at which they change alone, which says the same; both spare nodes of the grid.
    """
    made = {}
    for name in recordings:
        recording = campaign.recordings[name]
        values = dict(recording.values)
        for output in outputs:
            known = np.flatnonzero(np.isfinite(values[output]))
            if (every := len(known) // most) >= 2:
                few = np.full(len(recording.time), np.nan)
                few[known[::every]] = values[output][known[::every]]
                values[output] = few
        for channel in set(inputs) & set(values):
            known = np.flatnonzero(np.isfinite(values[channel]))
            if campaign.channels[channel].between == "held" and len(known) > 1:
                same = np.setdiff1d(known[1:], jumps(values[channel]))
                values[channel] = values[channel].copy()
                values[channel][same] = np.nan
        made[name] = replace(recording, values=values)
    return replace(campaign, recordings=made)


def in_pieces(data: RateData, seconds: float) -> RateData:
    """A few pieces of about so many seconds of each recording, evenly placed, each a recording of its own.

    A free run of a short piece is near the readings at once. That of a whole recording of something that
    swings drifts out of phase, and a fit to it ends where the phase is right by chance.
    """
    grids: dict[str, Grid] = {}
    for r in data.recordings:
        grid = data.grids[r]
        time, last = grid.time[grid.read], len(grid.read) - 1
        step = (time[-1] - time[0]) / max(last, 1)
        long = int(np.clip(round(seconds / step), min(_IN_PIECE, last), last)) if step else last
        count = min(last // long, _PIECES) if last else 1
        for k, begin in enumerate(np.linspace(0, last - long, count).astype(int)):
            first, end = int(grid.read[begin]), int(grid.read[begin + long])
            part = replace(grid.part(slice(begin, begin + long + 1)), recording=f"{r} ({k})", known={})
            part = replace(part, time=grid.time[first : end + 1], read=part.read - first)
            grids[part.recording] = part
    blocks = make_blocks([g.time[g.read] for g in grids.values()], data.blocks.count)
    return replace(data, recordings=tuple(grids), grids=grids, blocks=blocks)


def with_short_steps(data: RateData, model: Model) -> RateData:
    """The data with steps so short that the integration of the model errs by little of the noise."""
    seen = [[data.grids[r].readings[:, y] for r in data.recordings] for y in range(len(data.outputs))]
    noise = [min(n, roughness(some)) for n, some in zip(rough_noise(data).white, seen, strict=True)]
    try:
        runs = [
            predict_recording(model, data.campaign, r, data.outputs, noise, data.grids[r])
            for r in data.recordings
        ]
    except RunsAwayError:
        return data
    grids = resolved(runs, noise)
    return replace(data, grids=grids) if grids else data


def jumps(series: NDArray[np.float64]) -> NDArray[np.intp]:
    """Rows at which a series (N,), NaN where nothing is known, changes its value."""
    known = np.flatnonzero(np.isfinite(series))
    return np.asarray(known[1:][np.diff(series[known]) != 0])


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


def nearer(data: RateData, first: Model, second: Model) -> Model:
    """The second model if its start values run far nearer to the readings, otherwise the first.

    Start values from the weak form may belong to a model that runs away; no fit recovers from there.
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
