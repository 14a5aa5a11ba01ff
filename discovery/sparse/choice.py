"""Choice of a set of terms: free runs on left-out data choose its size, the cost of each term its members."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from discovery.fitting.noise import readings_as_one
from discovery.sparse.folds import Ints, bootstraps, choose
from discovery.sparse.gram import Gram
from discovery.sparse.masses import next_start
from discovery.sparse.problem import WHOLE, Problem, equal_shares
from discovery.sparse.pursuit import POINTS
from discovery.sparse.search import Search, Terms, on_grid

Array = NDArray[np.float64]

SPREADS = (0.01, 0.03, 0.1, 0.3, 1.0)  # of start values, as shares of the spread of the readings
_BENT = 1.2  # times the mean square that is left without a prior: a prior that leaves more bends the fit
_WEAKER = (1.0, 0.1, 0.01, 1e-3, 1e-4)  # times the strongest prior of gains


@dataclass(frozen=True)
class Choice:
    """The chosen set, and the evidence for it."""

    terms: Terms
    path: tuple[Terms, ...] = ()  # sets that were compared, smallest first
    left_out: tuple[float, ...] = ()  # rms on what was left out, of each
    fit: tuple[float, ...] = ()  # rms of the fit to everything, of each
    row: int = 0  # the chosen one
    start_sd: float = 0.0  # spread of start values
    zero_sd: float = 0.0  # spread of the zeros of trajectories
    spreads: tuple[float, ...] = ()  # of the coefficients in their prior
    costs: tuple[float, ...] = ()  # of each term: share by which the left-out rms grows without it
    stability: tuple[float, ...] = ()  # of each term: share of block bootstraps whose set has its family
    binding: tuple[tuple[int, float], ...] = ()  # families whose bound binds, and the coefficient asked for
    problem: Problem | None = None  # as it was believed in the end


def chosen(problem: Problem) -> Choice:
    """The smallest set within `tolerance` standard errors of the best on left-out data.

    No set is larger than the one of the least extended BIC at the effective number of readings. Terms share
    a time constant where the criterion is better for it.
    """
    problem = _with_parts(_with_spread(problem))
    search = problem.search()
    path = search.path(problem.max_terms)
    effective = _effective(problem, search, path[-1])
    worth = partial(_criterion, problem, search.g, effective)
    folds = problem.folds()
    errors = _left_out(problem, folds, path, int(np.argmin([worth(one) for one in path])) + 1)
    row = choose(errors, problem.tolerance)
    terms = search.shared(path[row], worth)
    problem, terms = _believed(problem, terms)
    found = evidence(problem, terms)
    fit = [max(search.g.square - one.gain, 0.0) / search.g.count for one in path[: len(errors)]]
    return replace(
        found,
        path=tuple(path[: len(errors)]),
        left_out=tuple(np.sqrt(errors.mean(axis=1)).tolist()),
        fit=tuple(np.sqrt(fit).tolist()),
        row=row,
    )


def evidence(problem: Problem, terms: Terms) -> Choice:
    """A set as a choice: what each term costs, and how stable it is."""
    left, costs = _costs(problem, terms)
    search = problem.search()
    residual = np.concatenate(problem.residuals(on_grid(terms, problem.families)))
    return Choice(
        terms,
        (terms,),
        (left,),
        (float(np.sqrt(np.mean(residual**2))),),
        0,
        problem.start_sd,
        problem.zero_sd,
        tuple(problem.spreads(terms).tolist()),
        costs,
        stability(problem, terms),
        _binding(problem, search, terms),
        problem,
    )


def _binding(problem: Problem, search: Search, terms: Terms) -> tuple[tuple[int, float], ...]:
    """Families whose bound binds, and the coefficients that the readings ask for."""
    effective = partial(_effective, problem, search)
    price = np.log(effective(terms)) + 2 * np.log(problem.families.columns)
    return tuple(search.binding(terms, float(price), effective).items())


def _believed(problem: Problem, terms: Terms) -> tuple[Problem, Terms]:
    """The problem with the strongest prior of its gains that predicts left-out data, and the set under it.

    Every model lacks something. Its gains bend to that as well, so what it leaves of the readings that it was
    fitted to says too little of how far it is off, and of how long it stays off. At most, the prior is scaled
    by the error on unseen readings. Responses that really oppose each other would give way to so strong a
    prior: it is weaker where recordings that are left out whole ask for it. Parts of the same recordings do
    not say so: gains that cancel predict them as well. It is also weaker where it bends the fit itself: what
    is left over long times, as of a start, says little of a gain that short times determine.
    """
    if not problem.parts:
        return problem, terms
    left = [np.full(len(readings), np.nan) for readings in problem.readings]
    for fold, search in problem.folds():
        one = search.refined(terms.family, terms.place, terms.pole)
        for i, run in _unseen(problem, one, fold):
            here = np.isin(problem.blocks.of[i], fold)
            left[i][here] = (problem.readings[i] - run)[here]
    search = problem.search()
    moved = (search.g.square - search.of(problem.always).gain) / search.g.count
    off = float(np.nanmean(np.concatenate(left) ** 2))
    independent = search.g.count / readings_as_one([r[:, None] for r in left])
    most = off / moved / independent * len(terms)
    free = _left(problem, terms)
    tried = [problem.changed(parts=most * share) for share in _WEAKER]
    firm = [trial for trial in tried if _left(trial, terms) <= _BENT * free] or tried[-1:]
    tried = firm if len(problem.columns) >= WHOLE else firm[:1]
    errors = np.full((len(tried), problem.blocks.count), np.nan)
    for trial, row in zip(tried, errors, strict=True):
        for fold, search in trial.folds():
            _missed(trial, search.refined(terms.family, terms.place, terms.pole), fold, row)
    best = tried[choose(errors[:, np.isfinite(errors).all(axis=0)], problem.tolerance)]
    return best, best.search().refined(terms.family, terms.place, terms.pole)


def _left(problem: Problem, terms: Terms) -> float:
    """Mean square of what a set leaves of the readings, its numbers fitted under the prior of the problem."""
    found = problem.search().refined(terms.family, terms.place, terms.pole)
    return float(np.mean(np.concatenate(problem.residuals(on_grid(found, problem.families))) ** 2))


def _with_spread(problem: Problem) -> Problem:
    """The problem with the spread of start values that makes its readings most likely (empirical Bayes).

    -2 log p = n log(cost/n) + log det(1 + P^-1 D'D/k), with n the effective number of readings, k of which
    say the same once, D the decays of each trajectory over the noise and P the precisions of the starts.
    Counted as independent, readings of what the model lacks would buy starts that follow it. Where
    trajectories have zeros of their own, masses may begin closer to their declared starts than these.
    """
    counts = [d.shape[1] for d in problem.nuisance]
    if not all(counts):
        return problem
    size = float(np.nanstd(np.concatenate(problem.readings)))
    search = problem.search()
    alike = search.g.count / _effective(problem, search, search.path(problem.max_terms)[-1])

    def tried(masses: float, zero: float) -> tuple[float, Problem]:
        precision = equal_shares(masses * size, counts, zero * size if problem.zeroed else None)
        one = problem.changed(start_sd=masses * size, zero_sd=zero * size, precision=precision)
        search = one.search()
        left = max(search.g.square - search.path(one.max_terms)[-1].gain, 1e-12 * search.g.square)
        volume = 0.0
        for d, y, own in zip(one.nuisance, one.readings, precision, strict=True):
            scaled = d[np.isfinite(y)] / np.sqrt(own)
            volume += float(np.linalg.slogdet(np.eye(len(own)) + scaled.T @ scaled / alike)[1])
        return search.g.count / alike * np.log(left / search.g.count) + volume, one

    found = {(share, share): tried(share, share) for share in SPREADS}
    if problem.zeroed:
        zero = min(found, key=lambda pair: found[pair][0])[1]
        found |= {(share, zero): tried(share, zero) for share in SPREADS if share < zero}
    return min(found.values(), key=lambda one: one[0])[1]


def _with_parts(problem: Problem) -> Problem:
    """The problem with the prior that no response has a part in the readings much larger than its share.

    The parts of n responses add up to what the readings move: each is believed normal with 1/n of its
    variance. Inputs that follow each other, as a cooling power follows the load, could otherwise have gains
    that cancel; on what was left out of the same recordings these do as well as smaller ones.
    """
    if not (problem.families.count >= POINTS).any():
        return problem
    search = problem.search()
    largest = search.path(problem.max_terms)[-1]
    moved = search.g.square - search.of(problem.always).gain
    left = max(search.g.square - largest.gain, 1e-12 * search.g.square)
    share = left / max(moved, left) / _effective(problem, search, largest)
    return problem.changed(parts=share * len(largest))


def _effective(problem: Problem, search: Search, terms: Terms) -> float:
    """Number of independent readings, from the residual of a set."""
    left = problem.residuals(on_grid(terms, problem.families))
    return float(search.g.count / readings_as_one([r[:, None] for r in left]))


def _criterion(problem: Problem, g: Gram, effective: float, terms: Terms) -> float:
    """Extended Bayesian criterion (Chen & Chen, Biometrika 95, 2008) at the effective number of readings."""
    left = max(g.square - terms.gain, 1e-12 * g.square) / g.count
    price = np.log(effective) * problem.numbers(terms) + 2 * len(terms) * np.log(len(problem.families.count))
    return float(effective * np.log(left) + price)


def _left_out(
    problem: Problem, folds: Sequence[tuple[Ints, Search]], whole: Sequence[Terms], sizes: int
) -> Array:
    """Mean squared error (sizes, B) of the free run on each block.

    Each fold searches on its own. Where its readings themselves prefer the set of that size that was found on
    all of them, that set stands: that a search on less misses it says nothing against the size.

    Args:
        whole: sets found on everything.
    """
    paths = [_better(search, search.path(len(problem.always) + sizes - 1), whole) for _, search in folds]
    rows = min(len(path) for path in paths)
    errors = np.full((rows, problem.blocks.count), np.nan)
    for (fold, _), path in zip(folds, paths, strict=True):
        for row in range(min(rows, sizes)):
            _missed(problem, path[row], fold, errors[row])
    return errors[:, np.isfinite(errors).all(axis=0)]


def _better(search: Search, path: Sequence[Terms], whole: Sequence[Terms]) -> list[Terms]:
    """Of each size the set that takes more off: the own one, or one found elsewhere and refined here."""
    others = {len(one): one for one in whole}
    found = []
    for one in path:
        if other := others.get(len(one)):
            refined = search.refined(other.family, other.place, other.pole)
            one = refined if refined.gain > one.gain else one
        found.append(one)
    return found


def _missed(problem: Problem, terms: Terms, fold: Ints, errors: Array) -> None:
    """Fill in the mean squared error (B,) of the free run on the blocks of a fold."""
    blocks = problem.blocks
    for i, run in _unseen(problem, terms, fold):
        left = problem.readings[i] - run
        for b in fold[blocks.recording[fold] == i]:
            mine = left[(blocks.of[i] == b) & np.isfinite(left)]
            if len(mine):
                errors[b] = max(float(np.mean(mine**2)), 1e-12)


def _unseen(problem: Problem, terms: Terms, fold: Ints) -> Iterator[tuple[int, Array]]:
    """Each trajectory of which a fold leaves something out, and its free run."""
    gone = list(dict.fromkeys(problem.blocks.recording[fold].tolist()))
    begin = _begin(problem, terms, [i for i in range(len(problem.readings)) if i not in gone])
    for i in gone:
        yield i, free_run(problem, terms, i, begin)


def free_run(problem: Problem, terms: Terms, i: int, begin: tuple[Array, Array] | None = None) -> Array:
    """Prediction (R,) of a trajectory, zeroed on its first reading alone.

    The same Bayesian step as `fitting.predict_recording`: the masses in use, and the zero of the trajectory,
    share what the first reading says.

    Args:
        begin: mean (k,) and covariance (k, k) of their starts; default those of no other trajectory.
    """
    readings, decays = problem.readings[i], _decays(problem, terms, i)
    mean, covariance = begin or _begin(problem, terms, [])
    predicted = problem.columns[i] @ on_grid(terms, problem.families) + decays @ mean
    first = np.flatnonzero(np.isfinite(readings))
    if not len(mean) or not len(first):
        return np.asarray(predicted)
    decay = decays[first[0]]
    gain = covariance @ decay / (decay @ covariance @ decay + 1.0)
    return np.asarray(predicted + decays @ gain * (readings[first[0]] - predicted[first[0]]))


def _decays(problem: Problem, terms: Terms, i: int) -> Array:
    """What is left of the starts (R, k) of the masses in use in a trajectory, and of its zero."""
    nuisance, families = problem.nuisance[i], problem.families
    curved = problem.curved(terms)
    bank = np.zeros(len(families.count), int) if families.bank is None else families.bank
    used = np.unique(np.column_stack([bank[terms.family], terms.place])[curved], axis=0)
    masses = nuisance.shape[1] - problem.zeroed
    if not len(used) or not masses:
        return nuisance[:, masses:]
    count = masses // (int(bank.max()) + 1)
    low = np.minimum(used[:, 1].astype(int), count - 2)
    share, first = used[:, 1] - low, used[:, 0].astype(int) * count + low
    decays = (1 - share) * nuisance[:, first] + share * nuisance[:, first + 1]
    return np.column_stack([decays, nuisance[:, masses:]])


def _begin(problem: Problem, terms: Terms, others: Sequence[int]) -> tuple[Array, Array]:
    """Mean (k,) and covariance (k, k) of the starts of a further trajectory, from those of others.

    The prior of a start counts as one more, the less the more others there are.
    """
    count = _decays(problem, terms, 0).shape[1]
    variance = np.full(count, problem.start_sd**2)
    if problem.zeroed:
        variance[-1] = problem.zero_sd**2
    prior = np.zeros(count), np.diag(variance)
    if not others:
        return prior
    theta = on_grid(terms, problem.families)
    seen: list[tuple[Array, Array]] = []
    for i in others:
        known = np.isfinite(problem.readings[i])
        decays = _decays(problem, terms, i)[known]
        left = (problem.readings[i] - problem.columns[i] @ theta)[known]
        covariance = np.asarray(np.linalg.inv(decays.T @ decays + np.diag(1 / variance)), dtype=np.float64)
        seen.append((covariance @ (decays.T @ left), covariance))
    return next_start(seen, prior)


def _costs(problem: Problem, terms: Terms) -> tuple[float, tuple[float, ...]]:
    """rms on left-out data, and the share by which it grows without each term."""
    sets = [None, *range(len(problem.always), len(terms))]
    errors = np.full((len(sets), problem.blocks.count), np.nan)
    for fold, search in problem.folds():
        whole = search.refined(terms.family, terms.place, terms.pole)
        for row, k in zip(errors, sets, strict=True):
            _missed(problem, whole if k is None else search.without(whole, k), fold, row)
    rms = np.sqrt(np.nanmean(errors, axis=1))
    unknown = (float("nan"),) * len(problem.always)
    return float(rms[0]), unknown + tuple((rms[1:] / rms[0] - 1).tolist())


def stability(problem: Problem, terms: Terms) -> tuple[float, ...]:
    """Share of block bootstraps whose set of the same size has a term of the same family."""
    kept: Counter[int] = Counter()
    for weights in bootstraps(problem.blocks.count, problem.bootstraps, problem.seed):
        kept.update(set(problem.search(weights).path(len(terms))[-1].members))
    return tuple(kept[int(f)] / max(problem.bootstraps, 1) for f in terms.family)
