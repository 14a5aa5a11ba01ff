"""What a diagnosis writes into diagnosis.json."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, TypedDict

import numpy as np

from discovery.diagnosis.form import (
    Against,
    Alternative,
    Claim,
    Considered,
    DescriptionDocument,
    Detection,
    DiagnosisDocument,
    Gain,
    HungSensor,
    ImprovementDocument,
    LocationDocument,
    MissingHeat,
    Number,
    OwnEffect,
    Physics,
    ResponseDocument,
    ResponsePart,
    Size,
    SizeRatio,
    Window,
    WrongReading,
)
from discovery.diagnosis.named import Named
from discovery.diagnosis.proof import Improvement, unit_of
from discovery.diagnosis.ratios import known_ratio
from discovery.diagnosis.response import Response
from discovery.diagnosis.thresholds import RIVALS_SHOWN
from discovery.diagnosis.verdict import FAULT, UNEXPLAINED
from discovery.diagnosis.when import instants
from discovery.effects.catalogue import catalogue
from discovery.effects.form import LEVEL
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.latent_force import alike, heat_over_time
from discovery.models.dimensions import heat_unit
from discovery.printed import undetermined
from discovery.terms import names, parse, text

if TYPE_CHECKING:
    from discovery.diagnosis.diagnose import Diagnosis

CONSIDERED = 12  # claims on what the baseline leaves that are listed
WRONG_READINGS = 12  # single wrong readings that are named


class _Claimed(TypedDict):
    effect: str
    states: list[str]
    recording: str | None
    lasts: bool
    grows: bool
    channels: list[str]


def document(d: Diagnosis) -> DiagnosisDocument:
    """diagnosis.json of a diagnosis."""
    rate = not any(s.capacity for s in d.context.model.states.values())
    return DiagnosisDocument(
        model=d.context.model.name,
        verdict=d.verdict.word,
        reasons=list(d.verdict.reasons),
        about="the model has no heat capacities: effects act on rates" if rate else "heat flows in W",
        detection=_detection(d),
        location=_location(d),
        physics=[_physics(d, n) for n in d.verdict.named] or _wrong_readings(d),
        alternatives=_alternatives([*d.verdict.named]),
        considered=_considered(d),
        closest=[Claim(**_claim(n.hypothesis)) for n in d.verdict.candidates],
        own_effects=[
            OwnEffect(
                **_claim(one.hypothesis),
                named=one.named,
                log_evidence=number(one.gain, 4),
                log_evidence_below_best=number(one.below, 4),
            )
            for one in d.own
        ],
        improvement=_improvement(d),
        set_aside=[
            WrongReading(
                output=o.output, recording=o.recording, time_s=number(o.time, 7), size=number(o.size, 4)
            )
            for o in d.context.outliers
        ],
        hung=[
            HungSensor(
                output=h.output,
                recording=h.recording,
                start_s=number(h.start, 7),
                end_s=number(h.end, 7),
                value=number(h.value, 7),
                readings=h.count,
            )
            for h in d.hung
        ],
        missing_heat=_missing_heat(d),
        description=DescriptionDocument(
            state=d.description.state,
            formula=d.description.formula,
            log_evidence=number(d.description.gain, 4),
        )
        if d.description
        else None,
        responses=[_response(one) for one in d.responses],
        next_experiment=d.question,
        seconds=round(d.seconds, 2),
    )


def number(value: float | None, digits: int = 5) -> Number:
    """A number for JSON, rounded to so many digits; null for NaN and infinity."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.{digits}g}")


def _claim(h: Hypothesis) -> _Claimed:
    return {
        "effect": h.effect.word,
        "states": list(h.places),
        "recording": h.recording,
        "lasts": h.effect.lasts,
        "grows": h.grows,
        "channels": list(h.follows),
    }


def _response(one: Response) -> ResponseDocument:
    return ResponseDocument(
        output=one.output,
        unit=one.unit,
        parts=[
            ResponsePart(
                input=p.input,
                gain=number(p.gain, 4),
                unit=p.unit,
                time_constant_s=number(p.seconds, 4),
                low_s=number(p.low, 4),
                high_s=number(p.high, 4),
            )
            for p in one.parts
        ],
        rms_left_out=number(one.left),
        rms_of_model=number(one.left_by_model),
        sentence=one.sentence(),
    )


