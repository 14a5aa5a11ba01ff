"""Worked examples: what a formula of the catalogue gives for numbers that can be checked with a pencil."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.effects.form import Example
from discovery.terms import evaluate, parse

Array = NDArray[np.float64]


def worked(formula: str, example: Example) -> float:
    """What a formula gives for an example.

    >>> worked("lag(x, tau)", Example({"x": 1.0, "tau": 100.0}, 0.6321, before={"x": 0.0}, since=100.0))
    0.6321205588285577
    """
    pairs = {n: np.array([example.before.get(n, now), now]) for n, now in example.values.items()}
    result = evaluate(parse(formula), pairs, memory=_Step(pairs, example.since)).value
    return float(np.broadcast_to(result, (2,))[1])


@dataclass(frozen=True)
class _Step:
    """Memory of series (2,) that were settled at the first value and stepped to the second some time ago."""

    pairs: Mapping[str, Array]
    since: float

    def delayed(self, channel: str, seconds: float) -> tuple[Array, Array]:
        before, now = self.pairs[channel]
        return np.array([before, now if seconds <= self.since else before]), np.zeros(2)

    def lagged(self, value: Array, time_constant: float) -> Array:
        before, now = np.broadcast_to(value, (2,))
        return np.array([before, now + (before - now) * np.exp(-self.since / time_constant)])

    def play(self, value: Array, width: float) -> tuple[Array, NDArray[np.intp], Array]:
        before, now = np.broadcast_to(value, (2,))
        return np.array([before, np.clip(before, now - width, now + width)]), np.arange(2), np.zeros(2)
