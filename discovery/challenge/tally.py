"""The figures of one method over all cases."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from statistics import mean, median
from typing import Any

from discovery.challenge.calibration import Reliability, by_confidence, weighted_gap
from discovery.challenge.intervals import Share, share
from discovery.challenge.overlap import overlap
from discovery.challenge.scoring import (
    ELSEWHERE,
    FAILED,
    FALSE_ALARM,
    RIGHT,
    WRONG,
    WRONG_KIND,
    Answer,
    Judgement,
    Key,
    at_place,
    in_stated_set,
    judge,
    names,
    of_machine,
    places,
    stands,
    truths,
)
from discovery.challenge.sizes import covered

SIZES = (0.5, 1.0, 2.0, 4.0)  # bins of size, split at their geometric middles
NAMING = ("missing physics", "measurement fault")


@dataclass(frozen=True)
class Scored:
    """A case with the answer of one method; no answer where the method failed."""

    case: str
    key: Key
    answer: Answer | None
    judgement: Judgement

    @property
    def verdict(self) -> str:
        """Word of the answer."""
        return str(self.answer["verdict"]) if self.answer else "failed"

    @property
    def named(self) -> list[Answer]:
        """Effects that the answer names."""
        return list(self.answer.get("physics") or []) if self.answer else []

    @property
    def states_bodies(self) -> bool:
        """Whether the answer states bodies at all; a method that failed should have."""
        return self.answer is None or "location" in self.answer

    @property
    def alarms(self) -> bool:
        """A false alarm, or no answer, where nothing is concealed."""
        return self.judgement.word in (FALSE_ALARM, FAILED)

    @property
    def large(self) -> bool:
        """One effect of size 1 or more that a diagnosis could name."""
        return bool(self.key["kind"] in ("one", "input") and self.key.get("rms_over_noise", 0.0) >= 1.0)


@dataclass(frozen=True)
class Bin:
    """Cases of about one size: how many were detected, named, named rightly."""

    size: float
    count: int
    detected: int
    named: int
    right: int


@dataclass(frozen=True)
class Tally:
    """Everything that is known of one method; None and empty shares where nothing of the sort occurred."""

    scored: Sequence[Scored]
    points: float  # mean of -2 to 1
    verdicts: Mapping[str, Mapping[str, int]]  # kind of case -> verdict -> cases
    words: Mapping[str, int]
    confusion: Mapping[str, Mapping[str, int]]  # truth -> what was said
    power: Sequence[Bin]
    false_alarms: Share
    false_alarms_coloured: Share  # of the cases with slow noise and small heat
    outside_named: Share
    large_named: Share
    large_right: Share  # of those named
    named_right: Share  # all cases with effects of the catalogue, of those named
    stated: Share
    measuring_right: Share
    two_found: Share  # of the single effects of cases with two
    extra: Share  # cases with a named effect that is not there, of those named
    body_first: Share  # the body stated first is one at which the effect acts
    reliability: Sequence[Reliability]
    calibration_points: float | None  # |said - true| on average over named effects, in points
    bias_points: float | None  # said minus true over all
    overlap: float | None
    windows: int
    coverage: Share
    explained: float | None  # median share of the closable gap where something is named
    explained_all: float | None  # the same over every case with effects, nothing where nothing is named
    seconds: float | None
    seconds_most: float | None
    processor: float | None  # median seconds of the processor
    failed: int = field(default=0)


def score_all(keys: Mapping[str, Key], answers: Mapping[str, Answer | None]) -> list[Scored]:
    """Each case judged."""
    return [Scored(case, key, answers.get(case), judge(key, answers.get(case))) for case, key in keys.items()]


def tally(scored: Sequence[Scored]) -> Tally:
    """All figures of one method."""
    quiet = [s for s in scored if s.key["effect"] is None]
    outside = [s for s in scored if s.key["kind"] == "outside"]
    inside = [s for s in scored if s.key["kind"] in ("one", "input", "two", "measuring")]
    answered = [s for s in inside if s.verdict in NAMING]
    large = [s for s in scored if s.large]
    large_answered = [s for s in large if s.verdict in NAMING]
    two = [(t, s) for s in scored if s.key["kind"] == "two" for t in truths(s.key)]
    confidences = _confidences(scored)
    reliability = by_confidence(confidences)
    overlaps = [o for s in scored if s.answer and (o := overlap(s.key, s.answer)) is not None]
    gaps = [(s, g) for s in inside if (g := _gap(s)) is not None]
    seconds, processor = _times(scored, "seconds"), _times(scored, "processor_seconds")
    sized = [
        c
        for s in inside
        for t in truths(s.key)
        for f in s.named
        if at_place(t, f) and (c := covered(t, f)) is not None
    ]
    said = [p for p, _ in confidences]
    everywhere = [_gap(s) or 0.0 for s in inside if s.key["kind"] != "measuring"]
    return Tally(
        scored=scored,
        points=mean(s.judgement.points for s in scored) if scored else 0.0,
        verdicts=_counts((str(s.key["kind"]), s.verdict) for s in scored),
        words=Counter(s.judgement.word for s in scored),
        confusion=_counts(pair for s in scored for pair in _confused(s)),
        power=_power([s for s in scored if s.key["kind"] in ("one", "input") and "rms_over_noise" in s.key]),
        false_alarms=share([s.alarms for s in quiet]),
        false_alarms_coloured=share([s.alarms for s in quiet if s.key.get("coloured")]),
        outside_named=share([s.judgement.word in (WRONG, WRONG_KIND) for s in outside]),
        large_named=share([s.verdict in NAMING for s in large]),
        large_right=share([s.judgement.word == RIGHT for s in large_answered]),
        named_right=share([s.judgement.word == RIGHT for s in answered]),
        stated=share([in_stated_set(t, s.answer) for s in answered if s.answer for t in truths(s.key)]),
        measuring_right=share(
            [s.judgement.word in (RIGHT, ELSEWHERE) for s in inside if s.key["kind"] == "measuring"]
        ),
        two_found=share([any(stands(t, f) for f in s.named) for t, s in two]),
        extra=share([_has_extra(s) for s in answered]),
        body_first=share(
            [
                _first_body(s) in places(s.key)
                for s in scored
                if s.key["kind"] in ("one", "input", "outside") and s.key["states"] and s.states_bodies
            ]
        ),
        reliability=reliability,
        calibration_points=weighted_gap(reliability),
        bias_points=100 * (mean(said) - mean(float(c) for _, c in confidences)) if said else None,
        overlap=mean(overlaps) if overlaps else None,
        windows=len(overlaps),
        coverage=share(sized),
        explained=median(g for s, g in gaps if s.verdict in NAMING)
        if any(s.verdict in NAMING for s, _ in gaps)
        else None,
        explained_all=median(everywhere) if gaps and everywhere else None,
        seconds=median(seconds) if seconds else None,
        seconds_most=max(seconds, default=None),
        processor=median(processor) if processor else None,
        failed=sum(s.answer is None for s in scored),
    )


def by_family(t: Tally) -> dict[str, Tally]:
    """The figures of each family of machines; nothing where the keys do not say of which family a case is."""
    found: dict[str, list[Scored]] = {}
    for s in t.scored:
        if "family" in s.key:
            found.setdefault(str(s.key["family"]), []).append(s)
    return {name: tally(scored) for name, scored in found.items()}


def _counts(pairs: Any) -> dict[str, dict[str, int]]:
    out: dict[str, dict[str, int]] = {}
    for row, column in pairs:
        out.setdefault(row, {})[column] = out.get(row, {}).get(column, 0) + 1
    return out


def _times(scored: Sequence[Scored], key: str) -> list[float]:
    return [float(s.answer[key]) for s in scored if s.answer and s.answer.get(key) is not None]


def _gap(s: Scored) -> float | None:
    found = (s.answer or {}).get("improvement", {}).get("explained")
    return None if found is None else float(found)


def _first_body(s: Scored) -> str | None:
    states = (s.answer or {}).get("location", {}).get("states", {})
    return max(states, key=lambda name: states[name], default=None)


def _has_extra(s: Scored) -> bool:
    true = set().union(*(names(t) for t in truths(s.key)))
    return any(f["effect"] not in true and not of_machine(s.key, f) for f in s.named)


def _confused(s: Scored) -> list[tuple[str, str]]:
    """(truth, what was said) of each single effect of a case; "no effect" is a truth as well."""
    true = truths(s.key)
    if not true:
        return [("no effect", s.named[0]["effect"] if s.named else s.verdict)]
    pairs = []
    strangers = [f["effect"] for f in s.named if all(f["effect"] not in names(t) for t in true)]
    for t in true:
        hit = next((f["effect"] for f in s.named if f["effect"] in names(t)), None)
        other = strangers.pop(0) if hit is None and strangers else None
        truth = (
            "irregular heat"
            if s.key["kind"] == "outside" and t["effect"] == "unmeasured_heat"
            else t["effect"]
        )
        pairs.append((truth, hit or other or (s.verdict if not s.named else "not named")))
    return pairs


def _power(scored: Sequence[Scored]) -> list[Bin]:
    out = []
    for k, size in enumerate(SIZES):
        low = (SIZES[k - 1] * size) ** 0.5 if k else 0.0
        high = (SIZES[k + 1] * size) ** 0.5 if k + 1 < len(SIZES) else float("inf")
        here = [s for s in scored if low <= s.key["rms_over_noise"] < high]
        answered = [s for s in here if s.verdict in NAMING]
        detected = sum(s.verdict not in ("no mismatch", "failed") for s in here)
        out.append(
            Bin(size, len(here), detected, len(answered), sum(s.judgement.word == RIGHT for s in answered))
        )
    return out


def _confidences(scored: Sequence[Scored]) -> list[tuple[float, bool]]:
    """Probability and truth of every effect that was named: effect and place have to be right."""
    return [
        (float(f["probability"]), any(stands(t, f) for t in truths(s.key)) or of_machine(s.key, f))
        for s in scored
        for f in s.named
        if f.get("probability") is not None
    ]
