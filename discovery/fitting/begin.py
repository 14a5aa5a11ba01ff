"""What a fit begins with: gains that fit the other start values, a first noise, first spreads of starts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, at_rest
from discovery.errors import RunsAwayError
from discovery.fitting.noise import Noise, roughness, white_noise
from discovery.fitting.problem import Key, Problem, Unknown
from discovery.fitting.solve import solve
from discovery.models import Model
from discovery.terms import names
from discovery.threads import side_by_side

Array = NDArray[np.float64]

SETTLED = 1e-6  # in the unit of a state, no spread to speak of
_BEGINS = {"fitted": 0.05, "moved": 0.5}  # of what a state moves, how far from its start it may begin
_APART, _SEVERAL = 0.7, 5  # of logarithms of sizes: how far other beginnings are, and how many are drawn
_LOOK, _ROUGHLY = 15, 1e-3  # steps from each of them, and the relative change of the cost that ends them
_CLEARLY = 10.0  # by which the cost of another minimum has to be smaller
_SMALL = 0.01  # of the spread of readings: the least noise to begin with, where none is stated


def gains_first(
    problem: Problem, theta: Array, noise: Noise, runs: tuple[Trajectory, ...]
) -> tuple[Array, tuple[Trajectory, ...]]:
    """Where a fit begins once the gains of inputs are right for everything else, and the free runs there.

    Outputs are linear in them, so one step finds them. With gains that are wrong by orders, a fit bends rates
    and rooms to what the gains miss, and does not come back.
    """
    gains = _gains(problem.model)
    if not gains:
        return theta, runs
    held = tuple(
        u if u.name in gains and not u.is_nuisance else replace(u, low=float(x), high=float(x))
        for u, x in zip(problem.unknowns, theta, strict=True)
    )
    try:
        found = solve(replace(problem, unknowns=held), theta, noise, "linear", 1, 0.0, runs=runs)
    except RunsAwayError:
        return theta, runs
    return found.theta, found.trajectories


def another_minimum(
    problem: Problem, theta: Array, cost: float, noise: Noise, together: float
) -> dict[str, float] | None:
    """Parameters from which a fit comes clearly below a minimum that it has found; None if there are none.

    A model of several bodies has several minima: one path between bodies at zero, and another one too large.
    Steps are taken from its start values, a third and three times of them, and each within a factor of two of
    its own (drawn with a fixed seed), under the noise that the fit has found. A beginning that cannot come
    below ends early.

    Args:
        theta: (U,) the minimum.
        cost: there.
        together: as in `solve`.
    """
    common = [u for u in problem.unknowns if u.recording is None and u.prior is None and not u.is_nuisance]
    free = [u in common and u.low < u.high for u in problem.unknowns]
    if sum(free) < 2:
        return None
    start = np.array([u.start for u in problem.unknowns])
    draws = np.random.default_rng(0).normal(0.0, _APART, (_SEVERAL, len(theta)))
    low, high = problem.bounds
    begins = [np.zeros(len(theta)), *(np.full(len(theta), side * np.log(3.0)) for side in (-1, 1)), *draws]

    def ended(log: Array) -> tuple[float, Array]:
        place = np.clip(np.where(free, start * np.exp(log), theta), low, high)
        try:
            found = solve(problem, place, noise, "linear", _LOOK, _ROUGHLY, together, cost - _CLEARLY)
        except RunsAwayError:
            return inf, theta
        return found.cost, found.theta

    least, best = min(side_by_side(ended, begins), key=lambda one: one[0])
    if least >= cost - _CLEARLY:
        return None
    return {u.name: float(x) for u, x, f in zip(problem.unknowns, best, free, strict=True) if f}


def _gains(model: Model) -> set[str]:
    """Free parameters that stand next to inputs only, never in a term or an output with a state."""
    found = set(model.free)
    for expression in model.expressions():
        used = names(expression)
        if used & set(model.states):
            found -= used
    return found & frozenset().union(*(names(term.expression) for term in model.terms))


def first_noise(
    problem: Problem, runs: Sequence[Trajectory], stated: Mapping[str, float | None], least: Sequence[float]
) -> Noise:
    """The first noise: the residual at the start of the fit, but not more than the roughness of the readings.

    With too much noise, or outputs weighed otherwise than in the end, the first round forgets where it began.
    """
    single = [system.grid.single for system in problem.systems]
    rough = [_rough([r[:, j][np.isfinite(r[:, j])] for r in single]) for j in range(len(problem.outputs))]
    left = [problem.residual(run) * run.system.grid.per_reading for run in runs]
    begun = white_noise(problem.outputs, stated, left, least)
    white = [
        stated[name] or max(min(a, b) if np.isfinite(a) else b, floor)
        for name, a, b, floor in zip(problem.outputs, begun.white, rough, least, strict=True)
    ]
    return replace(begun, white=tuple(white))


def _rough(readings: Sequence[Array]) -> float:
    """Roughness of the readings (R,) of a channel, at least a small share of their spread, because a logger
    that interpolates shows no roughness.
    """
    spread = np.concatenate(readings)
    return max(roughness(readings), _SMALL * float(np.std(spread)) if len(spread) else 0.0)


def first_spreads(problem: Problem, runs: Sequence[Trajectory]) -> dict[Key, float]:
    """A first guess of how far states begin from their start that are neither read nor given a spread: a
    share of what they move. What a memory holds may be farther from what it is fed with, if the machine is
    not in balance with its first inputs: before the recording that may have been any that comes later in it.
    """
    asked = [u for u in problem.unknowns if u.spread in _BEGINS and u.is_start]
    moved: dict[Key, float] = {}
    for run in runs:
        mine = [u for u in asked if u.recording == run.system.grid.recording]
        shares = {"fitted": _BEGINS["fitted"], "moved": 0.0}
        if any(u.spread == "moved" for u in mine):
            shares["moved"] = _BEGINS["moved"] * _unrest(run)
        for u in mine:
            moves = float(np.ptp(run.x[:, run.system.states.index(u.name)]))
            if moves <= SETTLED and u.spread == "fitted":  # it only cools down: that is the start
                moves = _read(run)
            moved[u.key] = max(shares[u.spread] * moves, SETTLED)
    # how far a body begins from its start is of the machine, what a memory holds of the recording
    of_machine = [u for u in asked if u.spread == "fitted"]
    return moved | {u.key: max(moved[o.key] for o in of_machine if o.name == u.name) for u in of_machine}


def _read(run: Trajectory) -> float:
    """What the readings move, at most, in the unit of their output: an order of magnitude."""
    readings = run.system.grid.readings
    columns = (readings[np.isfinite(readings[:, j]), j] for j in range(readings.shape[1]))
    return max((float(np.ptp(column)) for column in columns if len(column)), default=0.0)


def is_settled(u: Unknown) -> bool:
    """Whether this is what a memory holds where a recording begins at rest: nothing unknown."""
    return u.spread == "moved" and u.prior is not None and u.prior[1] <= SETTLED


def _unrest(run: Trajectory) -> float:
    """How far from their balance with the first inputs states that are read begin, as a share of what they
    move, at most one: a machine that begins in balance has been at rest, and remembers nothing else. Inputs
    count as they were recorded, and a difference within the spread of one says nothing.
    """
    grid = run.system.grid.shifted({})
    unsure = max((grid.spread.get(name, 0.0) for name in grid.samples), default=0.0)
    read = [i for i, name in enumerate(run.system.states) if run.system.model.states[name].read_as]
    try:
        away = run.x[0] - at_rest(replace(run.system, grid=grid), run.values)
    except RunsAwayError:
        return 1.0
    share = (np.abs(away[read]) - unsure) / np.maximum(np.ptp(run.x, axis=0)[read], 1e-9)
    return float(np.clip(share.max(initial=0.0), 0.0, 1.0))
