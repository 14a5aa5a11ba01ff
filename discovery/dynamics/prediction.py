"""What a trajectory shows: its outputs, and how they depend on its states."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics.trajectory import Trajectory
from discovery.errors import RunsAwayError, UserError
from discovery.terms import Dual

Array = NDArray[np.float64]
Ints = NDArray[np.intp]


def outputs(trajectory: Trajectory, wrt: frozenset[str] = frozenset()) -> list[Dual]:
    """Outputs of the grid on all nodes (values (T,)), with derivatives by the names of `wrt`.

    Each counts from the zero that its readings have in this recording.
    """
    system = trajectory.system
    for name in system.grid.outputs:
        if name not in system.model.outputs and name not in system.states:
            raise UserError(
                f"model '{system.model.name}' has no output '{name}'; give it one under [outputs]"
            )
    found = system.outputs(trajectory.at_nodes(), wrt, system.nodes)
    zeros = [system.grid.offset.get(name, 0.0) for name in system.grid.outputs]
    return [Dual(one.value + zero, one.partials) for one, zero in zip(found, zeros, strict=True)]


def predict(trajectory: Trajectory) -> Array:
    """Outputs at the reading instants, (R, Y).

    Raises:
        RunsAwayError: one that is not finite where it was read.
    """
    grid = trajectory.system.grid
    shown = np.empty((len(grid.looked_at), len(grid.outputs)))
    for y, dual in enumerate(outputs(trajectory)):
        value = np.asarray(dual.value)
        shown[:, y] = value[grid.looked_at] if value.ndim else value
    found = grid.at_readings(shown)
    lost = grid.measured & ~np.isfinite(found)
    if lost.any():
        y = int(np.argmax(lost.any(axis=0)))
        raise RunsAwayError(
            f"model '{trajectory.system.model.name}': the output '{grid.outputs[y]}' is not a finite number "
            f"{grid.time[grid.read][lost[:, y]][0]:.0f} s after the start of recording '{grid.recording}'; "
            "check what it divides by and what log(), sqrt() and ** are taken of"
        )
    return found


def output_matrix(trajectory: Trajectory, nodes: Ints | None = None) -> Array:
    """dy/dx at the reading instants, or other nodes (R,): (R, Y, n). The last are kept."""
    system = trajectory.system
    read, count = system.grid.read if nodes is None else nodes, len(system.grid.time)
    kind = "read" if read is system.grid.read else "nodes"
    if (known := trajectory.shown.get(kind)) is not None and known[0] is read:
        return known[1]
    out = np.zeros((len(read), len(system.grid.outputs), len(system.states)))
    for y, dual in enumerate(outputs(trajectory, frozenset(system.states))):
        for name, partial in dual.partials.items():
            out[:, y, system.states.index(name)] = np.broadcast_to(partial, (count,))[read]
    trajectory.shown[kind] = (read, out)
    return out
