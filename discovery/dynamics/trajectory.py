"""The free run of a model on a recording."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import kernel
from discovery.dynamics.grid import interleaved
from discovery.dynamics.starts import start_values
from discovery.dynamics.system import System
from discovery.dynamics.transitions import transitions
from discovery.errors import RunsAwayError
from discovery.terms import Dual
from discovery.terms.dual import Value

Array = NDArray[np.float64]

_FAR = 1e50  # in any unit: beyond it a model has run away, before its squares overflow
_ROUNDS = 30  # of Newton on the trajectory
_TOLERANCE = 1e-8  # largest change of a state in its unit, relative to 1 + its size
_CLOSE = 1e-6  # change from which one step of Newton ends it
_HELPS = 0.3  # factor by which steps with an old linearisation have to become shorter
_LEAST, _FEW = 8, 10  # intervals of a trajectory that is not divided, and steps of Newton on it
_FIRST = 3  # steps of Newton that may become longer
_SHRINKS = 0.5  # factor by which later ones have to become shorter, else half of them is taken
_AWAY = 3  # steps of Newton that lead away from a trajectory that old linearisations have come close to ...
_NEAR = 1e-5  # ... by steps as short as this: the solution, as well as the kink of a law lets it be known

_CHECK = "check signs, bounds and start values of its parameters"


@dataclass(frozen=True)
class Trajectory:
    """Solution of a system: states on all nodes and the linearisation around them."""

    system: System
    values: Mapping[str, float]
    x: Array  # (T, n)
    a: Array  # (K, n, n) state matrices
    which: NDArray[np.int64]
    e: Array
    w0: Array
    w1: Array
    # how outputs depend on states: of which nodes, and (N, Y, n)
    shown: dict[str, tuple[Any, Array]] = field(default_factory=dict, repr=False, compare=False)

    def at_ends(self) -> dict[str, Array | float]:
        """States, channels and parameters at the interval ends, ready for `evaluate`."""
        return {**self.system.grid.ends, **self.values, **_state_ends(self.system, self.x)}

    def at_nodes(self) -> dict[str, Array | float]:
        """States, channels and parameters at the nodes, ready for `evaluate`."""
        states = {name: self.x[:, i] for i, name in enumerate(self.system.states)}
        return {**self.system.grid.nodes, **self.values, **states}


def simulate(
    system: System,
    values: Mapping[str, float],
    start: Array | None = None,
    near: Trajectory | None = None,
) -> Trajectory:
    """Free run of a model on a recording.

    Nonlinear terms are solved by Newton's method on the whole trajectory. Most of its time goes into the
    exponentials of a new linearisation, so the last one is used again as long as its steps help. At the kink
    of a threshold full steps may go to and fro over it for ever; half a step ends between. Where steps on the
    whole trajectory lead away or do not settle, as where something swings many times, it is solved window by
    window. Where the slope of a law has no bound, as that of a root at zero, steps with an old linearisation
    come close and those with a new one lead away: the closest trajectory is kept.

    Args:
        values: parameter values by name.
        start: (n,) start values; default the declared ones.
        near: a run close by, to begin from (nonlinear terms only).

    Raises:
        RunsAwayError: the trajectory does not stay finite.
    """
    first = start_values(system, values) if start is None else start
    last = None if system.affine else near
    x = last.x if last else np.tile(first, (len(system.grid.time), 1))
    before, away, closest = 1.0, 0, (np.inf, last)
    change = np.inf
    for count in range(1 if system.affine else _ROUNDS):
        with np.errstate(all="ignore"):
            x, step = _nearer(system, values, first, last, x) if last else (x, np.inf)
            a, g0, g1 = _linearise(system, values, x)
        which, e, w0, w1 = transitions(a, system.grid.step)
        new = kernel.trajectory(which, e, w0, w1, g0, g1, first)
        if not np.all(np.abs(new) < _FAR):
            return _in_windows(system, values, first)
        change = _change(x, new)
        if step < closest[0]:
            closest = step, Trajectory(system, dict(values), x, a, which, e, w0, w1)
        away += change > step
        if away >= _AWAY and closest[0] < _NEAR:
            last = closest[1]
            break
        last = Trajectory(system, dict(values), new, a, which, e, w0, w1)
        # the next step shrinks at least as much as this one did, and the first one to less than its square
        if system.affine or change * min(1.0, change / before) < _TOLERANCE:
            break
        halved = count >= _FIRST and change > _SHRINKS * before
        x, before = (0.5 * (x + new) if halved else new), change
    else:
        return _in_windows(system, values, first)
    assert last is not None
    return last


def _in_windows(system: System, values: Mapping[str, float], first: Array) -> Trajectory:
    """The free run, solved in windows one after the other, each from the end of the one before.

    Newton's method on a window begins near enough where the window is short: windows become shorter until it
    settles, and longer where it settles at once.

    Raises:
        RunsAwayError: the trajectory does not stay finite.
    """
    last = len(system.grid.step)
    x, done, wide = np.tile(first, (last + 1, 1)), 0, max(last // 2, 1)
    while done < last:
        end = min(done + wide, last)
        shortest = system.affine or end - done <= _LEAST
        found, quick = _window(system.between(done, end), values, x[done], shortest)
        if found is None and shortest:
            raise RunsAwayError(
                f"model '{system.model.name}' diverges on recording '{system.grid.recording}'; "
                + (_no_number(system.between(done, end), values, x[done]) or _CHECK)
            )
        if found is None:
            wide = max((end - done) // 2, 1)
            continue
        x[done : end + 1], done = found, end
        wide *= 2 if quick else 1
    a = _linearise(system, values, x)[0]
    return Trajectory(system, dict(values), x, a, *transitions(a, system.grid.step))


def _no_number(system: System, values: Mapping[str, float], first: Array) -> str:
    """Which term has no number at the start of a window, and when; empty where all have one."""
    with np.errstate(all="ignore"):
        found = _term_rates(system, values, np.tile(first, (len(system.grid.time), 1)))
    for term, dual in zip(system.model.terms, found, strict=True):
        wrong = np.flatnonzero(np.isnan(np.broadcast_to(dual.value, 2 * len(system.grid.step))))
        if wrong.size:
            at = system.grid.time[(wrong[0] + 1) // 2]
            return (
                f"its term '{term.name}' is not a number at {at:g} s: a power, root or logarithm of a value "
                "below zero? If an input is noisy around zero, write max(0, ...)"
            )
    return ""


def _window(
    system: System, values: Mapping[str, float], first: Array, shortest: bool
) -> tuple[Array | None, bool]:
    """States (T, n) of a window, if Newton's method settles there, and whether it did so at once; the
    shortest window keeps what stays finite.
    """
    x, before = np.tile(first, (len(system.grid.time), 1)), 1.0
    for count in range(_FEW if shortest and not system.affine else _ROUNDS):
        with np.errstate(all="ignore"):
            a, g0, g1 = _linearise(system, values, x)
            which, e, w0, w1 = transitions(a, system.grid.step)
            new = kernel.trajectory(which, e, w0, w1, g0, g1, first)
        if not np.all(np.abs(new) < _FAR):
            return None, False
        change = _change(x, new)
        if change * min(1.0, change / before) < _TOLERANCE:
            return new, count <= _FIRST
        slow = count >= _FIRST and change > _SHRINKS * before
        if slow and not shortest:
            return None, False
        x, before = (0.5 * (x + new) if slow else new), change
    return (x if shortest else None), False


def _nearer(
    system: System, values: Mapping[str, float], first: Array, last: Trajectory, x: Array
) -> tuple[Array, float]:
    """A trajectory (T, n) nearer to the solution, by steps with the last linearisation, and the length of the
    step from it.

    The length of the step from a trajectory says how far it is from the solution. A step to where the next
    one would be longer led away and is undone: behind the kink of a threshold the old linearisation does
    not hold, and Newton's method may not come back from there.
    """
    before, earlier = np.inf, x
    for _ in range(_ROUNDS):
        g0, g1 = kernel.left_over(_state_rates(system, _term_rates(system, values, x)), last.a, x)
        new = kernel.trajectory(last.which, last.e, last.w0, last.w1, g0, g1, first)
        change = _change(x, new)
        if not change < _HELPS * before:  # also NaN
            return (x, change) if change < before else (earlier, before)
        before, earlier, x = change, x, new
        if change < _CLOSE:
            return x, change
    return x, before


def _change(old: Array, new: Array) -> float:
    """Largest change of a state in its unit, relative to 1 + its size."""
    return float(np.max(np.abs(new - old) / (1.0 + np.abs(new)), initial=0.0))


def _linearise(system: System, values: Mapping[str, float], x: Array) -> tuple[Array, Array, Array]:
    """State matrices (K, n, n) around a trajectory, forcing left over at both interval ends (K, n) each.

    Those of an affine system are the same around any trajectory. It is asked at zero, where all is left over.
    """
    count, n = len(system.grid.step), len(system.states)
    wanted = frozenset(system.states)
    if system.affine:
        zero = dict.fromkeys(system.states, 0.0)
        found = system.rates({**system.grid.ends, **values, **zero}, wanted, system.ends)
    else:
        found = _term_rates(system, values, x, wanted)
    entries: dict[tuple[int, int], Value] = {}
    means: dict[int, Value] = {}  # of each derivative, which several terms may share
    ends = zip(system.into.tolist(), system.source.tolist(), strict=True)
    for dual, (i, j) in zip(found, ends, strict=True):
        for name, partial in dual.partials.items():
            s = system.states.index(name)
            if id(partial) not in means:
                means[id(partial)] = _interval_means(partial)
            mean = means[id(partial)]
            entries[i, s] = entries.get((i, s), 0.0) + system.scale[i] * mean
            if j >= 0:
                entries[j, s] = entries.get((j, s), 0.0) - system.scale[j] * mean
    a = np.zeros((count, n, n))
    for (i, s), entry in entries.items():
        a[:, i, s] = entry
    rates = _state_rates(system, found)
    if system.affine:
        return a, np.ascontiguousarray(rates[0::2]), np.ascontiguousarray(rates[1::2])
    return a, *kernel.left_over(rates, a, x)


def _term_rates(
    system: System, values: Mapping[str, float], x: Array, wrt: frozenset[str] = frozenset()
) -> list[Dual]:
    """Rate of each term at both ends of each interval (2K,), with derivatives by some names."""
    return system.rates({**system.grid.ends, **values, **_state_ends(system, x)}, wrt, system.ends)


def _state_rates(system: System, found: Sequence[Dual]) -> Array:
    """Rate of each state at both ends of each interval (2K, n): the sum of its terms."""
    sums: list[Value] = [0.0] * len(system.states)
    ends = zip(system.into.tolist(), system.source.tolist(), strict=True)
    for dual, (i, j) in zip(found, ends, strict=True):
        sums[i] = sums[i] + system.scale[i] * dual.value
        if j >= 0:
            sums[j] = sums[j] - system.scale[j] * dual.value
    rates = np.empty((2 * len(system.grid.step), len(sums)))
    for i, one in enumerate(sums):
        rates[:, i] = one
    return rates


def _interval_means(ends: Value) -> Value:
    """Means (K,) over the intervals of a series at their ends (2K,); a constant is its own mean."""
    return 0.5 * (ends[0::2] + ends[1::2]) if isinstance(ends, np.ndarray) and ends.ndim else float(ends)


def _least(ends: Value) -> Value:
    """The smaller of both ends of each interval (K,) of a series at its ends (2K,)."""
    return np.minimum(ends[0::2], ends[1::2]) if isinstance(ends, np.ndarray) and ends.ndim else float(ends)


def flows(trajectory: Trajectory) -> Array:
    """Size (K, n) of the flow through each state in each interval: the root of its summed squared terms.

    In W at a body, otherwise in the unit of the state per time unit. A term counts with the smaller of its
    sizes at both ends: a gap between two bodies that are as good as one closes within an interval, and what
    flows at its beginning, megawatts if the joint is stiff enough, moves next to no heat.
    """
    system = trajectory.system
    squares = np.zeros((len(system.grid.step), len(system.states)))
    found = _term_rates(system, trajectory.values, trajectory.x)
    for dual, i, j in zip(found, system.into, system.source, strict=True):
        lasting = _least(np.square(dual.value))
        squares[:, i] += lasting
        if j >= 0:
            squares[:, j] += lasting
    return np.sqrt(squares)


def answers(trajectory: Trajectory, inputs: Collection[str]) -> Array:
    """How much more flows into each state per unit of some inputs together, (K, n)."""
    system = trajectory.system
    rates = np.zeros((len(system.grid.step), len(system.states)))
    found = _term_rates(system, trajectory.values, trajectory.x, frozenset(inputs))
    for dual, i, j in zip(found, system.into, system.source, strict=True):
        for partial in dual.partials.values():
            mean = _interval_means(partial)
            rates[:, i] += mean
            if j >= 0:
                rates[:, j] -= mean
    return rates


def _state_ends(system: System, x: Array) -> dict[str, Array]:
    return {name: interleaved(x[:-1, i], x[1:, i]) for i, name in enumerate(system.states)}
