"""Ridge regression on the inputs; left-out data choose its strength."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import make_grid
from discovery.fitting.fit import Fit
from discovery.fitting.held import held_fit
from discovery.models.regression import regression
from discovery.recordings import Campaign

Array = NDArray[np.float64]

STRENGTHS = np.geomspace(1e-4, 1e4, 17)  # of the ridge, on standardised inputs, per reading
PARTS = 5  # that a single recording is cut into; several recordings are left out one by one


def fit_ridge(
    campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], inputs: Sequence[str]
) -> Fit:
    """Ridge regression (Hoerl & Kennard, Technometrics 12, 1970) of each output on the inputs at its
    readings.

    The strength is the one that predicts recordings that were left out best (parts of a single one).
    Intervals are those of the ridge estimate at white noise.
    """
    values: dict[str, float] = {}
    errors: dict[str, float] = {}
    for output in outputs:
        grids = [make_grid(campaign, r, inputs, [output]) for r in recordings]
        x = [np.column_stack([g.nodes[u][g.read] for u in inputs]) for g in grids]
        y = [g.readings[:, 0] for g in grids]
        groups = [np.full(len(one), i) for i, one in enumerate(y)]
        if len(y) == 1:
            groups = [np.arange(len(y[0])) * PARTS // len(y[0])]
        theta, error = _ridge(np.concatenate(x), np.concatenate(y), np.concatenate(groups))
        names = [f"b{k}_{output}" for k in range(len(inputs) + 1)]
        values |= dict(zip(names, theta.tolist(), strict=True))
        errors |= dict(zip(names, error.tolist(), strict=True))
    model = regression(inputs, outputs, campaign.channels).with_values(values)
    return held_fit(model, campaign, recordings, outputs, errors)


def _ridge(x: Array, y: Array, groups: Array) -> tuple[Array, Array]:
    """Coefficients (1 + U,), the constant first, and their standard errors."""
    known = np.isfinite(y)
    x, y, groups = x[known], y[known], groups[known]
    centre, scale = x.mean(axis=0), np.maximum(x.std(axis=0), 1e-12)
    z = (x - centre) / scale
    left = np.zeros(len(STRENGTHS))
    for group in np.unique(groups):
        out = groups == group
        if out.all():
            break
        middle = y[~out].mean()
        a, b = z[~out].T @ z[~out], z[~out].T @ (y[~out] - middle)
        for k, strength in enumerate(STRENGTHS):
            theta = np.linalg.solve(a + strength * np.eye(len(a)), b)
            left[k] += float(np.sum((y[out] - middle - z[out] @ theta) ** 2))
    a = z.T @ z
    inverse = np.linalg.inv(a + STRENGTHS[int(np.argmin(left))] * np.eye(len(a)))
    theta = inverse @ z.T @ (y - y.mean())
    noise = float(np.sum((y - y.mean() - z @ theta) ** 2)) / max(len(y) - len(theta) - 1, 1)
    covariance = noise * inverse @ a @ inverse
    slope = theta / scale
    error = np.sqrt(np.diag(covariance)) / scale
    constant = y.mean() - centre @ slope
    spread = noise / len(y) + (centre / scale) @ covariance @ (centre / scale)
    return np.r_[constant, slope], np.r_[np.sqrt(spread), error]
