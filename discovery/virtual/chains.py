"""The finer plant stepped exactly: between switches it is linear, one matrix exponential a pump state.

What is concealed comes in as extra heat at the bodies, held over a step of 20 s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.virtual.fine import COOLED, LINKS, LOSSES, STEP_S, WET, Array, FineMachine, Inputs


@dataclass(frozen=True)
class Propagator:
    """Exact steps of the linear plant: x' = E x + F (heat by channel), for pump off and on."""

    machine: FineMachine
    E: tuple[Array, Array]  # (N, N)
    F: tuple[Array, Array]  # (N, 9): air, fluid, drive, cooling, and heat of an effect at each body
    mean: Array  # (5, N) body means


def propagator(m: FineMachine) -> Propagator:
    """Cut the bodies into chains and take the matrix exponential over one step.

    Air acts along the whole chain, drive loss and cooling at its first node, fluid at the last, an
    effect at the last two thirds, so that its heat does not enter where the baseline's does.
    """
    from scipy.linalg import expm

    ends = np.cumsum(m.nodes)
    first = ends - m.nodes
    N = int(ends[-1])
    C, A = np.empty(N), np.zeros((N, N))
    B = np.zeros((N, 9))
    mean = np.zeros((5, N))
    outer = _outer_conductance(m)

    def link(i: int, j: int, G: float) -> None:
        A[i, i] -= G
        A[j, j] -= G
        A[i, j] += G
        A[j, i] += G

    for b in range(5):
        here = slice(first[b], ends[b])
        k = int(m.nodes[b])
        C[here] = m.capacity[b] * m.weights[b]
        mean[b, here] = m.weights[b]
        for i in range(first[b], ends[b] - 1):
            link(i, i + 1, m.stiffness * outer[b] * (k - 1))
        B[here, 0] = m.air[b] * m.weights[b]
        A[here, here] -= np.diag(m.air[b] * m.weights[b])
        where = np.arange(first[b] + k // 3, ends[b])
        B[where, 4 + b] = 1.0 / len(where)
    for (i, j), G in zip(LINKS, m.links, strict=True):
        link(int(ends[i]) - 1, int(first[j]), float(G))
    for b, share in zip(LOSSES, m.loss, strict=True):
        B[first[b], 2] += share
    B[first[COOLED], 3] -= m.cooling
    wet = np.zeros(N)
    for b, G in zip(WET, m.wet, strict=True):
        wet[ends[b] - 1] = G
    E, F = [], []
    for pump in (0.0, 1.0):
        system = np.zeros((N + 9, N + 9))
        forcing = B.copy()
        forcing[:, 1] = pump * wet
        system[:N, :N] = (A - pump * np.diag(wet)) / C[:, None]
        system[:N, N:] = forcing / C[:, None]
        power = expm(system * STEP_S)
        E.append(np.ascontiguousarray(power[:N, :N]))
        F.append(np.ascontiguousarray(power[:N, N:]))
    return Propagator(m, (E[0], E[1]), (F[0], F[1]), mean)


def _outer_conductance(m: FineMachine) -> Array:
    """Sum of the conductances (5,) that leave each body."""
    total = m.air.copy()
    for (i, j), G in zip(LINKS, m.links, strict=True):
        total[[i, j]] += G
    total[list(WET)] += m.wet
    return np.asarray(total)


class Law(NamedTuple):
    """Concealed heat: `gate` (n,) times a function of the temperatures; `form` is one of the words below.

    out: the body that the heat leaves or that drives it, -1: none. ref (n,): a temperature. a, b, c: shape.
    """

    form: int
    into: int
    out: int
    gate: Array
    ref: Array
    a: float = 0.0
    b: float = 0.0
    c: float = 1.0


HEAT, TO_REF, LINK, DRIVEN, POWER, EXPONENT, EVAPORATION, CONTACT, HIDDEN_MASS, MELTING = range(10)


def run(p: Propagator, u: Inputs, start: Array, heat: Array, laws: Sequence[Law] = ()) -> Array:
    """Body means (n + 1, 5) [degC] under `heat` (n, 5) [W] and `laws`; bodies begin uniform at `start`."""
    n, forcing = len(u.air), np.column_stack([u.air, u.fluid, u.drive, u.cooling, heat])
    where = np.array([[law.form, law.into, law.out] for law in laws], dtype=np.int64).reshape(-1, 3)
    gate = np.array([law.gate for law in laws]).reshape(-1, n)
    ref = np.array([law.ref for law in laws]).reshape(-1, n)
    shape = np.array([[law.a, law.b, law.c] for law in laws], dtype=np.float64).reshape(-1, 3)
    x0 = np.repeat(start, p.machine.nodes)
    E, F = np.stack(p.E), np.stack(p.F)
    return np.asarray(
        _march(x0, E, F, (u.pump > 0).astype(np.int64), forcing, p.mean, where, gate, ref, shape)
    )


@njit(cache=True)
def _march(
    x: Array, E: Array, F: Array, pump: NDArray[np.int64], u: Array, mean: Array,
    where: NDArray[np.int64], gate: Array, ref: Array, shape: Array,
) -> Array:  # fmt: skip
    bodies = np.empty((len(u) + 1, len(mean)))
    bodies[0] = mean @ x
    memory = np.zeros(len(where))
    for r in range(len(where)):
        T = bodies[0, where[r, 1]]
        memory[r] = T if where[r, 0] == HIDDEN_MASS else _melted(T, shape[r])
    for k in range(len(u)):
        forcing = u[k].copy()
        for r in range(len(where)):
            form, into, out = where[r]
            q, memory[r] = _heat(
                form, bodies[k, into], bodies[k, max(out, 0)], gate[r, k], ref[r, k], shape[r], memory[r]
            )
            forcing[4 + into] += q
            if form in (LINK, CONTACT):
                forcing[4 + out] -= q
        x = E[pump[k]] @ x + F[pump[k]] @ forcing
        bodies[k + 1] = mean @ x
    return bodies


@njit(cache=True)
def _heat(
    form: int, T: float, other: float, gate: float, ref: float, shape: Array, memory: float
) -> tuple[float, float]:
    """Heat [W] of one law now, and its memory after the step."""
    a, b = shape[0], shape[1]
    if form == HEAT:
        return gate, memory
    if form == TO_REF:
        return gate * (ref - T), memory
    if form == LINK:
        return gate * (other - T), memory
    if form == DRIVEN:
        return gate * (T - other), memory
    if form == POWER:
        return gate * (abs(ref - T) / 5.0) ** a * (ref - T), memory
    if form == EXPONENT:
        return gate * np.exp(a * (T - 22.0)), memory
    if form == EVAPORATION:  # vapour doubles every 11 K; 45 % in the room
        dry = np.exp(0.062 * (T - 22.0)) - 0.45 * np.exp(0.062 * (ref - 22.0))
        return -gate * max(0.0, dry) / 0.55, memory
    if form == CONTACT:
        return gate * ((T + other) / 2.0 - 22.0) * (other - T), memory
    if form == HIDDEN_MASS:
        return gate * (memory - T), memory + (T - memory) * (1.0 - np.exp(-STEP_S / a))
    change = (_melted(T, shape) - memory) * (1.0 - np.exp(-STEP_S / b))  # MELTING: gate is latent heat [J]
    return -gate * change / STEP_S, memory + change


@njit(cache=True)
def _melted(T: float, shape: Array) -> float:
    """Molten fraction of something that melts about a degC, over a width of c K."""
    return float(0.5 * (1.0 + np.tanh((T - shape[0]) / shape[2])))
