"""How the values of a column look."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

HELD = 0.5  # share of readings that repeat the one before: what is set, not measured


@dataclass(frozen=True)
class Shape:
    """How values look: `jump`: the third largest step over the span; `slow`: they answer, they do not
    jump.
    """

    low: float
    high: float
    first: float
    jump: float
    count: int
    binary: bool
    whole: bool
    few: int  # different values

    @property
    def span(self) -> float:
        return self.high - self.low

    @property
    def slow(self) -> bool:
        return self.span > 0 and self.jump < 0.15 and self.few > 6


def is_set(values: Array) -> bool:
    """Whether somebody sets a channel (N,), as a target: most readings repeat the one before, and it jumps.

    >>> is_set(np.repeat([0.0, 105.0, 60.0], 20)), is_set(np.linspace(20.0, 30.0, 60).round())
    (True, False)
    """
    known = values[np.isfinite(values)]
    form = shape(known)
    return form is not None and not form.slow and bool(np.mean(np.diff(known) == 0) > HELD)


def shape(values: Array) -> Shape | None:
    """None where nothing was read."""
    known = values[np.isfinite(values)]
    if not known.size:
        return None
    low, high = float(known.min()), float(known.max())
    steps = np.sort(np.abs(np.diff(known)))
    jump = float(steps[-min(3, steps.size)]) / (high - low) if steps.size and high > low else 0.0
    different = np.unique(known)
    return Shape(
        low,
        high,
        float(known[0]),
        jump,
        int(known.size),
        bool(np.isin(different, (0.0, 1.0)).all()),
        bool((different == np.round(different)).all()),
        int(different.size),
    )
