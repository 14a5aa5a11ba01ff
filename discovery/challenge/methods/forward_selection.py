"""Forward selection by BIC with white residuals: the classical way through the same catalogue.

Each step refits the claims that the residual speaks for most and keeps the one with the lowest BIC, until
none lowers it (Bacher & Madsen, Energy and Buildings 43, 2011, with BIC in place of their likelihood-ratio
test).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from discovery.challenge.methods.named import named_entry, windows_of
from discovery.challenge.problem import Answer, Problem
from discovery.diagnosis.context import Context
from discovery.diagnosis.scan import look
from discovery.diagnosis.scored import Assessment, assess
from discovery.effects.hypothesis import Hypothesis
from discovery.errors import UserError
from discovery.fitting.noise import white_noise

MOST = 3  # effects that may be added
REFITS = 6  # claims that are refitted at each step


@dataclass(frozen=True)
class Step:
    """A fitted model with its BIC."""

    assessment: Assessment
    bic: float


def forward_selection(problem: Problem) -> Answer:
    """The effects that forward selection adds; weights of BIC within a step stand for probabilities."""
    context = with_white_noise(problem.context)
    current = _step(context, (), None)
    assert current is not None  # the baseline alone has been fitted before
    named: list[tuple[Hypothesis, float]] = []
    alternatives = []
    for _ in range(MOST):
        claims = look(context, current.assessment).claims[:REFITS]
        kept = current.assessment.hypotheses
        tried = [s for c in claims if (s := _step(context, (*kept, c.hypothesis), current.assessment))]
        if not tried or min(s.bic for s in tried) >= current.bic:
            break
        tried.sort(key=lambda s: s.bic)
        current = tried[0]
        below = [0.5 * (s.bic - current.bic) for s in tried]  # about the log of the ratio of evidence
        added = [s.assessment.hypotheses[-1] for s in tried]
        named.append((added[0], float(1 / np.sum(np.exp(-np.array(below))))))
        alternatives += [
            {"effect": h.effect.word, "states": list(h.places), "log_evidence_below_best": gap}
            for h, gap in zip(added[1:], below[1:], strict=True)
        ]
    physics = [named_entry(current.assessment, h, p) for h, p in named]
    fault = physics and not any(h.effect.is_physics for h, _ in named)
    return {
        "verdict": "measurement fault" if fault else "missing physics" if physics else "no mismatch",
        "physics": physics,
        "alternatives": alternatives,
        "location": {
            "states": {s: 1.0 for h, _ in named[:1] for s in h.states},
            "windows": windows_of([h for h, _ in named]),
        },
        "improvement": problem.improvement(
            current.assessment.fit.model if named else None, current.assessment.hypotheses
        ),
    }


def with_white_noise(context: Context) -> Context:
    """The context with one noise setting: white, as large as the residual of the baseline."""
    fit = context.baseline
    stated = {name: context.campaign.channels[name].noise for name in context.outputs}
    residuals = [fit.problem.residual(t) for t in fit.trajectories]
    return replace(context, settings=(white_noise(context.outputs, stated, residuals),))


def _step(context: Context, chosen: tuple[Hypothesis, ...], start: Assessment | None) -> Step | None:
    """The refit, or None where the model with the effect runs away."""
    try:
        found = assess(context, chosen, context.settings[0], start)
    except UserError:
        return None
    return Step(found, bic(found))


def bic(found: Assessment) -> float:
    """sum_y n_y log(RSS_y/n_y) + k log n: white residuals, one variance an output, k fitted numbers."""
    residuals = np.concatenate(found.lens.residuals)
    counts = np.isfinite(residuals).sum(axis=0)
    squares = np.nansum(residuals**2, axis=0)
    edges = sum(
        shape.fixed for h in found.hypotheses for shape in h.effect.shapes
    )  # instants searched on a grid
    k = len(found.fit.theta) + edges
    return float(np.sum(counts * np.log(squares / counts)) + k * np.log(counts.sum()))
