"""`discovery diagnose` without its report."""

from __future__ import annotations

from discovery.challenge.problem import Answer, Problem
from discovery.diagnosis import diagnose


def workbench(problem: Problem) -> Answer:
    """The whole content of diagnosis.json."""
    experiment = problem.experiment
    found = diagnose(
        problem.model, experiment.campaign, experiment.fit, experiment.held_out, experiment.outputs
    )
    return found.document().model_dump(mode="json", exclude_unset=True)
