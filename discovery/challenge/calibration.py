"""Are the probabilities true? Of the effects named with 90 %, nine in ten should be there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import mean

from discovery.challenge.intervals import Share, share

CONFIDENCE = (0.0, 0.5, 0.7, 0.9, 0.97, 1.0)  # edges of the bins of probability


@dataclass(frozen=True)
class Reliability:
    """Named effects of about one probability: what was said on average, what came true."""

    said: float
    true: Share


def by_confidence(confidences: Sequence[tuple[float, bool]]) -> list[Reliability]:
    """Named effects by what was said of them; each with its probability and whether it is true."""
    out = []
    for low, high in pairwise(CONFIDENCE):
        here = [(p, true) for p, true in confidences if low < p <= high or (low == p == 0.0)]
        if here:
            out.append(Reliability(mean(p for p, _ in here), share([true for _, true in here])))
    return out


def weighted_gap(rows: Sequence[Reliability]) -> float | None:
    """Expected calibration error in points: |said - true| by bin, weighed by the number in it."""
    total = sum(r.true.count for r in rows)
    return 100 * sum(abs(r.said * r.true.count - r.true.hits) for r in rows) / total if total else None
