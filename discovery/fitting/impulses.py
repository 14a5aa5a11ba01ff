"""What inputs that are recorded a little wrong do to the states between readings: impulses, each time others.

    P += sum over steps of g g' S,    g_i = scale_i dq_i/du

An input that switches a little before or after its stamp gives an impulse at the bodies. So does the noise of
each of its samples: over a step h, noise of standard deviation sd in samples that are D apart moves the
integral of the input by sd sqrt(D h) (white noise of the spectral density sd^2 D). Samples of an input that
moves faster than they come are noisy in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory
from discovery.dynamics.sensitivity import moved_in_time, moved_terms

Array = NDArray[np.float64]


def added(parts: Sequence[tuple[float, Callable[[], Array]]]) -> Array:
    """Covariance (R - 1, n, n) of all impulses together, each some times as large as known; empty where there
    are none.
    """
    found = [size**2 * covariance for size, made in parts if size and len(covariance := made())]
    return np.sum(found, axis=0) if found else np.zeros((0, 0, 0))


def late_switches(trajectory: Trajectory) -> Array:
    """Covariance (R - 1, n, n) of what the states get between two readings where each switch comes before or
    after its stamp by as much as the input may be logged late; empty where no input may.
    """
    grid = trajectory.system.grid
    channels = tuple(grid.late)
    if not channels:
        return _none(trajectory)
    size = [grid.step * grid.unsure[name] for name in channels]
    return _between(trajectory, moved_in_time(trajectory, channels), size)


def noisy_inputs(trajectory: Trajectory) -> Array:
    """Covariance (R - 1, n, n) of what the states get between two readings from the noise of recorded inputs;
    empty where no input has any.
    """
    grid = trajectory.system.grid
    channels = tuple(grid.noisy)
    if not channels:
        return _none(trajectory)
    middle = 0.5 * (grid.time[1:] + grid.time[:-1])
    size = [grid.noisy[name].at(middle) * np.sqrt(grid.step) for name in channels]
    return _between(trajectory, moved_terms(trajectory, channels), size)


def _none(trajectory: Trajectory) -> Array:
    n = len(trajectory.system.states)
    return np.zeros((0, n, n))


def _between(trajectory: Trajectory, pieces: Sequence[Column], size: Sequence[Array]) -> Array:
    """Covariance (R - 1, n, n) between readings of independent impulses.

    Args:
        pieces: slopes of the flows; those with one owner move together.
        size: standard deviation (K,) of the integral of what each owner moves by over each step.
    """
    system = trajectory.system
    n, steps = len(system.states), len(system.grid.step)
    impulse = np.zeros((len(size), steps, n))
    for piece in pieces:
        slope = np.broadcast_to(piece.series, (2 * steps,)).reshape(-1, 2).mean(axis=1) * size[piece.owner]
        for state, sign in ((piece.into, 1.0), (piece.source, -1.0)):
            if state:
                i = system.states.index(state)
                impulse[piece.owner, :, i] += sign * system.scale[i] * slope
    sums = np.zeros((len(system.grid.time), n, n))
    np.cumsum(np.einsum("cki,ckj->kij", impulse, impulse), axis=0, out=sums[1:])
    return np.diff(sums[system.grid.read], axis=0)
