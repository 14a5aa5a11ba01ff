"""Compiled recursions along one series: play, lag, and where a long one has moved."""

from __future__ import annotations

import numpy as np
from numba import njit


@njit(cache=True, nogil=True)
def moved(values, base, far):  # type: ignore[no-untyped-def]
    """At which instants (T,) any of the values (T, C) is farther than `far` from what it was at the last one
    that was such an instant or one of `base` (T,).
    """
    found = np.zeros(values.shape[0], np.bool_)
    last = values[0].copy()
    for k in range(values.shape[0]):
        for c in range(values.shape[1]):
            if abs(values[k, c] - last[c]) > far:
                found[k] = True
        if found[k] or base[k]:
            for c in range(values.shape[1]):
                last[c] = values[k, c]
    return found


@njit(cache=True, nogil=True)
def tridiagonal(below, own, above, wanted):  # type: ignore[no-untyped-def]
    """Solution (T,) of equations with three diagonals (T,), each in the place of its row, by elimination with
    exchanged rows where the next one is larger.
    """
    count = len(own)
    d, u, x = own.copy(), above.copy(), wanted.copy()
    far = np.zeros(count)  # the diagonal that exchanges make
    for k in range(count - 1):
        if abs(below[k + 1]) > abs(d[k]):
            factor = d[k] / below[k + 1]
            d[k], own_next, above_next = below[k + 1], d[k + 1], u[k + 1]
            d[k + 1] = u[k] - factor * own_next
            u[k], far[k] = own_next, above_next
            u[k + 1] = -factor * above_next
            x[k], x[k + 1] = x[k + 1], x[k] - factor * x[k + 1]
        else:
            factor = below[k + 1] / d[k]
            d[k + 1] -= factor * u[k]
            x[k + 1] -= factor * x[k]
    for k in range(count - 1, -1, -1):
        if k + 1 < count:
            x[k] -= u[k] * x[k + 1]
        if k + 2 < count:
            x[k] -= far[k] * x[k + 2]
        x[k] /= d[k]
    return x


@njit(cache=True, nogil=True)
def play(series, width):  # type: ignore[no-untyped-def]
    """Play operator y = max(x - w, min(x + w, y_before)), starting at rest in the middle.

    Returns:
        y (N,), index of the instant whose x it follows (N,), side of the contact (N,): 1, -1, or 0 before
        any.
    """
    n = series.shape[0]
    y = np.empty(n)
    follows = np.zeros(n, np.int64)
    contact = np.zeros(n)
    y[0] = series[0]
    for k in range(1, n):
        y[k] = y[k - 1]
        follows[k] = follows[k - 1]
        contact[k] = contact[k - 1]
        if series[k] - width > y[k]:
            y[k] = series[k] - width
            follows[k] = k
            contact[k] = 1.0
        elif series[k] + width < y[k]:
            y[k] = series[k] + width
            follows[k] = k
            contact[k] = -1.0
    return y, follows, contact


@njit(cache=True, nogil=True)
def lag_ends(series, step, tau):  # type: ignore[no-untyped-def]
    """First-order lag of a series on interval ends (2K,) that runs straight within each interval; starts
    settled.
    """
    out = np.empty_like(series)
    y = series[0]
    for k in range(step.shape[0]):
        a, b = series[2 * k], series[2 * k + 1]
        h = step[k] / tau
        decay = np.exp(-h)
        ramp = 1.0 - (1.0 - decay) / h if h > 1e-8 else 0.5 * h
        out[2 * k] = y
        y = decay * y + (1.0 - decay) * a + ramp * (b - a)
        out[2 * k + 1] = y
    return out
