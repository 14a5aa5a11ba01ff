"""Which set of filtered inputs: sizes and terms judged by free runs on what was left out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.fitting.noise import readings_as_one
from discovery.sparse.folds import Blocks, Ints, bootstraps, choose, make_folds
from discovery.sparse.gram import Gram, gram, project_out, total
from discovery.sparse.pursuit import POINTS
from discovery.sparse.search import Families, Search, Terms, on_grid

Array = NDArray[np.float64]

SPREADS = (0.01, 0.03, 0.1, 0.3)  # of start values, as shares of the rms of the readings
WHOLE = 4  # trajectories from which whole ones are left out; of fewer a quarter of each

@dataclass(frozen=True)
class Problem:
    """One output on all trajectories, over its noise."""

    columns: tuple[Array, ...]  # (R, M) each
    decays: tuple[Array, ...]  # (R, m): what is left of a start value, by time constant of the grid
    readings: tuple[Array, ...]  # (R,) each, NaN: not read
    blocks: Blocks
    families: Families
    always: Ints  # families that are in every set
    start_sd: float
    max_terms: int
    tolerance: float = 1.0

    def search(self, g: Gram) -> Search:
        """Moves on normal equations."""
        return Search(g, self.families, self.always)

    def curved(self, terms: Terms) -> NDArray[np.bool_]:
        """Which terms have a time constant."""
        return np.asarray(self.families.count[terms.family] >= POINTS)

    def numbers(self, terms: Terms) -> int:
        """Numbers that a set holds: coefficients and time constants."""
        return len(terms) + len(set(terms.pole[self.curved(terms)].tolist()))


@dataclass(frozen=True)
class Choice:
    """The chosen set, and what speaks for it."""

    terms: Terms
    sizes: tuple[int, ...]
    left_out: Array  # (sizes, B) mean squared error on each block, by fits that have not seen its fold
    chosen: int  # row of `left_out`
    fit: Array  # (sizes,) mean squared error of the fit to everything
    start_sd: float  # spread of start values
    costs: tuple[float, ...]  # of each term: share by which the error on what was left out grows without it
    stability: tuple[float, ...]  # of each term: share of block bootstraps whose set has its family


def chosen(problem: Problem, runs: int = 0, seed: int = 0) -> Choice:
    """The smallest set within `tolerance` standard errors of the best on what was left out.

    No set is larger than the one of the least extended BIC at the effective number of readings. Terms of the set
    then share a time constant where the criterion is better for it.

    Args:
        runs: block bootstraps.
    """
    grams = [_block_grams(problem, i) for i in range(len(problem.columns))]
    problem = _started(problem, grams)
    whole = _pooled(problem, grams, np.ones(problem.blocks.count))
    while True:
        search = problem.search(whole)
        path = search.path(problem.max_terms)
        effective = whole.count / _as_one(problem, path[-1])
        scores = [_criterion(problem, whole, effective, one) for one in path]
        most = int(np.argmin(scores)) + 1
        folds = _fold_searches(problem, grams)
        errors = _left_out(problem, folds, most)
        most = min(most, len(errors))
        row = choose(errors, problem.tolerance)
        terms = search.shared(path[row], lambda one: _criterion(problem, whole, effective, one))
        ended = search.ended(terms)
        if not ended:
            break
        problem = replace(problem, families=problem.families.without(ended))
    fit = np.array([max(whole.square - one.gain, 0.0) / whole.count for one in path[:most]])
    return Choice(
        terms,
        tuple(len(one) for one in path[:most]),
        errors,
        row,
        fit,
        problem.start_sd,
        _costs(problem, folds, terms),
        _stability(problem, grams, terms, runs, seed),
    )


def _started(problem: Problem, grams: Sequence[dict[int, Gram]]) -> Problem:
    """The problem with the spread of start values that makes its readings most likely (empirical Bayes).

    -2 log p = n log(cost/n) + log det(1 + spread^2 D'D/m), with D the decays of each trajectory over the noise.
    """
    everything, first = np.ones(problem.blocks.count), problem.families.columns
    values = [np.linalg.eigvalsh(total(list(g.values())).matrix[first:, first:]) for g in grams]
    best, least = problem, np.inf
    for share in SPREADS:
        tried = replace(problem, start_sd=share * problem.start_sd)
        whole = _pooled(tried, grams, everything)
        left = max(whole.square - tried.search(whole).path(tried.max_terms)[-1].gain, 1e-12 * whole.square)
        volume = sum(np.log1p(np.maximum(v, 0.0) * tried.start_sd**2 / len(v)).sum() for v in values)
        score = whole.count * np.log(left / whole.count) + volume
        if score < least:
            best, least = tried, score
    return best


def _criterion(problem: Problem, g: Gram, effective: float, terms: Terms) -> float:
    """Extended Bayesian criterion (Chen & Chen, Biometrika 95, 2008) at the effective number of readings."""
    left = max(g.square - terms.gain, 1e-12 * g.square) / g.count
    drives = len(problem.families.count)
    price = np.log(effective) * problem.numbers(terms) + 2 * len(terms) * np.log(drives)
    return float(effective * np.log(left) + price)


def _as_one(problem: Problem, terms: Terms) -> float:
    """Readings in a row that say the same thing once, by what a set and the start values leave."""
    theta = on_grid(terms, problem.families)
    left = []
    for x, decays, y in zip(problem.columns, problem.decays, problem.readings, strict=True):
        known = np.isfinite(y)
        rest, d = (y - x @ theta)[known], decays[known]
        prior = np.eye(d.shape[1]) * d.shape[1] / problem.start_sd**2
        left.append(rest - d @ np.linalg.solve(d.T @ d + prior, d.T @ rest))
    return readings_as_one([r[:, None] for r in left])


def _block_grams(problem: Problem, i: int) -> dict[int, Gram]:
    """Normal equations by block of a trajectory, columns [library, start values]."""
    columns = np.column_stack([problem.columns[i], problem.decays[i]])
    y, block = problem.readings[i], problem.blocks.of[i]
    known = np.isfinite(y)
    return {int(b): gram(columns[known & (block == b)], y[known & (block == b)]) for b in np.unique(block)}


def _pooled(problem: Problem, grams: Sequence[dict[int, Gram]], weights: Array) -> Gram:
    """Normal equations of the library with the start values taken out of each trajectory.

    What is left of an unknown start is a sum of decays of all time constants, each with its share of the variance:
    it does not ask which masses are in the set.
    """
    parts, first = [], problem.families.columns
    for trajectory in grams:
        used = [b for b in trajectory if weights[b] > 0]
        if used:
            whole = total([trajectory[b] for b in used], [weights[b] for b in used])
            starts = np.arange(first, len(whole.vector))
            parts.append(project_out(whole, starts, np.full(len(starts), len(starts) / problem.start_sd**2)))
    return total(parts)


def _fold_searches(problem: Problem, grams: Sequence[dict[int, Gram]]) -> list[tuple[Ints, Search]]:
    """What is left out in each fold, and the search on the rest."""
    found = []
    for fold in make_folds(problem.blocks, len(problem.columns) >= WHOLE):
        weights = np.ones(problem.blocks.count)
        weights[fold] = 0.0
        found.append((fold, problem.search(_pooled(problem, grams, weights))))
    return found


def _left_out(problem: Problem, folds: Sequence[tuple[Ints, Search]], most: int) -> Array:
    """Mean squared error (sizes, B) of the free run on each block; the path of each fold is its own."""
    kept = len(problem.always)
    paths = [search.path(kept + most - 1) for _, search in folds]
    rows = min(len(path) for path in paths)
    errors = np.full((rows, problem.blocks.count), np.nan)
    for (fold, _), path in zip(folds, paths, strict=True):
        for row in range(rows):
            _missed(problem, path[row], fold, errors[row])
    return errors[:, np.isfinite(errors).all(axis=0)]


def _missed(problem: Problem, terms: Terms, fold: Ints, errors: Array) -> None:
    """Fill in the mean squared error (B,) of the free run on the blocks of a fold."""
    blocks = problem.blocks
    for i in dict.fromkeys(blocks.recording[fold].tolist()):
        left = problem.readings[i] - free_run(problem, terms, i)
        for b in fold[blocks.recording[fold] == i]:
            mine = left[(blocks.of[i] == b) & np.isfinite(left)]
            if len(mine):
                errors[b] = max(float(np.mean(mine**2)), 1e-12)


def free_run(problem: Problem, terms: Terms, i: int) -> Array:
    """Prediction (R,) of a trajectory, zeroed on its first reading alone.

    The same Bayesian step as `fitting.predict_recording`: the masses in use share what the first reading says.
    """
    readings = problem.readings[i]
    predicted = problem.columns[i] @ on_grid(terms, problem.families)
    curved = problem.curved(terms)
    first = np.flatnonzero(np.isfinite(readings))
    if not curved.any() or not len(first):
        return np.asarray(predicted)
    places = np.unique(terms.place[curved])
    grid = np.arange(problem.decays[i].shape[1])
    decays = np.column_stack([_between(problem.decays[i], grid, p) for p in places])
    decay = decays[first[0]]
    gain = decay / (decay @ decay + problem.start_sd**-2.0)
    return np.asarray(predicted + decays @ gain * (readings[first[0]] - predicted[first[0]]))


def _between(decays: Array, grid: Array, place: float) -> Array:
    """A decay (R,) between two of the grid (R, m)."""
    low = min(int(place), len(grid) - 2)
    share = place - low
    return np.asarray((1 - share) * decays[:, low] + share * decays[:, low + 1])


def _costs(problem: Problem, folds: Sequence[tuple[Ints, Search]], terms: Terms) -> tuple[float, ...]:
    """For each term: share by which the rms on what was left out grows when the set does without it."""
    sets = [None, *range(len(problem.always), len(terms))]
    errors = np.full((len(sets), problem.blocks.count), np.nan)
    for fold, search in folds:
        whole = search.refined(terms.family, terms.place, terms.pole)
        for row, k in zip(errors, sets, strict=True):
            _missed(problem, whole if k is None else search.without(whole, k), fold, row)
    rms = np.sqrt(np.nanmean(errors, axis=1))
    return (np.nan,) * len(problem.always) + tuple((rms[1:] / rms[0] - 1).tolist())


def _stability(
    problem: Problem, grams: Sequence[dict[int, Gram]], terms: Terms, runs: int, seed: int
) -> tuple[float, ...]:
    """Share of block bootstraps whose set of the same size has a term of the same family."""
    kept: Counter[int] = Counter()
    for weights in bootstraps(problem.blocks.count, runs, seed):
        path = problem.search(_pooled(problem, grams, weights)).path(len(terms))
        kept.update(set(path[-1].members))
    return tuple(kept[int(f)] / max(runs, 1) for f in terms.family)

