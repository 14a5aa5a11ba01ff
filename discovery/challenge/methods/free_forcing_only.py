"""Free forcing alone: smooth heat of unknown cause says whether, where and when, never what."""

from __future__ import annotations

from discovery.challenge.problem import Answer, Problem
from discovery.diagnosis.doubts import FREE
from discovery.diagnosis.location import locate
from discovery.diagnosis.verdict import NO_MISMATCH, UNEXPLAINED
from discovery.evidence.latent_force import free_forcing


def free_forcing_only(problem: Problem) -> Answer:
    """`unexplained` with place and windows where free heat at some body adds evidence."""
    found = free_forcing(problem.context, problem.baseline)
    fires = bool(found) and found[0].gain > FREE
    place = locate(problem.context, problem.baseline, problem.baseline, (), found)
    windows = [
        {"recording": w.recording, "start_s": w.start_s, "end_s": w.end_s, "state": w.state}
        for w in place.windows
    ]
    return {
        "verdict": UNEXPLAINED if fires else NO_MISMATCH,
        "physics": [],
        "alternatives": [],
        "location": {"states": dict(place.states), "windows": windows},
    }
