"""Transition matrices of the intervals of a linear time-varying system, many side by side.

With x' = A x + g(t), constant A and g running straight from g0 to g1:

    x1 = E x0 + W0 g0 + W1 g1,   E = exp(hA),  W1 = h phi2(hA),  W0 = h phi1(hA) - W1,
    phi1(z) = (e^z - 1)/z,  phi2(z) = (phi1(z) - 1)/z        (Hochbruck & Ostermann, Acta Numerica 19, 2010)

by scaling and squaring. Arrays are copied number by number: what numba compiles for an assignment to a part
of an array, with its message for shapes that do not fit, takes it five seconds.
"""

from __future__ import annotations

from math import factorial

import numpy as np
from numba import njit

# 1/(i + 2)! of the series of phi2; what follows m^12 is below rounding for a scaled norm of 1/2
_TAYLOR = np.array([1.0 / factorial(i + 2) for i in range(13)])
_FEW = 8  # matrices that are worked on one after the other: they have less from it than short loops cost
_LANES = 32  # matrices that are worked on side by side: they stay in the nearest memory of a processor
_LOOKBACK = 12  # recent transitions looked through before a new one is computed


@njit(cache=True, nogil=True)
def matmul(a, b, out):  # type: ignore[no-untyped-def]
    """Fills out (n, m) = a b."""
    n, m = a.shape[0], b.shape[1]
    for i in range(n):
        for j in range(m):
            total = 0.0
            for k in range(n):
                total += a[i, k] * b[k, j]
            out[i, j] = total


@njit(cache=True, nogil=True)
def _sum(factor, a, times, b, out):  # type: ignore[no-untyped-def]
    """Fills out = factor (a + times b), all (N,)."""
    for i in range(a.shape[0]):
        out[i] = factor * (a[i] + times * b[i])


@njit(cache=True, nogil=True)
def _products(a, b, out):  # type: ignore[no-untyped-def]
    """Fills out = a b, all (n, n, L) of L matrices side by side: a processor works on several at once."""
    n, lanes = a.shape[0], a.shape[2]
    if lanes == 1:
        matmul(a.reshape(n, n), b.reshape(n, n), out.reshape(n, n))
        return
    for i in range(n):
        for j in range(n):
            for c in range(lanes):
                out[i, j, c] = a[i, 0, c] * b[0, j, c]
            for k in range(1, n):
                for c in range(lanes):
                    out[i, j, c] += a[i, k, c] * b[k, j, c]


@njit(cache=True, nogil=True)
def _add_identity(factor, out):  # type: ignore[no-untyped-def]
    """Adds factor times the identity to each of the matrices (n, n, L)."""
    for i in range(out.shape[0]):
        for c in range(out.shape[2]):
            out[i, i, c] += factor


@njit(cache=True, nogil=True)
def _halvings(a, h):  # type: ignore[no-untyped-def]
    """How often h a is halved until its norm is 1/2 at most; -1 where it is no number or far too large."""
    norm = 0.0
    for i in range(a.shape[0]):
        row = 0.0
        for j in range(a.shape[1]):
            row += abs(a[i, j]) * h
        norm = max(norm, row)
        if not row < 1e12:  # also NaN
            return -1
    count = 0
    while norm > 0.5:
        norm *= 0.5
        count += 1
    return count


