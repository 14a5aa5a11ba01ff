"""Discovery of one error as a sum of hidden thermal masses."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.fitting import fit_model
from discovery.recordings import Campaign
from discovery.sparse.discovery import Discovery, PathPoint
from discovery.sparse.folds import PREDICT, Blocks, Ints, bootstraps, choose, make_folds
from discovery.sparse.gram import Gram, solve
from discovery.sparse.masses import MassLibrary, Response, block_grams, free_run, mass_model, pooled
from discovery.sparse.optimisers import pysindy_path
from discovery.sparse.options import SparseOptions
from discovery.sparse.path import Support, forward
from discovery.terms import text

Array = NDArray[np.float64]

OFFSET = (0,)  # column that is always in: the zero of the error
START_SHARE = 0.05  # spread of a start value, as a share of the rms of the readings


@dataclass(frozen=True)
class MassData:
    """The library on the recordings to fit, shared by all errors."""

    library: MassLibrary
    grids: Mapping[str, Grid]
    responses: tuple[Response, ...]
    blocks: Blocks


@dataclass(frozen=True)
class _Problem:
    """One error, everything over its noise."""

    data: MassData
    readings: tuple[Array, ...]  # (R,) each
    grams: tuple[dict[int, Gram], ...]
    start_sd: float
    low: Array
    high: Array

    def gram(self, weights: Array) -> Gram:
        return pooled(self.grams, self.data.responses[0].columns.shape[1], self.start_sd, weights)


def discover_error(
    data: MassData,
    campaign: Campaign,
    recordings: Sequence[str],
    output: str,
    options: SparseOptions,
) -> Discovery:
    """Choose the masses and drives of one error and fit their numbers."""
    column = data.grids[recordings[0]].outputs.index(output)
    readings = [data.grids[r].readings[:, column] for r in recordings]
    size = float(np.sqrt(np.nanmean(np.concatenate(readings) ** 2)))
    noise = campaign.channels[output].noise or 0.02 * size
    start_sd = max(noise, START_SHARE * size)
    problem = _pose(data, readings, noise, start_sd / noise, options)

    everything = np.ones(data.blocks.count)
    errors = _left_out(problem, options)
    whole = problem.gram(everything)
    path = _path(whole, problem, options)
    rows = min(len(path), len(errors))
    row = choose(errors[:rows], PREDICT if options.tolerance is None else options.tolerance)
    chosen = path[row]
    theta = solve(whole, chosen, problem.low, problem.high)
    labels = data.library.labels
    points = tuple(
        PathPoint(
            (output,),
            len(path[k]),
            noise * float(np.sqrt(errors[k].mean())),
            noise
            * float(
                np.sqrt(max(whole.cost(solve(whole, path[k], problem.low, problem.high)), 0) / whole.count)
            ),
            k == row,
            tuple(labels[j] for j in path[k]),
        )
        for k in range(rows)
    )
    model = mass_model(data.library, output, campaign.channels[output].unit, chosen, theta * noise, start_sd)
    if options.refine:
        grids = {
            r: replace(data.grids[r], outputs=(output,), readings=data.grids[r].readings[:, [column]])
            for r in recordings
        }
        model = fit_model(model, campaign, recordings, [output], grids=grids).model
    terms, drives = _stability(problem, chosen, options)
    report = {
        "outputs": [output],
        "form": "masses",
        "terms": len(chosen),
        "masses": len({int(data.library.mass[k]) for k in chosen} - {-1}),
        "left_out_rms": round(points[row].left_out_rms, 4),
        "library": len(labels),
        "drive_stability": {name: round(share, 3) for name, share in drives.items()},
    }
    stability = {f"{output}: {labels[k]}": share for k, share in terms.items()}
    return Discovery(model, points, stability, report)


def _pose(
    data: MassData,
    readings: Sequence[Array],
    noise: float,
    start_sd: float,
    options: SparseOptions,
) -> _Problem:
    scaled = tuple(series / noise for series in readings)
    grams = tuple(
        block_grams(response, series, block)
        for response, series, block in zip(data.responses, scaled, data.blocks.of, strict=True)
    )
    count = data.responses[0].columns.shape[1]
    low, high = np.full(count, -np.inf), np.full(count, np.inf)
    for k, drive in enumerate(data.library.drive):
        if drive >= 0 and (bound := options.bounds.get(text(data.library.drives[drive]))):
            low[k], high[k] = bound[0] / noise, bound[1] / noise
    return _Problem(data, scaled, grams, start_sd, low, high)


def _path(g: Gram, problem: _Problem, options: SparseOptions, size: int | None = None) -> list[Support]:
    if options.optimiser != "elimination":
        return [s for s in pysindy_path(g, options.optimiser, OFFSET) if len(s) <= options.max_terms]
    groups = problem.data.library.mass
    return forward(
        g, size or options.max_terms, OFFSET, groups, options.max_masses, problem.low, problem.high
    )


def _left_out(problem: _Problem, options: SparseOptions) -> Array:
    """Mean squared error (sizes, B) of the free run on each block, by models that have not seen its fold."""
    data = problem.data
    found = []
    for fold in make_folds(data.blocks):
        weights = np.ones(data.blocks.count)
        weights[fold] = 0.0
        g = problem.gram(weights)
        thetas = [solve(g, support, problem.low, problem.high) for support in _path(g, problem, options)]
        found.append(np.array([_missed(problem, theta, fold) for theta in thetas]))
    rows = min(len(errors) for errors in found)
    return np.asarray(np.nansum([errors[:rows] for errors in found], axis=0))


def _missed(problem: _Problem, theta: Array, fold: Ints) -> Array:
    """Mean squared error (B,) of the free run on the blocks of a fold, NaN elsewhere."""
    blocks = problem.data.blocks
    row = np.full(blocks.count, np.nan)
    for i in dict.fromkeys(blocks.recording[fold].tolist()):
        response, readings = problem.data.responses[i], problem.readings[i]
        run = free_run(problem.data.library, response, theta, readings, problem.start_sd)
        for b in fold[blocks.recording[fold] == i]:
            row[b] = np.nanmean((readings - run)[blocks.of[i] == b] ** 2)
    return row


def _stability(
    problem: _Problem, chosen: Support, options: SparseOptions
) -> tuple[dict[int, float], dict[str, float]]:
    """Share of block bootstraps that keep each chosen column, and each drive through whatever mass."""
    library = problem.data.library
    kept: Counter[int] = Counter()
    drives: Counter[str] = Counter()
    for weights in bootstraps(problem.data.blocks.count, options.bootstraps, options.seed):
        path = _path(problem.gram(weights), problem, options, len(chosen))
        support = min(path, key=lambda s: abs(len(s) - len(chosen)), default=())
        kept.update(support)
        drives.update({text(library.drives[library.drive[k]]) for k in support if k})
    runs = max(options.bootstraps, 1)
    names = sorted(drives, key=lambda name: -drives[name])
    return {k: kept[k] / runs for k in chosen}, {name: drives[name] / runs for name in names}
