"""The second law: no exchange of two bodies, or of a body and a medium, takes heat to the warmer one."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.effects.hypothesis import Hypothesis
from discovery.fitting import Fit
from discovery.terms import Term, evaluate, names

Array = NDArray[np.float64]


def goes_uphill(chosen: Sequence[Hypothesis], fit: Fit) -> bool:
    """Whether an effect makes an exchange negative at any time, of two bodies or of a body and what it
    stands in, all terms of the model between them together, by more than its size is unsure of (95 %).

        d(flow into a body)/d(temperature of the other) < 0
    """
    parameters = fit.model.parameters
    for h in chosen:
        if h.effect.amplitude.unit != "W/K" or len(h.states) > 2 or len(h.terms) > len(h.amplitudes):
            continue
        for term, size in zip(h.terms, h.amplitudes, strict=True):
            value, high = parameters[size].value, parameters[size].high
            if value >= 0 or high is None or high >= 0:
                continue
            others = {*h.states} - {term.into} or _media(fit.trajectories[0], term)
            for run, other in product(fit.trajectories, others):
                own, every = (_slope(run, some, term.into, other) for some in (h.terms, _terms(run)))
                if np.any(every + own * (high - value) / value < 0.0):
                    return True
    return False


def _media(run: Trajectory, term: Term) -> set[str]:
    """What an exchange couples a body to: it counts as much as the body, the other way round."""
    body = _slope(run, [term], term.into, term.into)
    used = [name for name in names(term.expression) if name in run.system.grid.samples]
    return {n for n in used if np.any(body) and np.allclose(_slope(run, [term], term.into, n), -body)}


def _terms(run: Trajectory) -> Sequence[Term]:
    return run.system.model.terms


def _slope(run: Trajectory, terms: Sequence[Term], into: str, other: str) -> Array:
    """How much more flows into a body per kelvin of another one, or of a medium, by some terms, (2K,)."""
    env, wrt = run.at_ends(), frozenset((other,))
    found = np.zeros(2 * len(run.system.grid.step))
    for term in terms:
        sign = 1.0 if term.into == into else -1.0 if term.source == into else 0.0
        if sign:
            partials = evaluate(term.expression, env, wrt, run.system.ends).partials
            found = found + sign * partials.get(other, 0.0)
    return found
