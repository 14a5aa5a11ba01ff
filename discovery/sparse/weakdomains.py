"""Domains and weights of the weak form of PySINDy (`WeakPDELibrary`) of signals in time.

On each domain, a stretch of the recording, a signal is integrated against (1 - s^2)^4 (Reinbold, Gurevich &
Grigoriev, Phys. Rev. E 101, 2020); s goes from -1 to 1. Between its instants the signal is straight.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import binom, perm

Array = NDArray[np.float64]

POWER = 4
HALF = 20.0  # half a domain is the recording over this


@dataclass(frozen=True, slots=True)
class Domain:
    """Weights (N,) of the values of a signal on some rows: they give the integral of the signal, and (with
    a minus sign) that of its rate, each times the test function.
    """

    rows: slice
    of_values: Array
    of_rates: Array


def weak_domains(time: Array, count: int, seed: int) -> list[Domain]:
    """Domains at random places in a recording, drawn in the same order as the library draws them."""
    stretches = _stretches(time, count, seed)
    halves = [0.5 * (time[end - 1] - time[begin]) for begin, end in stretches]
    middles = [0.5 * (time[end - 1] + time[begin]) for begin, end in stretches]
    pieces = [
        (time[begin:end] - middle) / half
        for (begin, end), half, middle in zip(stretches, halves, middles, strict=True)
    ]
    edges = np.cumsum([0, *(len(one) for one in pieces)])
    values, rates = (_weights(np.concatenate(pieces), edges, order) for order in (0, 1))
    return [
        Domain(slice(*stretch), values[a:b] * half, rates[a:b])
        for stretch, half, a, b in zip(stretches, halves, edges[:-1], edges[1:], strict=True)
    ]


def _stretches(time: Array, count: int, seed: int) -> list[tuple[int, int]]:
    """First row and the row after the last one of each domain; one with fewer than two is drawn again."""
    rng = np.random.RandomState(seed)  # the numbers that the library draws
    half = (time[-1] - time[0]) / HALF
    low, high = time[0] + half, time[-1] - half
    found = []
    for middle in rng.uniform(low, high, count):
        begin = end = 0
        while end - begin < 2:
            begin = int(np.searchsorted(time, middle - half, side="right"))
            end = int(np.searchsorted(time, middle + half, side="left"))
            middle = rng.uniform(low, high) if end - begin < 2 else middle
        found.append((begin, end))
    return found


def _weights(s: Array, edges: NDArray[np.int_], order: int) -> Array:
    """Weights of the values at s in the integral against a derivative of the test function; domains follow
    each other, cut at `edges`.
    """
    once, moment = _integrals(s, order)
    step = np.diff(s)
    with np.errstate(divide="ignore", invalid="ignore"):  # between two domains
        after = s[1:] / step * np.diff(once), 1.0 / step * np.diff(moment)
        before = s[:-1] / step * np.diff(once), 1.0 / step * np.diff(moment)
    first, last = edges[:-1], edges[1:] - 1
    weights = np.empty(len(s))
    weights[1:-1] = after[0][1:] - before[0][:-1] + before[1][:-1] - after[1][1:]
    weights[first] = after[0][first] - after[1][first]
    weights[last] = before[1][last - 1] - before[0][last - 1]
    return weights


def _integrals(s: Array, order: int) -> tuple[Array, Array]:
    """Indefinite integrals of a derivative of (1 - s^2)^4, and of s times that derivative."""
    k = np.array([k for k in range(POWER + 1) if 2 * (POWER - k) >= order])[:, None]
    power = 2 * (POWER - k) - order
    sign, factor = binom(POWER, k) * (-1.0) ** k, perm(2 * (POWER - k), order)
    once, moment = (np.sum(sign * s ** (power + more) * factor / (power + more), axis=0) for more in (1, 2))
    return once, moment
