"""Covariance of the fitted parameters, and the parameters that these recordings do not determine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.fitting.problem import Problem
from discovery.models import Model, State

Array = NDArray[np.float64]

Z95 = 1.959963984540054  # standard deviations of a normal distribution: 95 % lie within
NO_EFFECT = "no effect on any reading, so these recordings cannot determine it"
NOT_SEPARATED = "not separated from other parameters by these recordings"
WIDE = "not determined (95 % interval wider than the value)"
_UNSEEN = 1e-4  # share of a column's length that the other unknowns leave; below it, it is not determined


def covariance_of(problem: Problem, gram: Array, theta: Array) -> tuple[Array, list[str]]:
    """Gauss-Newton covariance (U, U), and a sentence for each reason why readings leave parameters open,
    with their names.

    Args:
        gram: (U, U) normal equations of whitened residuals and priors.
        theta: (U,) where the fit ended.
    """
    low = problem.bounds[0]
    total = len(problem.unknowns)
    length = np.sqrt(np.diag(gram))
    lost: dict[str, list[str]] = {reason: [] for reason in (NO_EFFECT, NOT_SEPARATED, WIDE)}
    seen = length > 0
    scaled = gram[np.ix_(seen, seen)] / np.outer(length[seen], length[seen])
    size, direction = np.linalg.eigh(scaled)
    known = size > 1e-12 * size.max(initial=0.0)
    inverse = (direction[:, known] / size[known]) @ direction[:, known].T
    blind = np.sum(direction[:, ~known] ** 2, axis=1) > 1e-6  # part of a combination that nothing determines
    covariance = np.zeros((total, total))
    index = np.flatnonzero(seen)
    covariance[np.ix_(index, index)] = inverse / np.outer(length[seen], length[seen])
    for i, u in enumerate(problem.unknowns):
        if u.is_nuisance:
            continue
        name = f"{u.name} in '{u.recording}'" if u.recording else u.name
        if not seen[i]:
            lost[NO_EFFECT].append(name)
            covariance[i, i] = np.inf
            continue
        k = int(np.searchsorted(index, i))
        share = 0.0 if blind[k] else 1.0 / np.sqrt(max(inverse[k, k], 1.0))
        error = np.sqrt(covariance[i, i])
        if share < _UNSEEN:
            covariance[i, i] = np.inf if blind[k] else covariance[i, i]
            lost[NOT_SEPARATED].append(name)
        elif error * Z95 > max(abs(theta[i]), 1e-12) and not (
            np.isfinite(low[i]) and theta[i] <= low[i] + 1e-9
        ):
            lost[WIDE].append(name)
    return covariance, [f"{reason}: {', '.join(names)}" for reason, names in lost.items() if names]


def with_intervals(problem: Problem, theta: Array, errors: Array) -> Model:
    """The model with the values found, (U,), and 95 % intervals by their standard errors, (U,)."""
    model = problem.model
    parameters = dict(model.parameters)
    fitted = {system.grid.recording for system in problem.systems}
    for i, u in enumerate(problem.unknowns):
        if u.is_nuisance:
            continue
        p = parameters[u.name]
        value, half = float(theta[i]), Z95 * float(errors[i])
        interval = (max(value - half, p.min), min(value + half, p.max)) if np.isfinite(half) else None
        if u.recording is not None:
            values = {**p.values, u.recording: value}
            given = model.parameters[u.name].values
            # the common value of an event of one recording keeps it out of all others: it stays
            mean = not given or fitted <= given.keys()
            common = float(np.mean(list(values.values()))) if mean else p.value
            spread = spread_elsewhere(list(values.values())) if mean else 0.0
            kept = {name: ends for name, ends in p.intervals.items() if name != u.recording}
            intervals = kept | ({u.recording: interval} if interval else {})
            parameters[u.name] = replace(
                p, values=values, value=common, low=None, high=None, intervals=intervals, spread=spread
            )
            continue
        low, high = interval or (None, None)
        parameters[u.name] = replace(p, value=value, low=low, high=high)
    return replace(model, parameters=parameters, states=_with_spreads(problem))


def spread_elsewhere(values: list[float]) -> float:
    """Standard deviation of the value of one more recording about the mean of `values` (K,): that of a normal
    distribution whose 95 % interval is Student's, for few values say little of how far they spread.

        t(0.975; K - 1)/1.96 s sqrt(1 + 1/K)

    Of a single one, its own size is all that is known.
    """
    from scipy.special import stdtrit

    count = len(values)
    if count == 1:
        return abs(values[0])
    student = stdtrit(count - 1, 0.975) / Z95
    return float(student * np.std(values, ddof=1) * np.sqrt(1 + 1 / count))


def _with_spreads(problem: Problem) -> dict[str, State]:
    """The states with the spread of their starts in recordings that no fit has seen. A memory that no
    recording shows but at rest is settled.
    """
    found = problem.start_spreads()
    return {
        name: replace(one, start_sd=found.get(name, 0.0 if one.memory else one.start_sd))
        for name, one in problem.model.states.items()
    }
