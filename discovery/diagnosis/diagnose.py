"""A diagnosis from start to end: fit, noise, search, posterior, verdict, proof, location, next experiment."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from discovery.diagnosis import thresholds
from discovery.diagnosis.centred import centred
from discovery.diagnosis.coarse_bodies import judging, sentences, with_coarse_bodies, with_slow_outputs
from discovery.diagnosis.context import Context, make_context, with_noise_of
from discovery.diagnosis.description import Curve, Description, curves, describe
from discovery.diagnosis.location import Location, locate
from discovery.diagnosis.own import Searched, searched
from discovery.diagnosis.posterior import FAR, IN_PLAY, Posterior, posterior
from discovery.diagnosis.proof import Improvement, explained, unit_of
from discovery.diagnosis.repair import repaired, with_repair
from discovery.diagnosis.response import Response, responses
from discovery.diagnosis.scan import in_play
from discovery.diagnosis.scored import Scored, is_usual, with_unknown
from discovery.diagnosis.selection import Search
from discovery.diagnosis.trial import Trial
from discovery.diagnosis.unknown_law import instead
from discovery.diagnosis.verdict import FAULT, NO_MISMATCH, UNEXPLAINED, Verdict, decide
from discovery.diagnosis.withdrawal import (
    idle,
    not_of_a_logger,
    refuted,
    small,
    unfinished,
    unforeseen,
    without_the_least,
    wrong_readings,
)
from discovery.diagnosis.written import written
from discovery.dynamics import gaps
from discovery.effects.catalogue import catalogue
from discovery.effects.form import Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.not_offered import not_offered
from discovery.errors import UserError
from discovery.evidence import late, noisy
from discovery.evidence.hung import Hung, without_hung
from discovery.evidence.latent_force import Force, latent_forces
from discovery.evidence.outliers import without_wrong
from discovery.fitting import Fit, fit_model
from discovery.models import Model
from discovery.models.units import differences
from discovery.printed import printed
from discovery.recordings import Campaign
from discovery.threads import one_thread

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

    from discovery.diagnosis.form import DiagnosisDocument

ANOTHER_NOISE = 0.05  # relative change of a channel's reading noise that calls for another search


@dataclass(frozen=True)
class Diagnosis:
    """Everything a diagnosis found. `document()` is the content of diagnosis.json."""

    context: Context
    search: Search
    posterior: Posterior
    verdict: Verdict
    alone: Scored  # the answer with what is named and nothing else
    before: Fit  # the model as the user gave it, fitted as any model of an experiment
    after: Fit | None  # with what was named; None where nothing is
    location: Location
    forces: tuple[Force, ...]  # on what the baseline leaves
    fit: Improvement  # free runs of the recordings to fit
    held_out: dict[str, Improvement]
    contradicted_by: tuple[str, ...]  # held-out recordings where the names make it worse
    description: Description | None
    responses: tuple[Response, ...]
    curves: tuple[Curve, ...]
    question: str
    seconds: float
    own: tuple[Searched, ...] = ()  # effects of the experiment file
    hung: tuple[Hung, ...] = ()  # sensors that hung, in any recording

    @property
    def repaired(self) -> Model | None:
        """The model with the named effects, fitted and in plain form; None if nothing is named."""
        return written(self.after.model, [n.hypothesis for n in self.verdict.named]) if self.after else None

    @property
    def explained(self) -> float | None:
        """Share of the closable mismatch of the held-out recordings that the repair removes."""
        if self.after is None or all(n.hypothesis.effect.is_event for n in self.verdict.named):
            return None
        return explained(self.held_out)

    @cached_property
    def _centred(self) -> tuple[Scored, ...]:
        """The model with the named effects alone, and next to those that are not sure."""
        both = {one.keys: one for one in (self.alone, self.verdict.answer)}
        return tuple(centred(self.context, one) for one in both.values())

    def interval(self, h: Hypothesis, name: str) -> tuple[float | None, float | None]:
        """95 % interval of a parameter of a named effect.

        It covers the interval under the noise of the diagnosis, and that next to effects which are not sure,
        around their values and around that of the repaired model: they may differ. Each is wider than in its
        fit, because the form of the law may be slightly wrong.
        """
        assert self.after is not None
        p = self.after.model.parameters[name]
        wider = thresholds.FORM * abs(p.value) if h.effect.is_physics and name in h.amplitudes else 0.0
        own = [ends for one in self._centred if (ends := one.interval(name))]
        halves = [(high - low) / 2 for low, high in own]
        around = [(p.value - half, p.value + half) for half in halves]
        known: list[tuple[float | None, float | None]] = [*own, *around] or [(p.low, p.high)]
        # one that lies on one side of the value does not widen the other
        lows = [p.value - np.hypot(max(p.value - s[0], 0.0), wider) for s in known if s[0] is not None]
        highs = [p.value + np.hypot(max(s[1] - p.value, 0.0), wider) for s in known if s[1] is not None]
        low, high = min(lows, default=None), max(highs, default=None)
        return None if low is None else max(low, p.min), None if high is None else min(high, p.max)

    def document(self) -> DiagnosisDocument:
        """Return the content of diagnosis.json; `docs/mismatch.md` describes its keys."""
        from discovery.diagnosis.document import document

        return document(self)

    def summary(self) -> str:
        """Return what the command prints: verdict, effects with sizes, rivals, proof, next experiment."""
        from discovery.diagnosis.summary import lines_of

        return "\n".join(lines_of(self.document().model_dump()))

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each parameter of each named effect, with its 95 % interval."""
        from discovery.diagnosis.shown import to_frame

        return to_frame(self.document())

    def plot(self) -> Figure:
        """Plot the rms of free runs before and after the repair, for fitted and held-out recordings."""
        from discovery.diagnosis.shown import plot

        return plot(self.document())

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        table = self.to_frame().to_html(index=False, float_format="{:.4g}".format)
        return f"<pre>{escape(self.summary())}</pre>{table}"


