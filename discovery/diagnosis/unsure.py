"""Sentences about effects of the answer that are not sure enough to be named."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, isfinite

from discovery.diagnosis import thresholds
from discovery.diagnosis.named import Named, added, claims
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from discovery.effects.hypothesis import Hypothesis
from discovery.printed import printed


def apart(found: Search, answer: Scored, rest: Sequence[Named], least: float) -> tuple[str, ...]:
    """A sentence for each effect of the answer that is not sure enough to be named, with its rival.

    Args:
        least: log evidence that a name has to add.
    """
    sentences = []
    for n in rest:
        gain = added(found, answer, n.hypothesis)
        rival = n.rivals[0] if n.rivals and n.rivals[0].below < gain else None
        said = rival.hypothesis.stated if rival else ""
        sentence = _unsure(n, gain, least, _alone_or_not(found, n.hypothesis, said))
        if rival:
            sentence += f"; {said} instead has {rival.below:.1f} less"
        sentences.append(sentence)
    return tuple(sentences)


def _alone_or_not(found: Search, h: Hypothesis, rival: str) -> str:
    """How an effect alone compares with the best other one alone, if both were tried and act, and the other
    is not the rival that is stated anyhow.
    """
    alone = found.tried.get(frozenset((h.key,)))
    single = [m for m in found.tried.values() if len(m.hypotheses) == 1 and not claims(m, h)]
    other = max(single, key=lambda m: m.evidence, default=None)
    if alone is None or other is None or not isfinite(alone.evidence - other.evidence):
        return ""
    if other.hypotheses[0].stated == rival:
        return ""
    more = alone.evidence - other.evidence
    how = f"{abs(more):.0f} {'more' if more >= 0 else 'less'}"
    return f" (alone it has {how} than {other.hypotheses[0].stated})"


def _unsure(n: Named, added: float, least: float, alone: str) -> str:
    """Why an effect of the answer has no name. `alone`: how it compares with another one alone."""
    name = n.hypothesis.stated
    chance = f"probability {_chance(n.probability)}"
    if added >= least and n.together >= thresholds.NAMED:
        return (
            f"{name} is not named: too much of its log evidence of {added:.0f} ({chance}) may be due to "
            f"effects that are not sure enough to be named{alone}"
        )
    # a high probability next to too little evidence reads like a contradiction: only what is short is said
    short = []
    if added < least:  # 15.96 of 16 is not shown as 16, nor 49.72 of 49.74 as 49.7 of 49.7
        short.append(
            f"log evidence {printed(floor(10 * added) / 10)} of the {printed(ceil(10 * least) / 10)}"
        )
    if n.together < thresholds.NAMED:
        short.insert(0, f"{chance} of the {thresholds.NAMED:g}")
    return f"{name} is possible but not sure enough to be named ({' and '.join(short)} that a name needs)"


def _chance(probability: float) -> str:
    """A probability with two digits; 0.698 of 0.7 is not shown as 0.70."""
    if 0 < thresholds.NAMED - probability < 0.005:
        return f"{floor(100 * probability) / 100:.2f}"
    return f"{probability:.2f}" if probability >= 0.005 else "below 0.01"
