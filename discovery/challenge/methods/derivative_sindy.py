"""The published way: the derivative of the residual regressed on a library along the simulated states.

Kaheman et al. (arXiv:1909.08574, 2019) and Ebers et al. (SIAM J. Appl. Dyn. Syst. 23, 2024) learn a
discrepancy so. The library is the workbench's catalogue of physics at every place and shape; the measuring
chain has no rate.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.challenge.methods.named import named_entry
from discovery.challenge.problem import Answer, Problem
from discovery.diagnosis.refit import refit
from discovery.dynamics import Trajectory
from discovery.dynamics.prediction import output_matrix
from discovery.effects.candidates import with_shapes
from discovery.effects.hypothesis import Hypothesis
from discovery.errors import RunsAwayError
from discovery.fitting import Fit
from discovery.terms import evaluate

Array = NDArray[np.float64]

MOST = 3  # effects that may be named


def derivative_sindy(problem: Problem) -> Answer:
    """The effects whose terms the regression keeps, largest first, with their shares as probabilities."""
    from discovery.sparse.derivative import discrepancy_terms  # PySINDy takes seconds to load

    context, fit = problem.context, problem.context.baseline
    library = [
        one
        for h in context.candidates
        if h.terms and h.recording is None and h.effect.search == "shapes"
        for one in with_shapes(h)
    ]
    white = np.array(problem.white.white.white)
    blocks = [
        block
        for t in fit.trajectories
        for block in _blocks(
            t, fit.problem.residual(t) / white, output_rates(t, library) / white[None, :, None]
        )
    ]
    kept = discrepancy_terms(blocks)
    first: dict[object, tuple[Hypothesis, float]] = {}
    for k, share in kept:
        first.setdefault(library[k].key, (library[k], share))
    chosen = list(first.values())[:MOST]
    found = _refit(problem, [h for h, _ in chosen])
    physics = [
        named_entry(found, h, share)
        if found
        else {"effect": h.effect.word, "states": list(h.places), "probability": share}
        for h, share in chosen
    ]
    return {
        "verdict": "missing physics" if physics else "no mismatch",
        "physics": physics,
        "alternatives": [],
        "location": {"states": {s: 1.0 for h, _ in chosen[:1] for s in h.states}, "windows": []},
        "improvement": problem.improvement(found, [h for h, _ in chosen]),
    }


def output_rates(trajectory: Trajectory, library: list[Hypothesis]) -> Array:
    """Rate (R, Y, A) at which a unit of each effect begins to move the outputs, at the readings."""
    system = trajectory.system
    lever = output_matrix(trajectory)
    nodes = trajectory.at_nodes()
    out = np.zeros((len(system.grid.read), len(system.grid.outputs), len(library)))
    for k, h in enumerate(library):
        values = {**nodes, **h.shapes, **dict.fromkeys(h.amplitudes, 1.0)}
        for term in h.terms:
            heat = evaluate(term.expression, values, memory=system.nodes).value
            series = np.broadcast_to(np.asarray(heat, dtype=float), system.grid.time.shape)[system.grid.read]
            for state, sign in ((term.into, 1.0), (term.source, -1.0)):
                if state:
                    i = system.states.index(state)
                    capacity = system.model.states[state].capacity or 1.0
                    out[:, :, k] += sign * series[:, None] / capacity * lever[:, :, i]
    return out


def _blocks(trajectory: Trajectory, residual: Array, rates: Array) -> list[tuple[Array, Array]]:
    """Quarters of a recording: library (N, A) and derivative of the residual (N,)."""
    from discovery.sparse.derivative import smoothed_derivative

    time = trajectory.system.grid.time[trajectory.system.grid.read]
    columns, target, when = [], [], []
    for y in range(residual.shape[1]):
        known = np.isfinite(residual[:, y])
        if known.sum() < 40:
            continue
        columns.append(rates[known, y])
        target.append(smoothed_derivative(time[known], residual[known, y]))
        when.append(time[known])
    x, d, t = np.concatenate(columns), np.concatenate(target), np.concatenate(when)
    quarter = np.minimum(4 * (t - t.min()) / max(np.ptp(t), 1.0), 3).astype(int)
    return [(x[quarter == q], d[quarter == q]) for q in range(4)]


def _refit(problem: Problem, chosen: list[Hypothesis]) -> Fit | None:
    """The model with all chosen terms, refitted; None where there are none or it runs away."""
    try:
        return refit(problem.white, chosen, problem.white.white) if chosen else None
    except RunsAwayError:
        return None