@one_thread
def diagnose(
    model: Model,
    campaign: Campaign,
    fit: Sequence[str],
    held_out: Sequence[str] = (),
    outputs: Sequence[str] | None = None,
    effects: Sequence[Effect] = (),
    *,
    fitted: Fit | None = None,
    tell: Callable[[str], None] = lambda _: None,
) -> Diagnosis:
    """Find the physics that a model leaves out; `docs/mismatch.md` describes the method.

    Args:
        model: the model to diagnose; its start values are believed, `guessed` ones hardly.
        fit: recordings for fits and searches.
        held_out: recordings for the proof; nothing else uses them.
        outputs: measured channels; default all that model and campaign share.
        effects: further effects; one with the same word replaces that of the catalogue.
        fitted: the fit of the model, if there is one already.
        tell: is called with a few words when a step begins.

    Returns:
        Verdict, named effects, rivals, location and proof.

    Raises:
        UserError: the model predicts no measured channel or does not run, or the recordings have no readings.
    """
    from discovery.design.question import ask  # it asks about what is found here

    began = clock.perf_counter()
    shared = [n for n in {**model.outputs, **model.states} if n in campaign.channels]
    outputs = tuple(dict.fromkeys(outputs or shared))
    outputs = tuple(n for n in outputs if n in model.outputs or n in model.states)
    if not outputs:
        raise UserError(f"model '{model.name}' predicts no measured channel; name one under [outputs]")
    if what := campaign.unread_to_fit(fit, outputs):
        raise UserError(what)
    campaign, hung = without_hung(campaign, outputs)
    own = {e.word for e in effects}
    entries = [*(e for e in catalogue().values() if e.word not in own), *effects]
    seen = replace(campaign, recordings={r: campaign.recordings[r] for r in fit})  # nothing else can leak in
    tell("fitting the baseline and its noise")
    before = fitted if fitted and not any(h.recording in fit for h in hung) else None
    before = before or fit_model(model, seen, fit, outputs, minima=True)
    after_each = _after(campaign, fit)
    context = make_context(seen, model, fit, outputs, entries, after_each, before)
    if wrong := context.outliers:  # no fit may follow them
        campaign, seen = without_wrong(campaign, wrong), without_wrong(seen, wrong)
        before = fit_model(model, seen, fit, outputs, minima=True)
        context = make_context(seen, model, fit, outputs, entries, after_each, before)
        context = replace(context, outliers=(*wrong, *context.outliers))
    tell("scoring the catalogue")
    found = Search(context, lambda what: tell(f"found so far: {what}"))
    found = _with_coarse_bodies(found.begun()).grow()
    for _ in range(2):  # each answer is questioned under the noise that it leaves
        found = _under_own_noise(found, tell)
        found.run()
    context = found.context
    found.finish_near(FAR)
    tell("weighing the answers")
    chances = posterior(context, [*found.tried.values(), *_unknown(context, found)])
    tell("proving in free runs")
    # as if there were little process noise: where it is larger than usual, it has absorbed what is missing
    forces = latent_forces(found.baseline.seen, in_play(context, found.baseline)[-1], context.floor)
    free_heat = forces[0].gain if forces and not chances.best.forced else inf  # else it explains most of all
    verdict = small(found, decide(context, found, chances), free_heat)
    decided = verdict
    read = [r for r in held_out if not campaign.unread([r], outputs)]
    every, unit = list(range(len(outputs))), unit_of(campaign, outputs)
    while True:
        verdict, alone, after = with_repair(context, found, verdict, model, seen)
        known = (alone if after else found.baseline).known()
        trial = Trial(campaign, context, read, before, verdict.answer.noise, known)
        judges = judging(context, verdict.answer, [n.hypothesis for n in verdict.named])
        shown = trial.runs(after or before, every)
        judged = shown if judges == every else trial.runs(after or before, judges)
        fewer = without_the_least(found, verdict, judged.held_out)
        if fewer is verdict:
            break
        verdict = fewer

    def whole() -> Improvement | None:
        """How well the repaired model with every effect of the answer follows the fitted recordings."""
        answer, some = verdict.answer, len(verdict.answer.hypotheses) > len(verdict.named)
        fit_of_all = repaired(context, answer, answer.hypotheses, model, seen) if some else None
        return trial.fitted(fit_of_all, judges) if fit_of_all else None

    verdict = idle(found, verdict, judged.each, withdrawn=len(verdict.named) < len(decided.named))
    verdict = refuted(unfinished(verdict, judged.fit, unit, whole), judged.held_out, judged.fit)
    verdict = unforeseen(verdict, judged.held_out, unit)
    if not verdict.named:
        after = None
    in_fit = [h for h in hung if h.recording in fit]
    verdict = not_of_a_logger(verdict, late.beyond(found.baseline.fit))
    verdict = wrong_readings(verdict, len(context.outliers), len(in_fit))
    law = instead(context, verdict.answer) if verdict.word == UNEXPLAINED else None
    mine = tuple(searched(found, verdict, effects))
    further = [law] if law else []
    further += [_stood_still(h, campaign) for h in hung]
    stands_on = verdict.answer if verdict.named else found.baseline
    further += _reasons(context, verdict, stands_on, read, shown.held_out, effects, mine)
    verdict = replace(verdict, reasons=tuple(dict.fromkeys((*verdict.reasons, *further))))
    tell("locating")
    # what changes an output only has no curve of heat
    heats = [] if chances.best.forced and not chances.best.forced_state else forces
    unexplained = verdict.word == UNEXPLAINED and bool(heats)
    return Diagnosis(
        context=context,
        search=found,
        posterior=chances,
        verdict=verdict,
        alone=alone,
        before=before,
        after=after,
        location=locate(context, found.baseline, verdict, chances, heats),
        forces=tuple(forces),
        fit=shown.fit,
        held_out=shown.held_out,
        contradicted_by=tuple(run for run, i in judged.held_out.items() if i.contradicts and verdict.named),
        description=describe(context, found.baseline, heats[0]) if unexplained and not law else None,
        responses=tuple(responses(context)) if verdict.word == UNEXPLAINED else (),
        curves=tuple(curves(found.baseline, heats[0])) if heats and verdict.word != NO_MISMATCH else (),
        question=ask(context, found, verdict),
        seconds=clock.perf_counter() - began,
        own=mine,
        hung=hung,
    )


