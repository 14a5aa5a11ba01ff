"""The diagnosis from start to end: fit, noise, detect, locate, name, model, prove, check, ask."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from discovery.errors import UserError
from discovery.mismatch.ask import NOTHING_CLOSE, aim, believed, look_back, next_experiment
from discovery.mismatch.assess import Assessment
from discovery.mismatch.catalogue import Effect, catalogue
from discovery.mismatch.context import Context, make_context, seen_beside
from discovery.mismatch.deliver import delivered, written
from discovery.mismatch.describe import Curve, Description, curves, describe
from discovery.mismatch.evidence import Score
from discovery.mismatch.forcing import Forcing, free_forcing
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.idle import not_offered
from discovery.mismatch.late import told
from discovery.mismatch.locate import Location, locate
from discovery.mismatch.printed import printed
from discovery.mismatch.prove import Improvement, compare, explained, improvements, size_of
from discovery.mismatch.search import Search, search
from discovery.mismatch.selfcheck import false_alarm, named_again
from discovery.mismatch.verdict import FAULT, NO_MISMATCH, RIVAL, UNEXPLAINED, Verdict, decide
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.threads import one_thread

INVISIBLE = 0.05  # share of a signature that a refit leaves; below it these recordings decide nothing

ANOTHER_NOISE = 0.05  # relative change of a channel's reading noise that calls for another search


@dataclass(frozen=True)
class Diagnosis:
    """Everything a diagnosis found. `document()` is the content of diagnosis.json."""

    context: Context
    search: Search
    before: Assessment  # the baseline as it runs freely best
    after: Assessment  # with what was found, as it runs freely best; the baseline where nothing is named
    verdict: Verdict
    location: Location
    forcings: tuple[Forcing, ...]  # on what the baseline leaves
    fit: Improvement
    held_out: dict[str, Improvement]
    p_value: float
    repaired: Model | None  # the baseline with what was found, fitted; None where nothing is named
    description: Description | None
    curves: tuple[Curve, ...]
    checked: tuple[float | None, ...]  # share of blind repetitions that name each effect again
    question: str
    seconds: float

    @property
    def explained(self) -> float | None:
        """Share of the closable mismatch of the held-out recordings that the repair removes."""
        if self.repaired is None or all(n.hypothesis.recording for n in self.verdict.named):
            return None
        return explained(self.held_out)

    def document(self) -> dict[str, Any]:
        """The content of diagnosis.json, contract section 6."""
        from discovery.mismatch.document import document

        return document(self)


@one_thread
def diagnose(
    model: Model,
    campaign: Campaign,
    fit: Sequence[str],
    held_out: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    effects: Sequence[Effect] = (),
    *,
    physical: bool = True,
    tell: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Find what a model leaves out.

    Args:
        model: the baseline, start values as its author believes them.
        fit: recordings that fits and searches see.
        held_out: recordings for the proof at the end, touched by nothing before.
        outputs: measured channels; default all that model and campaign share.
        effects: entries beside the catalogue's, or replacing those of the same word.
        physical: the start values of the model are an engineer's beliefs (not those of a builder).
        tell: told what begins.

    Raises:
        UserError: a model that does not run, or recordings without readings.
    """
    began = clock.perf_counter()
    shared = [n for n in {**model.outputs, **model.states} if n in campaign.channels]
    outputs = tuple(dict.fromkeys(outputs or shared))
    outputs = tuple(n for n in outputs if n in model.outputs or n in model.states)
    if not outputs:
        raise UserError(f"model '{model.name}' predicts no measured channel; name one under [outputs]")
    if what := campaign.unread(fit, outputs):
        raise UserError(what)
    own = {e.word for e in effects}
    entries = [*(e for e in catalogue().values() if e.word not in own), *effects]
    seen = replace(campaign, recordings={r: campaign.recordings[r] for r in fit})  # nothing else can leak in
    tell("fitting the baseline and its noise")
    context = make_context(seen, model, fit, outputs, entries, physical)
    tell("scoring the catalogue")
    found = search(context, tell=lambda what: tell(f"found so far: {what}"))
    beside = seen_beside(context, found.best.fit)
    change = np.log(np.array(beside.settings[0].white) / np.array(context.settings[0].white))
    if found.best.hypotheses and np.max(np.abs(change)) > ANOTHER_NOISE:
        tell("once more, with the reading noise as it stands beside the answer")
        context, found = beside, search(beside, tell=lambda what: tell(f"found so far: {what}"), begun=found)
    tell("locating")
    before = free_forcing(context, found.baseline)
    after = free_forcing(context, found.best) if found.best is not found.baseline else before
    tell("fitting what was found for free runs")
    old = delivered(context, found.baseline)
    new = delivered(context, found.best) if found.best.hypotheses else old
    verdict = decide(context, found, before, after, new)
    new = new if verdict.named else old
    verdict = replace(verdict, reasons=(*verdict.reasons, *not_offered(context, effects)))
    location = locate(context, found.baseline, found.best, verdict.named, before)
    noise = found.best.best_view.noise
    repaired = written(new) if verdict.named else None
    tell("proving on held-out recordings")
    read = [r for r in held_out if not campaign.unread([r], outputs)]
    proof = improvements(campaign, read, outputs, old.fit.model, new.fit.model, noise)
    if lost := ", ".join(r for r in read if r not in proof):
        reason = f"the model itself runs away on unseen recording {lost}: nothing can be proved there"
        verdict = replace(verdict, reasons=(*verdict.reasons, reason))
    verdict = replace(verdict, reasons=(*verdict.reasons, *told(found.best.fit)))
    tell("asking for the next experiment")
    question = _question(context, found, verdict)
    levels = [v.level for v in found.baseline.views]
    top = found.looks[0][0].gain if found.looks[0] else 0.0
    unexplained = verdict.word == UNEXPLAINED and bool(before)
    return Diagnosis(
        context=context,
        search=found,
        before=old,
        after=new,
        verdict=verdict,
        location=location,
        forcings=tuple(before),
        fit=_on_fit(old, new, size_of(campaign, new.best_view.noise)),
        held_out=proof,
        p_value=false_alarm(found.board, int(np.argmax(levels)), top),
        repaired=repaired,
        description=describe(context, found.baseline, before[0]) if unexplained else None,
        curves=tuple(curves(found.baseline, before[0])) if before and verdict.word != NO_MISMATCH else (),
        checked=tuple(named_again(found, n.hypothesis) for n in verdict.named),
        question=question,
        seconds=clock.perf_counter() - began,
    )


