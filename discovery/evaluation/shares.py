"""How much of the errors comes from each term of a fitted model."""

from __future__ import annotations

import numpy as np

from discovery.dynamics import Column, sensitivities
from discovery.fitting import Fit
from discovery.terms import evaluate


def term_shares(fit: Fit) -> dict[str, float]:
    """Share of each term in what moves the outputs, by name; they add up to 1.

    The effect of a term is what the outputs would lose without it, to first order: its own heat flow or rate
    along the fitted trajectory, filtered through the model's dynamics, as rms over the readings in units of
    their noise.
    """
    terms = fit.problem.model.terms
    white = np.array(fit.noise.white)
    total, count = np.zeros(len(terms)), 0
    for trajectory in fit.trajectories:
        system = trajectory.system
        env, steps = trajectory.at_ends(), len(system.grid.step)
        columns = []
        for owner, term in enumerate(system.model.terms):
            series = np.broadcast_to(
                evaluate(term.expression, env, frozenset(), system.ends).value, (2 * steps,)
            )
            columns.append(Column(owner, term.into, np.ascontiguousarray(series), term.source))
        effect = sensitivities(trajectory, (), (), columns, len(terms)) / white[:, None]  # (R, Y, terms)
        known = system.grid.measured
        total += np.sum(effect[known] ** 2, axis=0)
        count += int(known.sum())
    rms = np.sqrt(total / max(count, 1))
    whole = float(rms.sum()) or 1.0
    shares: dict[str, float] = {}
    for term, one in zip(terms, rms, strict=True):
        shares[term.name] = shares.get(term.name, 0.0) + float(one) / whole
    return shares
