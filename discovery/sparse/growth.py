"""Growth of a baseline: candidates enter one by one, where the residual asks for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from discovery.fitting import Noise
from discovery.models import Model
from discovery.sparse.gram import solve
from discovery.sparse.path import best_of_each_size, forward
from discovery.sparse.ratedata import RateData, rough_noise
from discovery.sparse.rates import Evidence, evidence, extended_bic, refit, without


@dataclass(frozen=True)
class Growth:
    """How a model grows: coefficients that are in it from the start and may leave, and how many more may
    enter.

    A baseline that lacks something large is bent by its fit; so each fit also starts from the values
    `restart` that the baseline had before, and the better one counts.
    """

    entered: tuple[str, ...] = ()
    most: int = 15
    restart: Mapping[str, float] = field(default_factory=dict)


def grown(
    data: RateData, model: Model, labels: Mapping[str, str], growth: Growth
) -> tuple[Model, dict[str, str]]:
    """The baseline with the candidates that its residual asks for, one at a time, each time fitted anew.

    A candidate enters by its score: what its column, filtered through the present model, takes off the cost
    when all fitted parameters may follow. Growth ends where the extended criterion does not pay for the next
    term.
    """
    entered = list(growth.entered)
    noise = rough_noise(data)
    for _ in range(growth.most + 1):
        model, _ = _fitted_with(data, model, labels, entered, growth, noise)
        seen = _seen_from(data, model, noise)
        kept = [i for i, name in enumerate(seen.names) if name in entered or name not in labels]
        g = seen.pooled()
        better = forward(g, len(kept) + 1, kept, low=seen.low, high=seen.high)
        if not better:
            break
        costs = [g.cost(solve(g, s)) for s in (kept, better[0])]
        dispersion = max(costs[1] / g.count, 1.0)
        before, after = extended_bic(g, [0, 1], [c / dispersion for c in costs], len(labels))
        if after >= before:
            break
        entered.append(next(seen.names[i] for i in better[0] if i not in kept))
    model, entered = _exchanged(data, model, labels, entered, growth, noise)
    whole = without(model, [name for name in labels if name not in entered])
    return whole, {name: labels[name] for name in entered}


def _exchanged(
    data: RateData,
    model: Model,
    labels: Mapping[str, str],
    entered: Sequence[str],
    growth: Growth,
    noise: Noise,
) -> tuple[Model, list[str]]:
    """The terms that entered, or others in their place that do better together.

    The first terms enter a baseline that is bent by what it lacks; a proxy that came in then may keep the
    right one out. From where all fit together, every set of that size is ranked anew.
    """
    entered = list(entered)
    model, cost = _fitted_with(data, model, labels, entered, growth, noise)
    for _ in range(growth.most):
        seen = _seen_from(data, model, noise)
        kept = [i for i, name in enumerate(seen.names) if name not in labels]
        g = seen.pooled()
        path = best_of_each_size(g, len(kept) + len(entered), kept, seen.low, seen.high)
        costs = [g.cost(solve(g, s, seen.low, seen.high)) for s in path]
        dispersion = max(min(costs) / g.count, 1.0)
        ranked = extended_bic(g, [len(s) for s in path], [c / dispersion for c in costs], len(labels))
        other = [seen.names[i] for i in path[int(np.argmin(ranked))] if i not in kept]
        if set(other) == set(entered):
            break
        tried, its = _fitted_with(data, model, labels, other, growth, noise)
        sizes, both = [len(entered), len(other)], [2 * cost / dispersion, 2 * its / dispersion]
        before, after = extended_bic(g, sizes, both, len(labels))
        if after >= before:
            break
        entered, model, cost = other, tried, its
    return model, entered


def _fitted_with(
    data: RateData,
    model: Model,
    labels: Mapping[str, str],
    entered: Sequence[str],
    growth: Growth,
    noise: Noise,
) -> tuple[Model, float]:
    """The model with all candidates, fitted with those that entered (the others zero), and its cost."""
    small = without(model, [name for name in labels if name not in entered])
    starts = [{}, growth.restart] if growth.restart else [{}]
    fits = [
        refit(small, data.campaign, data.recordings, data.outputs, start, data.grids, noise, 40)
        for start in starts
    ]
    fit = min(fits, key=lambda one: one.cost)
    out = {
        name: float(np.clip(0.0, model.parameters[name].min, model.parameters[name].max))
        for name in labels
        if name not in entered
    }
    return model.with_values(out | {name: fit.model.parameters[name].value for name in small.free}), fit.cost


def _seen_from(data: RateData, model: Model, noise: Noise) -> Evidence:
    """The normal equations around a model as it stands."""
    here = refit(model, data.campaign, data.recordings, data.outputs, {}, data.grids, noise, 1)
    return evidence(here, data.blocks)
