"""Which first model: the kinds that exist, each judged on parts of the recordings that its fit did not see.

A kind joins by a line in `CANDIDATES`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import predict
from discovery.errors import UserError
from discovery.evaluation.crossvalidation import Fold, folds, masked
from discovery.experiment import Experiment
from discovery.experiment.form import ModelEntry
from discovery.experiment.modelfits import fit_of
from discovery.fitting import Fit, predict_recording
from discovery.progress import Progress, silent
from discovery.recordings import Campaign, Recording
from discovery.sparse.ratedata import jumps, readings_that_show, time_scale
from discovery.threads import side_by_side

Array = NDArray[np.float64]

NO_MODEL = "no model"
BETTER = 0.95  # of the error without a model: less is no improvement worth the name
_SIMPLER = 1.1  # a simpler kind that is so near may win, where the parts cannot tell the two apart
_FEWEST, _MOST = 600, 6000  # instants of a recording: enough to choose by
_IN_TIME_SCALE = 10  # instants in the time in which readings forget half of what they were
_ROUNDS = 20  # of Levenberg-Marquardt
_LOST = 10.0  # times the error without a model: the score of a model that runs away

# simplest first: name -> entry of an experiment file; INPUTS becomes the channels that drive the outputs
CANDIDATES = {
    "regression": '{ kind = "regression" }',
    "reduced": '{ kind = "reduced", inputs = [INPUTS] }',
    "first_order": '{ file = "model.toml" }',
    "two_masses": '{ file = "two_masses.toml" }',
    "discovered": '{ kind = "sindy", bootstraps = 0 }',
}
# in every experiment for comparison, but never the first model
NOT_TRIED = {"pysindy": '{ kind = "pysindy" }'}


@dataclass(frozen=True)
class Score:
    """`ratio`: rms left over on what a fit did not see, over that without any model, pooled over the outputs;
    `folds`: the same in each part that was left out.
    """

    name: str
    ratio: float
    folds: tuple[float, ...]

    @property
    def helps(self) -> bool:
        """Whether the model is better than none, and not by one lucky part."""
        return self.ratio < BETTER and sum(one < 1.0 for one in self.folds) > 0.5 * len(self.folds)


def choose(experiment: Experiment, progress: Progress = silent) -> list[Score]:
    """The models of an experiment, which stand there simplest first, best first; one that runs away comes
    last.

    Each is found and fitted anew without each recording (or third of a single one) and predicts it freely.
    Only the recordings to fit are looked at.
    """
    thin = replace(experiment, campaign=thinned(experiment.fitting, _points(experiment)))
    parts = [one for one in folds(thin.campaign, thin.fit) if len(thin.fit) < 2 or one.windows is None]
    models = experiment.form.models

    def tried(one: tuple[str, int]) -> tuple[Array, Array]:
        name, k = one
        progress(f"trying {name}, part {k + 1} of {len(parts)} left out")
        return _left_out(thin, name, models[name], parts[k])

    pairs = [(name, k) for name in reversed(models) for k in range(len(parts))]  # the longest first
    squares = dict(zip(pairs, side_by_side(tried, pairs), strict=True))
    scores = []
    for name in models:
        mine = [squares[name, k] for k in range(len(parts))]
        pooled = sum(left for left, _ in mine) / sum(of for _, of in mine)
        each = tuple(float(np.sqrt(np.mean(left / of))) for left, of in mine)
        scores.append(Score(name, float(np.sqrt(np.mean(pooled))), each))
    order = sorted(scores, key=lambda one: one.ratio)
    for found in scores:  # simplest first
        if found.helps and as_good(found, order[0]):
            return [found, *(one for one in order if one is not found)]
    return order


def as_good(one: Score, best: Score) -> bool:
    """Whether a kind is near the best, and worse by no more than one standard error of their difference over
    the parts (Hastie, Tibshirani & Friedman, The Elements of Statistical Learning, 2009, sect. 7.10).
    """
    if one.ratio > _SIMPLER * best.ratio:
        return False
    worse = np.log(np.maximum(one.folds, 1e-12)) - np.log(np.maximum(best.folds, 1e-12))
    if len(worse) < 2:
        return one is best
    return bool(np.mean(worse) <= np.std(worse, ddof=1) / np.sqrt(len(worse)))


def _left_out(experiment: Experiment, name: str, entry: ModelEntry, fold: Fold) -> tuple[Array, Array]:
    """Return two sums of squares for each output over the parts that a fit did not see: of the model, and
    without a model.
    """
    whole, outputs = experiment.campaign, experiment.outputs_of(entry)
    kept = [r for r in experiment.fit if r not in fold.recordings]
    seen = {
        r: masked(whole.recordings[r], outputs, fold.windows[r]) if fold.windows else whole.recordings[r]
        for r in kept
    }
    inner = replace(
        experiment,
        campaign=replace(whole, recordings=seen),
        form=experiment.form.model_copy(update={"fit": kept}),
    )
    reference = np.array([_spread(whole, r, outputs, fold) for r in fold.recordings or kept])
    try:
        fit = fit_of(inner, name, entry, max_rounds=_ROUNDS)[2]
        left = np.array([_residual(fit, whole, r, outputs, fold) for r in fold.recordings or kept])
    except UserError:
        left = _LOST**2 * reference
    of = reference.sum(axis=0)
    found = np.minimum(np.nan_to_num(left, nan=np.inf).sum(axis=0), _LOST**2 * of)
    return found, np.maximum(of, 1e-12)


def _residual(fit: Fit, campaign: Campaign, recording: str, outputs: Sequence[str], fold: Fold) -> Array:
    known = fit.offset_in(recording)  # of a part that is left out, its recording was seen
    trajectory = predict_recording(
        fit.model, campaign, recording, outputs, fit.noise.white, known=known, zeros=fit.zeros
    )
    grid = trajectory.system.grid
    rows = grid.readings - predict(trajectory)
    squares: Array = np.nansum(
        np.where(_inside(grid.time[grid.read], fold, recording)[:, None], rows, np.nan) ** 2, axis=0
    )
    return squares


def _spread(campaign: Campaign, recording: str, outputs: Sequence[str], fold: Fold) -> Array:
    """Sum of squares of what is read without a model: errors themselves, others from the first one."""
    found = []
    one = campaign.recordings[recording]
    inside = _inside(one.time, fold, recording)
    for name in outputs:
        values = one.values[name]
        known = values[np.isfinite(values)]
        zero = known[0] if campaign.channels[name].role != "error" and known.size else 0.0
        found.append(float(np.nansum((values[inside] - zero) ** 2)))
    return np.array(found)


def _inside(time: Array, fold: Fold, recording: str) -> NDArray[np.bool_]:
    if fold.windows is None:
        return np.ones(len(time), dtype=np.bool_)
    low, high = fold.windows[recording]
    return np.asarray((time >= low) & (time < high))


def _points(experiment: Experiment) -> int:
    """Return the instants of a recording at which models are compared. There are more where the outputs
    move quickly, or ring.
    """
    campaign, fit = experiment.fitting, experiment.fit
    scale = min(time_scale(campaign, fit, [y]) for y in experiment.outputs)
    longest = max(float(campaign.recordings[r].time[-1]) for r in fit)
    wanted = max(_IN_TIME_SCALE * longest / scale, readings_that_show(campaign, fit, experiment.outputs))
    return int(np.clip(wanted, _FEWEST, _MOST))


def thinned(campaign: Campaign, points: int = _FEWEST) -> Campaign:
    """The campaign with less than twice so many instants a recording: inputs as means in between, single
    readings. Fewer would blur what moves quickly, and spare little.
    """
    recordings = {name: _thin(one, campaign, points) for name, one in campaign.recordings.items()}
    return replace(campaign, recordings=recordings)


def _thin(recording: Recording, campaign: Campaign, points: int) -> Recording:
    count = len(recording.time)
    if count < 2 * points:
        return recording
    edges = np.linspace(0, count, points + 1).astype(int)
    held = [n for n, c in campaign.channels.items() if c.is_input and c.between == "held"]
    switches = np.unique(
        np.concatenate([edges[:0], *(jumps(recording.values[n]) for n in held if n in recording.values)])
    )
    if len(switches) <= points:  # what is held until it jumps keeps the instant of the jump
        edges = np.union1d(edges, switches)
    values = {}
    for name, series in recording.values.items():
        pieces = list(_pieces(series, edges))
        if campaign.channels[name].is_input:
            values[name] = np.array([np.nanmean(p) if np.isfinite(p).any() else np.nan for p in pieces])
        else:
            values[name] = np.array(
                [p[np.isfinite(p)][0] if np.isfinite(p).any() else np.nan for p in pieces]
            )
    return replace(recording, time=recording.time[edges[:-1]], values=values)


def _pieces(series: Array, edges: NDArray[np.int_]) -> Iterator[Array]:
    for a, b in pairwise(edges):
        yield series[a:b]