def _stated_at(d: Diagnosis, h: Hypothesis) -> str | None:
    """What an amplitude is a size at: a speed, or the largest recorded value of an input."""
    if h.effect.at or LEVEL not in names(parse(h.effect.formula)):
        return h.effect.at or None
    channel = h.channels[0]
    unit = d.context.campaign.channels[channel].unit
    return f"{channel} = {d.context.scene.largest[channel]:.3g} {'' if unit == '1' else unit}".rstrip()


def _ratio(d: Diagnosis, size: str) -> SizeRatio | None:
    found = known_ratio(d.alone, size)
    if found is None:
        return None
    value, low, high = (number(v) for v in (found.value, found.low, found.high))
    return SizeRatio(to=found.to, value=value, low=low, high=high)


def _physics(d: Diagnosis, n: Named) -> Physics:
    h, after = n.hypothesis, d.after
    assert after is not None
    several = len(h.amplitudes) > 1 and h.shown  # else one size for all outputs, or one for each body
    output = dict(zip(h.amplitudes, h.shown, strict=True)) if several else {}
    sizes = {}
    for name in (*h.amplitudes, *h.shapes):
        low, high = h.spans.get(name) or d.interval(h, name)
        p = after.model.parameters[name]
        sizes[name] = Size(
            value=number(p.value),
            low=number(p.value if p.fixed and name not in h.spans else low),
            high=number(p.value if p.fixed and name not in h.spans else high),
            unit=p.unit,
            at=_stated_at(d, h) if name in h.amplitudes else None,
            output=output.get(name),
            ratio=_ratio(d, name) if undetermined(low, high) else None,
        )
    beyond = [s for s in sizes.values() if s.output and s.low is not None and s.high is not None]
    moved = [str(s.output) for s in beyond if not (s.low or 0.0) <= 0.0 <= (s.high or 0.0)]
    shown = h.shows(d.context.model)
    expressions = [text(t.expression) for t in h.terms] or [
        text(e) for name, e in shown.items() if name in (moved or list(shown)[:1])
    ]
    return Physics(
        **_claim(h),
        title=h.effect.title,
        moved=moved or None,
        probability=round(n.probability, 4),
        together=round(n.together, 4) if n.together > n.probability else None,
        expression=expressions[0],
        expressions=expressions if len(expressions) > 1 else None,
        parameters=sizes,
        source=h.effect.source,
        confused_with=list(h.effect.confused_with),
    )


def _wrong_readings(d: Diagnosis) -> list[Physics]:
    """Single wrong readings, largest first, if nothing else is wrong."""
    if d.verdict.word != FAULT:
        return []
    entry, rows = catalogue()["outlier"], []
    for o in sorted(d.context.outliers, key=lambda o: -abs(o.size / o.noise))[:WRONG_READINGS]:
        half, unit = 1.96 * o.noise, d.context.campaign.channels[o.output].unit
        rows.append(
            Physics(
                effect=entry.word,
                title=entry.title,
                states=[o.output],
                recording=o.recording,
                probability=0.98,
                expression=f"{o.size:.4g} {unit} at {o.time:.0f} s",
                parameters={
                    "outlier": Size(
                        value=number(o.size),
                        low=number(o.size - half),
                        high=number(o.size + half),
                        unit=unit,
                    )
                },
                source=entry.source,
                confused_with=list(entry.confused_with),
            )
        )
    return rows


def _alternatives(named: Sequence[Named]) -> list[Alternative]:
    rows = [
        Alternative(
            **_claim(r.hypothesis),
            log_evidence_below_best=round(r.below, 2),
            instead_of=n.hypothesis.effect.word,
        )
        for n in named
        for r in n.rivals
    ]
    return sorted(rows, key=lambda row: row.log_evidence_below_best)[:RIVALS_SHOWN]