def _with_coarse_bodies(found: Search) -> Search:
    """The search with bodies that may be off by more than the others, where its best model shows some: they
    hide nothing as long as both this and the model without effects are off by no more than usual.
    """
    if all(is_usual(one.setting) for one in (found.baseline, found.best)):
        return found
    other = with_coarse_bodies(found.context, found.best)
    return found if other is found.context else found.under(other)


def _under_own_noise(found: Search, tell: Callable[[str], None]) -> Search:
    """The search under the reading noise that the best model leaves, with the form errors of its bodies, and
    with those that it leaves coarse, where they are others.
    """
    found = _with_coarse_bodies(found)
    slower = with_slow_outputs(found.context, found.best)
    found = found if slower is found.context else found.under(slower)
    before = found.context
    other = with_noise_of(before, found.best.fit)
    change = np.log(np.array(other.white.white) / np.array(before.white.white))
    is_other = other.form is not before.form or np.max(np.abs(change)) > ANOTHER_NOISE
    if not found.best.hypotheses or not is_other:
        return found
    tell("repeating with the noise of the answer")
    return found.under(other)


def _after(campaign: Campaign, fit: Sequence[str]) -> dict[str, tuple[str, ...]]:
    """For each recording to fit, the recordings of the campaign from then on: by their dates if all have one,
    else in the order of the campaign.
    """
    origin = {name: recording.origin for name, recording in campaign.recordings.items()}
    names = list(campaign.recordings)
    if all(origin.values()):
        names.sort(key=lambda name: str(origin[name]))
    return {run: tuple(names[names.index(run) :]) for run in fit}