def _question(context: Context, found: Search, verdict: Verdict) -> str:
    """What to do next."""
    if verdict.word == NO_MISMATCH:
        return _smallest(found)
    if verdict.word == FAULT:
        return (
            "check the device and repeat the recording; a fault of the measuring chain needs no new physics"
        )
    shown = verdict.named or verdict.candidates
    if not shown:
        return NOTHING_CLOSE
    rivals = [
        r.hypothesis
        for n in shown
        for r in n.rivals
        if r.below <= RIVAL and not (r.hypothesis.recording and n.hypothesis.recording)
    ]  # no pattern tells two events of the past apart
    rival = _rival_model(found, rivals[0]) if rivals else None
    claims = [n.hypothesis for n in shown]
    if rival is None and all(h.recording for h in claims):
        return look_back(context, claims)
    purpose = aim(claims, rivals[0] if rival else None, bool(verdict.named))
    noise, answer = found.best.best_view.noise, found.best.fit.model
    return next_experiment(context, answer, rival or _without(found.best), noise, purpose, believed(context))


def _on_fit(before: Assessment, after: Assessment, one: float) -> Improvement:
    parts = [
        compare(old, new, after.best_view.noise, one)
        for old, new in zip(before.fit.trajectories, after.fit.trajectories, strict=True)
    ]

    def together(values: Sequence[float]) -> float:
        return float(np.sqrt(np.mean(np.square(values))))

    return Improvement(
        together([p.before for p in parts]),
        together([p.after for p in parts]),
        together([p.floor for p in parts]),
        min(p.low for p in parts),
        max(p.high for p in parts),
    )


def _without(best: Assessment) -> Model:
    """The model with its effects switched off and everything else as it is with them."""
    return best.fit.model.with_values({name: 0.0 for h in best.hypotheses for name in h.amplitudes})


def _rival_model(found: Search, rival: Hypothesis) -> Model | None:
    for attempt in found.tried:
        as_many = len(attempt.hypotheses) == len(found.best.hypotheses)
        if as_many and any(h.key == rival.key for h in attempt.hypotheses):
            return attempt.fit.model
    return None


def _smallest(found: Search) -> str:
    """What would have been seen: the size at which usual effects reach the threshold, and where."""
    texts = []
    for word in (
        "fluid_convection",
        "friction_speed",
        "evaporation_drying",
        "flooded_gap",
        "second_thermal_mass",
    ):
        claims = [c for c in found.looks[0] if c.hypothesis.effect.word == word]
        seen = [c for c in claims if _size_is_told(c)]
        if not seen:
            continue
        size, c = max(((4.5 * abs(c.size[0] / c.t), c) for c in seen), key=lambda item: item[0])
        h = c.hypothesis
        speed = f" at {h.effect.at}" if h.effect.at else ""
        places = list(dict.fromkeys(" and ".join(c.hypothesis.places) for c in seen))
        everywhere = len(seen) == len(claims) and len(places) > 1 and h.effect.place in _ANYWHERE
        where = _ANYWHERE[h.effect.place] if everywhere else f"at {'; '.join(places)}"
        unit = h.units.get(h.amplitudes[0], "")
        texts.append(f"{word} of {printed(size, 2)} {unit}{speed} {where}")
    return (
        "these recordings would have shown " + ", ".join(texts)
        if texts
        else "nothing is missing that these recordings could show"
    )


def _size_is_told(claim: Score) -> bool:
    h = claim.hypothesis
    is_size = h.effect.amplitude.fixed is None and h.recording is None
    return is_size and claim.t != 0 and claim.share > INVISIBLE


_ANYWHERE = {
    "body": "at any body",
    "fluid-free body": "at any body without fluid",
    "driven body": "at any driven body",
    "any pair": "between any two bodies",
}
