"""The paper's quality criteria of an error, and what a compensation improves of them.

    P_V = max |e_k|        M_V = 1/N sum e_k        Q_M = 1/N sum (e_k - M_V)^2

(Tables 1 and 3 of "Compensation of cutting fluid influences on five axis machine tools"), with the root mean
square and R2 added. The mean alone is a weak criterion: a model may be right on average and wrong all
day.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Criteria:
    """Criteria of one error on one recording, in its unit (variance: unit squared)."""

    rms: float
    peak: float  # P_V, largest magnitude
    mean: float  # M_V
    variance: float  # Q_M, about the mean


def criteria(error: Array) -> Criteria:
    """Criteria of the readings that exist.

    Args:
        error: (N,) error, or what a compensation leaves of it; NaN where nothing was read.

    >>> criteria(np.array([-4.0, 4.0, np.nan, -3.0, 3.0]))
    Criteria(rms=3.5355339059327378, peak=4.0, mean=0.0, variance=12.5)
    """
    e = error[np.isfinite(error)]
    if not len(e):
        return Criteria(math.nan, math.nan, math.nan, math.nan)
    mean = float(np.mean(e))
    variance = float(np.mean((e - mean) ** 2))
    return Criteria(float(np.sqrt(np.mean(e**2))), float(np.max(np.abs(e))), mean, variance)


def improvement(before: Criteria, after: Criteria) -> dict[str, float]:
    """Improvement of each criterion's magnitude in percent: 100 (1 - |after|/|before|); NaN where nothing was
    wrong.

    >>> round(improvement(Criteria(9, 49, -35, 73), Criteria(3, 16, 6, 6))["mean"])
    83
    """
    was, now = asdict(before), asdict(after)
    return {key: 100.0 * (1.0 - abs(now[key]) / abs(was[key])) if was[key] else math.nan for key in was}


def evaluate(reading: Array, prediction: Array, reference: float = 0.0) -> dict[str, Any]:
    """Everything that results say about one error of one model on one recording.

    Args:
        reading: (N,) measured error, NaN where it was not read.
        prediction: (N,) what the model gives at the same instants.
        reference: what would be assumed without a model: 0 for an error, the first reading for a temperature.

    Returns:
        rms, peak, mean, variance of reading minus prediction, r2 (share of the error's variance explained),
        the same of the `uncompensated` error, and the `improvement` in percent.
    """
    left, raw = criteria(reading - prediction), criteria(reading - reference)
    r2 = 1.0 - left.rms**2 / raw.variance if raw.variance > 0 else math.nan
    return {**asdict(left), "r2": r2, "uncompensated": asdict(raw), "improvement": improvement(raw, left)}
