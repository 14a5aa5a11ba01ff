"""The verdict: what may be named, how sure it is, what else it could be, and when to say that nothing is
known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.forcing import Forcing
from discovery.mismatch.gates import bent, objections, unseen_lag
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.question import BLUNT, NAMED, SMALL, echoes, recurs, trace
from discovery.mismatch.search import MOST, Search

Array = NDArray[np.float64]

FREE = 9.0  # log evidence of free heat beyond which something acts, named or not
RIVAL = 3.0  # log evidence within which a rival stays in the answer
TRUST = 0.6  # evidence ratios are tempered: models are never exact
DOUBT = 0.02  # share of the answer that stays with causes outside the catalogue

MUCH = 3.0  # times the reading noise: a machine that leaves so much in no pattern is not well modelled

NO_MISMATCH, MISSING, FAULT, UNEXPLAINED = (
    "no mismatch",
    "missing physics",
    "measurement fault",
    "unexplained",
)


@dataclass(frozen=True)
class Rival:
    """Another answer to one part of the question."""

    hypothesis: Hypothesis
    below: float  # log evidence below the best


@dataclass(frozen=True)
class Named:
    """One effect that the repaired model adds."""

    hypothesis: Hypothesis
    probability: float
    rivals: tuple[Rival, ...]


@dataclass(frozen=True)
class Verdict:
    """The answer and the reasons for it."""

    word: str
    named: tuple[Named, ...]
    candidates: tuple[Named, ...]  # what stood closest where nothing is named
    reasons: tuple[str, ...]


def decide(
    context: Context,
    found: Search,
    before: Sequence[Forcing],
    after: Sequence[Forcing],
    goes_out: Assessment,
) -> Verdict:
    """Name only what passes every gate.

    Args:
        before, after: free forcing on what the baseline and the best model leave.
        goes_out: the best model, fitted for free runs.
    """
    best = found.best
    free_before = before[0].gain if before else -np.inf
    free_after = after[0].gain if after else -np.inf
    if not best.hypotheses:
        if free_before > FREE and not _coarse(context, found, free_before):
            place = before[0].state
            return Verdict(
                UNEXPLAINED,
                (),
                (),
                (f"heat of unknown cause acts at {place}; no effect of the catalogue follows it",),
            )
        if context.outliers:
            return Verdict(FAULT, (), (), (f"single wrong readings ({len(context.outliers)}), nothing else",))
        nothing = "no effect of the catalogue and no free heat adds evidence"
        return Verdict(NO_MISMATCH, (), (), (*(_dropped(found) or (nothing,)), *_much(best)))

    named = tuple(_named(found, h) for h in best.hypotheses)
    named = tuple(sorted(named, key=lambda n: -_weight(found, n.hypothesis)))
    reasons = []
    if recurs(context, best.hypotheses):
        reasons.append("unrecorded events come again and again: a cause, not an event")
    reasons += [
        f"unrecorded heat at {where} shows in another recording, too: a cause, not an event"
        for where in dict.fromkeys(h.where for h in best.hypotheses if echoes(h, found.looks[-1]))
    ]
    heated = any(h.recording and h.effect.word == "unmeasured_heat" for h in best.hypotheses)
    if len(context.recordings) == 1 and heated:
        reasons.append(
            "in the only recording an event cannot be told from what a law slightly off in form leaves; "
            "a second recording to fit would tell"
        )
    late = {h.recording for h in best.hypotheses if h.effect.word == "clock_shift"}
    if late >= set(context.recordings):
        reasons.append(
            "every recording would need its clock shifted: that may as well be a dead time between what "
            "drives the machine and what is read"
        )
    if len(best.hypotheses) >= MOST and best.rms() > MUCH:
        reasons.append(
            f"{len(best.hypotheses)} effects leave {best.rms():.1f} times the reading noise: the model is "
            "too far from this machine to say what is missing"
        )
    if other := _left(context, found):
        reasons.append(f"{other.effect.word} at {other.where} is still significant after the repair")
    if free_after > max(FREE, 0.1 * found.gain):
        reasons.append(f"free heat at {after[0].state} still explains much after the repair")
    if found.gain < 0.5 * free_before:
        reasons.append("free heat explains more than twice what the best effect does")
    reasons += [text for h in best.hypotheses for text in objections(best, h, found.gain)]
    if reasons:
        return Verdict(UNEXPLAINED, (), named, tuple(reasons))
    untold = tuple(text for n in named if (text := _may_be_nothing(goes_out, n.hypothesis)))
    if len(untold) == len(named):
        return Verdict(NO_MISMATCH, (), (), (*untold, *_much(best)))
    kinds = {n.hypothesis.effect.is_physics for n in named}
    word = MISSING if True in kinds else FAULT
    return Verdict(word, named, (), (*_dropped(found), *untold, *_much(best)))


def _may_be_nothing(goes_out: Assessment, h: Hypothesis) -> str | None:
    """A sentence where free runs do not tell the size of a lasting effect from zero."""
    if h.effect.amplitude.fixed is not None or h.recording is not None:
        return None
    sizes = [goes_out.model.parameters[name] for name in h.amplitudes]
    if any(p.low is None or p.high is None or p.low > 0 or p.high < 0 for p in sizes):
        return None
    ranges = ", ".join(f"{p.low:.3g} to {p.high:.3g} {p.unit}" for p in sizes)
    return (
        f"{h.effect.word} at {h.where} helps the fit, but free runs do not tell its size from zero: {ranges}"
    )


def _much(best: Assessment) -> tuple[str, ...]:
    """A sentence where much is left that only everyday heat and slow noise account for."""
    times = best.rms()
    if times < MUCH:
        return ()
    return (
        f"what is left is {times:.1f} times the reading noise, in no pattern: it is taken for everyday heat",
    )


def _dropped(found: Search) -> tuple[str, ...]:
    return tuple(
        f"{h.effect.word} at {h.where} helps the fit and does not carry over to recordings left out of it"
        for h in found.dropped
    )


def _left(context: Context, found: Search) -> Hypothesis | None:
    """What is still significant beside the best model, if anything.

    By the bars of the search: what would be bent to its limit has to add more, and so has what may be the
    trace of a law slightly off in form. Where something was dropped because it did not carry over, the search
    had found nothing more beside it.
    """
    if found.dropped:
        return None
    significant = []
    for c in found.looks[-1]:
        h = c.hypothesis
        usual = context.minor(h)[0] <= abs(c.size[0]) <= h.effect.amplitude.most
        if not usual or unseen_lag(context, h):
            continue
        refit = _beside(found, h)
        more = refit.evidence - found.best.evidence if refit else c.gain
        bar = max(NAMED + trace(found.gain + more), 0.05 * found.gain)
        if refit and any(bent(refit, o) for o in refit.hypotheses if o.key == h.key):
            bar = max(bar, BLUNT, SMALL * found.gain)  # with less it would be dropped, were it in the model
        if abs(c.size[0]) < context.of_a_link(h)[0]:
            bar = max(bar, BLUNT)
        if echoes(h, found.looks[-1]):
            bar = max(bar, SMALL * found.gain)
        if more > bar:
            significant.append((more, h))
    return max(significant, key=lambda item: item[0])[1] if significant else None


def _coarse(context: Context, found: Search, free: float) -> bool:
    """Whether an effect too small to matter explains what free heat does."""
    claims = found.looks[0]
    if not claims:
        return False
    top = claims[0]
    return abs(top.size[0]) < context.minor(top.hypothesis)[0] and top.gain > 0.5 * free


def _beside(found: Search, h: Hypothesis) -> Assessment | None:
    """The best refit of a claim beside the best model, where it was tried."""
    keys = {o.key for o in found.best.hypotheses} | {h.key}
    refits = [a for a in found.tried if {o.key for o in a.hypotheses} == keys]
    return max(refits, key=lambda a: a.evidence, default=None)


def _weight(found: Search, h: Hypothesis) -> float:
    """Evidence that goes with an effect: what the best model without it lacks."""
    without = [
        a.evidence for a in (*found.tried, found.baseline) if h.key not in {o.key for o in a.hypotheses}
    ]
    same = [
        a.evidence
        for a in found.tried
        if {o.key for o in a.hypotheses} == {o.key for o in found.best.hypotheses} - {h.key}
    ]
    return found.best.evidence - max(same or without or [found.baseline.evidence])


def _named(found: Search, h: Hypothesis) -> Named:
    others = {o.key for o in found.best.hypotheses} - {h.key}
    below: dict[object, Rival] = {}
    for attempt in found.tried:
        keys = {o.key for o in attempt.hypotheses}
        if h.key in keys or not others <= keys or len(keys) != len(others) + 1:
            continue
        rival = next(o for o in attempt.hypotheses if o.key not in others)
        gap = found.best.evidence - attempt.evidence
        label = (rival.effect.word, rival.places)
        if gap < 0:  # passed over by a rule of the search, not by evidence: no rival
            continue
        if label != (h.effect.word, h.places) and (label not in below or gap < below[label].below):
            below[label] = Rival(rival, float(gap))
    rivals = tuple(sorted(below.values(), key=lambda r: r.below))
    odds = sum(float(np.exp(-TRUST * r.below)) for r in rivals)
    return Named(h, (1 - DOUBT) / (1 + odds), rivals)
