"""A model on a recording: its trajectory and its outputs."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import kernel
from discovery.dynamics.grid import Grid, first_interval, interleaved
from discovery.dynamics.memory import Memory
from discovery.errors import RunsAwayError, UserError
from discovery.models import Model, expanded
from discovery.models.model import read_at_start
from discovery.recordings import Campaign
from discovery.terms import Dual, Program, compiled, degree, evaluate

Array = NDArray[np.float64]
Ints = NDArray[np.intp]
Value = float | Array

_FAR = 1e50  # in any unit: beyond it a model has run away, before its squares overflow
_ROUNDS = 30  # of Newton on the trajectory
_TOLERANCE = 1e-8  # largest change of a state in its unit, relative to 1 + its size
_CLOSE = 1e-6  # change from which one step of Newton ends it
_HELPS = 0.3  # factor by which steps with an old linearisation have to become shorter


@dataclass(frozen=True)
class System:
    """A model bound to a grid, with index tables made once and its terms compiled once."""

    model: Model  # expanded: no lag() left
    grid: Grid
    states: tuple[str, ...]
    affine: bool
    into: NDArray[np.int64]  # (terms,) index of the state
    source: NDArray[np.int64]  # (terms,) index or -1
    scale: Array  # (states,)
    ends: Memory
    nodes: Memory

    def rates(self, values: Mapping[str, Value], wrt: frozenset[str], memory: Memory) -> list[Dual]:
        """What each term lets flow, with derivatives by some names."""
        if wrt not in self.programs:
            self.programs[wrt] = compiled(tuple(t.expression for t in self.model.terms), wrt)
        return self.programs[wrt].run(values, memory)

    programs: dict[frozenset[str], Program] = field(default_factory=dict, repr=False, compare=False)


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

    def at_ends(self) -> dict[str, Array | float]:
        """States, channels and parameters at the interval ends, ready for `evaluate`."""
        return {**self.system.grid.ends, **self.values, **_state_ends(self.system, self.x)}

    def at_nodes(self) -> dict[str, Array | float]:
        """States, channels and parameters at the nodes, ready for `evaluate`."""
        states = {name: self.x[:, i] for i, name in enumerate(self.system.states)}
        return {**self.system.grid.nodes, **self.values, **states}


def make_system(model: Model, grid: Grid) -> System:
    """Bind a model to a grid."""
    taken = [name for y, name in enumerate(grid.outputs) if grid.measured[:, y].any()]
    model = read_at_start(expanded(model, {*grid.samples, *grid.outputs}), taken)
    states = tuple(model.states)
    index = {name: i for i, name in enumerate(states)}
    variables = frozenset(states)
    return System(
        model=model,
        grid=grid,
        states=states,
        affine=all(degree(term.expression, variables) <= 1 for term in model.terms),
        into=np.array([index[term.into] for term in model.terms], dtype=np.int64),
        source=np.array([index[term.source] if term.source else -1 for term in model.terms], dtype=np.int64),
        scale=np.array([model.states[name].scale for name in states]),
        ends=Memory(grid, True),
        nodes=Memory(grid, False),
    )


def start_values(
    system: System, values: Mapping[str, float], moved: Mapping[str, float] | None = None
) -> Array:
    """Start values (n,): an expression at the first instant, or the balance of the state's terms there.

    Args:
        moved: how far states begin from that, and with them the states whose starts follow; memories are
        settled with it.
    """
    known: dict[str, float] = {**first_values(system.grid), **values}
    out = np.zeros(len(system.states))
    for i, name in enumerate(system.states):
        start = system.model.states[name].start
        if start is None:
            continue
        try:
            out[i] = float(np.mean(evaluate(start, known, memory=None).value))
        except KeyError as missing:
            raise UserError(
                f"model '{system.model.name}': the start of state '{name}' needs {missing}, "
                f"which recording '{system.grid.recording}' does not give"
            ) from None
    free = balanced(system)
    out = _balanced(system, values, out, free)
    if moved:
        out += starts_follow(system) @ np.array([moved.get(name, 0.0) for name in system.states])
    return _balanced(system, values, out, memories(system, free)) if moved else out


def starts_follow(system: System) -> Array:
    """How far each state begins off its start (rows) where another one is moved by one (columns), (n, n)."""
    found = np.eye(len(system.states))
    for i, state in enumerate(system.model.states.values()):
        for other, part in state.start_with.items():
            found[i] += part * found[system.states.index(other)]
    return found


def balanced(system: System) -> list[int]:
    """States that start in the balance of their terms."""
    return [i for i, name in enumerate(system.states) if system.model.states[name].start is None]


def memories(system: System, free: Sequence[int]) -> list[int]:
    """Those of some states that are what a lag() remembers."""
    return [i for i in free if system.model.states[system.states[i]].memory]


def at_start(system: System, values: Mapping[str, float], start: Array) -> dict[str, Value]:
    """States, channels and parameters at the first instant, ready for `evaluate`; series of one interval."""
    ends: dict[str, Value] = {name: series[:2] for name, series in system.grid.ends.items()}
    return {**ends, **values, **dict(zip(system.states, start.tolist(), strict=True))}


def rates_at_start(
    system: System, values: Mapping[str, float], start: Array, wrt: Sequence[str]
) -> tuple[Array, Array]:
    """Rates (n,) of the states at the first instant, and their derivatives (n, M) by the names of `wrt`."""
    rates, slopes = np.zeros(len(system.states)), np.zeros((len(system.states), len(wrt)))
    env, wanted = at_start(system, values, start), frozenset(wrt)
    memory = Memory(first_interval(system.grid), True)
    for dual, i, j in zip(system.rates(env, wanted, memory), system.into, system.source, strict=True):
        for k, sign in ((i, 1.0), (j, -1.0)):
            if k >= 0:
                rates[k] += sign * system.scale[k] * float(np.ravel(dual.value)[0])
                for name, partial in dual.partials.items():
                    slopes[k, wrt.index(name)] += sign * system.scale[k] * float(np.ravel(partial)[0])
    return rates, slopes


def _balanced(system: System, values: Mapping[str, float], start: Array, free: Sequence[int]) -> Array:
    """The start values (n,) with some states in the balance of their terms, given the others."""
    names = [system.states[i] for i in free]
    for _ in range(_ROUNDS if free else 0):
        rates, slopes = rates_at_start(system, values, start, names)
        if not (np.isfinite(rates).all() and np.isfinite(slopes).all()):
            raise RunsAwayError(
                f"model '{system.model.name}' has no finite rate at the start of recording "
                f"'{system.grid.recording}'; check its parameters and start values"
            )
        # what never balances (a sum of its input) stays where it is
        change = np.linalg.lstsq(slopes[free], -rates[free], rcond=1e-10)[0]
        if not np.all(np.isfinite(change)):
            break
        start[free] += change
        if np.max(np.abs(change)) < _TOLERANCE * (1.0 + np.max(np.abs(start[free]))):
            break
    return start


def shifted(system: System, offset: Mapping[str, float], late: Mapping[str, float] | None = None) -> System:
    """The system with channels moved by constants from what was recorded; all that reads them follows.

    Held channels may move in time, too: the terms follow.
    """
    grid = system.grid.shifted(offset, late)
    return replace(system, grid=grid, ends=Memory(grid, True), nodes=Memory(grid, False))


def inputs_of(model: Model, campaign: Campaign, outputs: Collection[str]) -> list[str]:
    """Channels that an expanded model needs of a recording, start values included, besides its outputs.

    Raises:
        UserError: an output that is no channel.
    """
    outputs = [name for name in outputs if campaign.channels[name]]
    starting = model.start_names & set(campaign.channels)
    return sorted({*model.inputs, *starting} - set(outputs))


def uncertain(system: System) -> tuple[str, ...]:
    """Channels known only within a spread that the model uses."""
    model = system.model
    used = {*model.inputs, *model.start_names}
    own = {*model.parameters, *model.states}
    return tuple(name for name in system.grid.spread if name in used - own)


def first_values(grid: Grid) -> dict[str, float]:
    """Channels at the first instant, outputs at their first reading."""
    first = {name: float(series[0]) for name, series in grid.nodes.items()}
    for i, name in enumerate(grid.outputs):
        read = grid.readings[:, i]
        read = read[np.isfinite(read)]
        if len(read):
            first[name] = float(read[0])
    return first


def _state_ends(system: System, x: Array) -> dict[str, Array]:
    return {name: interleaved(x[:-1, i], x[1:, i]) for i, name in enumerate(system.states)}


def _linearise(system: System, values: Mapping[str, float], x: Array) -> tuple[Array, Array, Array]:
    """State matrices (K, n, n) around a trajectory, forcing left over at both interval ends (K, n) each."""
    count, n = len(system.grid.step), len(system.states)
    env: dict[str, Array | float] = {**system.grid.ends, **values, **_state_ends(system, x)}
    rates = np.zeros((2 * count, n))
    a = np.zeros((count, n, n))
    variables = frozenset(system.states)
    for dual, i, j in zip(system.rates(env, variables, system.ends), system.into, system.source, strict=True):
        rates[:, i] += system.scale[i] * dual.value
        if j >= 0:
            rates[:, j] -= system.scale[j] * dual.value
        for name, partial in dual.partials.items():
            if np.ndim(partial):
                flat = np.asarray(partial)
                mean: Array | float = 0.5 * (flat[0::2] + flat[1::2])
            else:
                mean = float(partial)
            s = system.states.index(name)
            a[:, i, s] += system.scale[i] * mean
            if j >= 0:
                a[:, j, s] -= system.scale[j] * mean
    g0 = rates[0::2] - np.matmul(a, x[:-1, :, None])[:, :, 0]
    g1 = rates[1::2] - np.matmul(a, x[1:, :, None])[:, :, 0]
    return a, g0, g1


def _rates(system: System, values: Mapping[str, float], x: Array) -> Array:
    """What changes each state at both ends of each interval, (2 K, n)."""
    env: dict[str, Array | float] = {**system.grid.ends, **values, **_state_ends(system, x)}
    rates = np.zeros((2 * len(system.grid.step), len(system.states)))
    found = system.rates(env, frozenset(), system.ends)
    for dual, i, j in zip(found, system.into, system.source, strict=True):
        rates[:, i] += system.scale[i] * dual.value
        if j >= 0:
            rates[:, j] -= system.scale[j] * dual.value
    return rates


def flows(trajectory: Trajectory) -> Array:
    """Size (K, n) of what flows through each state in each interval: the root of the sum of squares of its
    terms, W at a body, else a rate in the unit of the state per time unit.
    """
    system = trajectory.system
    squares = np.zeros((len(system.grid.step), len(system.states)))
    env = trajectory.at_ends()
    found = system.rates(env, frozenset(), system.ends)
    for dual, i, j in zip(found, system.into, system.source, strict=True):
        ends = np.square(dual.value)
        mean = 0.5 * (ends[0::2] + ends[1::2]) if np.ndim(ends) else ends
        squares[:, i] += mean
        if j >= 0:
            squares[:, j] += mean
    return np.sqrt(squares)


def simulate(
    system: System,
    values: Mapping[str, float],
    start: Array | None = None,
    near: Trajectory | None = None,
) -> Trajectory:
    """Free run of a model on a recording.

    Newton on the trajectory where terms are not linear. Most of its time goes into the exponentials of a new
    linearisation, so that steps with the last one come first, as long as they help.

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
    before = 1.0
    for _ in range(1 if system.affine else _ROUNDS):
        with np.errstate(all="ignore"):
            x = _nearer(system, values, first, last, x) if last else x
            a, g0, g1 = _linearise(system, values, x)
        which, e, w0, w1 = kernel.transitions(a, system.grid.step)
        new = kernel.trajectory(which, e, w0, w1, g0, g1, first)
        if not np.all(np.abs(new) < _FAR):
            raise RunsAwayError(
                f"model '{system.model.name}' diverges on recording '{system.grid.recording}'; "
                "check signs, bounds and start values of its parameters"
            )
        change = _change(x, new)
        x, last = new, Trajectory(system, dict(values), new, a, which, e, w0, w1)
        # Newton's steps shrink at least as fast as this one did, a first one to less than its square
        if change * min(1.0, change / before) < _TOLERANCE:
            break
        before = change
    assert last is not None
    return last


