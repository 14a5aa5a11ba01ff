"""How the outputs of a trajectory move with parameters, start values and candidate terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import kernel
from discovery.dynamics.grid import interleaved
from discovery.dynamics.prediction import output_matrix, outputs
from discovery.dynamics.starts import balanced, memories, rates_at_start, settled, starts_follow
from discovery.dynamics.system import System, shifted
from discovery.dynamics.trajectory import Trajectory
from discovery.terms import Name, evaluate, names
from discovery.terms.dual import Value

Array = NDArray[np.float64]

_PART = 0.01  # of what an input is expected to be late, the step of a difference


@dataclass(frozen=True)
class Column:
    """A piece of forcing: a heat flow (or rate) that enters `into` and leaves `source`, at the interval ends
    (2K,).

    Pieces with the same `owner` add up to one sensitivity column.
    """

    owner: int
    into: str
    series: Array
    source: str | None = None


def sensitivities(
    trajectory: Trajectory,
    parameters: Sequence[str],
    starts: Sequence[str] = (),
    candidates: Sequence[Column] = (),
    count: int | None = None,
    grown: Array | None = None,
) -> Array:
    """dy/d(everything) at the reading instants, (R, Y, M).

    Columns stand in this order: `parameters`, `starts` (start values of states), candidate owners 0, 1, ...

    Args:
        parameters: names of parameters, or of channels that move by a constant (start values declared from
            them move along); of an output, its zero moves, and what starts at its first reading with it.
        starts: names of states whose start value moves.
        candidates: forcing pieces of candidate terms.
        count: number of candidate owners; default the largest owner plus one.
        grown: (K + 1,) share of its change that each parameter has made at the nodes; default all of it.
    """
    system = trajectory.system
    owners = count if count is not None else max((c.owner for c in candidates), default=-1) + 1
    first = len(parameters) + len(starts)
    moved = moved_terms(trajectory, parameters) if parameters else []
    if grown is not None:
        ends = interleaved(grown[:-1], grown[1:])
        moved = [replace(piece, series=ends * piece.series) for piece in moved]
    pieces = [*moved, *candidates]
    owner = [piece.owner for piece in moved] + [first + piece.owner for piece in candidates]
    place = {name: i for i, name in enumerate(system.states)}
    into = np.array([place[piece.into] for piece in pieces], dtype=np.int64)
    source = np.array([place[p.source] if p.source else -1 for p in pieces], dtype=np.int64)
    size = np.empty((len(pieces), 2 * len(system.grid.step)))
    for k, piece in enumerate(pieces):
        size[k] = piece.series
    nodes = system.grid.looked_at
    begin = _start_slopes(trajectory, parameters, starts, _at_first(system, candidates, first, owners))
    if grown is not None:
        begin[:, : len(parameters)] *= grown[0]
    dy = kernel.columns(
        trajectory.which,
        np.concatenate([trajectory.e, trajectory.w0, trajectory.w1], axis=2),
        begin,
        np.array(owner, dtype=np.int64),
        into,
        system.scale[into],
        source,
        system.scale[source],
        size,
        nodes.astype(np.int64),
        output_matrix(trajectory, nodes),
    )
    for y, partials in enumerate(_shown_by_outputs(trajectory, parameters)):
        zero = system.grid.outputs[y]
        shown = partials | ({zero: 1.0} if zero in parameters else {})
        for name, partial in shown.items():
            whole = np.broadcast_to(partial, (len(system.grid.time),))
            dy[:, y, parameters.index(name)] += (whole if grown is None else grown * whole)[nodes]
    return system.grid.at_readings(dy)


def _shown_by_outputs(trajectory: Trajectory, parameters: Sequence[str]) -> list[dict[str, Value]]:
    """How each output moves with each parameter that stands in its expression."""
    system, wanted = trajectory.system, _in_terms(trajectory, parameters)
    shown = {name: system.model.outputs.get(name, Name(name)) for name in system.grid.outputs}
    if all(wanted.isdisjoint(names(expression)) for expression in shown.values()):
        return [{} for _ in shown]
    return [dual.partials for dual in outputs(trajectory, wanted)]


def moved_in_time(trajectory: Trajectory, late: Sequence[str]) -> list[Column]:
    """What each term changes by for a second by which a channel is logged later, owners in order.

    By differences: where a channel is held, its mean over an interval is a straight line of the shift but
    where a step comes past a node, and expressions with memory are no case of their own.
    """
    system, grid = trajectory.system, trajectory.system.grid
    ends = trajectory.at_ends() if late else {}
    found = []
    for owner, channel in enumerate(late):
        width = _PART * grid.unsure[channel]
        sides = []
        for by in (width, -width):
            when = {**grid.late, channel: grid.late[channel] + by}
            there = grid.logged_late(channel, when[channel]) + grid.offset.get(channel, 0.0)
            sides.append((shifted(system, grid.offset, when).ends, {**ends, channel: there}))
        for term in system.model.terms:
            if channel in names(term.expression):
                above, below = (evaluate(term.expression, env, memory=m).value for m, env in sides)
                change = np.asarray((above - below) / (2 * width))
                found.append(Column(owner, term.into, change, term.source))
    return found


def _in_terms(trajectory: Trajectory, parameters: Sequence[str]) -> frozenset[str]:
    """Those of the names that may stand in a term: there, the name of an output is that of a state."""
    return frozenset(parameters).difference(trajectory.system.grid.outputs)


def moved_terms(trajectory: Trajectory, parameters: Sequence[str]) -> list[Column]:
    """How each term moves with each parameter (or channel) in it; owners count the parameters."""
    system, wanted = trajectory.system, _in_terms(trajectory, parameters)
    env = trajectory.at_ends()
    return [
        Column(parameters.index(name), term.into, np.asarray(partial), term.source)
        for term, dual in zip(system.model.terms, system.rates(env, wanted, system.ends), strict=True)
        for name, partial in dual.partials.items()
    ]


def _at_first(system: System, candidates: Sequence[Column], first: int, owners: int) -> Array:
    """Rates (n, M) by which candidates move the states at the first instant, behind `first` other columns."""
    place = {name: i for i, name in enumerate(system.states)}
    found = np.zeros((len(place), first + owners))
    for c in candidates:
        for name, sign in ((c.into, 1.0), (c.source, -1.0)):
            if name is not None:
                found[place[name], first + c.owner] += (
                    sign * system.scale[place[name]] * float(np.ravel(c.series)[0])
                )
    return found


def _start_slopes(
    trajectory: Trajectory, parameters: Sequence[str], starts: Sequence[str], forced: Array
) -> Array:
    """Slopes of the start values, (n, M). `forced` (n, M): rates that candidates add at the first instant,
    where states that nothing reads are in balance.
    """
    system, wanted = trajectory.system, frozenset(parameters)
    start = np.zeros(forced.shape)
    # one that also moves freely does so around what its formula says
    for state, dual in system.starts({**system.grid.first, **trajectory.values}, wanted).items():
        for name, slope in dual.partials.items():
            turn = -1.0 if name in system.grid.outputs else 1.0  # a first reading less its zero
            start[system.states.index(state), parameters.index(name)] = turn * float(np.mean(slope))
    free = balanced(system)
    late = memories(system, free)
    inner = _in_terms(trajectory, parameters)
    wrt = [*dict.fromkeys((*system.states, *inner))]
    slopes = rates_at_start(system, trajectory.values, trajectory.x[0], wrt, free)[1] if free else start[:0]

    def settle(some: Sequence[int]) -> None:
        mine = slopes[[free.index(i) for i in some]]
        others = [i for i in range(len(system.states)) if i not in some]
        moved = mine[:, others] @ start[others] + forced[list(some)]
        for name in inner:
            moved[:, parameters.index(name)] += mine[:, wrt.index(name)]
        start[some] = settled(mine[:, list(some)], moved)

    if free and not (starts and late == free):  # memories are settled once all others have moved
        settle(free)
    if starts:
        by, follow = np.zeros_like(start), starts_follow(system)
        for k, name in enumerate(starts, len(parameters)):
            by[:, k] = follow[:, system.states.index(name)]
        start += by
        if late:
            settle(late)
            start[late] += by[late]
    return start
