"""Time constants and settling times of a warm-up, figure 3 of the paper.

    y(t) = y_end - (y_end - y_0) exp(-t/tau)

One time constant is a summary, not a law: a table of several bodies has several. So the table
also gives the time after which the readings stay within a tenth of the whole change of its end.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Settling:
    """Of one error over one phase. `change`: y_end - y_0 of the exponential, in the unit of the error;
    `tau_h` with its standard error `tau_sd`; `settled_h`: from here on readings stay within a tenth of the
    change of where the exponential ends, NaN if they do not before the phase ends; `largest`: magnitude read.
    """

    change: float
    tau_h: float
    tau_sd: float
    settled_h: float
    largest: float


def settling(time_s: Array, error: Array, smooth: int = 5) -> Settling | None:
    """Time constant and settling time of one phase; None for fewer than 8 readings, or no change beyond the
    scatter of the readings.

    Args:
        time_s: (N,) instants in s. error: (N,), NaN where not read.
        smooth: readings in the running median that the settling time is taken from.
    """
    from scipy.optimize import least_squares

    seen = np.isfinite(error)
    t, y = (time_s[seen] - time_s[seen][:1]) / 3600.0, error[seen]
    if len(y) < 8:
        return None

    def residual(p: Array) -> Array:
        return np.asarray(p[1] - (p[1] - p[0]) * np.exp(-t / np.exp(p[2])) - y)

    span = float(t[-1])
    starts = [np.array([y[0], y[-1], np.log(span * share)]) for share in (0.05, 0.2, 0.6)]
    bounds = ([-np.inf, -np.inf, np.log(span / 500)], [np.inf, np.inf, np.log(3 * span)])
    found = min((least_squares(residual, p, bounds=bounds) for p in starts), key=lambda one: one.cost)
    y0, end, log_tau = found.x
    scatter = float(np.sqrt(2 * found.cost / max(len(y) - 3, 1)))
    if abs(end - y0) < 3 * scatter / np.sqrt(len(y)):
        return None
    jacobian = np.asarray(found.jac, dtype=np.float64)
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * scatter**2
    tau = float(np.exp(log_tau))
    half = smooth // 2
    calm = np.array([np.median(y[max(0, k - half) : k + half + 1]) for k in range(len(y))])
    outside = np.flatnonzero(np.abs(calm - end) > 0.1 * abs(end - y0))
    settled = float(t[outside[-1] + 1]) if len(outside) and outside[-1] + 1 < len(t) - smooth else np.nan
    if not len(outside):
        settled = 0.0
    return Settling(
        float(end - y0), tau, tau * float(np.sqrt(covariance[2, 2])), settled, float(np.max(np.abs(y)))
    )
