"""Growth of a baseline: candidates enter one by one, by their score on the residual."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Noise
from discovery.models import Model
from discovery.sparse.choice import Choice
from discovery.sparse.gram import Gram
from discovery.sparse.options import SparseOptions
from discovery.sparse.problem import Problem
from discovery.sparse.ratedata import RateData, rough_noise
from discovery.sparse.rates import around, extended_bic, linearised, refit, regress, without
from discovery.sparse.search import Terms

_PACE = 2  # terms whose mean gain says whether growth comes near its goal
_WORSE = 2.0  # times the cost of one set: another one of that size is not better
_ALIKE = 1e-4  # of the cost: two fits that differ by less ended at the same place


@dataclass(frozen=True)
class Growth:
    """How a model grows: coefficients that are in it from the start and may leave, and how many more may
    enter.

    A baseline that lacks something large is bent by its fit; so each fit also starts from the values
    `restart` that the baseline had before, and the better one counts, until both have ended alike twice.
    Growth ends where it would not reach the cost `goal` at the pace of its last terms.
    """

    entered: tuple[str, ...] = ()
    always: tuple[str, ...] = ()  # of these, those that stay
    most: int = 15
    restart: Mapping[str, float] = field(default_factory=dict)
    goal: float = np.inf


def grown(
    data: RateData, model: Model, labels: Mapping[str, str], growth: Growth, options: SparseOptions
) -> tuple[Model, dict[str, str]]:
    """The baseline with the candidates that its residual supports, one at a time; each time everything is
    fitted again, until one does not lower the cost.

    A candidate enters by its score: what its column, filtered through the present model, takes off the cost
    when all fitted parameters may follow. Growth ends where the extended criterion does not pay for the next
    term.
    """
    entered = list(growth.entered)
    noise = rough_noise(data)
    before, course = False, [np.inf]
    for left in range(growth.most, -1, -1):
        try:
            larger, fit, alike = _fitted_with(data, model, labels, entered, growth, noise)
        except RunsAwayError:
            if len(entered) == len(growth.entered):
                raise
            entered.pop()
            break
        if fit.cost >= course[-1]:  # what the linearised fit promised did not come
            entered.pop()
            break
        model = larger
        course.append(fit.cost)
        if fit.cost - left * (course[-1 - _PACE :][0] - fit.cost) / _PACE > growth.goal:
            break
        if alike and before:  # the bend is gone
            growth = replace(growth, restart={})
        before = alike and bool(entered)
        seen = linearised(around(fit, model, data.campaign))
        kept = [name for name in seen.names if name in entered or name not in labels]
        best = regress(seen, kept, options, partial(_next, library=len(labels)), 1).terms
        if len(best) == len(kept):
            break
        entered.append(seen.names[best.family[-1]])
    model, entered = _exchanged(data, model, labels, entered, growth, noise, options)
    whole = without(model, [name for name in labels if name not in entered])
    return whole, {name: labels[name] for name in entered}


def _exchanged(
    data: RateData,
    model: Model,
    labels: Mapping[str, str],
    entered: Sequence[str],
    growth: Growth,
    noise: Noise,
    options: SparseOptions,
) -> tuple[Model, list[str]]:
    """The terms that entered, or others that are better together.

    The first terms enter a baseline that is bent by what it lacks; a proxy that came in then may keep the
    right one out. From where all fit together, every set of that size is ranked anew.
    """
    entered = list(entered)
    model, fit, _ = _fitted_with(data, model, labels, entered, growth, noise)
    for _ in range(growth.most):
        seen = linearised(around(fit, model, data.campaign))
        kept = [name for name in seen.names if name not in labels or name in growth.always]
        choice = regress(
            seen, kept, options, partial(_best_set, library=len(labels)), len(entered) - len(growth.always)
        )
        other = [seen.names[f] for f in choice.terms.members if seen.names[f] in labels]
        if set(other) == set(entered):
            break
        try:
            tried, its, _ = _fitted_with(data, model, labels, other, growth, noise, _WORSE * fit.cost)
        except RunsAwayError:
            break
        dispersion = max(2 * min(fit.cost, its.cost) / seen.count, 1.0)
        price = np.log(max(seen.count, 2)) + 2 * np.log(len(labels))
        before, after = (
            2 * c / dispersion + len(k) * price for c, k in ((fit.cost, entered), (its.cost, other))
        )
        if after >= before:
            break
        entered, model, fit = other, tried, its
    return model, entered


def _fitted_with(
    data: RateData,
    model: Model,
    labels: Mapping[str, str],
    entered: Sequence[str],
    growth: Growth,
    noise: Noise,
    most: float = np.inf,
) -> tuple[Model, Fit, bool]:
    """The model with all candidates, those that entered fitted and the others zero; that fit, and whether the
    fits from all starts ended alike.

    Args:
        most: a cost that is of no use: a fit that would not fall below it ends early.

    Raises:
        RunsAwayError: the model stays finite from none of the starts.
    """
    small = without(model, [name for name in labels if name not in entered])
    starts = [{}, growth.restart] if growth.restart else [{}]
    fits: list[Fit] = []
    for start in starts:
        goal = min([most, *((1 + _ALIKE) * one.cost for one in fits)])
        with suppress(RunsAwayError):
            fits.append(
                refit(small, data.campaign, data.recordings, data.outputs, start, data.grids, noise, 40, goal)
            )
    if not fits:
        raise RunsAwayError(f"no fit of {', '.join(entered)} stays finite")
    fit = min(fits, key=lambda one: one.cost)
    alike = max(one.cost for one in fits) <= (1 + _ALIKE) * fit.cost
    out = {
        name: float(np.clip(0.0, model.parameters[name].min, model.parameters[name].max))
        for name in labels
        if name not in entered
    }
    whole = model.with_values(out | {name: fit.model.parameters[name].value for name in small.free})
    return whole, fit, alike


def _next(problem: Problem, library: int) -> Choice:
    """The terms that stay, and the one term that lowers the extended criterion, if any."""
    search = problem.search()
    path = search.path(len(problem.always) + 1)
    return Choice(path[_least(search.g, path, library)])


def _best_set(problem: Problem, library: int) -> Choice:
    """The set with the smallest extended criterion."""
    search = problem.search()
    path = search.path(problem.max_terms)
    return Choice(path[_least(search.g, path, library)])


def _least(g: Gram, path: Sequence[Terms], library: int) -> int:
    """The set of a path with the smallest extended criterion."""
    costs = [g.square - one.gain for one in path]
    dispersion = max(min(costs) / g.count, 1.0)
    return int(
        np.argmin(extended_bic(g, [len(one) for one in path], [c / dispersion for c in costs], library))
    )
