"""The search: which effects, added to the model one by one and questioned, make the readings most likely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from discovery.mismatch.assess import Assessment, assess
from discovery.mismatch.context import Context
from discovery.mismatch.evidence import Board, Score
from discovery.mismatch.gates import bent, matters, of_a_link, unseen_lag
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.lens import Lens
from discovery.mismatch.look import again, attempt, look, sharpened
from discovery.mismatch.question import (
    BLUNT,
    EVENTS,
    NAMED,
    SMALL,
    echoes,
    prune,
    question,
    recurs,
    supported,
    trace,
)

MOST = 6  # effects at once
REFITS = 6  # claims that are refitted at each step
QUESTIONED = 3  # with more effects than this the machine is far from its model, and each one is large
FAR_BELOW = 12.0  # log evidence below the best from which an attempt is no rival under another noise either


@dataclass(frozen=True)
class Search:
    """The course of a search: the fit without any effect, the best model found, and everything tried."""

    baseline: Assessment
    best: Assessment
    tried: tuple[Assessment, ...]  # without their views
    board: Board  # signatures of all claims on what the baseline leaves
    looks: tuple[tuple[Score, ...], ...]  # claims on each model taken up, last on what the best one leaves
    dropped: tuple[Hypothesis, ...] = ()  # what helped to fit and did not carry over

    @property
    def gain(self) -> float:
        """Log evidence of the best model over the baseline."""
        return self.best.evidence - self.baseline.evidence


def search(
    context: Context,
    most: int = MOST,
    tell: Callable[[str], None] = lambda _: None,
    begun: Search | None = None,
) -> Search:
    """Add effects one by one while each adds evidence, drop what the others have made idle, question each one
    that is left; where that changed something, see whether more can be added now. Where an effect did not
    carry over nothing is added any more: it would be the same one, or one that looks like it.

    Args:
        most: effects at once.
        tell: told what is taken up.
        begun: a search under another noise to go on from: what it found is judged anew.
    """
    current = assess(context, (), context.settings[0])
    current = assess(context, (), current.best_view.noise, current)
    whole = look(context, current)
    baseline, looks = current, [whole.claims]
    tried: list[Assessment] = []
    dropped: list[Hypothesis] = []
    stood = _keys(begun.best) if begun else set()
    if begun:
        noise, near = current.best_view.noise, begun.best.evidence - FAR_BELOW
        chosen = (*begun.best.hypotheses, *begun.dropped)
        current = again(context, begun.best, chosen, noise) or current
        known = [again(context, a, a.hypotheses, noise) for a in begun.tried if a.evidence > near]
        tried = [_light(a) for a in known if a]
        looks.append(look(context, current).claims)
    for freely in (True, False):
        before = _keys(current)
        current, more, claims = _grow(context, baseline, current, looks[-1], most, freely, tell)
        tried, looks = tried + more, looks + claims
        grown = _keys(current)
        if grown == before and not (begun and freely):
            break
        current, more = prune(context, baseline, current)
        tried += more
        questioned = grown != before and 1 < len(current.hypotheses) <= QUESTIONED
        if questioned and not recurs(context, current.hypotheses):
            stands = _keys(current)
            current, more = question(context, current, tried)
            tried += more
            if _keys(current) != stands:  # what came in another's place has to be needed, too
                current, more = prune(context, baseline, current)
                tried += more
        if _keys(current) != stood:  # what carried over once carries over again
            current, more, dropped = supported(context, current, tried)
            tried, stood = tried + more, _keys(current)
        # sizes under the noise that stands beside the answer, not beside the one before
        current = assess(context, current.hypotheses, current.best_view.noise, current)
        looks.append(look(context, current).claims)
        if _keys(current) == grown or dropped:
            break
    current, more, claims = _without_echoes(context, baseline, current, looks[-1])
    tried, looks = tried + more, looks + claims
    light = tuple(_light(a) for a in tried)
    return Search(baseline, current, light, whole.board, tuple(looks), tuple(dropped))


def _keys(answer: Assessment) -> set[object]:
    return {h.key for h in answer.hypotheses}


def _grow(
    context: Context,
    baseline: Assessment,
    current: Assessment,
    claims: tuple[Score, ...],
    most: int,
    freely: bool,
    tell: Callable[[str], None],
) -> tuple[Assessment, list[Assessment], list[tuple[Score, ...]]]:
    """Add effects while each adds evidence: freely at first, for the right ones may only stand out beside
    others; later no more than would stand.

    Returns:
        The last model, everything tried, the claims on each model taken up.
    """
    tried: list[Assessment] = []
    looks: list[tuple[Score, ...]] = []
    while len(current.hypotheses) < most and not recurs(context, current.hypotheses):
        first = claims[0].gain if claims else 0.0
        pool = [c for c in claims[:REFITS] if c.gain > max(2.0, 0.2 * first)]
        attempts = [
            a
            for c in pool
            if (a := attempt(context, current, current.hypotheses, c.hypothesis, c.size)) is not None
        ]
        if not attempts:
            break
        step = _step(context, attempts, current.evidence)
        tried += [_light(a) for a in attempts if matters(context, a, a.hypotheses[-1])]
        bar = NAMED if freely else NAMED + trace(current.evidence - baseline.evidence)
        if bent(step, step.hypotheses[-1]):
            bar = max(bar, BLUNT)  # what is left has another law, and there is not much of it
        if not matters(context, step, step.hypotheses[-1]):
            bar = max(bar, BLUNT)  # small for its kind, but no coarse model shows it so clearly
        if of_a_link(context, step, step.hypotheses[-1]):
            bar = max(bar, BLUNT)  # nor this
        if step.evidence - current.evidence < bar:
            break
        tell(f"{step.hypotheses[-1].effect.title} at {step.hypotheses[-1].where}")
        if step.hypotheses[-1].effect.word in EVENTS and step.hypotheses[-1].recording:
            step = sharpened(context, step, step.hypotheses[-1])
        current = step
        claims = look(context, current).claims
        looks.append(claims)
    return current, tried, looks


def _without_echoes(
    context: Context, baseline: Assessment, current: Assessment, claims: tuple[Score, ...]
) -> tuple[Assessment, list[Assessment], list[tuple[Score, ...]]]:
    """Drop small heat for some hours that shows in another recording, too: a law slightly off in form leaves
    it, and it must not hide the law's name. The last of `looks` is on what is left.
    """
    tried: list[Assessment] = []
    looks: list[tuple[Score, ...]] = []
    for h in [h for h in current.hypotheses if echoes(h, claims)]:
        rest = attempt(context, current, tuple(o for o in current.hypotheses if o is not h))
        if rest and current.evidence - rest.evidence < SMALL * (current.evidence - baseline.evidence):
            current = rest
            tried.append(rest)
            looks.append(look(context, current).claims)
    return current, tried, looks


def _step(context: Context, attempts: Sequence[Assessment], before: float) -> Assessment:
    """The attempt to go on with: the best of those that pass, unless the very best adds far more.

    An attempt passes when its law is not bent to its limit, its size matters (a short lag of a sensor: adds
    more than a coarse model would show) and it acts in every recording. One that does not pass gives way to
    another that adds half as much, and, where it is a minor size that wins, far more than a coarse model
    would show.
    """

    def passes(a: Assessment) -> bool:
        h = a.hypotheses[-1]
        clear = unseen_lag(context, h, a) and a.evidence - before > BLUNT
        return (clear or matters(context, a, h)) and bent(a, h) is None and h.recording is None

    best = max(attempts, key=lambda a: a.evidence)
    minor = not matters(context, best, best.hypotheses[-1])
    other = max((a for a in attempts if passes(a)), key=lambda a: a.evidence, default=best)
    enough = max(BLUNT if minor else NAMED, 0.5 * (best.evidence - before))
    return other if other.evidence - before > enough else best


def _light(attempt: Assessment) -> Assessment:
    """An attempt without what takes memory and is not asked for again: its views and sensitivities."""
    return replace(attempt, views=(), lens=Lens(attempt.fit))