def _nearer(system: System, values: Mapping[str, float], first: Array, last: Trajectory, x: Array) -> Array:
    """A trajectory (T, n) nearer to the solution, by steps with a linearisation that is there already."""
    before = np.inf
    for _ in range(_ROUNDS):
        rates = _rates(system, values, x)
        g0 = rates[0::2] - np.matmul(last.a, x[:-1, :, None])[:, :, 0]
        g1 = rates[1::2] - np.matmul(last.a, x[1:, :, None])[:, :, 0]
        new = kernel.trajectory(last.which, last.e, last.w0, last.w1, g0, g1, first)
        change = _change(x, new)
        if not change < _HELPS * before:  # also NaN
            return x
        x, before = new, change
        if change < _CLOSE:
            return x
    return x


def _change(old: Array, new: Array) -> float:
    """Largest change of a state in its unit, relative to 1 + its size."""
    return float(np.max(np.abs(new - old) / (1.0 + np.abs(new)), initial=0.0))


def outputs(trajectory: Trajectory, wrt: frozenset[str] = frozenset()) -> list[Dual]:
    """Outputs of the grid on all nodes (values (T,)), with derivatives by the names of `wrt`."""
    system = trajectory.system
    env = trajectory.at_nodes()
    found = []
    for name in system.grid.outputs:
        expression = system.model.outputs.get(name)
        if expression is not None:
            found.append(evaluate(expression, env, wrt, system.nodes))
        elif name in system.states:
            found.append(Dual(env[name], {name: 1.0} if name in wrt else {}))
        else:
            raise UserError(
                f"model '{system.model.name}' has no output '{name}'; give it one under [outputs]"
            )
    return found


