"""Effects of the answer, each with its probability and its rivals."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from discovery.diagnosis import thresholds
from discovery.diagnosis.abrupt import is_abrupt
from discovery.diagnosis.posterior import Posterior
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from discovery.effects.hypothesis import Hypothesis, Key


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
    together: float  # probability that it acts, or a rival that is nearly as likely
    rivals: tuple[Rival, ...]
    near: frozenset[Key] = frozenset()  # those that are nearly as likely
    is_abrupt: bool = False  # a jump of a sensor that no flow makes, where those of the model are wrong

    @property
    def is_firm(self) -> bool:
        """Whether it can be recognised next to something that no effect explains. Another event or fault may
        make up for that.
        """
        return self.is_abrupt or self.hypothesis.effect.is_law


def one_named(found: Search, posterior: Posterior, answer: Scored, h: Hypothesis) -> Named:
    """An effect of the answer; its rivals stand in its place next to the same others.

    The same effect there in every recording and in one of them is one claim, not two that compete. In another
    recording it is a rival: of two, a gain that is too low in one or too high in the other looks the same.
    """
    others = answer.keys - {h.key}
    below: dict[object, Rival] = {}
    same = list[Hypothesis]()
    for one in found.tried.values():
        if h.key in one.keys or not others <= one.keys or len(one.keys) != len(others) + 1:
            continue
        rival = next(o for o in one.hypotheses if o.key not in others)
        gap = max(answer.evidence - one.evidence, 0.0)
        label = (rival.effect.word, rival.where)
        if not isfinite(gap):
            continue
        if label != (h.effect.word, h.where) or _elsewhere(h, rival):
            if label not in below or gap < below[label].below:
                below[label] = Rival(rival, gap)
        elif gap <= thresholds.RIVAL and rival.law == h.law and None in (h.event, rival.event):
            same.append(rival)
    rivals = tuple(sorted(below.values(), key=lambda r: r.below))
    near = [r.hypothesis for r in rivals if r.below <= thresholds.RIVAL]
    own, together = posterior.of_claims([h, *same]), posterior.of_claims([h, *same, *near])
    keys = frozenset(rival.key for rival in (*near, *same))
    abrupt = answer.coarse and is_abrupt(answer, h)
    return Named(h, min(own, thresholds.SUREST), min(together, thresholds.SUREST), rivals, keys, abrupt)


def _elsewhere(h: Hypothesis, rival: Hypothesis) -> bool:
    """Whether both are events, of different recordings."""
    return None not in (h.event, rival.event) and h.event != rival.event


def claims(one: Scored, h: Hypothesis) -> bool:
    """Whether a model holds an effect, or one that is the same claim: by another input that no report names,
    it is no other answer.
    """
    return any(o.claim == h.claim for o in one.hypotheses)


def added(found: Search, answer: Scored, h: Hypothesis) -> float:
    """Log evidence that goes with an effect: what the model without it lacks, or the one without any."""
    without = found.tried.get(answer.keys - {h.key}, found.baseline)
    return answer.evidence - max(without.evidence, found.baseline.evidence)