def _considered(d: Diagnosis) -> list[Considered]:
    rows = []
    for c in d.search.claims[:CONSIDERED]:
        found = instants(d.context.campaign, c.hypothesis)
        rows.append(
            Considered(
                **_claim(c.hypothesis),
                instants_s=[round(t, 1) for t in found] if found else None,
                log_evidence=number(c.gain, 4),
                log_odds=number(c.odds, 4),
                score=number(c.t, 4),
                share_that_a_refit_leaves=number(c.share, 3),
            )
        )
    return rows


def _detection(d: Diagnosis) -> Detection:
    noise = d.verdict.answer.noise
    left = d.before.residuals().values()
    slow = noise.slow or (0.0,) * len(noise.outputs)
    return Detection(
        p_value=number(d.posterior.nothing, 3),
        log_evidence=number(d.search.gain),
        latent_force_log_evidence=number(d.forces[0].gain) if d.forces else None,
        noise={n: number(v) for n, v in zip(noise.outputs, noise.white, strict=True)},
        slow_noise={n: number(v) for n, v in zip(noise.outputs, slow, strict=True)},
        process_noise={n: number(v) for n, v in (noise.heat or {}).items()},
        form_error=noise.share,
        residual_rms={
            name: number(_rms(np.concatenate([r[:, y] for r in left])))
            for y, name in enumerate(d.context.outputs)
        },
    )


def _rms(residual: np.ndarray) -> float:
    """rms of a residual; NaN of an output without readings."""
    read = residual[np.isfinite(residual)]
    return float(np.sqrt(np.mean(read**2))) if len(read) else float("nan")


def _location(d: Diagnosis) -> LocationDocument:
    model = d.before.problem.model
    return LocationDocument(
        outputs=dict(d.location.outputs),
        states=dict(d.location.states),
        alike=[list(group) for group in alike(d.forces) if len(group) > 1],
        windows=[
            Window(
                recording=w.recording,
                start_s=number(w.start_s, 7),
                end_s=number(w.end_s, 7),
                state=w.state,
                heat_W=number(w.heat, 4),
            )
            for w in d.location.windows
        ],
        regime=d.location.regime,
        unmodelled_heat_W={
            f.state: number(float(np.sqrt(np.mean(np.concatenate(list(f.heat.values())) ** 2))), 3)
            for f in d.forces
        },
        heat_units={
            name: heat_unit(model, model.states[name])
            for name in dict.fromkeys([*(w.state for w in d.location.windows), *(f.state for f in d.forces)])
            if name in model.states
        },
    )


def _improvement(d: Diagnosis) -> ImprovementDocument:
    return ImprovementDocument(
        unit=unit_of(d.context.campaign, d.context.outputs),
        fit=_gain(d.fit),
        held_out={run: _gain(i) for run, i in d.held_out.items()},
        contradicted_by=list(d.contradicted_by),
        explained=number(d.explained, 4),
    )


def _gain(i: Improvement) -> Gain:
    each: Mapping[str, tuple[Number, Number]] = {
        name: (number(old), number(new)) for name, (old, new) in i.outputs.items()
    }
    return Gain(
        rms_before=number(i.before),
        rms_after=number(i.after),
        noise_floor=number(i.floor),
        expected=number(i.expected),
        gain_low=number(i.low),
        gain_high=number(i.high),
        outputs=dict(each),
        from_known_starts=(number(i.judged[0]), number(i.judged[1])),
        runs_away=True if np.isinf(i.after) else None,
    )


def _missing_heat(d: Diagnosis) -> MissingHeat | None:
    if not d.curves or not d.forces:
        return None
    force = d.forces[0]
    offsets = {r: d.context.campaign.recordings[r].start for r in d.context.recordings}
    return MissingHeat(
        state=force.state,
        over_time=heat_over_time(force, offsets, d.context.recordings),
        against={
            c.variable: Against(
                value=[number(v, 5) for v in c.centre],
                heat=[number(v, 4) for v in c.heat],
                error=[number(v, 3) for v in c.error],
            )
            for c in d.curves
        },
        named=d.verdict.word != UNEXPLAINED,
    )
