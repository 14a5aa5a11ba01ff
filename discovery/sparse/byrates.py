"""Discovery of terms in the rates of states: from eq. (9), from measured temperatures, or from a baseline
file.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.dynamics.system import predict
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Noise, predict_recording
from discovery.fitting.noise import white_noise
from discovery.models import Model
from discovery.sparse.discovery import Discovery, PathPoint
from discovery.sparse.folds import CLAIM, NAME, bootstraps, choose, make_folds
from discovery.sparse.gram import Gram, solve
from discovery.sparse.growth import Growth, grown
from discovery.sparse.optimisers import pysindy_path
from discovery.sparse.options import SparseOptions
from discovery.sparse.path import Support, best_of_each_size
from discovery.sparse.ratedata import RateData, has_reading, rough_noise, stated_noise
from discovery.sparse.rates import Evidence, evidence, extended_bic, masked, refit, without

Array = NDArray[np.float64]

_ROUNDS = 3  # of a fit in a fold: it starts where the normal equations of the fold have their minimum
_SIZES = 5  # that are refitted and run freely, down from the one that the criterion names


def discover_rates(
    data: RateData,
    model: Model,
    labels: Mapping[str, str],
    always: Sequence[str],
    options: SparseOptions,
    growth: Growth | None = None,
    plain: Sequence[str] = (),
    easy: Sequence[str] = (),
) -> Discovery:
    """Choose which coefficients of a model stay, and fit the rest.

    Args:
        model: baseline and all candidates, coefficients at good start values.
        labels: coefficients that may leave, by name; what reports call their terms.
        always: parameters that cannot leave (shapes, baseline terms that are kept).
        growth: terms first enter one by one by their score, then those that entered may leave; else all are
            fitted at once and leave one by one.
        plain: coefficients of a model that competes at any rate: where little is recorded the way down from
            all candidates may miss it.
        easy: coefficients of terms of the first order: where the readings hardly tell, one of them stands for
            a term of a higher order.
    """
    if growth is not None:
        model, labels = grown(data, model, labels, growth)
    full = refit(model, data.campaign, data.recordings, data.outputs, {}, data.grids, rough_noise(data))
    noise = white_noise(data.outputs, stated_noise(data), list(full.residuals().values()))
    full = replace(full, noise=noise)
    seen = evidence(full, data.blocks)
    kept = [i for i, name in enumerate(seen.names) if name in always or name not in labels]
    g = seen.pooled()
    most = len(kept) + options.max_terms * len(data.outputs)
    path = _path(g, seen, kept, options, most)
    costs = [g.cost(solve(g, s, seen.low, seen.high)) for s in path]
    dispersion = max(min(costs) / max(g.count - len(path[-1]), 1), 1.0)
    criterion = extended_bic(g, [len(s) for s in path], [c / dispersion for c in costs], max(len(labels), 1))
    last = int(np.argmin(criterion))
    simple = tuple(sorted({*kept, *(i for i, name in enumerate(seen.names) if name in plain)}))
    window = {*path[max(0, last - _SIZES + 1) : last + 1], *([simple] if plain else [])}
    supports = sorted(window, key=len)

    errors = np.array([_left_out(data, model, seen, one, noise, growth is None) for one in supports])
    usual = NAME if growth is None else CLAIM
    row = choose(errors, usual if options.tolerance is None else options.tolerance)
    worth = dispersion * (np.log(max(g.count, 2)) + 2 * np.log(max(len(labels), 1)))  # of one more term
    supports[row] = chosen = _plainer(g, seen, supports[row], kept, easy, labels, float(worth))
    fit = _refit(data, model, seen, g, chosen, data.grids, None, 25)
    points = tuple(
        PathPoint(
            data.outputs,
            len(one),
            float(np.sqrt(errors[i].mean())),
            float(np.sqrt(max(g.cost(solve(g, one, seen.low, seen.high)), 0.0) / g.count)),
            i == row,
            tuple(labels.get(seen.names[j], seen.names[j]) for j in one),
        )
        for i, one in enumerate(supports)
    )
    stability = _stability(seen, kept, chosen, options)
    report = {
        "outputs": list(data.outputs),
        "form": "rates",
        "terms": len(chosen),
        "left_out_rms": round(points[row].left_out_rms, 4),
        "library": len(labels),
        "kept": [labels[seen.names[j]] for j in chosen if seen.names[j] in labels],
    }
    named = {labels[seen.names[j]]: share for j, share in stability.items() if seen.names[j] in labels}
    return Discovery(fit.model, points, named, report)


def _path(g: Gram, seen: Evidence, kept: Sequence[int], options: SparseOptions, most: int) -> list[Support]:
    if options.optimiser != "elimination":
        return [s for s in pysindy_path(g, options.optimiser, kept) if len(s) <= most]
    return best_of_each_size(g, most, kept, seen.low, seen.high)


def _plainer(
    g: Gram,
    seen: Evidence,
    support: Support,
    kept: Sequence[int],
    easy: Sequence[str],
    labels: Mapping[str, str],
    worth: float,
) -> Support:
    """The support with terms of the first order in place of others into the same state, where the cost rises
    by less than a further term would have to bring.
    """
    first = [i for i, name in enumerate(seen.names) if name in easy]
    bound = g.cost(solve(g, support, seen.low, seen.high)) + worth
    for term in [i for i in support if i not in kept and i not in first]:
        into = labels[seen.names[term]].split(": ")[0]
        swaps = [
            tuple(sorted({*support, i} - {term}))
            for i in first
            if i not in support and labels[seen.names[i]].split(": ")[0] == into
        ]
        costs = [g.cost(solve(g, one, seen.low, seen.high)) for one in swaps]
        if costs and min(costs) < bound:
            support = swaps[int(np.argmin(costs))]
    return support


def _refit(
    data: RateData,
    model: Model,
    seen: Evidence,
    g: Gram,
    support: Support,
    grids: Mapping[str, Grid],
    noise: Noise | None,
    rounds: int,
) -> Fit:
    theta = solve(g, support, seen.low, seen.high)
    gone = [name for i, name in enumerate(seen.names) if i not in support]
    start = {name: float(theta[i]) for i, name in enumerate(seen.names) if i in support}
    recordings = [r for r in data.recordings if r in grids]
    return refit(without(model, gone), data.campaign, recordings, data.outputs, start, grids, noise, rounds)


def _left_out(
    data: RateData, model: Model, seen: Evidence, support: Support, noise: Noise, whole: bool
) -> Array:
    """Mean squared error (B,) of the free run on each block, by fits that have not seen its fold."""
    blocks = data.blocks
    errors = np.full(blocks.count, np.nan)
    for fold in make_folds(blocks, whole):
        keep = {r: ~np.isin(block, fold) for r, block in zip(data.recordings, blocks.of, strict=True)}
        train = {r: masked(data.grids[r], keep[r]) for r in data.recordings if keep[r].any()}
        try:
            weights = np.ones(blocks.count)
            weights[fold] = 0.0
            fit = _refit(data, model, seen, seen.pooled(weights), support, train, noise, _ROUNDS)
            trajectories = {t.system.grid.recording: t for t in fit.trajectories}
            for i, r in enumerate(data.recordings):
                mine = [b for b in fold if blocks.recording[b] == i]
                if not mine:
                    continue
                trajectory = trajectories.get(r) or predict_recording(
                    fit.model, data.campaign, r, data.outputs, fit.noise.white, data.grids[r]
                )
                left = data.grids[r].readings - predict(trajectory)
                for b in mine:
                    here = left[blocks.of[i] == b] ** 2
                    errors[b] = np.nanmean(here) if np.isfinite(here).any() else np.nan
        except RunsAwayError:  # a sparse model that runs away is a bad model
            errors[fold] = np.inf
    # a block without a reading says nothing: it must not tell the sizes apart
    silent = np.array([not has_reading(data, b) for b in range(blocks.count)])
    return np.where(np.isfinite(errors), errors, np.where(silent, 1.0, 1e12))


def _stability(
    seen: Evidence, kept: Sequence[int], chosen: Support, options: SparseOptions
) -> dict[int, float]:
    """Share of block bootstraps that keep each chosen column."""
    found: Counter[int] = Counter()
    for weights in bootstraps(len(seen.blocks), options.bootstraps, options.seed):
        path = _path(seen.pooled(weights), seen, kept, options, len(chosen))
        nearest: Support = min(path, key=lambda s: abs(len(s) - len(chosen)), default=())
        found.update(nearest)
    return {j: found[j] / max(options.bootstraps, 1) for j in chosen}
