"""How much better one model is than another on held-out recordings, with a 95 % interval.

The rms of both models is compared in blocks of each recording, and the blocks are drawn anew many times
(block bootstrap; Kuensch, Annals of Statistics 17, 1989). Neighbouring residuals are correlated, so single
readings would give too narrow an interval.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

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
    pairs = []  # of each recording and output: sums of squares by block, of the two
    for recording, output in cells(run, model):
        predictions = run.predictions.get(recording)
        if predictions is None or output not in predictions.models.get(model, {}):
            continue
        mine = predictions.left_over(model, output)
        if other is None:
            theirs = _without(run, predictions.readings[output], output)
        elif output in predictions.models.get(other, {}):
            theirs = predictions.left_over(other, output)
        else:
            continue
        both = np.isfinite(mine) & np.isfinite(theirs)
        if both.sum() >= _BLOCKS:
            pieces = np.array_split(np.flatnonzero(both), _BLOCKS)
            pairs.append(np.array([[np.sum(mine[p] ** 2), np.sum(theirs[p] ** 2)] for p in pieces]))
    if not pairs:
        return Lead(middle, middle, middle, float(middle < 1))
    rng = np.random.default_rng(0)
    logs = np.zeros(_DRAWS)
    for blocks in pairs:
        drawn = blocks[rng.integers(0, len(blocks), (_DRAWS, len(blocks)))].sum(axis=1)
        logs += 0.5 * np.log(np.maximum(drawn[:, 0], 1e-300) / np.maximum(drawn[:, 1], 1e-300)) / len(pairs)
    found = np.exp(logs)
    low, high = np.percentile(found, [2.5, 97.5])
    return Lead(middle, float(low), float(high), float(np.mean(found < 1)))


def _without(run: Run, readings: Array, output: str) -> Array:
    """What is left without a model: errors themselves, temperatures from the first reading on."""
    known = readings[np.isfinite(readings)]
    first = known[0] if known.size and run.unit(output) in ("°C", "K", "°F", "degC") else 0.0
    return np.asarray(readings - first)
