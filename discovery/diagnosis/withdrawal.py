"""Names that free runs withdraw, once the repaired model is there: they never add one."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import expm1, inf, isfinite, log

from discovery.diagnosis import thresholds
from discovery.diagnosis.named import added
from discovery.diagnosis.proof import Improvement
from discovery.diagnosis.scored import shapes_at_end
from discovery.diagnosis.selection import Search
from discovery.diagnosis.verdict import FAULT, NO_MISMATCH, UNEXPLAINED, Verdict, coarse, unrecorded, word_of
from discovery.fitting import Fit
from discovery.printed import printed

FITTED = "the recordings to fit"
NEARLY_RIGHT = "an event or a fault can only be recognised with a model that is nearly right"
SMALL = "what the model lacks is small: unknown heat at any body explains no more than it may by chance"


def idle(
    found: Search, verdict: Verdict, runs: Mapping[str, Improvement], withdrawn: bool = False
) -> Verdict:
    """No name where what was named does too little for free runs, on average over the recordings in which it
    may act: two hours of heat do nothing for the others. Logarithms of the rms are averaged: one recording of
    another machine does not drown the rest.

    Args:
        withdrawn: whether other names were withdrawn before. What they explain has no name then.
    """
    lower = _lower(i for run, i in runs.items() if _acts(verdict, run))
    if not verdict.named or lower >= 0.5 * thresholds.MATTERS**2:
        return verdict
    names = " and ".join(n.hypothesis.stated for n in verdict.named)
    reason = f"{names}: {_does(lower)}"
    word = UNEXPLAINED if withdrawn or coarse(found) else NO_MISMATCH
    reasons = dict.fromkeys((reason, *(coarse(found) or unrecorded(found)), *verdict.reasons))
    return replace(verdict, word=word, named=(), candidates=(), reasons=tuple(reasons))


def small(found: Search, verdict: Verdict, free_heat: float) -> Verdict:
    """No mismatch where no effect has a name and free heat at no body explains more than it may by chance:
    evidence of a law that is a little wrong grows with every reading, however little it matters. A fault of
    the measuring chain, or what happened in one recording, is no such law. What free runs miss is asked next.

    Args:
        free_heat: log evidence of heat of any course at the body where it explains most.
    """
    shows = max(free_heat, _beyond_laws(found))
    if verdict.word != UNEXPLAINED or verdict.named or coarse(found) or shows > 0:
        return verdict
    reasons = (SMALL, *unrecorded(found), *verdict.reasons)
    return replace(verdict, word=NO_MISMATCH, candidates=(), reasons=reasons)


def _beyond_laws(found: Search) -> float:
    """Log evidence that faults and events add to laws, beyond what a name needs."""
    laws = [one for one in found.tried.values() if all(h.effect.is_law for h in one.hypotheses)]
    return found.best.evidence - max(one.evidence for one in laws) - thresholds.SHORT


def _acts(verdict: Verdict, run: str) -> bool:
    """Whether anything that is named may act in a recording."""
    return any(n.hypothesis.acts_in(run) for n in verdict.named)


def _does(lower: float) -> str:
    """What effects do to free runs. `lower`: the logarithm by which the rms falls."""
    if not isfinite(lower):
        return "free runs run away with it"
    change = 100 * expm1(-lower)
    way = f"{'rises' if change == abs(change) else 'falls'} by {round(abs(change), 2):g} %"
    return f"too little for free runs (their rms {way} on average over the recordings)"


def _lower(runs: Iterable[Improvement]) -> float:
    """Mean over the recordings of the logarithm by which the rms of free runs falls."""
    judged = [i.judged for i in runs]
    logs = [log(max(old, 1e-12) / max(new, 1e-12)) if isfinite(new) else -inf for old, new in judged]
    return sum(logs) / max(len(logs), 1)


def runs_away(verdict: Verdict) -> Verdict:
    """The verdict with its names withdrawn, because the repaired model does not stay finite in free runs."""
    names = " and ".join(f"{n.hypothesis.effect.word} at {n.hypothesis.where}" for n in verdict.named)
    reasons = (f"with {names}, free runs of the model do not stay finite", *verdict.reasons)
    return replace(verdict, word=UNEXPLAINED, named=(), candidates=verdict.named, reasons=reasons)


def beyond_range(verdict: Verdict, repaired: Fit) -> Verdict:
    """The verdict without names that the repaired model fits only at the end of their range: there another
    law acts.
    """
    ends = {n.hypothesis.key: shapes_at_end([n.hypothesis], repaired) for n in verdict.named}
    lost = [n.hypothesis for n in verdict.named if ends[n.hypothesis.key]]
    if not lost:
        return verdict
    kept = tuple(n for n in verdict.named if not ends[n.hypothesis.key])
    reasons = (
        f"{h.stated} is not named: free runs fit best at the end of the range of {', '.join(ends[h.key])}, "
        "where another law acts"
        for h in lost
    )
    return replace(
        verdict,
        word=word_of(kept),
        named=kept,
        candidates=() if kept else verdict.named,
        reasons=(*reasons, *verdict.reasons),
    )


def without_the_least(found: Search, verdict: Verdict, proof: Mapping[str, Improvement]) -> Verdict:
    """The verdict without the one of several names that adds least evidence, where unseen recordings are
    predicted worse with all of them: one that is wrong would take the others with it.
    """
    other = refuted(verdict, proof)
    if len(verdict.named) < 2 or other.named:
        return verdict
    least = min(verdict.named, key=lambda n: added(found, verdict.answer, n.hypothesis))
    kept = tuple(n for n in verdict.named if n is not least)
    reason = f"{least.hypothesis.stated} is not named: {other.reasons[0]}"
    return replace(verdict, word=word_of(kept), named=kept, reasons=(reason, *verdict.reasons))


def refuted(
    verdict: Verdict, proof: Mapping[str, Improvement], fitting: Improvement | None = None
) -> Verdict:
    """The verdict with its names withdrawn where recordings are predicted worse with them, and unseen ones on
    average (of the logarithm of the rms). An event of a recording to fit does not act in another one;
    parameters that are fitted next to it speak against it if they miss by more than the fit leaves open.

    Args:
        proof: of unseen recordings.
        fitting: of the recordings to fit together, if they are asked, too.
    """
    every = {**proof, FITTED: fitting} if fitting else proof
    worse = [
        run for run, i in every.items() if i.contradicts and (_acts(verdict, run) or _misses(i, i.judged[1]))
    ]
    if not verdict.named or not worse:
        return verdict
    names = " and ".join(f"{n.hypothesis.effect.word} at {n.hypothesis.where}" for n in verdict.named)
    if _lower((proof or every).values()) >= 0:
        shown, check = "", "whether the machine was the same there, and how it began"
        if all(every[run].only_from_its_first_reading for run in worse):
            shown, check = " from the first reading alone", "how it began, and the inputs that are not sure"
        better = "better over all held-out recordings"
        if {*worse} >= {*proof}:  # each of them is better from other starts
            better = "better from each start within its spread (rms "
            better += ", ".join("{} -> {}".format(*map(printed, every[run].judged)) for run in worse) + ")"
        reason = (
            f"with {names}, free runs are {better}, but worse on {', '.join(worse)}{shown}: check {check}"
        )
        return replace(verdict, reasons=(*verdict.reasons, reason))
    reason = f"with {names}, free runs on {', '.join(worse)} are worse than without"
    return replace(
        verdict, word=UNEXPLAINED, named=(), candidates=verdict.named, reasons=(reason, *verdict.reasons)
    )


def unfinished(
    verdict: Verdict, fitting: Improvement, unit: str, whole: Callable[[], Improvement | None] = lambda: None
) -> Verdict:
    """The verdict where the model misses the recordings that it was fitted to by more than noise makes
    likely: something acts beside what is named, or where nothing is. Where it is more than the names
    explain, they are withdrawn: they may stand for it. So are events and faults, which can only be recognised
    with a model that is nearly right, but for jumps that no flow makes.

    Args:
        whole: `fitting` of the repaired model with the effects that are not sure, too: what they explain is
            no sign of anything else, unless it is more than the names do. None where there are none.
    """
    rms = fitting.judged[1 if verdict.named else 0]
    if not (verdict.named or verdict.word == NO_MISMATCH) or not _misses(fitting, rms, power=2):
        return verdict
    if verdict.named and (other := whole()) is not None:
        before, left = fitting.judged[0], other.judged[1]
        if not _misses(other, left, power=2) and 2 * rms**2 <= before**2 + left**2:
            return verdict
    still = "still " if verdict.named else ""
    missed = f"free runs on the fitted recordings {still}miss by {_size(fitting, rms, unit)}"
    firm = all(n.is_firm for n in verdict.named)
    if verdict.named and firm and (fitting.mostly or all(n.is_abrupt for n in verdict.named)):
        reason = f"something else acts as well, or the named laws are not exact: {missed}"
        return replace(verdict, reasons=(reason, *verdict.reasons))
    reason = (
        f"no effect is sure, but {missed}"
        if not verdict.named
        else f"the effects that are sure enough leave more than they explain: {missed}"
        if firm
        else f"{NEARLY_RIGHT}: {missed}"
    )
    return replace(
        verdict, word=UNEXPLAINED, named=(), candidates=verdict.named, reasons=(reason, *_large(verdict))
    )


def _large(verdict: Verdict) -> tuple[str, ...]:
    """The reasons of a verdict where free runs miss: what acts is not small."""
    return tuple(reason for reason in verdict.reasons if reason != SMALL)


def _misses(run: Improvement, rms: float, power: int = 1) -> bool:
    """Whether free runs miss their readings by more than noise and the fit make likely.

    Args:
        power: of the rms that counts. A fit brings the mean square below what is expected, if nothing is
            lacking; another day is off by more than a linear look at the parameters says.
    """
    return rms**power > thresholds.MISSED * run.expected**power


def _size(run: Improvement, rms: float, unit: str) -> str:
    """What a free run misses, with its unit, and what noise and the fit make likely."""
    of = "" if unit == "1" else f" {unit}"
    return f"{printed(rms)}{of} ({printed(run.expected)} expected)"


def unforeseen(verdict: Verdict, proof: Mapping[str, Improvement], unit: str) -> Verdict:
    """The verdict where unseen recordings show what the recordings to fit do not: free runs miss their
    readings by more than noise and the uncertainty of the parameters make likely. Names of laws stay: what
    the recordings to fit prove, holds there. Those of events and faults do not, for the model is not nearly
    right.
    """
    rms = {run: i.judged[1 if verdict.named else 0] for run, i in proof.items()}
    missed = [run for run, i in proof.items() if _misses(i, rms[run])]
    if not missed:
        return verdict
    sizes = ", ".join(f"{_size(proof[r], rms[r], unit)} on {r}" for r in missed)
    reason = (
        "free runs on held-out recordings miss more than noise and the fit explain, from each start within "
        f"its spread: rms {sizes}; something acts there that the recordings to fit do not show, or the "
        "recordings to fit are wrong (clock, units)"
    )
    if all(n.is_firm for n in verdict.named):
        word = UNEXPLAINED if verdict.word == NO_MISMATCH else verdict.word
        return replace(verdict, word=word, reasons=(*_large(verdict), reason))
    reasons = (f"{NEARLY_RIGHT}: {reason}", *_large(verdict))
    return replace(verdict, word=UNEXPLAINED, named=(), candidates=verdict.named, reasons=reasons)


def not_of_a_logger(verdict: Verdict, said: Sequence[str]) -> Verdict:
    """The verdict where nothing is missing, but for inputs that are late by more than a logger makes.

    Args:
        said: a sentence for each of them.
    """
    if verdict.word != NO_MISMATCH or not said:
        return verdict
    return replace(verdict, word=UNEXPLAINED, reasons=(*said, *verdict.reasons))


def wrong_readings(verdict: Verdict, single: int, hung: int = 0) -> Verdict:
    """The verdict where nothing but wrong readings was found. `single`: readings that their neighbours
    contradict; `hung`: sensors that hung.
    """
    if verdict.word != NO_MISMATCH or not single + hung:
        return verdict
    kinds = ((single, "single wrong reading", ""), (hung, "sensor", " that hung"))
    found = [f"one {what}{how}" if n == 1 else f"{n} {what}s{how}" for n, what, how in kinds if n]
    was = "was" if single + hung == 1 else "were"
    reason = f"only {' and '.join(found)} {was} found"
    return replace(verdict, word=FAULT, candidates=(), reasons=(reason, *verdict.reasons))
