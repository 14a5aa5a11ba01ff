"""A bank of first-order filters: every drive through every time constant, exactly, at irregular readings."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.dynamics.kernel import copy

Array = NDArray[np.float64]
Ints = NDArray[np.intp]


@njit(cache=True)
def filtered(left, right, step, read, taus, start):  # type: ignore[no-untyped-def]
    """Responses of unit gain, tau ds/dt = u - s, at the readings.

    Exact for inputs that are held or run straight within each interval (first-order hold), whatever the
    lengths of the intervals.

    Args:
        left, right: (K, D) inputs at both ends of each interval.
        step: (K,) lengths of the intervals [s].
        read: (R,) ascending nodes at which there are readings; node 0 is where the recording begins.
        taus: (m,) time constants [s].
        start: (D, m) values at node 0.

    Returns:
        (R, D, m)
    """
    count, drives = left.shape
    m = taus.shape[0]
    out = np.empty((read.shape[0], drives, m))
    s = start.copy()
    decay, ramp = np.empty(m), np.empty(m)
    r = 0
    while r < read.shape[0] and read[r] == 0:
        copy(s, out[r])
        r += 1
    before = -1.0
    for k in range(count):
        if r >= read.shape[0]:
            break
        if step[k] != before:
            before = step[k]
            for i in range(m):
                h = before / taus[i]
                decay[i] = np.exp(-h)
                ramp[i] = 1.0 + np.expm1(-h) / h if h > 1e-8 else 0.5 * h
        for d in range(drives):
            a = left[k, d]
            rise = right[k, d] - a
            for i in range(m):
                s[d, i] = a + decay[i] * (s[d, i] - a) + ramp[i] * rise
        while r < read.shape[0] and read[r] == k + 1:
            copy(s, out[r])
            r += 1
    return out
