"""Which model to take for each output: what is best on recordings that no fit has seen, and how sure that is.

The squared errors of free runs are averaged over pieces of the recordings. The logarithm of the ratio of
two rms has the standard error of the block jackknife, pieces left out one by one (Efron & Stein, Annals of
Statistics 9, 1981; Kuensch, Annals of Statistics 17, 1989). Models whose 95 % interval of the ratio to the
best one holds 1 tie with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PIECES = 8  # of a recording: a day's cycle in hours, which hardly remember each other
WHOLE = 8  # recordings from which on a piece is a whole one


@dataclass(frozen=True)
class Against:
    """A model against the best one: how much less (percent, negative) rms the best one leaves, 95 %
    interval.
    """

    model: str
    rms: float
    difference: float
    low: float
    high: float

    @property
    def tie(self) -> bool:
        """Whether the recordings do not distinguish the two."""
        return self.low <= 0.0 <= self.high


@dataclass(frozen=True)
class Recommendation:
    """The best model of an output on what was not fitted, and the others, best first."""

    output: str
    best: str
    rms: float
    others: tuple[Against, ...]

    @property
    def ties(self) -> tuple[str, ...]:
        """Models that the recordings do not distinguish from the best one."""
        return tuple(one.model for one in self.others if one.tie)


def recommend(output: str, left: Mapping[str, Sequence[Array]]) -> Recommendation | None:
    """What to take for an output; None where fewer than two models, or no reading, can be compared.

    Args:
        left: by model, for each recording: readings minus free run (R,), NaN where nothing was read. A model
            that lacks a recording (it ran away) is left out.
    """
    count = max((len(rows) for rows in left.values()), default=0)
    names = [name for name, rows in left.items() if len(rows) == count and count]
    if len(names) < 2:
        return None
    sums, counts = zip(*(_pieces(left[name]) for name in names), strict=True)
    squares, readings = np.array(sums), np.array(counts[0])  # (models, B), (B,)
    if readings.sum() == 0 or not np.isfinite(squares).all():
        return None
    total = squares.sum(axis=1)
    best = int(np.argmin(total))
    floor = 1e-300
    rest = np.log(np.maximum(total[:, None] - squares, floor)) / 2  # (models, B), each piece left out
    count = len(readings)
    wide = student95(max(count - 1, 1))
    others = []
    for k in np.argsort(total):
        if k == best:
            continue
        difference = rest[best] - rest[k]
        error = float(np.sqrt((count - 1) * np.var(difference)))
        middle = 0.5 * float(np.log(max(total[best], floor) / max(total[k], floor)))
        ratio, *ends = 100 * np.expm1(middle + wide * error * np.array([0.0, -1.0, 1.0]))
        rms = float(np.sqrt(total[k] / readings.sum()))
        others.append(Against(names[k], rms, float(ratio), float(ends[0]), float(ends[1])))
    return Recommendation(output, names[best], float(np.sqrt(total[best] / readings.sum())), tuple(others))


def student95(freedom: int) -> float:
    """The 97.5 % quantile of Student's distribution with so many degrees of freedom (Abramowitz & Stegun,
    Handbook of Mathematical Functions, 1964, 26.7.3 and 26.7.4).

    >>> round(student95(1), 4), round(student95(7), 4)
    (12.7062, 2.3646)
    """
    odd = freedom % 2
    orders = np.arange(2 + odd, freedom - 1, 2)
    factors = np.cumprod(np.concatenate([[1.0], (orders - 1) / orders]))

    def inside(angle: float) -> float:
        """Probability that the magnitude is below tan(angle) times the root of the freedom."""
        powers = np.cos(angle) ** (2 * np.arange(len(factors)))
        total = float(np.sin(angle) * (factors @ powers))
        if not odd:
            return total
        return 2 / np.pi * (angle + (float(np.cos(angle)) * total if freedom > 1 else 0.0))

    low, high = 0.0, float(np.pi / 2)
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (middle, high) if inside(middle) < 0.95 else (low, middle)
    return float(np.tan(middle) * np.sqrt(freedom))


def _pieces(rows: Sequence[Array]) -> tuple[Array, Array]:
    """Sum of squares and number of readings of each piece (B,): recordings where there are many, else
    parts.
    """
    parts = 1 if len(rows) >= WHOLE else PIECES
    pieces = [piece for one in rows for piece in np.array_split(one, parts)]
    known = [np.isfinite(piece) for piece in pieces]
    sums = [float(np.sum(piece[seen] ** 2)) for piece, seen in zip(pieces, known, strict=True)]
    return np.array(sums), np.array([int(seen.sum()) for seen in known])
