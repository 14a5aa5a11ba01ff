"""The effects of a diagnosis as rows of diagnosis.json: sizes with their intervals, expressions, places."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery.fitting import Fit
from discovery.mismatch.catalogue import catalogue
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.verdict import FAULT, Named
from discovery.terms import text

if TYPE_CHECKING:
    from discovery.mismatch.diagnosis import Diagnosis

# relative half-width that a model of few bodies adds to every size: with it, 95 % of 548 intervals on
# machines of many nodes hold the true size (72 % without any, 93 % with 0.12)
FORM = 0.15


def number(value: float | None, digits: int = 5) -> float | None:
    """A number as JSON holds it: so many digits, null for what is none."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.{digits}g}")


def claim(h: Hypothesis) -> dict[str, Any]:
    """What a hypothesis claims: effect, places, and the recording of an event."""
    return {
        "effect": h.effect.word,
        "states": list(h.places),
        **({"recording": h.recording} if h.recording else {}),
    }


def physics(d: Diagnosis, n: Named, checked: float | None) -> dict[str, Any]:
    """What a repaired model adds; `checked`: share of blind repetitions that name it again."""
    h = n.hypothesis
    parameters = {}
    fits = (d.search.best.fit, d.after.fit)
    several = len(h.amplitudes) > 1 and h.shown  # else one size for all outputs, or one for each body
    output = dict(zip(h.amplitudes, h.shown, strict=True)) if several else {}
    for name in (*h.amplitudes, *h.shapes):
        p = d.after.fit.model.parameters[name]
        value = p.values.get(h.recording, p.value) if h.recording else p.value
        # two ways to fit that do not agree leave that much open
        known = [span for span in (_interval(fit, h, name) for fit in fits) if span]
        low = min((span[0] for span in known), default=None)
        high = max((span[1] for span in known), default=None)
        parameters[name] = {
            "value": number(value),
            "low": number(h.spans[name][0] if name in h.spans else value if p.fixed else low),
            "high": number(h.spans[name][1] if name in h.spans else value if p.fixed else high),
            "unit": p.unit,
            **({"at": h.effect.at} if h.effect.at and name in h.amplitudes else {}),
            **({"output": output[name]} if name in output else {}),
        }
    moved = _moved(parameters)
    expressions = [text(t.expression) for t in h.terms] or [
        text(e) for name, e in h.shows(d.context.model).items() if name in (moved or [name])
    ]
    return {
        "effect": h.effect.word,
        "title": h.effect.title,
        "states": list(h.places),
        **({"moved": moved} if moved else {}),
        **({"recording": h.recording} if h.recording else {}),
        "probability": round(n.probability, 4),
        "named_again": number(checked, 3),
        "expression": expressions[0],
        **({"expressions": expressions} if len(expressions) > 1 else {}),
        "parameters": parameters,
        "source": h.effect.source,
        "confused_with": list(h.effect.confused_with),
    }


def _moved(parameters: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Outputs that an effect of several sizes moves, beyond the interval of each; a device set to zero may
    leave thermometers beside it as they are.
    """
    sizes = [p for p in parameters.values() if "output" in p and p["low"] is not None]
    return [p["output"] for p in sizes if not p["low"] <= 0.0 <= p["high"]]


def outliers(d: Diagnosis) -> list[dict[str, Any]]:
    """Single wrong readings, largest first, where they are all that is wrong."""
    if d.verdict.word != FAULT:
        return []
    entry = catalogue()["outlier"]
    rows = []
    for o in sorted(d.context.outliers, key=lambda o: -abs(o.size / o.noise))[:12]:
        unit = d.context.campaign.channels[o.output].unit
        half = 1.96 * o.noise
        rows.append(
            {
                "effect": entry.word,
                "title": entry.title,
                "states": [o.output],
                "recording": o.recording,
                "probability": 0.98,
                "named_again": None,
                "expression": f"{o.size:.4g} at {o.time:.0f} s",
                "parameters": {
                    "outlier": {
                        "value": number(o.size),
                        "low": number(o.size - half),
                        "high": number(o.size + half),
                        "unit": unit,
                    }
                },
                "source": entry.source,
                "confused_with": list(entry.confused_with),
            }
        )
    return rows


def _interval(fit: Fit, h: Hypothesis, name: str) -> tuple[float, float] | None:
    """The 95 % interval of a size in one fit, about its own value there; None where it is not known."""
    p = fit.model.parameters[name]
    value = p.values.get(h.recording, p.value) if h.recording else p.value
    low, high = _of_one_recording(fit, name) if h.recording else (p.low, p.high)
    if low is None or high is None:
        return None
    if h.effect.is_physics:
        low = max(value - float(np.hypot(value - low, FORM * value)), p.min)
        high = min(value + float(np.hypot(high - value, FORM * value)), p.max)
    return low, high


def _of_one_recording(fit: Fit, name: str) -> tuple[float | None, float | None]:
    for i, u in enumerate(fit.problem.unknowns):
        if u.name == name and not u.is_start:
            half = 1.96 * float(fit.standard_errors[i])
            return float(fit.theta[i]) - half, float(fit.theta[i]) + half
    return None, None
