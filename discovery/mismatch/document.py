"""The content of diagnosis.json (contract section 6, and more that a reader of the report wants)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery.fitting import Fit
from discovery.mismatch.catalogue import catalogue
from discovery.mismatch.describe import heat_over_time
from discovery.mismatch.forcing import alike
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.verdict import FAULT, UNEXPLAINED, Named
from discovery.mismatch.when import instants
from discovery.models.units import differences
from discovery.terms import text

if TYPE_CHECKING:
    from discovery.mismatch.diagnosis import Diagnosis


# relative half-width that a model of few bodies adds to every size: on machines of many nodes estimates
# scatter by 6 % about the truth beyond what the noise of the readings explains
FORM = 0.12


def _number(value: float | None, digits: int = 5) -> float | None:
    return None if value is None or not np.isfinite(value) else float(f"{value:.{digits}g}")


def document(d: Diagnosis) -> dict[str, Any]:
    """diagnosis.json of a diagnosis."""
    rate = not any(s.capacity for s in d.context.model.states.values())
    return {
        "model": d.context.model.name,
        "verdict": d.verdict.word,
        "reasons": list(d.verdict.reasons),
        "about": "the states of this model are the errors themselves: effects act on their rates"
        if rate
        else "heat flows in W",
        "detection": _detection(d),
        "location": _location(d),
        "physics": [_physics(d, n, c) for n, c in zip(d.verdict.named, d.checked, strict=True)]
        or _outliers(d),
        "alternatives": _alternatives(d.verdict.named),
        "considered": [
            {
                **_claim(c.hypothesis),
                **_instants(d, c.hypothesis),
                "log_evidence": _number(c.gain, 4),
                "score": _number(c.t, 4),
                "share_that_a_refit_leaves": _number(c.share, 3),
                "decidable": c.decidable,
            }
            for c in d.search.looks[0][:12]
        ],
        "closest": [_claim(n.hypothesis) for n in d.verdict.candidates],
        "improvement": _improvement(d),
        "set_aside": [
            {
                "output": o.output,
                "recording": o.recording,
                "time_s": _number(o.time, 7),
                "size": _number(o.size, 4),
            }
            for o in d.context.outliers
        ],
        "missing_heat": _missing_heat(d),
        "description": (
            {
                "state": d.description.state,
                "formula": d.description.formula,
                "log_evidence": _number(d.description.gain, 4),
                "note": "describes the missing heat; it is not its cause",
            }
            if d.description
            else None
        ),
        "next_experiment": d.question,
        "seconds": round(d.seconds, 2),
    }


def _detection(d: Diagnosis) -> dict[str, Any]:
    """What the baseline leaves, fitted as in the proof, and what noise it is held against."""
    noise = d.search.best.best_view.noise
    known = d.search.baseline.views[0].noise
    left = {
        name: float(np.sqrt(np.nanmean(np.concatenate([r[:, y] for r in d.before.lens.residuals]) ** 2)))
        for y, name in enumerate(d.context.outputs)
    }
    return {
        "p_value": _number(d.p_value, 3),
        "log_evidence": _number(d.search.gain),
        "free_forcing_log_evidence": _number(d.forcings[0].gain) if d.forcings else None,
        "noise": {name: _number(v) for name, v in zip(known.outputs, known.white, strict=True)},
        "slow_noise": {n: _number(v) for n, v in zip(noise.outputs, noise.slow, strict=True)},
        "everyday_heat_W": {n: _number(v) for n, v in (noise.heat or {}).items()},
        "residual_rms": {name: _number(rms) for name, rms in left.items()},
    }


def _location(d: Diagnosis) -> dict[str, Any]:
    """Where and when."""
    return {
        "outputs": dict(d.location.outputs),
        "states": dict(d.location.states),
        "alike": [list(group) for group in alike(list(d.forcings)) if len(group) > 1],
        "windows": [
            {
                "recording": w.recording,
                "start_s": _number(w.start_s, 7),
                "end_s": _number(w.end_s, 7),
                "state": w.state,
                "heat_W": _number(w.heat, 4),
            }
            for w in d.location.windows
        ],
        "regime": d.location.regime,
        "unmodelled_heat_W": {
            f.state: _number(float(np.sqrt(np.mean(np.concatenate(list(f.heat.values())) ** 2))), 3)
            for f in d.forcings
            if f.state in d.context.fit_states
        },
    }


def _improvement(d: Diagnosis) -> dict[str, Any]:
    """The proof; `unit` of its figures, where all outputs have the same."""
    units = {differences(d.context.campaign.channels[name].unit) for name in d.context.outputs}
    return {
        "unit": units.pop() if len(units) == 1 else None,
        "fit": {
            "rms_before": _number(d.fit.before),
            "rms_after": _number(d.fit.after),
            "noise_floor": _number(d.fit.floor),
        },
        "held_out": {
            run: {
                "rms_before": _number(i.before),
                "rms_after": _number(i.after),
                "noise_floor": _number(i.floor),
                "gain_low": _number(i.low),
                "gain_high": _number(i.high),
                **({"runs_away": True} if np.isinf(i.after) else {}),
            }
            for run, i in d.held_out.items()
        },
        "contradicted_by": [run for run, i in d.held_out.items() if d.repaired and i.contradicts],
        "explained": _number(d.explained, 4),
    }


def _claim(h: Hypothesis) -> dict[str, Any]:
    return {
        "effect": h.effect.word,
        "states": list(h.places),
        **({"recording": h.recording} if h.recording else {}),
    }


def _instants(d: Diagnosis, h: Hypothesis) -> dict[str, Any]:
    """Begin and end of an event, or its one instant."""
    found = instants(d.context.campaign, h)
    return {"instants_s": [_number(t, 7) for t in found]} if found else {}


def _alternatives(named: tuple[Named, ...]) -> list[dict[str, Any]]:
    rows = [
        {
            **_claim(r.hypothesis),
            "log_evidence_below_best": round(r.below, 2),
            "instead_of": n.hypothesis.effect.word,
        }
        for n in named
        for r in n.rivals
    ]
    return sorted(rows, key=lambda row: row["log_evidence_below_best"])[:12]


def _physics(d: Diagnosis, n: Named, checked: float | None) -> dict[str, Any]:
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
            "value": _number(value),
            "low": _number(h.spans[name][0] if name in h.spans else value if p.fixed else low),
            "high": _number(h.spans[name][1] if name in h.spans else value if p.fixed else high),
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
        "named_again": _number(checked, 3),
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


def _outliers(d: Diagnosis) -> list[dict[str, Any]]:
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
                        "value": _number(o.size),
                        "low": _number(o.size - half),
                        "high": _number(o.size + half),
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


def _missing_heat(d: Diagnosis) -> dict[str, Any] | None:
    if not d.curves or not d.forcings:
        return None
    f = d.forcings[0]
    offsets = {r: d.context.campaign.recordings[r].start for r in d.context.recordings}
    return {
        "state": f.state,
        "over_time": heat_over_time(f, offsets, d.context.recordings),
        "against": {
            c.variable: {
                "value": [_number(v, 5) for v in c.centre],
                "heat": [_number(v, 4) for v in c.heat],
                "error": [_number(v, 3) for v in c.error],
            }
            for c in d.curves
        },
        "named": d.verdict.word != UNEXPLAINED,
    }
