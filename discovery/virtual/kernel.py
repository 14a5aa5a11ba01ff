"""The kernel of every virtual machine: a linearly implicit step of second order over a sparse network.

ROS2 of Verwer, Spee, Blom, Hundsdorfer (SIAM J. Sci. Comput. 20, 1999, 1456-1480), L-stable, and of second
order with any approximation of the Jacobian. Inputs are held over a step. The Jacobian of a network is nearly
a tree: it is eliminated in an order of least degree, which is found once.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.virtual.network import KELVIN, STEFAN_BOLTZMANN, Form

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

SMALLEST = 1000.0  # parts of a step, at most
GAMMA = 1.0 - 1.0 / np.sqrt(2.0)
RPM = 2.0 * np.pi / 60.0  # rad/s per rpm

# The columns of the integer table of laws.
FORM, INTO, SOURCE, LEAVES, FILM, SWITCH, GATE = range(7)
# The columns of the table of their numbers: size, take, half-wet mass, then five of shape.
SIZE, TAKE, HALF, SHAPE = range(4)

(HEAT, LINK, POWER, RADIATION, VISCOUS, STRIBECK, PRELOAD, EVAPORATION, CONTACT, MELTING) = (
    int(form) for form in Form
)


@njit(cache=True, error_model="numpy")
def vapour(T: float) -> float:
    """Saturated vapour pressure over water relative to 22 degC (Magnus formula)."""
    return float(np.exp(17.62 * T / (243.12 + T) - 17.62 * 22.0 / (243.12 + 22.0)))


@njit(cache=True, error_model="numpy", inline="always")
def flow(form: int, T: float, S: float, g: float, p: Array) -> tuple[float, float, float]:
    """Flow of a law and its slopes in T and S; `p` holds the five numbers of shape."""
    a, b, c = p[0], p[1], p[2]
    if form == LINK:
        return g * (S - T), -g, g
    if form == HEAT:
        return g, 0.0, 0.0
    if form == POWER:
        G = g * abs(S - T) ** a
        return G * (S - T), -G * (1.0 + a), G * (1.0 + a)
    if form == RADIATION:
        s, t, k = S + KELVIN, T + KELVIN, g * STEFAN_BOLTZMANN
        return k * (s**4 - t**4), -4.0 * k * t**3, 4.0 * k * s**3
    if form == VISCOUS:
        q = g * np.exp(a / (S + b) - a / (c + b))
        return q, 0.0, -q * a / (S + b) ** 2
    if form == STRIBECK:
        x = g / 1000.0 * np.exp(a / (S + b) - a / (c + b))
        slope = 0.0 if x <= 0.0 else -p[3] * np.exp(-x) + 2.0 / 3.0 * p[4] * x ** (-1.0 / 3.0)
        torque = p[3] * np.exp(-x) + p[4] * x ** (2.0 / 3.0)
        return g * RPM * torque, 0.0, -g * RPM * slope * x * a / (S + b) ** 2
    if form == PRELOAD:
        grip = max(0.0, 1.0 + a * (T - S))
        slope = 0.0 if grip <= 0.0 else g * a * b * grip ** (b - 1.0)
        return g * grip**b, slope, -slope
    if form == EVAPORATION:
        deficit = vapour(T) - a * vapour(S)
        if deficit <= 0.0:
            return 0.0, 0.0, 0.0
        return -g * deficit, -g * vapour(T) * 17.62 * 243.12 / (243.12 + T) ** 2, 0.0
    if form == CONTACT:
        G = g * (1.0 + a * np.tanh(((T + S) / 2.0 - b) / c))
        return G * (S - T), -G, G
    t = np.tanh((S - a) / b)  # MELTING
    return g * (1.0 + t) / 2.0, 0.0, g * (1.0 - t * t) / (2.0 * b)


@njit(cache=True, error_model="numpy")
def _copy(a: Array, out: Array) -> None:
    """Fills the first numbers of out: an assignment to a part of an array takes numba seconds to compile."""
    for i in range(len(a)):
        out[i] = a[i]


@njit(cache=True, error_model="numpy")
def _factors(on: Array, gate: Array, where: Ints, number: Array, factor: Array) -> None:
    """Fills factor (R,): gate, size and switch of each law, which hold over a step."""
    for r in range(len(where)):
        factor[r] = gate[where[r, GATE]] * number[r, SIZE]
        if where[r, SWITCH] >= 0:
            factor[r] *= on[where[r, SWITCH]]


@njit(cache=True, error_model="numpy", inline="always")
def _law(r: int, y: Array, factor: Array, where: Ints, number: Array) -> tuple[float, float, float]:
    """Flow of law `r` and its slopes, film and switch included."""
    g, film, form = factor[r], where[r, FILM], where[r, FORM]
    if film >= 0:
        mass = max(0.0, y[film])
        g *= mass / (mass + number[r, HALF])
    T, S = y[where[r, INTO]], y[where[r, SOURCE]]
    return flow(form, T, S, g, number[r, SHAPE:])


@njit(cache=True, error_model="numpy")
def _rates(y: Array, factor: Array, where: Ints, number: Array, C: Array, dx: Array) -> None:
    """Fills dx (N,); y (N + M,) holds the nodes and then the series of the inputs."""
    dx[:] = 0.0
    N = len(dx)
    for r in range(len(where)):
        q, _, _ = _law(r, y, factor, where, number)
        i, j = where[r, INTO], where[r, LEAVES]
        if i < N:
            dx[i] += q / C[i]
        if 0 <= j < N:
            dx[j] -= number[r, TAKE] * q / C[j]


@njit(cache=True, error_model="numpy")
def _system(
    y: Array, factor: Array, where: Ints, number: Array, C: Array, h: float, dx: Array, a: Array
) -> None:
    """Fills dx as `_rates` does and a = 1 - h J."""
    dx[:] = 0.0
    N = len(dx)
    for r in range(len(where)):
        q, by_t, by_s = _law(r, y, factor, where, number)
        i, s, j, f = where[r, INTO], where[r, SOURCE], where[r, LEAVES], where[r, FILM]
        by_f = q * number[r, HALF] / (y[f] * (y[f] + number[r, HALF])) if f >= 0 and y[f] > 1e-12 else 0.0
        if i < N:
            dx[i] += q / C[i]
            a[i, i] -= h * by_t / C[i]
            if s < N:
                a[i, s] -= h * by_s / C[i]
            if f >= 0:
                a[i, f] -= h * by_f / C[i]
        if 0 <= j < N:
            share = number[r, TAKE] / C[j]
            dx[j] -= share * q
            if i < N:
                a[j, i] += h * share * by_t
            if s < N:
                a[j, s] += h * share * by_s
            if f >= 0:
                a[j, f] += h * share * by_f


@njit(cache=True, error_model="numpy")
def _factor(a: Array, order: Ints, start: Ints, later: Ints) -> None:
    """Gauss elimination in place; `later[start[k]:start[k+1]]`: neighbours of `order[k]` still there."""
    for k in range(len(order)):
        p = order[k]
        for m in range(start[k], start[k + 1]):
            i = later[m]
            if a[i, p] != 0.0:
                a[i, p] /= a[p, p]
                for o in range(start[k], start[k + 1]):
                    a[i, later[o]] -= a[i, p] * a[p, later[o]]


@njit(cache=True, error_model="numpy")
def _solve(a: Array, order: Ints, start: Ints, later: Ints, b: Array) -> None:
    """Solve with what `_factor` left, in place of b (N,)."""
    for k in range(len(order)):
        for m in range(start[k], start[k + 1]):
            b[later[m]] -= a[later[m], order[k]] * b[order[k]]
    for k in range(len(order) - 1, -1, -1):
        p = order[k]
        for m in range(start[k], start[k + 1]):
            b[p] -= a[p, later[m]] * b[later[m]]
        b[p] /= a[p, p]


@njit(cache=True, error_model="numpy")
def _clear(a: Array, order: Ints, start: Ints, later: Ints) -> None:
    """The unit matrix again, wherever something may stand."""
    for k in range(len(order)):
        p = order[k]
        a[p, p] = 1.0
        for m in range(start[k], start[k + 1]):
            a[later[m], p] = a[p, later[m]] = 0.0


@njit(cache=True, error_model="numpy")
def march(
    x: Array, on: Array, h: float, C: Array, tolerance: Array, where: Ints, number: Array, gates: Array,
    outside: Array, sensor: Ints, target: Array, band: Array, order: Ints, start: Ints, later: Ints,
) -> tuple[Array, Array]:  # fmt: skip
    """Nodes (n + 1, N) and switches (n + 1, S) from x (N,), on (S,).

    A step in which some node is uncertain by more than its tolerance is taken in parts: a film that a pump
    reaches changes within a second.

    Args:
        tolerance: (N,) of the difference between the steps of first and of second order.
        gates: (n, K) factors of the laws. outside: (n, M) series behind the nodes in every index.
        sensor: index of what each switch senses. target: (n, S). band: positive cools, negative heats.
    """
    n, N = len(outside), len(x)
    nodes, switches = np.empty((n + 1, N)), np.empty((n + 1, len(on)))
    y, now = np.empty(N + outside.shape[1]), on.copy()
    factor = np.empty(len(where))
    a, k1, k2, at = np.zeros((N, N)), np.empty(N), np.empty(N), x.copy()
    _copy(x, nodes[0])
    for k in range(n):
        _copy(at, y)
        _copy(outside[k], y[N:])
        for s in range(len(now)):
            above = (y[sensor[s]] - target[k, s]) * np.sign(band[s])
            if abs(above) >= abs(band[s]):
                now[s] = 1.0 if above > 0.0 else 0.0
        _copy(now, switches[k])
        _factors(now, gates[k], where, number, factor)
        done, part = 0.0, h
        while done < h * (1.0 - 1e-9):
            part = min(part, h - done)
            _copy(at, y)
            _clear(a, order, start, later)
            _system(y, factor, where, number, C, GAMMA * part, k1, a)
            _factor(a, order, start, later)
            _solve(a, order, start, later, k1)
            for i in range(N):
                y[i] += part * k1[i]
            _rates(y, factor, where, number, C, k2)
            for i in range(N):
                k2[i] -= 2.0 * k1[i]
            _solve(a, order, start, later, k2)
            worst = 0.0
            for i in range(N):
                worst = max(worst, abs(0.5 * part * (k1[i] + k2[i])) / tolerance[i])
            if worst > 1.0 and part > h / SMALLEST:
                part *= 0.25
                continue
            for i in range(N):
                at[i] += part * (1.5 * k1[i] + 0.5 * k2[i])
            done += part
            if worst < 0.25:
                part *= 4.0
        _copy(at, nodes[k + 1])
    _copy(now, switches[n])
    return nodes, switches


@njit(cache=True, error_model="numpy")
def flows(nodes: Array, switches: Array, where: Ints, number: Array, gates: Array, outside: Array) -> Array:
    """Flow of each law at the beginning of each step, (n, R)."""
    n, N = len(outside), nodes.shape[1]
    out, factor, y = np.empty((n, len(where))), np.empty(len(where)), np.empty(N + outside.shape[1])
    for k in range(n):
        _copy(nodes[k], y)
        _copy(outside[k], y[N:])
        _factors(switches[k], gates[k], where, number, factor)
        for r in range(len(where)):
            out[k, r] = _law(r, y, factor, where, number)[0]
    return out
