"""Forward selection by BIC with white residuals: the classical way through the same catalogue.

Each step refits the claims that the residual supports most and keeps the one with the lowest BIC, until
none lowers it (Bacher & Madsen, Energy and Buildings 43, 2011, with BIC in place of their likelihood-ratio
test).
"""

from __future__ import annotations

import numpy as np

from discovery.challenge.methods.named import named_entry, windows_of
from discovery.challenge.problem import Answer, Problem
from discovery.diagnosis.refit import score
from discovery.diagnosis.scan import attempt, scan_model
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis

MOST = 3  # effects that may be added
REFITS = 6  # claims that are refitted at each step


def forward_selection(problem: Problem) -> Answer:
    """The effects that forward selection adds; weights of BIC within a step serve as probabilities."""
    context = problem.white
    current = score(context, (), context.white)
    assert current is not None  # the baseline alone has been fitted before
    named: list[tuple[Hypothesis, float]] = []
    alternatives = []
    for _ in range(MOST):
        claims = scan_model(context, current).claims[:REFITS]
        tried = [s for c in claims if (s := attempt(context, current, current.hypotheses, c))]
        if not tried or min(map(bic, tried)) >= bic(current):
            break
        tried.sort(key=bic)
        current = tried[0]
        below = [0.5 * (bic(s) - bic(current)) for s in tried]  # about the log of the ratio of evidence
        added = [s.hypotheses[-1] for s in tried]
        named.append((added[0], float(1 / np.sum(np.exp(-np.array(below))))))
        alternatives += [
            {"effect": h.effect.word, "states": list(h.places), "log_evidence_below_best": gap}
            for h, gap in zip(added[1:], below[1:], strict=True)
        ]
    physics = [named_entry(current.fit, h, p) for h, p in named]
    fault = physics and not any(h.effect.is_physics for h, _ in named)
    return {
        "verdict": "measurement fault" if fault else "missing physics" if physics else "no mismatch",
        "physics": physics,
        "alternatives": alternatives,
        "location": {
            "states": {s: 1.0 for h, _ in named[:1] for s in h.states},
            "windows": windows_of([h for h, _ in named]),
        },
        "improvement": problem.improvement(current.fit if named else None, current.hypotheses),
    }


def bic(found: Scored) -> float:
    """sum_y n_y log(RSS_y/n_y) + k log n: white residuals, one variance an output, k fitted numbers."""
    residuals = np.concatenate(found.seen.residuals)
    counts = np.isfinite(residuals).sum(axis=0)
    squares = np.nansum(residuals**2, axis=0)
    edges = sum(shape.instant for h in found.hypotheses for shape in h.effect.shapes)  # searched on a grid
    k = len(found.fit.theta) + edges
    return float(np.sum(counts * np.log(squares / counts)) + k * np.log(counts.sum()))
