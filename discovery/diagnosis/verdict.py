"""The verdict: the named effects, their probability, their rivals, or that the cause is unknown.

An effect is named if it is probable enough, if it improves the prediction of recordings that the fit has not
seen, and if no law of physics forbids it. Held-out recordings may withdraw a name, but never add one.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import cache, partial
from math import inf, sqrt

from discovery.diagnosis import thresholds
from discovery.diagnosis.coarse_bodies import of_its_own
from discovery.diagnosis.context import Context
from discovery.diagnosis.crossvalidation import LeftOut, left_out, together_left_out
from discovery.diagnosis.named import Named, added, claims, one_named
from discovery.diagnosis.posterior import Posterior
from discovery.diagnosis.refit import score
from discovery.diagnosis.scored import Scored, is_large, with_unknown
from discovery.diagnosis.selection import Search
from discovery.diagnosis.unknown_law import with_law
from discovery.diagnosis.unsure import apart
from discovery.diagnosis.vetoes import vetoed
from discovery.effects.hypothesis import Hypothesis, Key
from discovery.printed import printed

NO_MISMATCH, MISSING, FAULT, UNEXPLAINED = (
    "no mismatch",
    "missing physics",
    "measurement fault",
    "unexplained",
)


@dataclass(frozen=True)
class Verdict:
    """The answer and the reasons for it. `answer`: the model that the named effects belong to."""

    word: str
    answer: Scored
    named: tuple[Named, ...]
    candidates: tuple[Named, ...]  # what stood closest where nothing is named
    reasons: tuple[str, ...]


def decide(context: Context, found: Search, posterior: Posterior) -> Verdict:
    """What the recordings to fit say."""
    answer = posterior.instead(found.best)
    adds = partial(added, found, answer)
    candidates = tuple(
        sorted(
            (one_named(found, posterior, answer, h) for h in answer.hypotheses),
            key=lambda n: -adds(n.hypothesis),
        )
    )
    probable = [n for n in candidates if n.together >= thresholds.NAMED]
    unsure_of = [n for n in probable if not n.is_abrupt]  # a jump that no flow makes needs no good model
    refused = {
        n.hypothesis.key: text for n in unsure_of if (text := vetoed(context, answer, n.hypothesis, adds))
    }
    least = by_chance(found.gain)

    def level(some: Sequence[Named], goal: float) -> float:
        return _alone(context, found, answer, some, found.best.evidence - goal)

    def needed(some: Sequence[Named], lost: Collection[Key]) -> list[Named]:
        return _needed(some, least, level, lambda *those: _instead(found, lost, *those) - least)

    sure = needed([n for n in probable if n.hypothesis.key not in refused], refused)
    proved, idle, proofs = _proved(context, found, answer, sure)
    # what is named must not owe its evidence to what is not
    named = tuple(needed(proved, {*refused, *idle})) if idle else proved
    sure = [n for n in sure if n in named or n.hypothesis.key in idle]
    others = [n.hypothesis for n in candidates if n not in named]
    alone = _alone(context, found, answer, named)

    # of the effects without a name, all together: more than each of them may explain by chance
    more = _is_more(answer.evidence - alone, thresholds.SHORT * max(len(others), 1))

    @cache
    def acts() -> bool:
        """Whether the effects without a name explain more, and improve free runs outside the fit."""
        return more and _supports(together_left_out(context, answer, others))

    # what physics forbids is not lacking where it explains no more than chance, nor is what does not act
    nothing = {*(() if more else refused), *(idle if idle and not acts() else ())}
    withheld = {**refused, **idle}
    reasons = [*dict.fromkeys(text for key, text in withheld.items() if key not in nothing)]
    # a law has no name: it matters only where a name may stand for it
    lacking = (found.baseline, answer) if named else ()
    laws = [law for m in lacking for law in with_law(context, m, found.goal(m.noise))]
    rest = [m for m in (*posterior.models, *found.tried.values(), *laws) if not m.keys & nothing]
    best, without = _unknown_cause(rest, alone, bool(named))
    # names hold next to effects that are not sure, and next to something that no effect explains if they are
    # jumps that no flow makes, or laws that explain more than they leave, and still add what a name needs
    if _is_more(best.evidence - without) and (best.forced or named or acts()):
        mostly = [n for n in named if n.is_firm and _stays(n, proofs[n.hypothesis.key])]
        faults = [n.hypothesis for n in named if not n.is_firm]
        reasons += [
            f"{h.stated} is not named: something else acts as well, and an event or a fault can only be "
            "recognised with a model that is nearly right"
            for h in faults
        ]
        by_law = any(best is one for one in laws)
        has_names = bool(named)
        few = (
            "the effects that are sure enough explain too little" if has_names else "no effect is sure enough"
        )
        named = tuple(
            _needed(
                mostly, least, lambda some, goal: _unknown_beside(context, found, answer, some, goal, by_law)
            )
        )
        if named:
            reasons.append(
                f"{best.forced} acts as well, or the named laws are not exact: "
                f"with it, the model has {best.evidence - without:.0f} more log evidence"
            )
        else:
            most = max(m.evidence for m in rest if not m.forced)
            does = "explains more than effects do" if best.evidence > most else "or unsure effects act"
            reasons += [f"{best.forced} {does}"] if best.forced else []
            reasons.append(
                f"{few}: the best model of all has {max(m.evidence for m in rest) - alone:.0f} more log "
                f"evidence than the model {'with them' if has_names else 'as it is'}"
            )
    unsure = [n for n in candidates if n not in sure and n.hypothesis.key not in refused]
    further = (
        *dict.fromkeys(text for key, text in withheld.items() if key in nothing),
        *apart(found, answer, unsure, least),
    )
    every = (*reasons, *further)
    if named and all(n.is_abrupt for n in named):
        every = (*every, *coarse(found))
    if named:
        surest_first = sorted(named, key=lambda n: -round(n.probability, 2))
        return Verdict(word_of(named), answer, tuple(surest_first), (), every)
    if reasons:
        return Verdict(UNEXPLAINED, answer, (), candidates, every)
    return _nothing(found, answer, candidates, further)


def word_of(named: Sequence[Named]) -> str:
    """The verdict with some names, where something acts."""
    if not named:
        return UNEXPLAINED
    return MISSING if any(n.hypothesis.effect.is_physics for n in named) else FAULT


def _proved(
    context: Context, found: Search, answer: Scored, chosen: Sequence[Named]
) -> tuple[tuple[Named, ...], dict[Key, str], dict[Key, LeftOut | None]]:
    """Effects that improve free runs outside the fit, why each other one is not named, and what each changes
    there. Of several that do not, the one that explains least goes first: two that stand in for each other
    look idle as long as both are there.
    """
    kept, idle = tuple(chosen), dict[Key, str]()
    proofs = dict[Key, LeftOut | None]()
    while kept:
        whole = _only(context, found, answer, kept) or answer
        proofs |= left_out(context, whole, [n.hypothesis for n in kept])
        outside = [(n, proofs[n.hypothesis.key]) for n in kept]
        unsupported = [(n, one) for n, one in outside if one is not None and not _supports(one)]
        if not unsupported:
            break
        last, its = min(unsupported, key=lambda pair: pair[1].free.explained)
        idle[last.hypothesis.key] = _idle(last.hypothesis, its)
        kept = tuple(n for n in kept if n is not last)
    return kept, idle, proofs


def _unknown_cause(rest: Sequence[Scored], alone: float, named: bool) -> tuple[Scored, float]:
    """The model that may show that something else acts, and the log evidence that it has to exceed.

    With names, an unknown cause has to exceed all effects: their evidence is no evidence of it. Without a
    name, only a model with the unknown cause and no effect counts, for process noise looks like a few events.
    If that model is not likely, the best model of effects takes its place.

    Args:
        alone: log evidence of a model with the named effects only.
    """
    effects = [m for m in rest if not m.forced]
    if not named:
        return max([m for m in rest if m.forced and not m.keys] or effects, key=lambda m: m.evidence), alone
    best = max(rest, key=lambda m: m.evidence - (thresholds.SHORT if m.forced else 0.0))
    return best, max(m.evidence for m in effects)


def _is_more(evidence: float, least: float = thresholds.SHORT) -> bool:
    """Whether so much log evidence is more than may come by chance."""
    return evidence >= least


def _stays(n: Named, outside: LeftOut | None) -> bool:
    """Whether what is named explains more than it leaves, or is a jump that no flow makes."""
    return n.is_abrupt or (outside is not None and outside.free.mostly)


def _supports(outside: LeftOut | None) -> bool:
    """Whether left-out recordings support what was added; true where nothing can be left out."""
    return outside is None or outside.improves


def _idle(h: Hypothesis, outside: LeftOut) -> str:
    """Why an effect is not named that left-out recordings do not support."""
    old, new = outside.free.judged
    rms = f"{printed(old)} without it, {printed(new)} with it"
    if outside.matters:
        return (
            f"{h.effect.word} at {h.where} makes free runs better on recordings that are left out of the fit "
            f"(rms over the reading noise: {rms}), but from one reading to the next it predicts "
            f"{outside.better} of {outside.blocks} blocks of time better, and by no more than chance gives"
        )
    return (
        f"{h.effect.word} at {h.where} does not improve free runs enough on recordings that are left out of "
        f"the fit (rms over the reading noise: {rms})"
    )


def _instead(found: Search, lost: Collection[Key], n: Named, whole: float) -> float:
    """What a model of names has to exceed where one of them may be another effect: the best of all models
    that do not claim it, and without rivals that are named next to it as they are nearly as likely. Where
    effects that are not sure add more than a name needs, only a model counts that the best one does not
    exceed by as much. One with as many effects as that one is compared with it, if it claims the effect: both
    are helped by effects that are not sure.

    Args:
        lost: effects that are no rivals.
        whole: log evidence of the model.
    """
    none = {*n.near, *lost}
    others = (m for m in found.tried.values() if none.isdisjoint(m.keys) and not claims(m, n.hypothesis))
    more = found.best.evidence - whole
    fewer, as_many = max(more - thresholds.SHORT, 0.0), len(found.best.keys)
    if not claims(found.best, n.hypothesis):
        return max(m.evidence for m in others) - fewer
    return max(m.evidence - (more if len(m.keys) >= as_many else fewer) for m in others)


def _needed(
    chosen: Sequence[Named],
    least: float,
    level: Callable[[Sequence[Named], float], float],
    instead: Callable[[Named, float], float] = lambda _, __: -inf,
) -> list[Named]:
    """Effects that are all needed: each adds at least so much evidence to a model of the others.

    Args:
        level: log evidence of a model with some effects; it need not be exact below its second argument.
        instead: likewise, of what may be there in the place of one of them.
    """
    kept = list(chosen)
    while kept:
        whole = level(kept, -inf)
        levels = {
            n.hypothesis.key: max(level([o for o in kept if o is not n], whole - least), instead(n, whole))
            for n in kept
        }
        last = max(kept, key=lambda n: levels[n.hypothesis.key])
        if _is_more(whole - levels[last.hypothesis.key], least):
            break
        kept.remove(last)
    return kept


def _unknown_beside(
    context: Context, found: Search, answer: Scored, chosen: Sequence[Named], goal: float, by_law: bool
) -> float:
    """Log evidence of a model with only these effects and something of unknown cause, which may also be a
    law; it need not be exact below a goal.
    """
    model = _only(context, found, answer, chosen)
    if model is None:
        return -inf
    unknown = [*with_unknown(context, [model], goal), *(with_law(context, model) if by_law else [])]
    return max(m.evidence for m in unknown)


def by_chance(gain: float, least: float = thresholds.SHORT) -> float:
    """Log evidence that may come by chance. A log evidence of G varies by sqrt(2 G) from one set of readings
    to another: it is half of the square of a distance known within one standard deviation.
    """
    return max(least, thresholds.CHANCE * sqrt(2 * max(gain, 0.0)))


def _alone(
    context: Context, found: Search, answer: Scored, chosen: Sequence[Named], matters: float = inf
) -> float:
    """Log evidence of a model with only these effects; -inf if it does not stay finite.

    Args:
        matters: it need not be exact where it is further than this below the best of all models.
    """
    model = _only(context, found, answer, chosen, matters)
    return -inf if model is None else model.evidence


def _only(
    context: Context, found: Search, answer: Scored, chosen: Sequence[Named], matters: float = inf
) -> Scored | None:
    """The model with only these effects, fitted if the search has not fitted it; None if it does not stay
    finite.
    """
    keys = frozenset(n.hypothesis.key for n in chosen)
    known = found.tried.get(keys)
    if known is not None and known.fit.ended_early and found.best.evidence - known.evidence < matters:
        found.finish(known)
    elif known is None:
        goal = found.goal(answer.noise, matters)
        one = score(context, [n.hypothesis for n in chosen], answer.noise, answer.fit, goal=goal)
        if one is not None:
            found.keep(one)
    return found.tried.get(keys)


def _nothing(
    found: Search, answer: Scored, candidates: tuple[Named, ...], further: tuple[str, ...]
) -> Verdict:
    """Verdict without a name: "no mismatch", or "unexplained" if the model is so coarse that process noise
    explains any residual. `further`: about effects that are not named.
    """
    if said := coarse(found):
        return Verdict(UNEXPLAINED, answer, (), candidates, (*said, *further))
    return Verdict(NO_MISMATCH, answer, (), (), (*unrecorded(found), *further))


def unrecorded(found: Search) -> tuple[str, ...]:
    """A sentence about much heat that nobody records; nothing about as much as is usual."""
    if not is_large(found.baseline.unrecorded):
        return ()
    return (
        f"heat that the model does not give is about {100 * found.baseline.unrecorded:.0f} % of what flows, "
        "more than in most machines: log what else warms or cools the machine, and ask which exchange "
        "between its bodies the model has not",
    )


def coarse(found: Search) -> tuple[str, ...]:
    """Sentences about a model whose error is larger than usual, everywhere or at a place; else none."""
    if not found.baseline.coarse:
        return tuple(of_its_own(found.baseline))
    return (
        f"the flows of the model are wrong by about {100 * found.baseline.off:.0f} %, more than is usual for "
        "a lumped model, and no effect that is sure explains it",
        *of_its_own(found.baseline),
    )
