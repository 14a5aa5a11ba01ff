"""Refit the baseline and look whether its residual is white: what is left has no name."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.challenge.problem import Answer, Problem

Array = NDArray[np.float64]

LEVEL = 0.05  # of the family of tests
LAGS = 20


def refit_only(problem: Problem) -> Answer:
    """`unexplained` where a test of the residual fires (5 % over all of them), else `no mismatch`.

    Each series is tested for whiteness, and for its variance by chi-square where the reading noise is stated.
    """
    fit = problem.context.baseline
    p_values = []
    for trajectory in fit.trajectories:
        for name, series in zip(fit.problem.outputs, fit.problem.residual(trajectory).T, strict=True):
            read = series[np.isfinite(series)]
            p_values.append(ljung_box(read, LAGS))
            if sigma := problem.experiment.campaign.channels[name].noise:
                p_values.append(_chi_square(read, sigma))
    p = min(1.0, len(p_values) * min(p_values))
    verdict = "unexplained" if p < LEVEL else "no mismatch"
    return {"verdict": verdict, "physics": [], "alternatives": [], "detection": {"p_value": p}}


def ljung_box(series: Array, lags: int) -> float:
    """p-value of Q = n (n + 2) sum_k r_k^2 / (n - k), chi-square with `lags` degrees of freedom.

    Source: Ljung & Box, Biometrika 65 (1978) 297. 1 for a series not longer than `lags`.
    """
    from scipy.stats import chi2

    n = len(series)
    if n <= lags + 1:
        return 1.0
    x = series - series.mean()
    r = np.array([x[k:] @ x[:-k] for k in range(1, lags + 1)]) / (x @ x)
    return float(chi2.sf(n * (n + 2) * np.sum(r**2 / (n - np.arange(1, lags + 1))), lags))


def _chi_square(series: Array, sigma: float) -> float:
    from scipy.stats import chi2

    return float(chi2.sf(float(series @ series) / sigma**2, len(series)))
