"""Orthogonal matching pursuit over filtered inputs whose time constants move continuously.

The columns of one drive on a grid of time constants are samples of a smooth curve c(p), with p the place on
the grid (log tau in units of its spacing). Between the samples c(p) is their interpolation, w(p)' columns,
so that the normal equations of the grid hold those of *every* set of time constants:

    c(p)'c(q) = w(p)' G w(q),        c(p)'y = w(p)' v.

After each step all time constants of the set are refined together by variable projection (Golub & Pereyra,
Inverse Problems 19, 2003; Gauss-Newton of Kaufman, BIT 15, 1975) on these small matrices: what it costs
does not depend on the number of readings.

Columns stand in families: a family of one column has no time constant (an offset, an input that acts at
once), one of `POINTS` or more is a curve. A term is a family and a place; terms may share a place.
"""

from __future__ import annotations

import numpy as np
from numba import njit

POINTS = 6  # of the interpolation: its error is some 1e-5 of a column for 8 time constants a decade
APART = 1.0  # places of two terms of one family: nearer ones are the slope of a curve, not two masses
_RIDGE = 1e-10  # on columns of unit length
_ROUNDS = 60  # of Levenberg-Marquardt, those that fail too


@njit(cache=True)
def weights(p, m, w, dw):  # type: ignore[no-untyped-def]
    """Weights (POINTS,) of the interpolation at place p of 0 .. m - 1, their slopes; returns the first
    point.
    """
    if m < POINTS:
        w[:], dw[:] = 0.0, 0.0
        w[0] = 1.0
        return 0
    first = min(max(int(np.floor(p)) - POINTS // 2 + 1, 0), m - POINTS)
    x = p - first
    for i in range(POINTS):
        value, slope = 1.0, 0.0
        for j in range(POINTS):
            if j != i:
                slope = (slope * (x - j) + value) / (i - j)
                value = value * (x - j) / (i - j)
        w[i], dw[i] = value, slope
    return first


@njit(cache=True)
def _times(matrix, first, w, out):  # type: ignore[no-untyped-def]
    """out = w' matrix[first : first + POINTS]."""
    out[:] = 0.0
    for i in range(POINTS):
        if w[i] != 0.0:
            row = matrix[first + i]
            for j in range(out.shape[0]):
                out[j] += w[i] * row[j]


@njit(cache=True)
def _dot(row, first, w):  # type: ignore[no-untyped-def]
    total = 0.0
    for i in range(POINTS):
        if w[i] != 0.0:
            total += w[i] * row[first + i]
    return total


@njit(cache=True)
def _solve(a, b):  # type: ignore[no-untyped-def]
    """Solve a x = b for a positive definite a (n, n) and columns b (n, k), both overwritten; b becomes x."""
    n, many = b.shape
    for i in range(n):
        for j in range(i + 1):
            total = a[i, j]
            for k in range(j):
                total -= a[i, k] * a[j, k]
            a[i, j] = np.sqrt(max(total, 1e-30)) if i == j else total / a[j, j]
    for c in range(many):
        for i in range(n):
            total = b[i, c]
            for k in range(i):
                total -= a[i, k] * b[k, c]
            b[i, c] = total / a[i, i]
        for i in range(n - 1, -1, -1):
            total = b[i, c]
            for k in range(i + 1, n):
                total -= a[k, i] * b[k, c]
            b[i, c] = total / a[i, i]


@njit(cache=True)
def bounded(S, b, low, high):  # type: ignore[no-untyped-def]
    """Least squares on normal equations S theta = b within bounds, by an active set (Lawson & Hanson, 1974).

    The coefficient that is farthest beyond a bound is held there, until none is; then one that would rather
    come back is let go.
    """
    n = b.shape[0]
    at = np.zeros(n)  # 0 free, -1 at the lower bound, 1 at the upper one
    theta, a, x = np.zeros(n), np.empty((n, n)), np.empty((n, 1))
    for _ in range(3 * n + 3):
        for i in range(n):
            x[i, 0] = b[i] / np.sqrt(S[i, i])
            for j in range(n):
                a[i, j] = S[i, j] / (np.sqrt(S[i, i]) * np.sqrt(S[j, j]))
                if at[j] != 0:
                    x[i, 0] -= a[i, j] * (low[j] if at[j] < 0 else high[j]) * np.sqrt(S[j, j])
            a[i, i] += _RIDGE
        for i in range(n):
            if at[i] != 0:
                x[i, 0] = (low[i] if at[i] < 0 else high[i]) * np.sqrt(S[i, i])
                for j in range(n):
                    a[i, j] = a[j, i] = 0.0
                a[i, i] = 1.0
        _solve(a, x)
        worst, most = -1, 1e-12
        for i in range(n):
            theta[i] = x[i, 0] / np.sqrt(S[i, i])
            beyond = max(low[i] - theta[i], theta[i] - high[i]) * np.sqrt(S[i, i])
            if at[i] == 0 and beyond > most:
                worst, most = i, beyond
        if worst >= 0:
            at[worst] = -1.0 if theta[worst] < low[worst] else 1.0
            continue
        released, pull = -1, 1e-10
        for i in range(n):
            if at[i] != 0:
                slope = b[i]
                for j in range(n):
                    slope -= S[i, j] * theta[j]
                slope *= -at[i] / np.sqrt(S[i, i])
                if slope > pull:
                    released, pull = i, slope
        if released < 0:
            break
        at[released] = 0.0
    return theta


@njit(cache=True)
def solved(G, v, start, count, g, p, low, high, H, W, dW, first, S):  # type: ignore[no-untyped-def]
    """Coefficients (n,) of the terms (g, p) and what they take off the sum of squares.

    H (n, M), W and dW (n, POINTS), first (n,), S (n, n) are filled on the way: rows of G, weights and their
    columns, the normal equations of the terms.
    """
    n = g.shape[0]
    b, lower, upper = np.empty(n), np.empty(n), np.empty(n)
    for k in range(n):
        first[k] = start[g[k]] + weights(p[k], count[g[k]], W[k], dW[k])
        _times(G, first[k], W[k], H[k])
        b[k] = _dot(v, first[k], W[k])
        lower[k], upper[k] = low[g[k]], high[g[k]]
    for k in range(n):
        for j in range(n):
            S[k, j] = _dot(H[k], first[j], W[j])
        S[k, k] = max(S[k, k], 1e-300)
    theta = bounded(S, b, lower, upper)
    gain = 0.0
    for k in range(n):
        gain += 2 * theta[k] * b[k]
        for j in range(n):
            gain -= theta[k] * S[k, j] * theta[j]
    return theta, gain


@njit(cache=True)
def _scaled(S, a):  # type: ignore[no-untyped-def]
    """a = S with columns of unit length and the ridge."""
    n = S.shape[0]
    for i in range(n):
        for j in range(n):
            a[i, j] = S[i, j] / (np.sqrt(S[i, i]) * np.sqrt(S[j, j]))
        a[i, i] += _RIDGE


@njit(cache=True)
def refine(G, v, start, count, g, p, pole, low, high):  # type: ignore[no-untyped-def]
    """Places (n,), coefficients (n,) and what the terms take off the sum of squares, at the best places
    near p.

    Args:
        G, v: (M, M), (M,) normal equations.
        start, count: (F,) first column and number of columns of each family.
        g, p: (n,) family and place of each term.
        pole: (n,) terms of equal number share their place.
        low, high: (F,) bounds of the coefficients.
    """
    n, M, poles = g.shape[0], v.shape[0], 0
    H, Hd, W, dW = np.empty((n, M)), np.empty((n, M)), np.empty((n, POINTS)), np.empty((n, POINTS))
    first, S, cross, a = np.empty(n, np.int64), np.empty((n, n)), np.empty((n, n)), np.empty((n, n))
    for k in range(n):
        poles = max(poles, pole[k] + 1)
    moving = np.zeros(poles, np.bool_)
    for k in range(n):
        moving[pole[k]] = moving[pole[k]] or count[g[k]] >= POINTS
    gradient, hessian, within = np.empty(poles), np.empty((poles, poles)), np.empty((n, poles))
    damped, move = np.empty((poles, poles)), np.empty((poles, 1))
    best, new, theta, gain = p.copy(), p.copy(), np.zeros(n), -1.0
    damping, failed = 1e-3, 0
    for _ in range(_ROUNDS):
        tried, its = solved(G, v, start, count, g, new, low, high, H, W, dW, first, S)
        if its >= gain:
            change, rise = 0.0, its - gain
            for k in range(n):
                change = max(change, abs(new[k] - best[k]))
                best[k] = new[k]
            settled = gain >= 0 and rise < 1e-9 * its and change < 1e-4
            theta, gain, failed, damping = tried, its, 0, max(damping / 5, 1e-8)
            if settled:
                break
            # slope of the fit with each place: J_q = sum of theta_k c'_k over its terms, their part in the
            # columns
            # of the set taken out
            gradient[:], hessian[:], within[:] = 0.0, 0.0, 0.0
            for k in range(n):
                _times(G, first[k], dW[k], Hd[k])
                slope = _dot(v, first[k], dW[k])
                for j in range(n):
                    cross[k, j] = _dot(Hd[k], first[j], W[j])
                    slope -= theta[j] * cross[k, j]
                    cross[k, j] *= theta[k] / np.sqrt(S[j, j])
                    within[j, pole[k]] += cross[k, j]
                gradient[pole[k]] += theta[k] * slope
            for k in range(n):
                for j in range(n):
                    hessian[pole[k], pole[j]] += theta[k] * theta[j] * _dot(Hd[k], first[j], dW[j])
            _scaled(S, a)
            _solve(a, within)
            for k in range(n):
                for j in range(n):
                    for q in range(poles):
                        hessian[pole[k], q] -= cross[k, j] * within[j, q]
        else:
            failed, damping = failed + 1, damping * 6
            if failed > 8:
                break
        largest = 0.0
        for q in range(poles):
            for r in range(poles):
                damped[q, r] = hessian[q, r] if moving[q] and moving[r] else 0.0
            damped[q, q] += damping * damped[q, q] + (1e-12 + 1e-9 * abs(gradient[q]) if moving[q] else 1.0)
            move[q, 0] = gradient[q] if moving[q] else 0.0
        _solve(damped, move)
        for q in range(poles):
            largest = max(largest, abs(move[q, 0]))
        for k in range(n):
            if count[g[k]] >= POINTS:
                step = move[pole[k], 0] * min(1.0, 2.0 / max(largest, 1e-30))
                new[k] = min(max(best[k] + step, 0.0), count[g[k]] - 1.0)
    return best, theta, gain


@njit(cache=True)
def entry(G, v, start, count, g, p, low, high, barred):  # type: ignore[no-untyped-def]
    """Family and place on the grid of the column that takes most off the sum of squares; -1: none may enter.

    Args:
        barred: (M,) columns that may not enter.
    """
    n, M = g.shape[0], v.shape[0]
    H, W, dW = np.empty((n, M)), np.empty((n, POINTS)), np.empty((n, POINTS))
    first, S, a = np.empty(n, np.int64), np.empty((n, n)), np.empty((n, n))
    theta, _ = solved(G, v, start, count, g, p, low, high, H, W, dW, first, S)
    _scaled(S, a)
    inner = np.empty((n, M))
    for k in range(n):
        for j in range(M):
            H[k, j] /= np.sqrt(S[k, k])
            inner[k, j] = H[k, j]
    _solve(a, inner)
    best, family, place = 0.0, -1, 0
    for f in range(start.shape[0]):
        for i in range(count[f]):
            j = start[f] + i
            left, own = v[j], G[j, j]
            for k in range(n):
                left -= theta[k] * H[k, j] * np.sqrt(S[k, k])
                own -= H[k, j] * inner[k, j]
            barrier = (
                barred[j]
                or own <= 1e-7 * G[j, j]
                or (left > 0 and high[f] <= 0)
                or (left < 0 and low[f] >= 0)
            )
            for k in range(n):
                barrier = barrier or (g[k] == f and (count[f] < POINTS or abs(p[k] - i) < APART))
            if not barrier and left * left / own > best:
                best, family, place = left * left / own, f, i
    return family, place
