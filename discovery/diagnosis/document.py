"""The content of diagnosis.json (contract section 6, and more that a reader of the report wants)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.describe import heat_over_time
from discovery.mismatch.forcing import alike
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.prove import unit_of
from discovery.mismatch.rows import claim, number, outliers, physics
from discovery.mismatch.verdict import UNEXPLAINED, Named
from discovery.mismatch.when import instants

if TYPE_CHECKING:
    from discovery.mismatch.diagnosis import Diagnosis


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
        "physics": [physics(d, n, c) for n, c in zip(d.verdict.named, d.checked, strict=True)] or outliers(d),
        "alternatives": _alternatives(d.verdict.named),
        "considered": [
            {
                **claim(c.hypothesis),
                **_instants(d, c.hypothesis),
                "log_evidence": number(c.gain, 4),
                "score": number(c.t, 4),
                "share_that_a_refit_leaves": number(c.share, 3),
                "decidable": c.decidable,
            }
            for c in d.search.looks[0][:12]
        ],
        "closest": [claim(n.hypothesis) for n in d.verdict.candidates],
        "improvement": _improvement(d),
        "set_aside": [
            {
                "output": o.output,
                "recording": o.recording,
                "time_s": number(o.time, 7),
                "size": number(o.size, 4),
            }
            for o in d.context.outliers
        ],
        "missing_heat": _missing_heat(d),
        "description": (
            {
                "state": d.description.state,
                "formula": d.description.formula,
                "log_evidence": number(d.description.gain, 4),
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
        name: _rms(np.concatenate([r[:, y] for r in d.before.lens.residuals]))
        for y, name in enumerate(d.context.outputs)
    }
    return {
        "p_value": number(d.p_value, 3),
        "log_evidence": number(d.search.gain),
        "free_forcing_log_evidence": number(d.forcings[0].gain) if d.forcings else None,
        "noise": {name: number(v) for name, v in zip(known.outputs, known.white, strict=True)},
        "slow_noise": {n: number(v) for n, v in zip(noise.outputs, noise.slow, strict=True)},
        "everyday_heat_W": {n: number(v) for n, v in (noise.heat or {}).items()},
        "residual_rms": {name: number(rms) for name, rms in left.items()},
    }


def _rms(residual: NDArray[np.float64]) -> float | None:
    """None of an output that was never read."""
    read = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(read**2))) if len(read) else None


def _location(d: Diagnosis) -> dict[str, Any]:
    """Where and when."""
    return {
        "outputs": dict(d.location.outputs),
        "states": dict(d.location.states),
        "alike": [list(group) for group in alike(list(d.forcings)) if len(group) > 1],
        "windows": [
            {
                "recording": w.recording,
                "start_s": number(w.start_s, 7),
                "end_s": number(w.end_s, 7),
                "state": w.state,
                "heat_W": number(w.heat, 4),
            }
            for w in d.location.windows
        ],
        "regime": d.location.regime,
        "unmodelled_heat_W": {
            f.state: number(float(np.sqrt(np.mean(np.concatenate(list(f.heat.values())) ** 2))), 3)
            for f in d.forcings
            if f.state in d.context.fit_states
        },
    }


def _improvement(d: Diagnosis) -> dict[str, Any]:
    """The proof, and the unit of its figures."""
    return {
        "unit": unit_of(d.context.campaign, d.context.outputs),
        "fit": {
            "rms_before": number(d.fit.before),
            "rms_after": number(d.fit.after),
            "noise_floor": number(d.fit.floor),
        },
        "held_out": {
            run: {
                "rms_before": number(i.before),
                "rms_after": number(i.after),
                "noise_floor": number(i.floor),
                "gain_low": number(i.low),
                "gain_high": number(i.high),
                **({"runs_away": True} if np.isinf(i.after) else {}),
            }
            for run, i in d.held_out.items()
        },
        "contradicted_by": [run for run, i in d.held_out.items() if d.repaired and i.contradicts],
        "explained": number(d.explained, 4),
    }


def _instants(d: Diagnosis, h: Hypothesis) -> dict[str, Any]:
    """Begin and end of an event, or its one instant."""
    found = instants(d.context.campaign, h)
    return {"instants_s": [number(t, 7) for t in found]} if found else {}


def _alternatives(named: tuple[Named, ...]) -> list[dict[str, Any]]:
    rows = [
        {
            **claim(r.hypothesis),
            "log_evidence_below_best": round(r.below, 2),
            "instead_of": n.hypothesis.effect.word,
        }
        for n in named
        for r in n.rivals
    ]
    return sorted(rows, key=lambda row: row["log_evidence_below_best"])[:12]


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
                "value": [number(v, 5) for v in c.centre],
                "heat": [number(v, 4) for v in c.heat],
                "error": [number(v, 3) for v in c.error],
            }
            for c in d.curves
        },
        "named": d.verdict.word != UNEXPLAINED,
    }