@njit(cache=True, nogil=True)
def _phi(halvings, m, room):  # type: ignore[no-untyped-def]
    """Return e^z, phi1(z) and phi2(z) of z = 2^halvings m, each (n, n, L) with L matrices side by side;
    `room` (7, n, n, L) for them and what comes between.
    """
    # phi2 = sum m^i / (i + 2)! up to m^12 from m to m^4 (Paterson & Stockmeyer, SIAM J. Comput. 2, 1973)
    m2, m3, m4 = room[0], room[1], room[2]
    e, phi1, phi2, work = room[3], room[4], room[5], room[6]
    _products(m, m, m2)
    _products(m, m2, m3)
    _products(m2, m2, m4)
    _sum(_TAYLOR[12], m4.ravel(), 0.0, m4.ravel(), phi2.ravel())
    for block in (8, 4, 0):
        one, two, three, out = m.ravel(), m2.ravel(), m3.ravel(), phi2.ravel()
        for i in range(out.shape[0]):
            out[i] += (
                _TAYLOR[block + 1] * one[i] + _TAYLOR[block + 2] * two[i] + _TAYLOR[block + 3] * three[i]
            )
        _add_identity(_TAYLOR[block], phi2)
        if block:
            _products(m4, phi2, work)
            phi2, work = work, phi2
    _products(m, phi2, phi1)
    _add_identity(1.0, phi1)
    _products(m, phi1, e)
    _add_identity(1.0, e)
    for _ in range(halvings):
        _products(phi1, phi1, work)
        _sum(0.25, work.ravel(), 2.0, phi2.ravel(), phi2.ravel())
        _products(phi1, e, work)
        _sum(0.5, work.ravel(), 1.0, phi1.ravel(), phi1.ravel())
        _products(e, e, work)
        e, work = work, e
    return e, phi1, phi2


@njit(cache=True, nogil=True)
def _exponentials(a, h, first):  # type: ignore[no-untyped-def]
    """Return e, w0 and w1 (U, n, n) of the intervals `first` (U,) of a (K, n, n) and h (K,)."""
    used, n = first.shape[0], a.shape[1]
    e, w0, w1 = np.empty((used, n, n)), np.empty((used, n, n)), np.empty((used, n, n))
    halvings = np.empty(used, np.int64)
    for u in range(used):
        halvings[u] = _halvings(a[first[u]], h[first[u]])
    order = np.argsort(halvings, kind="mergesort")  # only those with as many halvings go together
    flat = np.empty(8 * n * n * (_LANES if used >= _FEW else 1))
    begin = 0
    while begin < used:
        halved, end = halvings[order[begin]], begin + 1
        while end < used and end - begin < _LANES and halvings[order[end]] == halved:
            end += 1
        lanes = end - begin if end - begin >= _FEW else 1
        room = flat[: 8 * n * n * lanes].reshape(8, n, n, lanes)
        m = room[7]
        for c in range(lanes):
            k = first[order[begin + c]]
            # what is no number is let through: the caller checks the trajectory
            part = h[k] / 2.0**halved if halved >= 0 else np.nan
            for i in range(n):
                for j in range(n):
                    m[i, j, c] = a[k, i, j] * part
        new, phi1, phi2 = _phi(halved, m, room)
        for c in range(lanes):
            u = order[begin + c]
            step = h[first[u]]
            for i in range(n):
                for j in range(n):
                    e[u, i, j] = new[i, j, c]
                    w1[u, i, j] = step * phi2[i, j, c]
                    w0[u, i, j] = step * (phi1[i, j, c] - phi2[i, j, c])
        begin += lanes
    return e, w0, w1


@njit(cache=True, nogil=True)
def _equal(a, j, k):  # type: ignore[no-untyped-def]
    """Whether the matrices at two places of a (K, n, n) are the same, number by number."""
    for p in range(a.shape[1]):
        for q in range(a.shape[2]):
            if a[j, p, q] != a[k, p, q]:
                return False
    return True


@njit(cache=True, nogil=True)
def transitions(a, h):  # type: ignore[no-untyped-def]
    """Transition matrices of all intervals, each distinct one computed once.

    Args:
        a: (K, n, n) state matrices in 1/s.
        h: (K,) interval lengths in s.

    Returns:
        which (K,) and e, w0, w1 (U, n, n): interval k uses e[which[k]] and so on.
    """
    count = a.shape[0]
    which, first = np.empty(count, np.int64), np.empty(count, np.int64)
    used = 0
    for k in range(count):
        found = -1
        for u in range(used - 1, max(used - 1 - _LOOKBACK, -1), -1):
            j = first[u]
            if h[j] == h[k] and _equal(a, j, k):
                found = u
                break
        if found < 0:
            first[used] = k
            found = used
            used += 1
        which[k] = found
    return which, *_exponentials(a, h, first[:used])
