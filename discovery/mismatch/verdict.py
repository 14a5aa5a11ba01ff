"""The verdict: what may be named, how sure it is, what else it could be, and when to say that nothing is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.mismatch.context import Context
from discovery.mismatch.forcing import Forcing
from discovery.mismatch.hypotheses import Hypothesis
from discovery.mismatch.search import MINOR, Assessment, Search, recurs
from discovery.mismatch.signatures import block_signatures, signatures

Array = NDArray[np.float64]

QUIET = 7.0  # log evidence that nothing left over may add once the answer is in the model
FREE = 6.0  # log evidence of free heat beyond which something acts, named or not
RIVAL = 3.0  # log evidence within which a rival stays in the answer
BLOCKS = 12  # per recording, in which an effect is asked for its size
STEADY = 6.0  # log evidence for a size that changes with time beyond which the form is wrong
TRUST = 0.6  # evidence ratios are tempered: models are never exact
DOUBT = 0.02  # share of the answer that stays with causes outside the catalogue

NO_MISMATCH, MISSING, FAULT, UNEXPLAINED = "no mismatch", "missing physics", "measurement fault", "unexplained"


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


def decide(context: Context, found: Search, before: Sequence[Forcing], after: Sequence[Forcing]) -> Verdict:
    """Name only what passes every gate.

    Args:
        before, after: free forcing on what the baseline and the best model leave.
    """
    best = found.best
    free_before = before[0].gain if before else -np.inf
    free_after = after[0].gain if after else -np.inf
    if not best.hypotheses:
        if free_before > FREE:
            place = before[0].state
            return Verdict(
                UNEXPLAINED, (), (), (f"heat of unknown cause acts at {place}; no effect of the catalogue follows it",)
            )
        if context.outliers:
            return Verdict(FAULT, (), (), (f"{len(context.outliers)} readings are wrong alone, nothing else is",))
        return Verdict(NO_MISMATCH, (), (), ("no effect of the catalogue and no free heat adds evidence",))

    named = tuple(_named(found, h) for h in best.hypotheses)
    named = tuple(sorted(named, key=lambda n: -_weight(found, n.hypothesis)))
    reasons = []
    if recurs(best.hypotheses):
        reasons.append("unrecorded heat comes again and again: a cause, not an event")
    left = [c for c in found.looks[-1].claims if abs(c.size[0]) >= MINOR * context.spread(c.hypothesis)[0]]
    if left and left[0].gain > max(QUIET, 0.05 * found.gain):
        other = left[0].hypothesis
        reasons.append(f"{other.effect.word} at {', '.join(other.places)} is still significant after the repair")
    if free_after > max(FREE, 0.1 * found.gain):
        reasons.append(f"free heat at {after[0].state} still explains much after the repair")
    if found.gain < 0.5 * free_before:
        reasons.append("free heat explains more than twice what the best effect does")
    for h in best.hypotheses:
        reasons += [text for text in (_disagreement(context, best, h), _at_bound(best, h), _unsteady(best, h)) if text]
    if reasons:
        return Verdict(UNEXPLAINED, (), named, tuple(reasons))
    kinds = {n.hypothesis.effect.is_physics for n in named}
    return Verdict(MISSING if True in kinds else FAULT, named, (), ())


def _weight(found: Search, h: Hypothesis) -> float:
    """Evidence that goes with an effect: what the best model without it lacks."""
    without = [a.evidence for a in (*found.tried, found.baseline) if h.key not in {o.key for o in a.hypotheses}]
    same = [a.evidence for a in found.tried if {o.key for o in a.hypotheses} == {o.key for o in found.best.hypotheses} - {h.key}]
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
        if label != (h.effect.word, h.places) and (label not in below or gap < below[label].below):
            below[label] = Rival(rival, float(gap))
    rivals = tuple(sorted(below.values(), key=lambda r: r.below))
    odds = sum(float(np.exp(-TRUST * r.below)) for r in rivals)
    return Named(h, (1 - DOUBT) / (1 + odds), rivals)


def _at_bound(best: Assessment, h: Hypothesis) -> str | None:
    """A sentence when a shape parameter presses against the end of its physical range: another law is at work."""
    for name, shape in zip(h.shapes, h.effect.shapes, strict=True):
        p = best.model.parameters[name]
        value = p.values.get(h.recording or "", p.value)
        if shape.fixed or p.fixed:
            continue
        if value < 1.03 * shape.low or value > 0.97 * shape.high:  # relative: ranges span decades
            return f"{h.effect.word} would need {shape.name} = {value:.3g} {shape.unit}, at the end of what is physical"
    return None


def _unsteady(best: Assessment, h: Hypothesis) -> str | None:
    """A sentence when the size of an effect would have to change from one part of the recordings to the next.

    Each block of time gets an amplitude of its own; their scatter is tested against a constant (log Bayes factor), and
    counts only when it is a large share of the amplitude itself: a law that is slightly off in form may stand.
    """
    if h.effect.amplitude.fixed is not None or h.shown or h.recording is not None:
        return None
    size = best.model.parameters[h.amplitudes[0]].value
    values = {name: best.model.parameters[name].value for name in h.shapes}
    columns = []
    total = BLOCKS * len(best.fit.trajectories)
    for k, t in enumerate(best.fit.trajectories):
        columns.append(block_signatures(t, h.at(values), BLOCKS, k * BLOCKS, total))
    view = best.best_view
    z = view.project(best.lens.whiten(view.noise, columns)[0])
    gram, dot = z.T @ z, z.T @ view.residual
    best_gain, share = 0.0, 0.0
    for spread in (0.2, 0.5, 1.0, 2.0):
        sd = spread * abs(size)
        inner = np.eye(total) + sd * sd * gram
        solved = sd * np.linalg.solve(inner, sd * dot)
        gain = 0.5 * float(dot @ solved) - 0.5 * float(np.linalg.slogdet(inner)[1])
        if gain > best_gain:
            best_gain, share = gain, spread
    if best_gain > STEADY and share >= 0.5:
        return f"the size of {h.effect.word} would have to change with time (log evidence {best_gain:.0f})"
    return None


def _disagreement(context: Context, best: Assessment, h: Hypothesis) -> str | None:
    """A sentence when the recordings ask for different sizes of an effect that should have one."""
    if h.recording is not None or h.effect.amplitude.fixed is not None or len(context.recordings) < 2:
        return None
    view = best.best_view
    estimates = []
    values = {name: best.model.parameters[name].value for name in h.shapes}
    columns = [signatures(t, [h.at(values)]) for t in best.fit.trajectories]
    for k in range(len(columns)):
        alone = [c if i == k else np.zeros_like(c) for i, c in enumerate(columns)]
        z = best.lens.whiten(view.noise, alone)[0][:, 0]
        estimates.append(z)
    # how much more or less of the effect each recording wants, beside everything that a refit may move
    z = view.project(np.array(estimates).T)
    gram = z.T @ z
    dot = z.T @ view.residual
    total = z.sum(axis=1)
    length = float(total @ total)
    joint = float(total @ view.residual) ** 2 / length if length > 1e-9 else 0.0
    solved = np.linalg.lstsq(gram, dot, rcond=1e-9)[0]
    chi2 = float(dot @ solved) - joint
    freedom = len(columns) - 1
    if chi2 > freedom + 6.0 * np.sqrt(2 * freedom) + 8.0:
        return f"the recordings ask for different sizes of {h.effect.word} (chi-square {chi2:.0f} for {freedom})"
    return None
