"""Log odds as probabilities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TypeVar

Key = TypeVar("Key", bound=str)


def probabilities(odds: Mapping[Key, float]) -> dict[Key, float]:
    """Probabilities of what excludes each other, the likeliest first.

    >>> {key: round(p, 2) for key, p in probabilities({"s": 0.0, "min": 2.0}).items()}
    {'min': 0.88, 's': 0.12}
    """
    most = max(odds.values())
    weights = {key: math.exp(value - most) for key, value in odds.items()}
    total = sum(weights.values())
    return {key: weights[key] / total for key in sorted(weights, key=lambda k: -weights[k])}


def likely(odds: Mapping[Key, float]) -> tuple[Key, float]:
    """The likeliest, and its probability."""
    return next(iter(probabilities(odds).items()))
