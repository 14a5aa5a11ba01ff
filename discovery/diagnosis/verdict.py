"""The verdict: what may be named, how sure it is, what else it could be, and when to say that nothing is
known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.doubts import FREE, MUCH, doubts
from discovery.mismatch.forcing import Forcing
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.search import Search

RIVAL = 3.0  # log evidence within which a rival stays in the answer
TRUST = 0.6  # evidence ratios are tempered: models are never exact
DOUBT = 0.02  # share of the answer that stays with causes outside the catalogue

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
    if not best.hypotheses:
        return _nothing_found(context, found, before)
    named = tuple(_named(found, h) for h in best.hypotheses)
    named = tuple(sorted(named, key=lambda n: -_weight(found, n.hypothesis)))
    if reasons := doubts(context, found, before, after):
        return Verdict(UNEXPLAINED, (), named, reasons)
    untold = tuple(text for n in named if (text := _may_be_nothing(goes_out, n.hypothesis)))
    if len(untold) == len(named):
        return Verdict(NO_MISMATCH, (), (), (*untold, *_much(best)))
    kinds = {n.hypothesis.effect.is_physics for n in named}
    word = MISSING if True in kinds else FAULT
    return Verdict(word, named, (), (*_dropped(found), *untold, *_much(best)))


def _nothing_found(context: Context, found: Search, before: Sequence[Forcing]) -> Verdict:
    """The verdict where the search has taken up nothing."""
    if before and before[0].gain > FREE and not _coarse(context, found, before[0].gain):
        reason = f"heat of unknown cause acts at {before[0].state}; no effect of the catalogue follows it"
        return Verdict(UNEXPLAINED, (), (), (reason,))
    if context.outliers:
        return Verdict(FAULT, (), (), (f"single wrong readings ({len(context.outliers)}), nothing else",))
    nothing = "no effect of the catalogue and no free heat adds evidence"
    return Verdict(NO_MISMATCH, (), (), (*(_dropped(found) or (nothing,)), *_much(found.best)))


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


def _coarse(context: Context, found: Search, free: float) -> bool:
    """Whether an effect too small to matter explains what free heat does."""
    claims = found.looks[0]
    if not claims:
        return False
    top = claims[0]
    return abs(top.size[0]) < context.minor(top.hypothesis)[0] and top.gain > 0.5 * free


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