def predict(trajectory: Trajectory) -> Array:
    """Outputs at the reading instants, (R, Y).

    Raises:
        RunsAwayError: one that is not finite where it was read.
    """
    grid = trajectory.system.grid
    count = len(grid.time)
    shown = [np.broadcast_to(dual.value, (count,))[grid.looked_at] for dual in outputs(trajectory)]
    columns = grid.at_readings(np.column_stack(shown)).T
    for name, column, seen in zip(grid.outputs, columns, grid.measured.T, strict=True):
        lost = seen & ~np.isfinite(column)
        if lost.any():
            raise RunsAwayError(
                f"model '{trajectory.system.model.name}': the output '{name}' is not a finite number "
                f"{grid.time[grid.read][lost][0]:.0f} s after the start of recording '{grid.recording}'; "
                "check what it divides by and what log(), sqrt() and ** are taken of"
            )
    return np.ascontiguousarray(columns.T)


def output_matrix(trajectory: Trajectory, nodes: Ints | None = None) -> Array:
    """dy/dx at the reading instants, or other nodes (R,): (R, Y, n)."""
    system = trajectory.system
    read, count = system.grid.read if nodes is None else nodes, len(system.grid.time)
    out = np.zeros((len(read), len(system.grid.outputs), len(system.states)))
    for y, dual in enumerate(outputs(trajectory, frozenset(system.states))):
        for name, partial in dual.partials.items():
            out[:, y, system.states.index(name)] = np.broadcast_to(partial, (count,))[read]
    return out
