"""The compiled kernel: exponential steps of a linear time-varying system and of its sensitivities.

Steps are those of `transitions`, exact for linear terms under held or straight inputs however stiff the
bodies are, and of second order otherwise. No code is compiled per model.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from discovery.dynamics.transitions import matmul


@njit(cache=True, nogil=True)
def copy(a, out):  # type: ignore[no-untyped-def]
    """Fills out = a, both (n, m)."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]


@njit(cache=True, nogil=True)
def left_over(rates, a, x):  # type: ignore[no-untyped-def]
    """Forcing at both ends of each interval, (K, n) each: what state matrices leave of the rates.

    Args:
        rates: (2K, n) of the states at the interval ends.
        a: (K, n, n) state matrices.
        x: (K + 1, n) states at the nodes.
    """
    count, n = a.shape[0], a.shape[1]
    g0, g1 = np.empty((count, n)), np.empty((count, n))
    for k in range(count):
        for i in range(n):
            left, right = rates[2 * k, i], rates[2 * k + 1, i]
            for j in range(n):
                left -= a[k, i, j] * x[k, j]
                right -= a[k, i, j] * x[k + 1, j]
            g0[k, i], g1[k, i] = left, right
    return g0, g1


@njit(cache=True, nogil=True)
def trajectory(which, e, w0, w1, g0, g1, start):  # type: ignore[no-untyped-def]
    """States (K + 1, n) from the start and the forcing at both ends of each interval, g0 and g1 (K, n)."""
    count, n = g0.shape
    x = np.empty((count + 1, n))
    for i in range(n):
        x[0, i] = start[i]
    for k in range(count):
        u = which[k]
        for i in range(n):
            total = 0.0
            for j in range(n):
                total += e[u, i, j] * x[k, j] + w0[u, i, j] * g0[k, j] + w1[u, i, j] * g1[k, j]
            x[k + 1, i] = total
    return x


@njit(cache=True, nogil=True)
def product(a, x, out):  # type: ignore[no-untyped-def]
    """Fills out (n, m) = a x with the first rows of x, four at a time: so sums stay in registers."""
    n, q = a.shape
    m = x.shape[1]
    for i in range(n):
        for c in range(m):
            out[i, c] = 0.0
        j = 0
        while j + 4 <= q:
            a0, a1, a2, a3 = a[i, j], a[i, j + 1], a[i, j + 2], a[i, j + 3]
            for c in range(m):
                out[i, c] += a0 * x[j, c] + a1 * x[j + 1, c] + a2 * x[j + 2, c] + a3 * x[j + 3, c]
            j += 4
        for k in range(j, q):
            for c in range(m):
                out[i, c] += a[i, k] * x[k, c]


@njit(cache=True, nogil=True)
def _show(lever, z, out):  # type: ignore[no-untyped-def]
    """Fills out (Y, m) = lever z with the first rows of z; few states show in an output."""
    for y in range(lever.shape[0]):
        for c in range(out.shape[1]):
            out[y, c] = 0.0
        for i in range(lever.shape[1]):
            factor = lever[y, i]
            if factor != 0.0:
                for c in range(out.shape[1]):
                    out[y, c] += factor * z[i, c]


