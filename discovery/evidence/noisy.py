"""Inputs that are recorded with noise: each sample is off by an amount of its own.

A power of 500 W that is read to 50 W heats a small body by other amounts than recorded, which looks like heat
of unknown cause. How rough a channel is between its samples is known from the recording. Whether this is
noise or the machine follows it is asked of the readings: noise of the inputs is one of the noise settings
(`process_noise.py`). It is left out where it could not pass for an effect.

Noise of an input is in what the model makes of it, too: a lag or a mass that only smooths the input then
explains some of what the noise leaves. So the inputs themselves are smoothed where the readings agree better
with that.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory
from discovery.dynamics.samples import Samples, read_samples
from discovery.evidence.outliers import FAR
from discovery.fitting import Fit, Noise
from discovery.fitting.kalman import make_filter
from discovery.recordings import Campaign

Array = NDArray[np.float64]

NEAR = 31  # samples, of which the noise of one in the middle is the median
_TOGETHER = 10_000  # medians at a time
GAUSS = 0.6745 * np.sqrt(6)  # median of the second differences of white noise, over its standard deviation


def perhaps_noisy(
    fit: Fit, campaign: Campaign, grids: Mapping[str, Grid], white: Noise, enough: float
) -> dict[str, Grid]:
    """Grids with the noise of each input that the model uses, if the readings could show it.

    Args:
        fit: of the model, to some or all readings of the grids.
        white: reading noise.
        enough: log likelihood, expected by a model that knows the noise over one that does not, if it is as
            large as the channel is rough.
    """
    runs = [with_noise(campaign, run) for run in fit.trajectories]
    names = sorted({name for run in runs for name in run.system.grid.noisy})
    shown = [name for name in names if sum(_gain(_only(run, [name]), white) for run in runs) > enough]
    noisy = {run.system.grid.recording: _only(run, shown).system.grid.noisy for run in runs}
    return {name: replace(grid, noisy=noisy[name]) for name, grid in grids.items()}


def smoothed(grids: Mapping[str, Grid]) -> dict[str, Grid]:
    """Grids whose noisy inputs are smoothed."""

    def one(grid: Grid) -> Grid:
        inputs = {name: smooth(grid.samples[name], noise) for name, noise in grid.noisy.items()}
        return replace(grid, samples={**grid.samples, **inputs}, known={})

    return {name: one(grid) for name, grid in grids.items()}


def smooth(samples: Samples, noise: Samples) -> Samples:
    """A channel with each sample as the mean of those near it, without those as far away as a wrong reading:
    edges stay (sigma filter; Lee, Comput. Vis. Graph. Image Process. 24, 1983).
    """
    step = np.diff(samples.time, append=2 * samples.time[-1] - samples.time[-2])
    sd = noise.at(samples.time) / np.sqrt(step)
    near = sliding_window_view(np.pad(samples.value, NEAR // 2, mode="reflect"), NEAR)
    alike = np.abs(near - samples.value[:, None]) <= FAR * sd[:, None]
    return replace(samples, value=np.sum(near * alike, axis=1) / np.sum(alike, axis=1))


def log_likelihood(fit: Fit, noises: Sequence[Noise]) -> float:
    """Log likelihood of what a fit leaves, under the most likely of some noises."""
    filters = [make_filter(run) for run in fit.trajectories]
    left = [fit.problem.residual(run)[:, :, None] for run in fit.trajectories]

    def under(noise: Noise) -> float:
        whitened = [part.whitened(noise, one) for part, one in zip(filters, left, strict=True)]
        return -sum(float(np.sum(log) + 0.5 * np.sum(z**2)) for z, log in whitened)

    return max(under(noise) for noise in noises)


def sentences(fit: Fit, noise: Noise) -> list[str]:
    """A sentence for each input that is recorded with noise, where this is the most likely noise."""
    if not noise.rough:
        return []
    noisy = {name for run in fit.trajectories for name in run.system.grid.noisy}
    allowed = (
        "jumps from sample to sample by more than the outputs show: noise of its recording, or too quick for "
        "the bodies; the diagnosis allows for it"
    )
    return [f"{name} {allowed}" for name in fit.model.inputs if name in noisy]


def spectral(samples: Samples, stated: float | None = None) -> Samples:
    """Noise of a channel as the root of its spectral density, in its unit per root of Hz, at each sample.

    By second differences of consecutive samples and their median, as `roughness`, near each sample: noise may
    grow with what is measured.

    Args:
        stated: standard deviation of the noise of a sample, if the campaign states it.
    """
    second = np.abs(np.diff(np.pad(samples.value, 1, mode="reflect"), 2)) / GAUSS
    near = _medians(second)
    step = np.diff(samples.time)
    sd = near if stated is None else np.full(len(near), stated)
    return Samples(samples.time, sd * np.sqrt(np.append(step, step[-1])), False)


def _medians(values: Array) -> Array:
    """Median of the values (N,) near each one; at both ends, the last one counts for those behind it."""
    near = sliding_window_view(np.pad(values, NEAR // 2, mode="edge"), NEAR)
    parts = np.array_split(near, len(near) // _TOGETHER + 1)  # a long recording does not fit into memory
    return np.concatenate([np.median(part, axis=1) for part in parts])


def with_noise(campaign: Campaign, run: Trajectory) -> Trajectory:
    """A run that knows the noise of those of its inputs that are read about as often as the outputs."""
    grid = run.system.grid
    return replace(run, system=replace(run.system, grid=replace(grid, noisy=_noisy(campaign, grid))))


def _noisy(campaign: Campaign, grid: Grid) -> dict[str, Samples]:
    spacing = min((grid.logged[y] for y in grid.outputs if y in grid.logged), default=0.0)
    often = [n for n in grid.samples if grid.logged.get(n, np.inf) <= spacing]
    samples = read_samples(campaign, grid.recording, often)
    noise = {n: spectral(s, campaign.channels[n].noise) for n, s in samples.items()}
    # at an end, the median is that of fewer samples: what is rough there alone is a switch
    inside = {n: one.value[NEAR // 2 : -(NEAR // 2)] for n, one in noise.items()}
    return {n: one for n, one in noise.items() if (inside[n] if inside[n].size else one.value).any()}


def _only(run: Trajectory, channels: Collection[str]) -> Trajectory:
    grid = run.system.grid
    kept = {name: one for name, one in grid.noisy.items() if name in channels}
    return replace(run, system=replace(run.system, grid=replace(grid, noisy=kept)))


def _gain(run: Trajectory, white: Noise) -> float:
    """Expected log likelihood of a model that knows the noise of the inputs over one that does not:

    0.5 sum v / w^2 - 0.5 sum log(s^2 / w^2)

    with the variance v that it gives to free runs, the innovations s of the filter and the reading noise w.
    """
    if not run.system.grid.noisy:
        return 0.0
    noise = replace(white, rough=1.0)
    sd = run.system.grid.sd(noise.white)
    _, roots = make_filter(run).gains(noise)
    gain = 0.5 * make_filter(run).spread(noise) / sd**2 - np.log(roots / sd)
    return float(np.sum(gain[run.system.grid.measured]))
