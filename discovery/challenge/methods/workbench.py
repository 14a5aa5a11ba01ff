"""`discovery diagnose` without its report."""

from __future__ import annotations

from discovery.challenge.problem import Answer, Problem
from discovery.experiment.pipeline import diagnosis


def workbench(problem: Problem) -> Answer:
    """The whole content of diagnosis.json."""
    found = diagnosis(problem.experiment)
    assert found is not None  # every case has a [mismatch]
    return found.document()
