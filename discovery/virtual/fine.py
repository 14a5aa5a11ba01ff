"""A finer plant than any model of the tool has: every body is a chain of nodes, drawn at random by seed.

Between switches the plant is linear, so a step of 20 s is exact (matrix exponential, one for each state of
the pump). What is concealed comes in as extra heat at the bodies, held over a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.virtual.cycles import HOUR, noise, room

Array = NDArray[np.float64]

BODIES = ("table", "c_body_1", "c_body_2", "b_corpus", "side")
ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")
LINKS = ((0, 1), (1, 2), (2, 3), (3, 4), (1, 3))
LOSSES = (1, 2, 3)  # bodies that take drive loss
WET = (0, 1)  # bodies that the fluid floods
COOLED = 2
STEP_S = 20.0
T_REF = 22.0


@dataclass(frozen=True)
class Inputs:
    """Inputs of one recording over steps of 20 s, shape (n,): degC, rpm, W; the pump is 0 or 1."""

    air: Array
    fluid: Array
    pump: Array
    speed: Array
    drive: Array
    cooling: Array


@dataclass(frozen=True)
class FineMachine:
    """A machine: lumped values as a modeller would know them, and how each body is cut into nodes."""

    capacity: Array  # (5,) J/K
    links: Array  # (5,) W/K, along LINKS
    air: Array  # (5,) W/K
    loss: Array  # (3,) share of the drive power, along LOSSES
    cooling: float  # share of the cooling power
    wet: Array  # (2,) W/K, along WET
    outputs: Array  # (4, 5) um/K
    nodes: NDArray[np.int64]  # (5,)
    weights: tuple[Array, ...]  # share of each node in its body's capacity
    stiffness: float  # W/K from end to end of a body, times the sum of its outer conductances
    power: tuple[float, float, float]  # recorded drive power: linear and power part [W at 600 rpm], exponent


def draw_machine(rng: np.random.Generator) -> FineMachine:
    """A machine with 20 to 45 nodes; every value drawn."""

    def around(values: list[float], spread: float) -> Array:
        return np.asarray(np.array(values) * np.exp(rng.normal(0.0, spread, len(values))))

    nodes = rng.integers(4, 10, size=5)
    weights = tuple(w / w.sum() for w in (rng.uniform(0.7, 1.3, k) for k in nodes))
    outputs = np.array(
        [
            [0.0, -1.2, -1.6, -2.6, 0.8],
            [0.8, 1.6, 1.8, 0.7, -0.3],
            [2.2, 0.4, 0.0, 0.0, 0.0],
            [0.0, 1.3, 1.8, -3.0, 1.4],
        ]
    )
    return FineMachine(
        capacity=around([45e3, 65e3, 90e3, 190e3, 130e3], 0.2).round(),
        links=around([28.0, 35.0, 28.0, 18.0, 10.0], 0.3),
        air=around([3.0, 2.0, 3.0, 8.0, 10.0], 0.3),
        loss=around([0.25, 0.45, 0.12], 0.2),
        cooling=float(rng.uniform(0.8, 1.1)),
        wet=around([45.0, 14.0], 0.3),
        outputs=(outputs * rng.uniform(0.75, 1.3, outputs.shape)).round(4),
        nodes=nodes,
        weights=weights,
        stiffness=30.0,
        power=(float(rng.uniform(150, 250)), float(rng.uniform(60, 140)), float(rng.uniform(1.4, 1.9))),
    )


def lumped(m: FineMachine) -> FineMachine:
    """The same machine with one node a body: what the baseline believes."""
    one = tuple(np.ones(1) for _ in BODIES)
    return replace(m, nodes=np.ones(5, dtype=np.int64), weights=one)


def draw_inputs(rng: np.random.Generator, m: FineMachine, hours: float = 72.0) -> Inputs:
    """A random cycle: speed and pump in steps, room and fluid drifting, cooling that follows the load."""
    n = round(hours * HOUR / STEP_S)
    t = (np.arange(n) + 0.5) * STEP_S

    def steps(low_h: float, high_h: float, level: Callable[[], float]) -> Array:
        values, at = np.empty(n), 0
        while at < n:
            end = at + max(3, round(rng.uniform(low_h, high_h) * HOUR / STEP_S))
            values[at:end] = level()
            at = end
        return values

    top = rng.uniform(1000, 1200)
    speed = steps(0.3, 3.2, lambda: 0.0 if rng.uniform() < 0.3 else float(rng.uniform(0.12, 1.0) * top))
    pump = steps(0.5, 4.0, lambda: float(rng.uniform() < 0.55))
    air = (
        room(rng, n * 2, rng.uniform(0.8, 1.6), 0.5, rng.uniform(21, 23))[: 2 * n].reshape(n, 2).mean(axis=1)
    )
    mean, swing, period, phase = rng.uniform([2.0, 0.5, 15.0, 0.0], [4.0, 1.2, 30.0, 6.28])
    tank = mean + swing * np.sin(2 * np.pi * t / (period * HOUR) + phase)
    fluid = first_order((air + np.where(pump > 0, tank, 0.3 * tank)), rng.uniform(900, 2400))
    rotation = speed / 600.0
    drive = m.power[0] * rotation + m.power[1] * rotation ** m.power[2]
    share = rng.uniform(0.08, 0.2)
    cooling = (
        5.0 + share * first_order(drive, rng.uniform(1200, 4000)) + 4.0 * noise(rng, n, STEP_S, HOUR, 1.0)
    )
    return Inputs(air, fluid, pump, speed, drive, np.maximum(0.0, cooling))


def first_order(x: Array, tau_s: float, start: float | None = None) -> Array:
    """`x` (n,) through a first-order lag of `tau_s`."""
    from scipy.signal import lfilter

    keep = float(np.exp(-STEP_S / tau_s))
    begin = x[0] if start is None else start
    return np.asarray(lfilter([1 - keep], [1.0, -keep], x, zi=[keep * begin])[0])


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
