"""How much of a column answers to other columns: what is warmed follows what warms it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.responses import even_grid, responses

Array = NDArray[np.float64]

_LAGS = (0.0, 0.01, 0.03, 0.1, 0.3, 1.0)  # time constants, of the length of the recording
_APART = 50  # changes are those over this part of the recording: no drift may pass for an answer ...
_DRIFT = 3  # ... nor what a polynomial of so many numbers explains of them


def explained_by(values: Array, drivers: Sequence[Array]) -> float:
    """Share of the changes of a column (N,), beyond a slow drift, that first-order responses to others (N,)
    explain; from 0 to 1.

    >>> from discovery.recordings.responses import filtered
    >>> heat = np.repeat([0.0, 1.0, 0.0, 0.5], 200)
    >>> body = filtered(heat, 1.0, 80.0)
    >>> explained_by(body, [heat]) > 0.99
    True
    >>> drift = np.random.default_rng(0).normal(size=800).cumsum()
    >>> explained_by(drift, [heat]) < 0.5
    True
    """
    known = np.isfinite(values)
    if not known.any() or np.ptp(values[known]) == 0.0:
        return 0.0
    rows = np.arange(len(values), dtype=float)
    at = even_grid(rows)
    inputs = {str(k): driver for k, driver in enumerate(drivers)}
    F = responses(inputs, rows, dict.fromkeys(inputs, "held"), at, [lag * len(rows) for lag in _LAGS])
    y, apart = np.interp(at, rows[known], values[known]), max(1, len(at) // _APART)
    change, answers = y[apart:] - y[:-apart], F[apart:] - F[:-apart]
    answers = answers / np.maximum(np.linalg.norm(answers, axis=0), 1e-300)
    slow = np.vander(np.linspace(-1.0, 1.0, len(change)), _DRIFT)
    left = [
        change - some @ np.linalg.lstsq(some, change, rcond=1e-8)[0]
        for some in (slow, np.hstack([slow, answers]))
    ]
    return float(1.0 - np.mean(left[1] ** 2) / max(np.mean(left[0] ** 2), 1e-300))
