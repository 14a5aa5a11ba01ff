"""The diagnosis from start to end: fit, noise, detect, locate, name, model, prove, check, ask."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from discovery.errors import UserError
from discovery.mismatch.ask import ask
from discovery.mismatch.assess import Assessment
from discovery.mismatch.catalogue import Effect, catalogue
from discovery.mismatch.context import Context, make_context, seen_beside
from discovery.mismatch.deliver import delivered, written
from discovery.mismatch.describe import Curve, Description, curves, describe
from discovery.mismatch.forcing import Forcing, free_forcing
from discovery.mismatch.idle import not_offered
from discovery.mismatch.late import told
from discovery.mismatch.locate import Location, locate
from discovery.mismatch.prove import Improvement, explained, improvements, on_fit, size_of
from discovery.mismatch.search import Search, search
from discovery.mismatch.selfcheck import false_alarm, named_again
from discovery.mismatch.verdict import NO_MISMATCH, UNEXPLAINED, Verdict, decide
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.threads import one_thread

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
    question = ask(context, found, verdict)
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
        fit=on_fit(old, new, size_of(campaign, new.best_view.noise)),
        held_out=proof,
        p_value=false_alarm(found.board, int(np.argmax(levels)), top),
        repaired=repaired,
        description=describe(context, found.baseline, before[0]) if unexplained else None,
        curves=tuple(curves(found.baseline, before[0])) if before and verdict.word != NO_MISMATCH else (),
        checked=tuple(named_again(found, n.hypothesis) for n in verdict.named),
        question=question,
        seconds=clock.perf_counter() - began,
    )
