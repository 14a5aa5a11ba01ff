"""Points for one diagnosis against its key, and the word for it.

Right effect at the right place +1; at another place +0.5; the truth among the alternatives within 3 units of
log evidence +0.7/sqrt(number of rivals, the answer included); no mismatch where there is none +1; a verdict
that the key accepts +1, else `unexplained` 0; a missed effect 0; a false alarm, a wrong name, physics taken
for the measuring chain or the reverse -2. Several effects: the share found, -1 for each that is not there. A
place counts if at most one state too many is listed.

A machine also has laws that its baseline lacks although nobody concealed them; the key lists them under
`also_true`. To name one is no mistake: +1 if nothing is concealed, 0 if the concealed effect is not named,
and no deduction next to the concealed effect.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from discovery.challenge.prepare import MEASURING

Key = Mapping[str, Any]
Answer = Mapping[str, Any]

NEAR = 3.0  # log evidence within which an alternative belongs to the answer
PENALTY = -2.0
SHOWN = frozenset({"joint_hysteresis"})  # stated at an output, though it sits at a body

RIGHT, OF_MACHINE, ELSEWHERE, IN_SET, MISSED, UNNAMED = (
    "right",
    "true of the machine",
    "right effect, wrong place",
    "truth in the set",
    "missed",
    "unexplained",
)
FALSE_ALARM, WRONG, WRONG_KIND, PARTLY, FAILED = (
    "false alarm",
    "wrong name",
    "wrong kind",
    "partly right",
    "failed",
)


@dataclass(frozen=True)
class Judgement:
    """Points of a diagnosis, -2 to 1, and what they are for."""

    points: float
    word: str


def judge(key: Key, answer: Answer | None) -> Judgement:
    """Judge the content of a diagnosis.json (None: there is none) against a key.

    >>> judge({"effect": "radiation", "states": ["table"]}, {"verdict": "unexplained"})
    Judgement(points=0.0, word='unexplained')
    """
    if answer is None:
        return Judgement(PENALTY, FAILED)
    verdict, named = answer["verdict"], answer.get("physics") or []
    found = [f for f in named if not of_machine(key, f)]
    if verdict in key.get("accepts", ()):
        return Judgement(1.0, RIGHT)
    if named and not found:
        return Judgement(0.0 if key["effect"] else 1.0, OF_MACHINE)
    if key["effect"] is None:
        return Judgement(1.0, RIGHT) if verdict == "no mismatch" else Judgement(PENALTY, FALSE_ALARM)
    if verdict == "no mismatch":
        return Judgement(0.0, MISSED)
    if verdict == "unexplained" or not found:
        return Judgement(0.0, UNNAMED)
    return _judge_several(key, found) if "effects" in key else _judge_first(key, found[0], answer)


def _judge_several(key: Key, found: Sequence[Answer]) -> Judgement:
    truths = key["effects"]
    hits = sum(any(f["effect"] in names(t) and _touches(f, t) for f in found) for t in truths)
    extra = sum(all(f["effect"] not in names(t) for t in truths) for f in found)
    points = hits / len(truths) - extra
    return Judgement(points, RIGHT if points == 1.0 else WRONG if extra else PARTLY if hits else ELSEWHERE)


def _judge_first(key: Key, best: Answer, answer: Answer) -> Judgement:
    if best["effect"] in names(key):
        return Judgement(1.0, RIGHT) if at_place(key, best) else Judgement(0.5, ELSEWHERE)
    rivals = near_rivals(answer)
    if any(rival["effect"] in names(key) for rival in rivals):
        return Judgement(0.7 / math.sqrt(1 + len(rivals)), IN_SET)
    crossed = (best["effect"] in MEASURING) != (key["effect"] in MEASURING)
    return Judgement(PENALTY, WRONG_KIND if crossed else WRONG)


def names(key: Key) -> set[str]:
    """Effects that count as right."""
    return {key["effect"], *key.get("also", ())}


def places(key: Key) -> set[str]:
    """States or output at which the effect acts; none where it acts everywhere."""
    return {*key["states"], *([key["output"]] if "output" in key else [])}


def of_machine(key: Key, named: Answer) -> bool:
    """Whether a named effect acts at the machine in silence, and is not one of those that are concealed.

    It may be named at several bodies at once. At most one of them may be a body where it does not act. What
    shows only together, at several bodies, has to be named at all of them but one.
    """
    if any(named["effect"] in names(truth) for truth in truths(key)):
        return False
    said = set(named.get("states", ()))
    own = [places(one) for one in key.get("also_true", ()) if named["effect"] in names(one)]
    there = set[str]().union(*(one for one in own if len(one - said) <= 1))
    return bool(said & there) and len(said - there) <= 1


def _touches(found: Answer, key: Key) -> bool:
    return bool(set(found.get("states", ())) & places(key))


def at_place(key: Key, found: Answer) -> bool:
    """Whether a named effect stands at the place of the key, with at most one state too many."""
    return not places(key) or (_touches(found, key) and len(found.get("states", ())) <= len(places(key)) + 1)


def near_rivals(answer: Answer) -> list[Answer]:
    """Alternatives that belong to the answer."""
    return [a for a in answer.get("alternatives", ()) if a["log_evidence_below_best"] <= NEAR]


def truths(key: Key) -> list[Key]:
    """The single effects of a key: none, one, or several."""
    return list(key["effects"]) if "effects" in key else [key] if key["effect"] else []


def stands(truth: Key, named: Answer) -> bool:
    """Whether a named effect is a true one at its place."""
    return named["effect"] in names(truth) and (at_place(truth, named) or named["effect"] in SHOWN)


def in_stated_set(truth: Key, answer: Answer) -> bool:
    """Whether a true effect stands at its place among what is named and its near rivals."""
    stated = [*(answer.get("physics") or []), *near_rivals(answer)]
    return any(stands(truth, s) for s in stated)
