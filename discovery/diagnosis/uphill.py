"""The second law: no exchange takes heat from the colder of two bodies to the warmer one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.effects.hypothesis import Hypothesis
from discovery.fitting import Fit
from discovery.terms import Term, evaluate

Array = NDArray[np.float64]


def goes_uphill(chosen: Sequence[Hypothesis], fit: Fit) -> bool:
    """Whether an effect makes an exchange of two bodies negative at any time, all terms of the model between
    them together, by more than its size is unsure of (95 %).

        d(flow into a body)/d(temperature of the other) < 0
    """
    parameters = fit.model.parameters
    for h in chosen:
        if h.effect.amplitude.unit != "W/K" or len(h.states) != 2 or len(h.terms) > len(h.amplitudes):
            continue
        for term, size in zip(h.terms, h.amplitudes, strict=True):
            value, high = parameters[size].value, parameters[size].high
            if value >= 0 or high is None or high >= 0:
                continue
            (other,) = set(h.states) - {term.into}
            for run in fit.trajectories:
                own, every = (sum(_slopes(run, some, term.into, other)) for some in (h.terms, _terms(run)))
                if np.any(every + own * (high - value) / value < 0.0):
                    return True
    return False


def _terms(run: Trajectory) -> Sequence[Term]:
    return run.system.model.terms


def _slopes(run: Trajectory, terms: Sequence[Term], into: str, other: str) -> Iterator[Array]:
    """How much more flows into a body per kelvin of another one by each of some terms, (2K,)."""
    env, wrt = run.at_ends(), frozenset((other,))
    for term in terms:
        sign = 1.0 if term.into == into else -1.0 if term.source == into else 0.0
        if sign:
            partials = evaluate(term.expression, env, wrt, run.system.ends).partials
            yield sign * np.broadcast_to(partials.get(other, 0.0), (2 * len(run.system.grid.step),))
