"""The verdict of an update: which explanation of new recordings holds, and whether it is sure."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from discovery.diagnosis.thresholds import NAMED, ODDS, RIVAL, SUREST

Verdict = Literal[
    "nothing",
    "wear",
    "wear goes on",
    "input sensor",
    "unused input",
    "idle input",
    "new physics",
    "something else",
    "undecided",
]
Kind = Literal[
    "nothing", "wear", "sensor of", "input", "no input", "exchange with", "effect", "something else"
]

# Chosen on seeds set aside for it and confirmed on others, see benchmarks/runtime.md
LEAST_ODDS = 2.5  # log of the odds against `nothing`, below which nothing has changed
SURE = 11.0  # log evidence of something new; a diagnosis, which knows no earlier fit, asks for more
RARE = 2.0  # log of how much less often a sensor fails, or something else changes, than a machine wears


@dataclass(frozen=True)
class Explanation:
    """A hypothesis by its kind. `what`: a channel, or an effect with its place; `word`: the effect alone."""

    kind: Kind
    what: str = ""
    word: str = ""

    def __str__(self) -> str:
        return self.what if self.kind == "effect" else f"{self.kind} {self.what}".strip()

    @property
    def is_new_physics(self) -> bool:
        """Whether it has a name that needs the evidence of one in a diagnosis."""
        return self.kind in ("effect", "exchange with")

    def is_alike(self, other: Explanation) -> bool:
        """Whether it is the other one, perhaps at another place."""
        return self == other or (self.kind == other.kind == "effect" and self.word == other.word)


NOTHING, WEAR, SOMETHING_ELSE = Explanation("nothing"), Explanation("wear"), Explanation("something else")
Odds = Mapping[Explanation, float]


def before(one: Explanation, asked: Collection[Explanation]) -> float:
    """Log of the odds of a hypothesis against `nothing` before any reading: that one of the sensors is off is
    as likely as that one of the other inputs acts, or that something else changed; another exchange is as
    likely as any effect of the catalogue.
    """
    if one == WEAR:
        return 0.0
    alike = [other for other in asked if other.kind == one.kind]
    return (float(np.log(ODDS)) if one.kind == "exchange with" else -RARE) - float(np.log(len(alike)))


def verdict_of(odds: Odds, evidence: Odds) -> tuple[Verdict, str]:
    """The best hypothesis, if it beats `nothing` and its rivals clearly. A sensor or an input needs the
    evidence of a name in a diagnosis. So does an effect of the catalogue, or another exchange with a
    temperature, over all that explains the readings without it. Where another exchange is more likely than
    the sensor, neither has the name.

    Args:
        odds: of each hypothesis against `nothing`, logarithms with those before any reading.
        evidence: the same without those before any reading; not of effects of the catalogue.
    """
    effects = [one for one in odds if one.is_new_physics]
    best, second, *_ = sorted((e for e in evidence if not e.is_new_physics), key=lambda one: -odds[one])
    effect = max(effects, key=lambda one: odds[one], default=None)
    # of two explanations alike, the evidence of one over the other varies as itself, not as what both explain
    if effect and odds[effect] - max(odds[best], 0.0) >= SURE:
        if probability(odds, effect) >= NAMED:
            return "new physics", str(effect)
        return "undecided", _or_next(odds, effect)
    if odds[best] < LEAST_ODDS:
        return "nothing", ""
    if odds[best] - odds[second] < RIVAL:
        first = sorted((best, second, *([effect] if effect else [])), key=lambda one: -odds[one])
        return "undecided", f"{first[0]} or {first[1]}"
    if best.kind == "wear" or best.kind == "something else":
        return best.kind, ""
    # effects have their sizes fitted and need more; another exchange is an integral as that of the sensor
    if any(odds[one] > odds[best] for one in evidence if one.is_new_physics):
        return "undecided", _or_next(odds, max(odds, key=lambda one: odds[one]))
    if evidence[best] < SURE:
        return "undecided", _or_next(odds, best)
    if best.kind == "no input":
        return "idle input", best.what
    return "unused input" if best.kind == "input" else "input sensor", best.what


def explains_all(verdict: Verdict, what: str, also: float) -> tuple[Verdict, str]:
    """The verdict after a look at what wear, or the sensor of an input, leaves to explain. A sensor is off by
    a constant, so it leaves nothing: that is what distinguishes it from heat that it explains in part.

    Args:
        also: log of the odds that something else changed, too.
    """
    if verdict == "wear" and also >= LEAST_ODDS:
        return "something else", "wear does not explain all of it"
    if verdict == "input sensor" and also > -RIVAL:
        return "undecided", f"sensor of {what} alone or with something else"
    return verdict, what


def probability(odds: Odds, effect: Explanation) -> float:
    """Probability that an effect began, at any place: the best answer with it against the best one without,
    as in a diagnosis.
    """
    ahead = odds[effect] - max(_without(odds, effect).values())
    return min(SUREST, float(1.0 / (1.0 + np.exp(-np.clip(ahead, -500.0, 500.0)))))


def _or_next(odds: Odds, one: Explanation) -> str:
    """A hypothesis or the most likely of the others, the same at another place left out."""
    others = _without(odds, one)
    other = max(others, key=lambda e: others[e])
    return f"{one} or {'no change' if other == NOTHING else other}"


def _without(odds: Odds, effect: Explanation) -> dict[Explanation, float]:
    """Hypotheses under which an effect did not begin anywhere."""
    return {one: value for one, value in odds.items() if not one.is_alike(effect)}
