"""How the outputs of a trajectory move with parameters, start values and candidate terms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import kernel
from discovery.dynamics.system import Trajectory, first_values, output_matrix, outputs
from discovery.terms import evaluate, names

Array = NDArray[np.float64]


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
) -> Array:
    """dy/d(everything) at the reading instants, (R, Y, M).

    Columns stand in this order: `parameters`, `starts` (start values of states), candidate owners 0, 1, ...

    Args:
        parameters: names of parameters, or of channels that move by a constant (start values declared from
            them move along).
        starts: names of states whose start value moves.
        candidates: forcing pieces of candidate terms.
        count: number of candidate owners; default the largest owner plus one.
    """
    system = trajectory.system
    steps = len(system.grid.step)
    owners = count if count is not None else max((c.owner for c in candidates), default=-1) + 1
    total = len(parameters) + len(starts) + owners
    owner: list[int] = []
    into: list[int] = []
    source: list[int] = []
    series: list[Array] = []
    wanted = frozenset(parameters)
    if parameters:
        env = trajectory.at_ends()
        for term, i, j in zip(system.model.terms, system.into, system.source, strict=True):
            if wanted.isdisjoint(names(term.expression)):
                continue
            dual = evaluate(term.expression, env, wanted, system.ends)
            for name, partial in dual.partials.items():
                owner.append(parameters.index(name))
                into.append(i)
                source.append(j)
                series.append(np.broadcast_to(partial, (2 * steps,)))
    for column in candidates:
        owner.append(len(parameters) + len(starts) + column.owner)
        into.append(system.states.index(column.into))
        source.append(system.states.index(column.source) if column.source else -1)
        series.append(np.broadcast_to(column.series, (2 * steps,)))
    stacked = np.array(series).reshape(len(series), steps, 2)
    left = np.ascontiguousarray(stacked[:, :, 0].T)
    right = np.ascontiguousarray(stacked[:, :, 1].T)
    into_index = np.array(into, dtype=np.int64)
    source_index = np.array(source, dtype=np.int64)
    read = system.grid.read.astype(np.int64)
    s = kernel.columns(
        trajectory.which,
        trajectory.e,
        trajectory.w0,
        trajectory.w1,
        _start_slopes(trajectory, parameters, starts, total),
        np.array(owner, dtype=np.int64),
        into_index,
        system.scale[into_index],
        source_index,
        system.scale[source_index],
        left,
        right,
        read,
    )
    dy: Array = np.einsum("ryn,rnm->rym", output_matrix(trajectory), s)
    for y, dual in enumerate(outputs(trajectory, wanted) if parameters else []):
        for name, partial in dual.partials.items():
            dy[:, y, parameters.index(name)] += np.broadcast_to(partial, (len(system.grid.time),))[
                system.grid.read
            ]
    return dy


def _start_slopes(
    trajectory: Trajectory, parameters: Sequence[str], starts: Sequence[str], total: int
) -> Array:
    """Slopes of the start values, (n, M)."""
    system, wanted = trajectory.system, frozenset(parameters)
    start = np.zeros((len(system.states), total))
    for k, name in enumerate(starts):
        start[system.states.index(name), len(parameters) + k] = 1.0
    for i, state in enumerate(system.model.states.values()):
        # one that also moves freely does so around what its formula says
        if state.start is not None and not wanted.isdisjoint(names(state.start)):
            known = {**first_values(system.grid), **trajectory.values}
            for name, slope in evaluate(state.start, known, wanted).partials.items():
                start[i, parameters.index(name)] = float(np.mean(slope))
    return start
