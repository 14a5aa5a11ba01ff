"""Which model to take for each output: what is best on recordings that no fit has seen, and how sure that is.

The squared errors of free runs are averaged over pieces of the recordings; pieces are drawn anew, for all
models alike (paired block bootstrap, Kuensch, Annals of Statistics 17, 1989). Models whose 95 % interval of
the ratio of rms to the best one holds 1 tie with it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PIECES = 8  # of a recording: a day's cycle in hours, which hardly remember each other
WHOLE = 8  # recordings from which whole ones are drawn
DRAWS = 2000
LEVEL = (2.5, 97.5)


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
        """Whether the recordings do not tell the two apart."""
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
        """Models that the recordings do not tell from the best one."""
        return tuple(one.model for one in self.others if one.tie)


def recommend(output: str, left: Mapping[str, Sequence[Array]], seed: int = 0) -> Recommendation | None:
    """What to take for an output; None where fewer than two models, or no reading, can be compared.

    Args:
        left: by model, for each recording: readings minus free run (R,), NaN where nothing was read. A
        model that
            lacks a recording (it ran away) is left out.
        seed: of the draws.
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
    drawn = np.random.default_rng(seed).multinomial(
        len(readings), np.full(len(readings), 1 / len(readings)), size=DRAWS
    )
    drawn = drawn[(drawn @ readings) > 0]
    floor = 1e-300
    logs = 0.5 * np.log(np.maximum(drawn @ squares.T, floor))
    others = []
    for k in np.argsort(total):
        if k == best:
            continue
        low, high = np.percentile(logs[:, best] - logs[:, k], LEVEL)
        ratio = float(np.sqrt(total[best] / max(total[k], floor)))
        ends = 100 * np.expm1(np.array([low, high]))
        rms = float(np.sqrt(total[k] / readings.sum()))
        others.append(Against(names[k], rms, 100 * (ratio - 1), float(ends[0]), float(ends[1])))
    return Recommendation(output, names[best], float(np.sqrt(total[best] / readings.sum())), tuple(others))


def _pieces(rows: Sequence[Array]) -> tuple[Array, Array]:
    """Sum of squares and number of readings of each piece (B,): recordings where there are many, else
    parts.
    """
    parts = 1 if len(rows) >= WHOLE else PIECES
    pieces = [piece for one in rows for piece in np.array_split(one, parts)]
    known = [np.isfinite(piece) for piece in pieces]
    sums = [float(np.sum(piece[seen] ** 2)) for piece, seen in zip(pieces, known, strict=True)]
    return np.array(sums), np.array([int(seen.sum()) for seen in known])
