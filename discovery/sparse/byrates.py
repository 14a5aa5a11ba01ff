"""Discovery of terms in the rates of states: from eq. (9), from measured temperatures, or from a baseline
file.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Noise
from discovery.fitting.noise import white_noise
from discovery.models import Model
from discovery.sparse.borrowed import borrowed
from discovery.sparse.choice import Choice, stability
from discovery.sparse.discovery import Discovery, path_points
from discovery.sparse.folds import NAME, choose, make_folds
from discovery.sparse.freeruns import RAN_AWAY, block_errors, left_out
from discovery.sparse.options import SparseOptions
from discovery.sparse.problem import Problem
from discovery.sparse.ratedata import RateData, rough_noise, stated_noise
from discovery.sparse.rates import extended_bic, linearised, refit, regress, without
from discovery.sparse.search import Search, Terms

Array = NDArray[np.float64]

_ROUNDS = 4  # of a fit in a fold: it starts at the fit to everything
_FAR = 2.0  # times the rms of a richer set
_SIZES = 5  # that are refitted and run freely, down from the one that the criterion names


def discover_rates(
    data: RateData,
    model: Model,
    labels: Mapping[str, str],
    always: Sequence[str],
    options: SparseOptions,
    grown: bool = False,
    tolerance: float = NAME,
    plain: Sequence[str] = (),
    easy: Sequence[str] = (),
) -> Discovery:
    """Choose the coefficients of a model that stay, and fit them.

    Args:
        model: baseline and all candidates, coefficients at good start values.
        labels: coefficients that may leave, by name; what reports call their terms.
        always: parameters that cannot leave (shapes, baseline terms that are kept).
        grown: the candidates entered one by one, each fitted: together they compete in any case.
        tolerance: default of the standard errors by which a sparser set may be worse on what was left out.
        plain: coefficients of a model that competes at any rate: where little is recorded the way down from
            all candidates may miss it.
        easy: coefficients of terms of the first order: where the readings hardly decide, one of them
            replaces a term of a higher order.
    """
    full = refit(model, data.campaign, data.recordings, data.outputs, {}, data.grids, rough_noise(data))
    noise = white_noise(data.outputs, stated_noise(data), list(full.residuals().values()))
    seen = linearised(replace(full, noise=noise))
    kept = [name for name in seen.names if name in always or name not in labels]
    judge = Judge(
        data,
        model,
        labels,
        seen.names,
        noise,
        not grown,
        tolerance if options.tolerance is None else options.tolerance,
        plain,
        easy,
        grown,
    )
    select = judge if options.optimiser == "search" else judge.on(options)
    choice = regress(seen, kept, options, select, options.max_terms * len(data.outputs))
    fit = judge.refit(choice.terms, data.grids, None, 25)
    names = [labels.get(name, name) for name in seen.names]
    kept_labels = [names[j] for j in choice.terms.members if seen.names[j] in labels]
    path = path_points(data.outputs, choice, names, model.only_starting)
    report = {
        "outputs": list(data.outputs),
        "form": "rates",
        "terms": path[choice.row].terms,
        "left_out_rms": round(choice.left_out[choice.row], 4),
        "library": len(labels),
        "kept": kept_labels,
        "costs": {
            names[f]: round(cost, 4)
            for f, cost in zip(choice.terms.family, choice.costs, strict=True)
            if np.isfinite(cost)
        },
    }
    shares = zip(choice.terms.family, choice.stability, strict=True)
    named = {names[f]: share for f, share in shares if seen.names[f] in labels}
    return Discovery(fit.model, path, named, report)


@dataclass(frozen=True)
class Judge:
    """Makes the choice of a linearised fit: refits each size and runs it freely on left-out data."""

    data: RateData
    model: Model
    labels: Mapping[str, str]
    names: Sequence[str]  # of the columns
    noise: Noise
    whole: bool  # leave whole recordings out, where there are several
    tolerance: float
    plain: Sequence[str]
    easy: Sequence[str]
    grown: bool

    def __call__(self, problem: Problem) -> Choice:
        """The sparsest set within the tolerance of the best on left-out data."""
        search = problem.search()
        g, count = search.g, max(len(self.labels), 1)
        path = search.path(problem.max_terms)
        dispersion = max(min(g.square - one.gain for one in path) / max(g.count - len(path[-1]), 1), 1.0)
        costs = [(g.square - one.gain) / dispersion for one in path]
        last = int(np.argmin(extended_bic(g, [len(one) for one in path], costs, count)))
        window = path[max(0, last - _SIZES + 1) : last + 1]
        if self.plain:
            simple = [
                i for i, name in enumerate(self.names) if name in self.plain and i not in problem.always
            ]
            competitor = search.of(np.concatenate([problem.always, np.array(simple, int)]))
            window += [competitor] * (competitor.members not in [one.members for one in window])
        if self.grown:
            everything = search.of(np.union1d(problem.always, np.arange(len(self.names))))
            window += [everything] * (everything.members not in [one.members for one in window])
        worth = float(dispersion * (np.log(max(g.count, 2)) + 2 * np.log(count)))  # of one more term
        plain = [plainer(search, one, self.names, self.easy, worth) for one in window]
        sets = sorted({one.members: one for one in plain}.values(), key=len)
        errors = self.compared(sets)
        return self.evidence(problem, sets, errors, choose(errors, self.tolerance))

    def on(self, options: SparseOptions) -> Callable[[Problem], Choice]:
        """The choice of an optimiser of PySINDy, with the evidence for it."""
        theirs = borrowed(options.optimiser, options.optimiser_arguments)

        def select(problem: Problem) -> Choice:
            terms = theirs(problem).terms
            return self.evidence(problem, [terms], self.compared([terms]), 0)

        return select

    def evidence(self, problem: Problem, sets: Sequence[Terms], errors: Array, row: int) -> Choice:
        """The choice of one of some sets, by their mean squared errors (sizes, B) on left-out data."""
        g = problem.pooled()
        return Choice(
            sets[row],
            tuple(sets),
            tuple(np.sqrt(errors.mean(axis=1)).tolist()),
            tuple(np.sqrt([max(g.square - one.gain, 0.0) / g.count for one in sets]).tolist()),
            row,
            costs=self.costs(problem, sets[row]),
            stability=stability(problem, sets[row]),
        )

    def refit(
        self, terms: Terms, grids: Mapping[str, Grid], noise: Noise | None, rounds: int, goal: float = np.inf
    ) -> Fit:
        """The model with only the terms of a set, fitted by output error from its present coefficients.

        Args:
            goal: the cost that is good enough to matter, as in `fit_model`.
        """
        found = {self.names[f]: float(v) for f, v in zip(terms.family, terms.theta, strict=True)}
        small = without(self.model, [name for name in self.names if name not in found])
        recordings = [r for r in self.data.recordings if r in grids]
        fits = []
        for start in ({}, found):
            try:
                fits.append(
                    refit(
                        small,
                        self.data.campaign,
                        recordings,
                        self.data.outputs,
                        start,
                        grids,
                        noise,
                        rounds,
                        goal,
                    )
                )
            except RunsAwayError:
                continue
        if not fits:
            raise RunsAwayError(f"no fit of {', '.join(found)} stays finite")
        return min(fits, key=lambda one: one.cost)

    def compared(self, sets: Sequence[Terms]) -> Array:
        """Mean squared errors (sizes, B) of the free runs on each block, by fits that have not seen its fold.

        These fits begin at the fit to everything: the linearised one may be far where terms are not linear.
        A set that leaves far more of what it was fitted to than a richer one is judged by that alone: on
        what was left out it is no better, and the fits of models that lack much take longest.
        """
        errors = np.full((len(sets), self.data.blocks.count), RAN_AWAY)
        least = np.inf
        for row, terms in sorted(enumerate(sets), key=lambda one: -len(one[1])):
            try:
                fit = self.refit(terms, self.data.grids, self.noise, 25, _FAR**2 * least)
            except RunsAwayError:
                continue
            least = min(least, fit.cost)
            if fit.cost > _FAR**2 * least:
                errors[row] = block_errors(self.data, fit)
            else:
                errors[row] = left_out(self.data, fit.model, self.noise, _ROUNDS, self.whole)
        return errors

    def costs(self, problem: Problem, terms: Terms) -> tuple[float, ...]:
        """Share by which the left-out error of the linearised fit grows without each term."""
        free = list(range(len(problem.always), len(terms)))
        left = np.zeros(len(free) + 1)
        for fold in make_folds(problem.blocks, False):
            inside, outside = np.ones(problem.blocks.count), np.zeros(problem.blocks.count)
            inside[fold], outside[fold] = 0.0, 1.0
            search, g = problem.search(inside), problem.pooled(outside)
            whole = search.of(terms.family)
            for row, k in enumerate([None, *free]):
                one = whole if k is None else search.without(whole, k)
                theta = np.zeros(len(g.vector))
                theta[one.family] = one.theta
                left[row] += max(g.cost(theta), 0.0)
        rms = np.sqrt(left)
        return (float("nan"),) * len(problem.always) + tuple((rms[1:] / max(rms[0], 1e-300) - 1).tolist())


def plainer(
    search: Search,
    terms: Terms,
    names: Sequence[str],
    easy: Sequence[str],
    worth: float,
) -> Terms:
    """The set with terms of the first order in place of others, where the cost rises by less than a further
    term would have to bring.
    """
    first = [i for i, name in enumerate(names) if name in easy]
    bound = terms.gain - worth
    for term in [f for f in terms.family[len(search.always) :] if f not in first]:
        others = [i for i in first if i not in terms.family]
        swaps = [search.of(np.where(terms.family == term, i, terms.family)) for i in others]
        best = max(swaps, key=lambda one: one.gain, default=None)
        if best is not None and best.gain > bound:
            terms = best
    return terms
