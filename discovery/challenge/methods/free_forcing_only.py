"""Free forcing alone: smooth heat of unknown cause says whether, where and when, never what."""

from __future__ import annotations

import numpy as np

from discovery.challenge.problem import Answer, Problem
from discovery.diagnosis.location import locate
from discovery.diagnosis.posterior import Posterior
from discovery.diagnosis.verdict import NO_MISMATCH, UNEXPLAINED, Verdict
from discovery.evidence.latent_force import latent_forces

FIRES = 9.0  # log evidence of free heat at the body where it explains most


def free_forcing_only(problem: Problem) -> Answer:
    """`unexplained` with place and windows where free heat at some body adds evidence."""
    context, baseline = problem.context, problem.baseline
    found = latent_forces(baseline.seen, baseline.setting, context.floor)
    fires = bool(found) and found[0].gain > FIRES
    verdict = Verdict(UNEXPLAINED if fires else NO_MISMATCH, baseline, (), (), ())
    place = locate(context, baseline, verdict, Posterior((baseline,), np.zeros((1, 1))), found)
    windows = [
        {"recording": w.recording, "start_s": w.start_s, "end_s": w.end_s, "state": w.state}
        for w in place.windows
    ]
    return {
        "verdict": verdict.word,
        "physics": [],
        "alternatives": [],
        "location": {"states": dict(place.states), "windows": windows},
    }
