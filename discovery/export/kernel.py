"""The compiled interpreter of straight-line programs and of the fixed step (see `stepper.INTEGRATOR`).

One kernel advances any exported model; no code is compiled per model.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from discovery.export.program import OPERATIONS

CODE = {name: np.int64(k) for k, name in enumerate(OPERATIONS)}
ORDER = 12  # of the Taylor series; with a norm of 1/2 its remainder is below 2e-14 of the increment
LARGEST_NORM = 0.5  # of A times the sub-step
LARGEST_SUBSTEPS = 4096  # stiffer than this is no thermal model

(
    _CONSTANT, _INPUT, _, _STATE, _DELAYED, _PLAYED, _TIME,
    _NEG, _ABS, _EXP, _LOG, _SQRT, _TANH, _SIGN,
    _ADD, _SUB, _MUL, _DIV, _POW, _LT, _LE, _GT, _GE, _EQ, _NE, _MIN, _MAX, _SELECT,
) = (int(CODE[name]) for name in OPERATIONS)  # fmt: skip


@njit(cache=True, error_model="numpy")
def run(table, value, r, u, x, d, p, t):  # type: ignore[no-untyped-def]  # noqa: C901 - a line an operation
    """Fill the numbers r (I,) of a program: table (I, 5) of operation, three arguments, index; value (I,)."""
    for k in range(table.shape[0]):
        op = table[k, 0]
        if op == _CONSTANT:
            r[k] = value[k]
            continue
        if op == _INPUT:
            r[k] = u[table[k, 4]]
            continue
        if op == _STATE:
            r[k] = x[table[k, 4]]
            continue
        if op == _DELAYED:
            r[k] = d[table[k, 4]]
            continue
        if op == _PLAYED:
            r[k] = p[table[k, 4]]
            continue
        if op == _TIME:
            r[k] = t
            continue
        a = r[table[k, 1]]
        b = r[table[k, 2]]
        if op == _ADD:
            r[k] = a + b
        elif op == _SUB:
            r[k] = a - b
        elif op == _MUL:
            r[k] = a * b
        elif op == _DIV:
            r[k] = a / b
        elif op == _POW:
            r[k] = a**b
        elif op == _NEG:
            r[k] = -a
        elif op == _ABS:
            r[k] = abs(a)
        elif op == _EXP:
            r[k] = np.exp(a if a < 500.0 else 500.0)
        elif op == _LOG:
            r[k] = np.log(a)
        elif op == _SQRT:
            r[k] = np.sqrt(a)
        elif op == _TANH:
            r[k] = np.tanh(a)
        elif op == _SIGN:
            r[k] = 1.0 if a > 0.0 else (-1.0 if a < 0.0 else 0.0)
        elif op == _LT:
            r[k] = 1.0 if a < b else 0.0
        elif op == _LE:
            r[k] = 1.0 if a <= b else 0.0
        elif op == _GT:
            r[k] = 1.0 if a > b else 0.0
        elif op == _GE:
            r[k] = 1.0 if a >= b else 0.0
        elif op == _EQ:
            r[k] = 1.0 if a == b else 0.0
        elif op == _NE:
            r[k] = 1.0 if a != b else 0.0
        elif op == _MIN:
            r[k] = a if a < b else b
        elif op == _MAX:
            r[k] = a if a > b else b
        else:
            r[k] = b if a != 0.0 else r[table[k, 3]]


@njit(cache=True, error_model="numpy")
def _times(row, column, a, v, out):  # type: ignore[no-untyped-def]
    out[:] = 0.0
    for k in range(row.shape[0]):
        out[row[k]] += a[k] * v[column[k]]


@njit(cache=True, error_model="numpy")
def increment(row, column, a, f, h, z):  # type: ignore[no-untyped-def]
    """z = h phi1(h A) f by sub-steps of z' = A z + f, each by its Taylor series; False: A is too stiff."""
    n = f.shape[0]
    norm = 0.0
    sums = np.zeros(n)
    for k in range(row.shape[0]):
        sums[row[k]] += abs(a[k])
    for i in range(n):
        if sums[i] > norm:
            norm = sums[i]
    substeps = 1
    needed = norm * h / LARGEST_NORM
    if not needed < LARGEST_SUBSTEPS:
        return False
    while substeps < needed:
        substeps += 1
    tau = h / substeps
    v = np.empty(n)
    w = np.empty(n)
    z[:] = 0.0
    for _ in range(substeps):
        _times(row, column, a, z, v)
        for i in range(n):
            v[i] = (v[i] + f[i]) * tau
            z[i] += v[i]
        for j in range(2, ORDER + 1):
            _times(row, column, a, v, w)
            for i in range(n):
                v[i] = w[i] * (tau / j)
                z[i] += v[i]
    return True


@njit(cache=True, error_model="numpy")
def advance(rates, outputs, row, column, delays, part, h, u, x, c, d, p, ring, position, count, y):  # type: ignore[no-untyped-def]
    """Step through inputs u (K, U), writing outputs y (K, Y); stops before a step that is not finite.

    Args:
        rates, outputs: (table, value, results) of the programs.
        delays: (D, 3) input, offset of the ring and its length; part (D,).
        x, c, d, p, ring, position: the running state, changed in place. count: steps done since the start.

    Returns:
        Number of steps done.
    """
    n, outs, plays = x.shape[0], y.shape[1], p.shape[0]
    entries = row.shape[0]
    r = np.empty(rates[0].shape[0])
    q = np.empty(outputs[0].shape[0])
    f = np.empty(n)
    a = np.empty(entries)
    z = np.empty(n)
    moved = np.empty(plays)
    new = np.empty(n)
    carry = np.empty(n)
    for k in range(u.shape[0]):
        for j in range(delays.shape[0]):
            offset, length = delays[j, 1], delays[j, 2]
            here = (position[j] + 1) % length
            ring[offset + here] = u[k, delays[j, 0]]
            d[j] = (1.0 - part[j]) * ring[offset + (here + 2) % length] + part[j] * ring[
                offset + (here + 1) % length
            ]
        run(rates[0], rates[1], r, u[k], x, d, p, (count + k) * h)
        for i in range(n):
            f[i] = r[rates[2][i]]
        for i in range(entries):
            a[i] = r[rates[2][n + i]]
        for i in range(plays):
            moved[i] = r[rates[2][n + entries + i]]
        good = increment(row, column, a, f, h, z)
        for i in range(n):
            step = z[i] - c[i]
            new[i] = x[i] + step
            carry[i] = (new[i] - x[i]) - step
        run(outputs[0], outputs[1], q, u[k], new, d, moved, (count + k + 1) * h)
        for i in range(n):
            good = good and abs(new[i]) < 1e30
        for i in range(outs):
            good = good and abs(q[outputs[2][i]]) < 1e30
        if not good:
            return k
        for i in range(n):
            x[i] = new[i]
            c[i] = carry[i]
        for i in range(plays):
            p[i] = q[outputs[2][outs + i]]
        for i in range(outs):
            y[k, i] = q[outputs[2][i]]
        for j in range(delays.shape[0]):
            position[j] = (position[j] + 1) % delays[j, 2]
    return u.shape[0]
