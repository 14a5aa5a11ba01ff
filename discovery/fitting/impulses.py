"""What inputs that are recorded a little wrong do to the states between readings: impulses, each time others.

    P += sum over steps of g g' S,    g_i = scale_i dq_i/du

An input that switches a little before or after its stamp gives an impulse at the bodies. So does the noise of
each of its samples: over a step h, noise of standard deviation sd in samples that are D apart moves the
integral of the input by sd sqrt(D h) (white noise of the spectral density sd^2 D). Samples of an input that
moves faster than they come are noisy in the same way, and so is one that is not known in a gap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory
from discovery.dynamics.samples import Samples
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
    noise = trajectory.system.grid.noisy
    return _between(trajectory, *_noise(trajectory, noise)) if noise else _none(trajectory)


def inputs_in_gaps(trajectory: Trajectory) -> Array:
    """Covariance (R - 1, n, n) of what the states get between two readings from what inputs may have done
    while they were not recorded; empty where all were. A gap may be long: what comes early in it flows on.
    """
    unknown = trajectory.system.grid.silent
    if not unknown:
        return _none(trajectory)
    impulse = _impulses(trajectory, *_noise(trajectory, unknown))
    fresh = np.einsum("cki,ckj->kij", impulse, impulse)
    read = trajectory.system.grid.read
    found = np.zeros((max(len(read) - 1, 0), *fresh.shape[1:]))
    for r in np.flatnonzero([fresh[a:b].any() for a, b in pairwise(read)]):
        for k in range(read[r], read[r + 1]):
            way = trajectory.e[trajectory.which[k]]
            found[r] = way @ (found[r] + 0.5 * fresh[k]) @ way.T + 0.5 * fresh[k]
    return found


def _none(trajectory: Trajectory) -> Array:
    n = len(trajectory.system.states)
    return np.zeros((0, n, n))


def _noise(trajectory: Trajectory, noise: Mapping[str, Samples]) -> tuple[list[Column], list[Array]]:
    """Slopes of the flows by channels, and the standard deviation (K,) of the integral of each over a step.

    Args:
        noise: by channel, its standard deviation per root of Hz.
    """
    grid = trajectory.system.grid
    middle = 0.5 * (grid.time[1:] + grid.time[:-1])
    size = [one.at(middle) * np.sqrt(grid.step) for one in noise.values()]
    return moved_terms(trajectory, tuple(noise)), size


def _between(trajectory: Trajectory, pieces: Sequence[Column], size: Sequence[Array]) -> Array:
    """Covariance (R - 1, n, n) between readings of independent impulses; arguments as of `_impulses`."""
    impulse = _impulses(trajectory, pieces, size)
    sums = np.zeros((impulse.shape[1] + 1, *impulse.shape[2:] * 2))
    np.cumsum(np.einsum("cki,ckj->kij", impulse, impulse), axis=0, out=sums[1:])
    return np.diff(sums[trajectory.system.grid.read], axis=0)


def _impulses(trajectory: Trajectory, pieces: Sequence[Column], size: Sequence[Array]) -> Array:
    """What each owner gives the states in each step, (C, K, n).

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
    return impulse
