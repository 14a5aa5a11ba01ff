"""The proof: free runs of the fitted baseline and of the repaired model, as in every table.

Both models are fitted and started like any model of an experiment, without the process noise and the starts
of the diagnosis. Single wrong readings are set aside.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import copysign, hypot, inf, isfinite, sqrt

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.left_open import Known
from discovery.dynamics import Trajectory, predict
from discovery.errors import RunsAwayError
from discovery.evidence.noisy import with_noise
from discovery.evidence.outliers import find_outliers, without
from discovery.evidence.process_noise import noise_in_free_runs
from discovery.fitting import Fit, Noise, from_known_starts, predict_recording
from discovery.models.units import differences
from discovery.recordings import Campaign

Array = NDArray[np.float64]

MULTIPLES = "times the reading noise"  # the unit of a proof over outputs of several units
CLOSABLE = 1.03  # rms over the noise floor from which a recording holds a mismatch worth closing
DRAWS = 400
BLOCKS = 8  # of a recording, resampled: what a free run misses lasts for hours


@dataclass(frozen=True)
class Improvement:
    """rms of a recording before and after the repair, and the rms of noise alone in a free run.

    `unsure` is what the uncertainty of the parameters adds on a recording that no fit has seen. `low` and
    `high` bound the improvement of the rms (before - after) by block bootstrap, 95 %; `outputs` has the plain
    rms of each output before and after, in its unit. `after` is infinite where the repaired model runs away.
    `started`: the rms before and after, and the bounds of the improvement, from the starts that all readings
    of a recording show. What a body that no sensor reads begins with is no merit of a model;
    whatever is decided is decided by these.
    """

    before: float
    after: float
    floor: float
    low: float
    high: float
    outputs: Mapping[str, tuple[float, float]]
    unsure: float = 0.0
    started: tuple[float, float, float, float] | None = None  # None: as before, after, low and high

    @property
    def judged(self) -> tuple[float, float]:
        """The rms before and after that decide."""
        return self.started[:2] if self.started else (self.before, self.after)

    @property
    def expected(self) -> float:
        """rms that noise and the uncertainty of the parameters make likely."""
        return hypot(self.floor, self.unsure)

    @property
    def explained(self) -> float:
        """What the repair explains of what was left before, rms; below zero where it leaves more."""
        before, after = self.judged
        square = before**2 - after**2
        return copysign(sqrt(abs(square)), square) if isfinite(square) else -inf

    @property
    def contradicts(self) -> bool:
        """Whether the recording is predicted worse than without the repair, beyond chance, from either of the
        starts: a controller knows the first readings alone.
        """
        return min(self.high, self.started[3] if self.started else inf) < 0

    @property
    def only_from_its_first_reading(self) -> bool:
        """Whether it is so from the start that the first reading shows, not from those that all show."""
        return self.contradicts and self.started is not None and self.started[3] >= 0

    @property
    def mostly(self) -> bool:
        """Whether the repair explains more of what was left before than it leaves."""
        before, after = self.judged
        return 2 * after**2 < before**2


@dataclass(frozen=True)
class FreeRuns:
    """Residuals (R, Y) of two models on one recording, wrong readings left out, over the size of a unit (Y,).

    `started`: the same from the starts that all readings show, if they differ.
    """

    before: Array
    after: Array | None  # None: the model runs away
    floor: float
    unit: Array  # (Y,) what turns a residual into its own unit
    unsure: float = 0.0  # rms from the uncertainty of the parameters
    started: tuple[Array, Array | None] | None = None

    @property
    def judged(self) -> tuple[Array, Array | None]:
        """The residuals that decide."""
        return self.started or (self.before, self.after)


def free_runs(
    campaign: Campaign,
    recordings: Sequence[str],
    before: Fit,
    after: Fit,
    noise: Noise,
    known: Known | None = None,
    only: Sequence[int] | None = None,
) -> dict[str, FreeRuns]:
    """Free runs on each recording; a recording on which the baseline diverges is left out.

    Args:
        known: what is left open of the parameters, and of when inputs were logged.
        only: outputs that are compared; default all.
    """
    mine = list(range(len(noise.outputs)) if only is None else only)
    size, white, found = size_of(campaign, noise), np.array(noise.white), {}
    for run in recordings:
        old, new = _run(before, campaign, run), _run(after, campaign, run)
        if old is None:
            continue
        grids = {run: old.system.grid}
        wrong = find_outliers(before, grids, white)
        readings = without(grids, wrong)[run].readings
        first = readings - predict(old)
        then = None if new is None else readings - predict(new)
        spreads = _spreads(before, after)
        started = None if new is None or then is None else _started(after, new, then, white, spreads)
        last = with_noise(campaign, new or old) if noise.rough else new or old

        def shown(left: Array) -> Array:
            return (left / size)[:, mine]

        found[run] = FreeRuns(
            shown(first),
            None if then is None else shown(then),
            noise_in_free_runs(last, noise, size, mine),
            size[mine],
            known.rms(new, size, mine) if known and new else 0.0,
            (
                shown(_started(before, old, first, white, spreads)),
                None if started is None else shown(started),
            ),
        )
    return found


def _spreads(before: Fit, after: Fit) -> dict[str, float]:
    """How far states may begin from their starts, in either fit: a better model finds that they began closer
    in the recordings of the fit, and is not sure for that how another one began.
    """
    found: dict[str, float] = {}
    for fit in (before, after):
        for name, state in fit.model.states.items():
            if state.start_sd is not None:
                found[name] = max(state.start_sd, found.get(name, 0.0))
    return found


def _started(fit: Fit, run: Trajectory, left: Array, reading: Array, spreads: Mapping[str, float]) -> Array:
    """Residuals (R, Y) of a free run from the starts that all its readings show; `reading`: (Y,) their noise.
    A model that misses much is not less sure where a body began that was read.

    Args:
        spreads: of the starts, by state.
    """
    model = run.system.model
    states = {n: replace(s, start_sd=spreads.get(n, s.start_sd)) for n, s in model.states.items()}
    run = replace(run, system=replace(run.system, model=replace(model, states=states)))
    known = fit.offset_in(run.system.grid.recording)
    return from_known_starts(
        run, left, np.array(fit.noise.white), known, fit.together, reading, thresholds.MISSED
    )


def improvement(runs: Sequence[FreeRuns], outputs: Sequence[str]) -> Improvement:
    """Change of the rms by the repair over some recordings; each reading has the same weight."""
    before = np.concatenate([r.before for r in runs])
    lost = any(r.after is None for r in runs)
    after = before if lost else np.concatenate([r.after for r in runs if r.after is not None])
    judged = [r.judged for r in runs]
    floor, unsure = (
        _rms(np.array(sizes)) for sizes in zip(*((r.floor, r.unsure) for r in runs), strict=True)
    )
    unit = runs[0].unit
    each = {
        name: (_rms(before[:, y] * unit[y]), inf if lost else _rms(after[:, y] * unit[y]))
        for y, name in enumerate(outputs)
    }
    started = _rms(np.concatenate([b for b, _ in judged]))
    if lost:
        return Improvement(_rms(before), inf, floor, -inf, -inf, each, unsure, (started, inf, -inf, -inf))
    low, high = _bounds([(r.before, r.after) for r in runs if r.after is not None])
    sure = [(b, a) for b, a in judged if a is not None]
    ended = _rms(np.concatenate([a for _, a in sure]))
    decided = (started, ended, *_bounds(sure))
    return Improvement(_rms(before), _rms(after), floor, low, high, each, unsure, decided)


def _bounds(pairs: Sequence[tuple[Array, Array]]) -> tuple[float, float]:
    """Bounds of the fall of the rms, 95 %, by bootstrap of blocks of time."""
    sums = [block_sums(before, after) for before, after in pairs]
    old, new, count = (np.concatenate(column) for column in zip(*sums, strict=True))
    draw = np.random.default_rng(0).integers(0, len(old), (DRAWS, len(old)))
    total = np.maximum(count[draw].sum(axis=1), 1)
    gain = np.sqrt(old[draw].sum(axis=1) / total) - np.sqrt(new[draw].sum(axis=1) / total)
    return float(np.quantile(gain, 0.025)), float(np.quantile(gain, 0.975))


def unit_of(campaign: Campaign, outputs: Sequence[str]) -> str:
    """The unit of a proof: that of all outputs, or, where they have several, multiples of the noise."""
    units = {differences(campaign.channels[name].unit) for name in outputs}
    return units.pop() if len(units) == 1 else MULTIPLES


def size_of(campaign: Campaign, noise: Noise) -> Array:
    """What one unit of a proof is in the unit of each output (Y,): outputs of one unit weigh alike, those of
    several by their reading noise.
    """
    white = np.array(noise.white)
    return white if unit_of(campaign, noise.outputs) == MULTIPLES else np.ones_like(white)


def explained(found: Mapping[str, Improvement]) -> float | None:
    """Share of the closable mismatch that the repair removes; None where there is none."""
    gap = gain = 0.0
    for i in found.values():
        before, after = i.judged
        if before > CLOSABLE * i.floor:
            gap += before**2 - i.floor**2
            gain += before**2 - max(after, i.floor) ** 2
    return float(np.clip(gain / gap, -1.0, 1.0)) if gap > 0 else None


def _run(fit: Fit, campaign: Campaign, run: str) -> Trajectory | None:
    """Free run of a model; None if it, or an output, does not stay finite."""
    try:
        trajectory = predict_recording(
            fit.model,
            campaign,
            run,
            fit.problem.outputs,
            fit.noise.white,
            known=fit.offset_in(run),
            zeros=fit.zeros,
        )
        predict(trajectory)
    except RunsAwayError:
        return None
    return trajectory


def surely_better(gains: Array, logs: Array | None = None) -> bool:
    """Whether chance makes blocks of time better by such gains (B,) with a probability of 1 - SUREST at most:
    the signed-rank test (Wilcoxon, Biometrics Bulletin 1, 1945). An hour that goes badly wrong has the
    highest rank there, no more; in a mean it outweighs all others. Hours in which nothing happens have the
    lowest; in a count of better blocks they weigh as much as those in which an effect acts.

    A few blocks are never enough for ranks, however much better each of them is.

    Args:
        logs: (B,) of the ratios of the squares, for Student's test of their mean (Biometrika 6 (1908) 1).

    >>> surely_better(np.array([3.0, 2.0, 5.0, -0.1, 4.0, 6.0, -0.2, 7.0]))
    True
    >>> surely_better(np.array([3.0, 2.0, 5.0, -9.0, 4.0, 6.0, -8.0, 7.0]))
    False
    >>> surely_better(np.array([90.0, 50.0, 80.0]), np.array([4.0, 3.5, 4.5]))
    True
    """
    return min(_by_ranks(gains), 1.0 if logs is None else _by_mean(logs)) <= 1.0 - thresholds.SUREST


def _by_ranks(gains: Array) -> float:
    """Chance of the sum of the ranks of better blocks, where each is better or worse by chance."""
    gains = gains[gains != 0]
    _, place, count = np.unique(np.abs(gains), return_inverse=True, return_counts=True)
    twice = (2 * np.cumsum(count) - count + 1)[place]  # the rank; of equal ones, the mean of theirs
    chance = np.ones(1)
    for rank in twice:
        chance = 0.5 * (np.pad(chance, (0, rank)) + np.pad(chance, (rank, 0)))
    return float(chance[twice[gains > 0].sum() :].sum())


def _by_mean(logs: Array) -> float:
    """Chance of the mean of such logarithms, where it is zero in truth."""
    from scipy.special import stdtr  # most commands need no proof

    spread = float(np.std(logs, ddof=1)) if len(logs) > 1 else 0.0
    if spread <= 0.0:
        return 1.0
    return float(stdtr(len(logs) - 1, -float(np.mean(logs)) * sqrt(len(logs)) / spread))


def block_sums(before: Array, after: Array, blocks: int = BLOCKS) -> tuple[Array, Array, Array]:
    """Sums of squares in blocks of time before and after, and the number of readings in each."""
    starts = np.linspace(0, len(before), min(blocks, len(before)) + 1).astype(int)[:-1]
    old, new = (np.add.reduceat(np.nansum(z**2, axis=1), starts) for z in (before, after))
    return old, new, np.add.reduceat(np.isfinite(before).sum(axis=1), starts)


def _rms(z: Array) -> float:
    seen = z[np.isfinite(z)]
    return float(np.sqrt(np.mean(seen**2))) if len(seen) else float("nan")
