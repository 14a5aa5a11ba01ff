"""Something is always missing, and nobody knows what: the answer that never names anything wrong."""

from __future__ import annotations

from discovery.challenge.problem import Answer, Problem


def always_unexplained(problem: Problem) -> Answer:  # noqa: ARG001
    """`unexplained`, whatever the recordings say."""
    return {"verdict": "unexplained", "physics": [], "alternatives": []}