@njit(cache=True, nogil=True)
def columns(which, ways, start, owner, into, into_scale, source, source_scale, size, read, lever):  # type: ignore[no-untyped-def]
    """Sensitivities of the outputs at the reading instants, as far as states show in them.

    Args:
        which: from `transitions`.
        ways: (U, n, 3n) e, w0 and w1 of it, next to each other.
        start: (n, M) sensitivities at the first node.
        owner: (P,) column that a piece of forcing belongs to.
        into, into_scale: (P,) state that the piece enters and its scale (1/C).
        source, source_scale: (P,) state that it leaves (-1: none) and its scale.
        size: (P, 2K) of the piece at the ends of each interval.
        read: (R,) ascending node indices.
        lever: (R, Y, n) of the states on the outputs there.

    Returns:
        (R, Y, M)
    """
    pieces, count = size.shape[0], size.shape[1] // 2
    n, m = start.shape
    out = np.empty((read.shape[0], lever.shape[1], m))
    z = np.zeros((3 * n, m))  # states, then forcing at the left end of the interval, then at the right end
    new = np.empty((n, m))
    copy(start, z)
    r = 0
    while r < read.shape[0] and read[r] == 0:
        _show(lever[r], z, out[r])
        r += 1
    for k in range(count):
        if r >= read.shape[0]:
            break
        for i in range(n, 3 * n):
            for c in range(m):
                z[i, c] = 0.0
        for p in range(pieces):
            c = owner[p]
            left, right = size[p, 2 * k], size[p, 2 * k + 1]
            i = n + into[p]
            z[i, c] += left * into_scale[p]
            z[i + n, c] += right * into_scale[p]
            i = n + source[p]
            if i >= n:
                z[i, c] -= left * source_scale[p]
                z[i + n, c] -= right * source_scale[p]
        product(ways[which[k]], z, new)
        copy(new, z)
        while r < read.shape[0] and read[r] == k + 1:
            _show(lever[r], z, out[r])
            r += 1
    return out


@njit(cache=True, nogil=True)
def between(which, e, read):  # type: ignore[no-untyped-def]
    """Transition from each reading instant to the next, (R - 1, n, n)."""
    n = e.shape[1]
    count = read.shape[0] - 1
    f = np.empty((count, n, n))
    work = np.empty((n, n))
    for r in range(count):
        for i in range(n):
            for j in range(n):
                f[r, i, j] = 1.0 if i == j else 0.0
        for k in range(read[r], read[r + 1]):
            matmul(e[which[k]], f[r], work)
            copy(work, f[r])
    return f


@njit(cache=True, nogil=True)
def gathered(which, e, read, begun, ended):  # type: ignore[no-untyped-def]
    """Covariance (R - 1, n, n) at each reading instant of what has come since the one before:

        P <- e (P + begun) e^T + ended    over each step, from zero

    Args:
        which, e: (K,) and (M, n, n) transition matrix of each step.
        read: (R,) nodes of the readings.
        begun, ended: (K, n, n) covariance of what comes at the beginning and at the end of each step.
    """
    n = e.shape[1]
    count = max(read.shape[0] - 1, 0)
    found = np.zeros((count, n, n))
    come, work = np.empty((n, n)), np.empty((n, n))
    for r in range(count):
        for k in range(read[r], read[r + 1]):
            for i in range(n):
                for j in range(n):
                    come[i, j] = found[r, i, j] + begun[k, i, j]
            matmul(e[which[k]], come, work)
            for i in range(n):
                for j in range(n):
                    total = ended[k, i, j]
                    for m in range(n):
                        total += work[i, m] * e[which[k], j, m]
                    found[r, i, j] = total
    return found


@njit(cache=True, nogil=True)
def driven(which, e, w0, w1, read, f, heated, floor, share, flow):  # type: ignore[no-untyped-def]
    """The way (R - 1, n, n + q) of the states from each reading instant to the next: f (R - 1, n, n) from
    `between`, then their response to a force at each of some states.

    Args:
        heated: (q,) indices of these states.
        floor, share: (q,) of the force, whose size in interval k is the root of floor^2 + (share flow)^2
            times a number that is held in between.
        flow: (K, n) through each state.
    """
    n, q = e.shape[1], heated.shape[0]
    count = read.shape[0] - 1
    ways = np.zeros((count, n, n + q))
    work = np.empty(n)
    for r in range(count):
        copy(f[r], ways[r])
        for k in range(read[r], read[r + 1]):
            u = which[k]
            for c in range(q):
                s = heated[c]
                size = np.sqrt(floor[c] ** 2 + (share[c] * flow[k, s]) ** 2)
                for i in range(n):
                    total = (w0[u, i, s] + w1[u, i, s]) * size
                    for j in range(n):
                        total += e[u, i, j] * ways[r, j, n + c]
                    work[i] = total
                for i in range(n):
                    ways[r, i, n + c] = work[i]
    return ways
