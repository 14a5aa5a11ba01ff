"""The lead of one model over another on held-out recordings, with a 95 % interval.

The rms of both models is compared in blocks of each recording, and the blocks are resampled many times (block
bootstrap; Kuensch, Annals of Statistics 17, 1989). Neighbouring residuals are correlated, so single readings
would give too narrow an interval.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from discovery.report.ranking import cells, ratio
from discovery.report.run import Run

Array = NDArray[np.float64]

_BLOCKS = 12  # of each recording
_DRAWS = 1000


@dataclass(frozen=True)
class Lead:
    """`ratio`: rms of the winner over that of another model (or of none), with its 95 % interval; `sure`:
    share of the draws in which the winner is better.
    """

    ratio: float
    low: float
    high: float
    sure: float


def lead_over(run: Run, model: str, other: str | None) -> Lead | None:
    """rms of a model over that of another one (None: no model), on held-out recordings (all where none is
    held out); None where the two share none.
    """
    middle = ratio(run, model, other)
    if not math.isfinite(middle):
        return None
    pairs = []
    for recording, output in cells(run, model):
        predictions = run.predictions.get(recording)
        if predictions is None or output not in predictions.models.get(model, {}):
            continue
        mine = predictions.left_over(model, output)
        if other is None:
            pairs.append((mine, _without(run, predictions.readings[output], output)))
        elif output in predictions.models.get(other, {}):
            pairs.append((mine, predictions.left_over(other, output)))
    return lead_of(pairs, middle)


def lead_of(pairs: Sequence[tuple[Array, Array]], middle: float | None = None) -> Lead:
    """The lead of a model from its residuals and those of another one.

    Args:
        pairs: of each recording and output, both residuals (N,); NaN where nothing was read.
        middle: ratio of the rms; else from `pairs`.

    Raises:
        ValueError: neither `middle` nor residuals to compute it from.
    """
    means, blocks = [], []  # of each pair: log ratio of the rms; sums of squares by block (B, 2)
    for mine, theirs in pairs:
        both = np.isfinite(mine) & np.isfinite(theirs)
        squares = np.stack([mine[both] ** 2, theirs[both] ** 2], axis=1)
        if squares.size and middle is None:
            means.append(float(_log_ratio(squares.sum(axis=0))))
        if len(squares) >= _BLOCKS:
            starts = [piece[0] for piece in np.array_split(np.arange(len(squares)), _BLOCKS)]
            blocks.append(np.add.reduceat(squares, starts, axis=0))
    if middle is None:
        if not means:
            raise ValueError("no residuals to compare")
        middle = math.exp(sum(means) / len(means))
    if not blocks:
        return Lead(middle, middle, middle, float(middle < 1))
    logs = sum(_log_ratio(_drawn(k) @ one) for k, one in enumerate(blocks)) / len(blocks)
    found = np.exp(logs)
    low, high = np.percentile(found, [2.5, 97.5])
    return Lead(middle, float(low), float(high), float(np.mean(found < 1)))


def _log_ratio(squares: Array) -> Array:
    """Logarithm of the ratio of two rms from their sums of squares (..., 2)."""
    found: Array = 0.5 * np.diff(np.log(np.maximum(squares, 1e-300)), axis=-1)[..., 0]
    return -found


@cache
def _drawn(number: int) -> Array:
    """Return how often each block of a pair is drawn, (draws, blocks). The draws of each pair are
    independent.
    """
    rng = np.random.default_rng(0)
    for _ in range(number + 1):
        picks = rng.integers(0, _BLOCKS, (_DRAWS, _BLOCKS))
    return np.stack([np.sum(picks == block, axis=1) for block in range(_BLOCKS)], axis=1) * 1.0


def _without(run: Run, readings: Array, output: str) -> Array:
    """Return what remains without a model: the errors themselves, and temperatures relative to their first
    reading.
    """
    known = readings[np.isfinite(readings)]
    first = known[0] if known.size and run.unit(output) in ("°C", "K", "°F", "degC") else 0.0
    return np.asarray(readings - first)
