"""The proof: free runs of the refitted baseline and of the repaired model on recordings that no fit saw."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.dynamics.system import predict
from discovery.errors import RunsAwayError
from discovery.fitting import Noise, predict_recording
from discovery.mismatch.assess import Assessment
from discovery.mismatch.events import heat_steps
from discovery.models import Model
from discovery.models.units import differences
from discovery.recordings import Campaign

Array = NDArray[np.float64]

MULTIPLES = "times the reading noise"  # the unit of a proof over outputs of several units
CLOSABLE = 1.03  # rms over the noise floor from which a recording holds a mismatch worth closing


@dataclass(frozen=True)
class Improvement:
    """Residual rms of a recording before and after the repair, and what no model can go below.

    `low` and `high` bound the improvement of the rms (before - after) by block bootstrap, 95 %. `after` is
    infinite where the repaired model runs away.
    """

    before: float
    after: float
    floor: float
    low: float
    high: float

    @property
    def contradicts(self) -> bool:
        """Whether the recording is predicted worse than without the repair, beyond chance."""
        return self.high < 0


def improvements(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    before: Model,
    after: Model,
    noise: Noise,
) -> dict[str, Improvement]:
    """Free runs on each recording, zeroed on the first reading alone.

    rms is over all outputs, each weighed by its reading noise, in `unit_of` them. A recording on which the
    model runs away before the repair proves nothing and is left out.
    """
    out, one = {}, size_of(campaign, noise)
    for run in recordings:
        old = _free_run(before, campaign, run, outputs, noise)
        new = _free_run(after, campaign, run, outputs, noise)
        if old and new:
            out[run] = compare(old, new, noise, one)
        elif old:
            out[run] = replace(compare(old, old, noise, one), after=inf, low=-inf, high=-inf)
    return out


def unit_of(campaign: Campaign, outputs: Sequence[str]) -> str:
    """The unit of a proof: that of all outputs, or, where they have several, multiples of the noise."""
    units = {differences(campaign.channels[name].unit) for name in outputs}
    return units.pop() if len(units) == 1 else MULTIPLES


def size_of(campaign: Campaign, noise: Noise) -> float:
    """What one reading noise is in the unit of a proof: the mean noise of outputs of one unit, else 1."""
    if unit_of(campaign, noise.outputs) == MULTIPLES:
        return 1.0
    return float(np.sqrt(np.mean(np.square(noise.white))))


def _free_run(
    model: Model, campaign: Campaign, run: str, outputs: Sequence[str], noise: Noise
) -> Trajectory | None:
    """None where the model, or an output of it, does not stay finite."""
    try:
        trajectory = predict_recording(model, campaign, run, outputs, noise.white)
        predict(trajectory)
    except RunsAwayError:
        return None
    return trajectory


def compare(old: Trajectory, new: Trajectory, noise: Noise, one: float) -> Improvement:
    """Two trajectories of one recording against its readings; `one`: what one reading noise is."""
    white = np.array(noise.white)
    a = (old.system.grid.readings - predict(old)) / white * one
    b = (new.system.grid.readings - predict(new)) / white * one
    rng = np.random.default_rng(0)
    count, size = len(a), max(1, len(a) // 24)
    starts = np.arange(0, count, size)
    sa = np.array([np.nansum(a[s : s + size] ** 2) for s in starts])
    sb = np.array([np.nansum(b[s : s + size] ** 2) for s in starts])
    number = np.array([np.isfinite(a[s : s + size]).sum() for s in starts])
    draw = rng.integers(0, len(starts), (400, len(starts)))
    total = number[draw].sum(axis=1)
    gain = np.sqrt(sa[draw].sum(axis=1) / total) - np.sqrt(sb[draw].sum(axis=1) / total)
    return Improvement(
        float(np.sqrt(np.nanmean(a**2))),
        float(np.sqrt(np.nanmean(b**2))),
        one * noise_floor(new, noise),
        float(np.quantile(gain, 0.025)),
        float(np.quantile(gain, 0.975)),
    )


def noise_floor(trajectory: Trajectory, noise: Noise) -> float:
    """rms that reading noise, slow noise and everyday heat leave in a free run, in reading noises."""
    white = np.array(noise.white)
    slow = np.array(noise.slow or np.zeros(len(white)))
    variance = np.tile(1.0 + (slow / white) ** 2, (len(trajectory.system.grid.read), 1))
    time = trajectory.system.grid.time
    edges = np.linspace(time[0], time[-1], 73)
    lag = np.abs(np.subtract.outer(edges[:-1], edges[:-1]))
    for state, sd in (noise.heat or {}).items():
        if sd > 0 and state in trajectory.system.states:
            steps = heat_steps(trajectory, state, edges)
            blocks = (steps[:, :, :-1] - steps[:, :, 1:]) / white[None, :, None] * sd
            kernel = np.exp(-lag / noise.heat_time)
            variance = variance + np.einsum("ryk,kl,ryl->ry", blocks, kernel, blocks, optimize=True)
    return float(np.sqrt(np.mean(variance)))


def explained(found: Mapping[str, Improvement]) -> float | None:
    """Share of the closable mismatch that the repair removes; None where there is none."""
    gap = gain = 0.0
    for i in found.values():
        if i.before > CLOSABLE * i.floor:
            gap += i.before**2 - i.floor**2
            gain += i.before**2 - max(i.after, i.floor) ** 2
    return float(np.clip(gain / gap, -1.0, 1.0)) if gap > 0 else None


def on_fit(before: Assessment, after: Assessment, one: float) -> Improvement:
    """The same of the recordings of the fit, all together."""
    parts = [
        compare(old, new, after.best_view.noise, one)
        for old, new in zip(before.fit.trajectories, after.fit.trajectories, strict=True)
    ]

    def together(values: Sequence[float]) -> float:
        return float(np.sqrt(np.mean(np.square(values))))

    return Improvement(
        together([p.before for p in parts]),
        together([p.after for p in parts]),
        together([p.floor for p in parts]),
        min(p.low for p in parts),
        max(p.high for p in parts),
    )