def _unknown(context: Context, found: Search) -> list[Scored]:
    """The baseline and the best answer with something of unknown cause."""
    models = list({one.keys: one for one in (found.baseline, found.best)}.values())
    return with_unknown(context, models, found.best.evidence - IN_PLAY)


def _set_aside(context: Context) -> list[str]:
    """A sentence on single wrong readings, if there are any."""
    if not (wrong := context.outliers):
        return []
    o = max(wrong, key=lambda one: abs(one.size / one.noise))
    unit = differences(context.campaign.channels[o.output].unit)
    what = f"{o.output} is off by {o.size:+.3g} {unit} in '{o.recording}' at {o.time:.0f} s"
    if len(wrong) == 1:
        return [f"a single wrong reading is set aside: {what}"]
    return [f"{len(wrong)} single wrong readings are set aside; the worst: {what}"]


def _stood_still(h: Hung, campaign: Campaign) -> str:
    """A sentence on a sensor that hung."""
    unit = campaign.channels[h.output].unit
    of = "" if unit == "1" else f" {unit}"
    return (
        f"{h.output} hung in '{h.recording}': it stays at {printed(h.value)}{of} for {h.count} readings "
        f"({h.start:.0f} to {h.end:.0f} s) and jumps behind them; all but the first of these are set aside"
    )


def _reasons(
    context: Context,
    verdict: Verdict,
    stands_on: Scored,
    read: Sequence[str],
    proof: dict[str, Improvement],
    effects: Sequence[Effect],
    mine: Sequence[Searched],
) -> list[str]:
    """Notes for the reader about the recordings and the effects of the experiment.

    Args:
        stands_on: the model with what is named, or without anything.
    """
    said = []
    if lost := ", ".join(r for r in read if r not in proof):
        said.append(f"the free run of the model diverges on {lost}, so the repair cannot be tested there")
    if idle_readings := ", ".join(context.unused_readings):
        said.append(
            f"the readings of {idle_readings} take no part: add them to the `outputs` of the experiment"
        )
    if verdict.named or verdict.word != FAULT:  # else they are the answer
        said += _set_aside(context)
    said += sentences(verdict.answer)
    said += not_offered(context.model, context.scene, effects)
    said += [one.sentence() for one in mine if not one.named]
    said += gaps.sentences({run: grid.silent for run, grid in context.grids.items()})
    is_right = verdict.word != UNEXPLAINED and is_usual(stands_on.setting)
    # if it is not, what a fit finds of its inputs may stand for what is missing
    said += late.sentences(stands_on.fit, is_right)
    return said + noisy.sentences(stands_on.fit, stands_on.noise) if is_right else said
