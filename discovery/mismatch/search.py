"""The search: which effects, added to the model one by one and questioned, make the readings most likely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discovery.errors import UserError
from discovery.mismatch.assess import WIDE, Assessment, assess
from discovery.mismatch.context import Context
from discovery.mismatch.events import place_events
from discovery.mismatch.evidence import Board, Score, by_claim, make_board, scores
from discovery.mismatch.gates import bent, matters, objections
from discovery.mismatch.hypotheses import Hypothesis, hypotheses
from discovery.mismatch.lens import Lens

REFITS = 6  # claims that are refitted at each step
SMALL = 0.1  # share of the whole gain below which an objectionable effect is dropped and not the answer
QUESTIONED = 3  # with more effects than this the machine is far from its model, and each one is large
BLUNT = 30.0  # log evidence that the coarseness of a model with few bodies does not reach
TRACE = 0.6  # log evidence of a law's traces, times the root of the whole gain
NAMED = 8.0  # log evidence that a claim has to add to be taken up


@dataclass(frozen=True)
class Look:
    """All claims scored on what an assessment leaves."""

    board: Board
    claims: tuple[Score, ...]


def look(context: Context, current: Assessment) -> Look:
    """Score every effect at every place on what the present model leaves."""
    model = current.fit.problem.model
    found = hypotheses(model, context.campaign.channels, context.outputs, context.recordings, context.effects)
    taken = {h.key for h in current.hypotheses}
    found = [h for h in found if h.key not in taken]
    spread = {a: WIDE * s for h in found for a, s in zip(h.amplitudes, context.spread(h), strict=True)}
    found = place_events(current.lens, current.best_view, found, spread)
    found = [h for h in found if not _start_of_shift(current, h)]
    board = make_board(
        current.lens, current.views, found, np.array([spread[a] for h in found for a in h.amplitudes])
    )
    return Look(board, tuple(by_claim(scores(board))))


def _start_of_shift(current: Assessment, h: Hypothesis) -> bool:
    """Whether an event only fills the start of a recording whose clock is shifted: no input is known
    there.
    """
    for o in current.hypotheses:
        if o.effect.word == "clock_shift" and o.recording == h.recording and o.shapes and h.shapes:
            (name,) = o.shapes
            shift = abs(current.model.parameters[name].values.get(h.recording or "", 0.0))
            return max(h.shapes.values()) <= 1.5 * shift
    return False


@dataclass(frozen=True)
class Search:
    """The course of a search: the fit without any effect, the best model found, and everything tried."""

    baseline: Assessment
    best: Assessment
    tried: tuple[Assessment, ...]  # without their views
    board: Board  # signatures of all claims on what the baseline leaves
    looks: tuple[
        tuple[Score, ...], ...
    ]  # claims on each model taken up, the last on what the best one leaves

    @property
    def gain(self) -> float:
        """Log evidence of the best model over the baseline."""
        return self.best.evidence - self.baseline.evidence


def search(context: Context, most: int = 6, tell: Callable[[str], None] = lambda _: None) -> Search:
    """Add effects one by one while each adds evidence, then question each one taken up."""
    current = assess(context, (), context.settings[0])
    current = assess(context, (), current.best_view.noise, current)
    whole = look(context, current)
    baseline, tried, looks = current, [], [whole.claims]
    for _ in range(most):
        first = looks[-1][0].gain if looks[-1] else 0.0
        pool = [c for c in looks[-1][:REFITS] if c.gain > max(2.0, 0.2 * first)]
        attempts = [a for c in pool if (a := _try(context, current, current.hypotheses, c)) is not None]
        if not attempts:
            break
        step = _step(context, attempts, current.evidence)
        tried += [_light(a) for a in attempts if matters(context, a, a.hypotheses[-1])]
        if step.evidence - current.evidence < NAMED or not matters(context, step, step.hypotheses[-1]):
            break
        tell(f"{step.hypotheses[-1].effect.title} at {', '.join(step.hypotheses[-1].places)}")
        current = step
        looks.append(look(context, current).claims)
        if recurs(current.hypotheses):
            break
    if 1 < len(current.hypotheses) <= QUESTIONED and not recurs(current.hypotheses):
        current, more = _question(context, current)
        tried += more
        looks.append(look(context, current).claims)
    current, more = _prune(context, baseline, current)
    if current.hypotheses:  # sizes under the noise that stands beside the answer, not beside the one before
        current = assess(context, current.hypotheses, current.best_view.noise, current)
    if more:
        tried += more
        looks.append(look(context, current).claims)
    return Search(baseline, current, tuple(_light(a) for a in tried), whole.board, tuple(looks))


def _prune(
    context: Context, baseline: Assessment, current: Assessment
) -> tuple[Assessment, list[Assessment]]:
    """Drop what is not needed: effects that the others have made idle, small ones that a gate objects to, and
    the traces that a law slightly off in form leaves; these grow with the effect that leaves them.
    """
    tried: list[Assessment] = []
    while len(current.hypotheses) > 1:
        shorter = []
        for h in current.hypotheses:
            others = tuple(o for o in current.hypotheses if o.key != h.key)
            without = _try(context, current, others, None)
            if without is None:
                continue
            tried.append(without)
            lost = current.evidence - without.evidence
            gain = current.evidence - baseline.evidence
            # heat that comes again and again is a sign of its own: the verdict needs to see it
            trace = 0.0 if recurs(current.hypotheses) else TRACE * float(np.sqrt(max(gain, 0.0)))
            if lost < NAMED + trace or (lost < SMALL * gain and objections(current, h, gain)):
                shorter.append((lost, without))
        if not shorter:
            break
        current = min(shorter, key=lambda item: item[0])[1]
    return current, tried


def _step(context: Context, attempts: Sequence[Assessment], before: float) -> Assessment:
    """The attempt to go on with: the best of those that pass, unless the very best adds far more.

    An attempt passes when its law is not bent to its limit, its size matters and it acts in every
    recording. One that does not pass gives way to another that adds half as much, and, where it is a minor
    size that wins, far
    more than a coarse model would show.
    """

    def passes(a: Assessment) -> bool:
        h = a.hypotheses[-1]
        return matters(context, a, h) and bent(a, h) is None and h.recording is None

    best = max(attempts, key=lambda a: a.evidence)
    minor = not matters(context, best, best.hypotheses[-1])
    other = max((a for a in attempts if passes(a)), key=lambda a: a.evidence, default=best)
    enough = max(BLUNT if minor else NAMED, 0.5 * (best.evidence - before))
    return other if other.evidence - before > enough else best


def _light(attempt: Assessment) -> Assessment:
    """An attempt without what takes memory and is not asked for again: its views and sensitivities."""
    return replace(attempt, views=(), lens=Lens(attempt.fit))


def recurs(chosen: Sequence[Hypothesis]) -> bool:
    """Whether heat without a record was taken up twice: then it is no event, and looking for a third one is
    idle.
    """
    return sum(h.effect.word == "unmeasured_heat" for h in chosen) > 1


def _try(
    context: Context, current: Assessment, others: tuple[Hypothesis, ...], claim: Score | None
) -> Assessment | None:
    """Refit with a claim beside others, from the sizes that the linear look gives."""
    chosen = (*others, claim.hypothesis) if claim else others
    sizes = dict(zip(claim.hypothesis.amplitudes, claim.size, strict=True)) if claim else {}
    if claim and claim.hypothesis.effect.amplitude.fixed is not None:
        sizes = {}
    try:
        return assess(context, chosen, current.best_view.noise, current, sizes)
    except UserError:  # a combination under which the model runs away is no explanation
        return None


def _question(context: Context, current: Assessment) -> tuple[Assessment, list[Assessment]]:
    """Take each effect out, see what would stand in its place, and drop what is not needed."""
    tried: list[Assessment] = []
    for h in current.hypotheses:
        others = tuple(o for o in current.hypotheses if o.key != h.key)
        if len(others) == len(current.hypotheses) or h.key not in {o.key for o in current.hypotheses}:
            continue
        without = _try(context, current, others, None)
        if without is None:
            continue
        tried.append(without)
        pool = [
            c
            for c in look(context, without).claims[: REFITS // 2]
            if c.hypothesis.key != h.key and c.gain > 2.0
        ]
        attempts = [a for c in pool if (a := _try(context, without, others, c)) is not None]
        attempts = [a for a in attempts if all(matters(context, a, o) for o in a.hypotheses)]
        tried += attempts
        best = max([*attempts, current], key=lambda a: a.evidence)
        current = best if best.evidence > without.evidence + NAMED else without
    return current, tried
