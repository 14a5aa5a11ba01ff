"""Refits of a model with a set of effects: everything is fitted again, under the noise it makes likely."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import MOVED, Scored, scored
from discovery.effects.form import Shape
from discovery.effects.hypothesis import Hypothesis
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Noise, Prior, fit_model
from discovery.models import Model

ENOUGH = 1e-5  # relative change of the cost that ends a refit: far below one unit of log evidence
LONGEST = 25  # rounds of a refit
ROUNDS = 3  # of refits under a noise that is more likely


def with_effects(model: Model, chosen: Sequence[Hypothesis]) -> Model:
    """The model with effects added, not fitted."""
    # what moves the zero of a sensor comes behind what smooths it: no lag makes a slope of a jump
    for h in sorted(chosen, key=lambda h: h.shifts_the_zero):
        model = h.added_to(model)
    return model


def refit(
    context: Context,
    chosen: Sequence[Hypothesis],
    noise: Noise,
    start: Fit | None = None,
    sizes: Mapping[str, float] | None = None,
    goal: float = inf,
) -> Fit:
    """The model with effects added, everything fitted to the recordings of the context.

    Sizes are free; shapes have the prior that the scan integrated over.

    Raises:
        RunsAwayError: the model does not stay finite with them.
    """
    return fit_model(
        with_effects(context.model, chosen),
        context.campaign,
        context.recordings,
        context.outputs,
        noise=noise,
        grids=context.grids,
        priors=shape_priors(chosen),
        belief=context.belief,
        guess=sizes,
        begin=start or context.baseline,
        max_rounds=LONGEST,
        tolerance=ENOUGH,
        goal=goal,
    )


def shape_priors(chosen: Sequence[Hypothesis]) -> dict[str, Prior]:
    """Priors of the shape parameters of effects, by name."""
    return {
        name: _prior(shape)
        for h in chosen
        for name, shape in zip(h.shapes, h.effect.shapes, strict=True)
        if not shape.instant
    }


def _prior(shape: Shape) -> Prior:
    assert shape.middle is not None
    if shape.factor:
        return Prior(float(np.log(shape.middle)), float(np.log(shape.factor)), is_log=True)
    return Prior(shape.middle, shape.spread)


def score(
    context: Context,
    chosen: Sequence[Hypothesis],
    noise: Noise,
    start: Fit | None = None,
    sizes: Mapping[str, float] | None = None,
    goal: float = inf,
    least: float = -inf,
) -> Scored | None:
    """Refit with a set of effects and score it; None if the model does not stay finite.

    The refit is repeated under the noise that it makes likely, until little moves. Much process noise
    explains any path of a model, so a score under the noise of a worse model is too low.

    Args:
        noise: of the first refit.
        goal: of the first refit, as in `fit_model`.
        least: as in `scored`.
    """
    one: Scored | None = None
    for _ in range(1 + ROUNDS):
        try:
            other = scored(context, chosen, refit(context, chosen, noise, start, sizes, goal), least)
        except RunsAwayError:
            break
        if one is not None and other.reached <= one.reached:
            break
        one = other
        if one.fit.ended_early or one.evidence == -inf or one.ahead < MOVED:
            break
        noise, start, sizes, goal = one.noise, one.fit, None, inf
    return one if one is None else _as_reached(one)


def rescored(context: Context, one: Scored, goal: Callable[[Noise], float] = lambda _: inf) -> Scored:
    """The score of a fitted model in another context, refitted where it can become better there: where a step
    promises it, and under little process noise, for much of it holds a fit where it is. What was read first
    is known as well as that context says.

    Args:
        goal: as in `fit_model`, under a noise.
    """
    there = scored(context, one.hypotheses, replace(one.fit, problem=one.fit.problem.spread(context.white)))
    if there.evidence == -inf:
        return there
    noises = [there.noise] if there.ahead >= MOVED else []
    noises += [context.usual] if there.noise.share > context.usual.share else []
    tried = [score(context, one.hypotheses, noise, one.fit, goal=goal(noise)) for noise in noises]
    return max([_as_reached(there), *(other for other in tried if other)], key=lambda other: other.evidence)


def _as_reached(one: Scored) -> Scored:
    """The score of a model for which refits found nothing better: what a step from there still promises does
    not count, for where process noise follows the flows a linear look reaches too far.
    """
    tried = one.evidence > -inf and not one.fit.ended_early
    return replace(one, unmet=one.ahead) if tried and one.ahead >= MOVED else one
