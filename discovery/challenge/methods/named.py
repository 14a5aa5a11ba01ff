"""Entries of diagnosis.json for methods that name effects of the catalogue."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from discovery.effects.hypothesis import Hypothesis
from discovery.fitting import Fit


def named_entry(fit: Fit, h: Hypothesis, probability: float) -> dict[str, Any]:
    """An effect with the parameters and 95 % intervals of a fit."""
    sizes = {}
    for name in (*h.amplitudes, *h.shapes):
        p = fit.model.parameters[name]
        value = (p.values or {}).get(h.recording, p.value) if h.recording else p.value
        half = next(
            (
                1.96 * float(sd)
                for u, sd in zip(fit.problem.unknowns, fit.standard_errors, strict=True)
                if u.name == name and not u.is_start
            ),
            0.0,
        )
        sizes[name] = {"value": value, "low": value - half, "high": value + half, "unit": p.unit}
    run = {"recording": h.recording} if h.recording else {}
    return {
        "effect": h.effect.word,
        "states": list(h.places),
        **run,
        "probability": probability,
        "parameters": sizes,
    }


def windows_of(named: Sequence[Hypothesis]) -> list[dict[str, Any]]:
    """Windows of events at a body that are named."""
    return [
        {"recording": h.recording, "start_s": edges[0], "end_s": edges[1], "state": h.states[0]}
        for h in named
        if h.effect.search == "window" and h.states and len(edges := list(h.shapes.values())) == 2
    ]
