"""What inputs that are recorded a little wrong do to the states between readings: impulses, each time others.

    P += sum over steps of g g' S,    g_i = scale_i dq_i/du

An input that switches anywhere between two samples is on or off for a part of the step, as if it were a
little more or less all the time, and more at one end of the step than at the other: the states answer over
the step, and each other. Noise of samples gives impulses: over a step h, noise of standard deviation sd in
samples that are D apart moves the integral of the input by sd sqrt(D h) (white noise of the spectral density
sd^2 D). Samples of an input that moves faster than they come are noisy in the same way, and so is one that is
not known in a gap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial, reduce

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.dynamics.gaps import unknown_before
from discovery.dynamics.kernel import gathered
from discovery.dynamics.samples import Samples
from discovery.dynamics.sensitivity import moved_in_time, moved_terms
from discovery.terms import Apply, Name, evaluate, rewrite

Array = NDArray[np.float64]

_THEN = "what a channel was a while ago"
_UNEVEN = 3 / 5  # variance of the tilt of a switch at any time of a step, over that of its mean


def added(parts: Sequence[tuple[float, Callable[[], Array]]]) -> Array:
    """Covariance (R - 1, n, n) of all impulses together, each some times as large as known; empty where there
    are none.
    """
    found = [size**2 * covariance for size, made in parts if size and len(covariance := made())]
    return reduce(np.add, found) if found else np.zeros((0, 0, 0))


def late_switches(trajectory: Trajectory) -> Array:
    """Covariance (R - 1, n, n) of what the states get between two readings where each switch comes before or
    after its stamp by as much as the input may be logged late; empty where no input may.

    A switch at any instant s of a step (of 0 to 1) leaves 1(u > s) - u of itself. Its mean 1/2 - s has the
    variance 1/12, and its best tilt from one end of the step to the other 3/5 of that; they are uncorrelated.
    """
    grid = trajectory.system.grid
    channels = tuple(grid.late)
    if not channels:
        return _none(trajectory)
    size = [np.full(len(grid.step), grid.unsure[name]) for name in channels]
    switched = _impulses(trajectory, moved_in_time(trajectory, channels), size)
    fresh = np.zeros((switched.shape[1], *switched.shape[2:] * 2))
    acts = np.flatnonzero(switched.any(axis=(0, 2)))
    w0, w1 = trajectory.w0[trajectory.which[acts]], trajectory.w1[trajectory.which[acts]]
    for way, part in ((w0 + w1, 1.0), (w0 - w1, _UNEVEN)):
        moved = np.einsum("kij,ckj->cki", way, switched[:, acts])
        fresh[acts] += part * np.einsum("cki,ckj->kij", moved, moved)
    return _at_readings(trajectory, np.zeros_like(fresh), fresh)


def noisy_inputs(trajectory: Trajectory) -> Array:
    """Covariance (R - 1, n, n) of what the states get between two readings from the noise of recorded inputs;
    empty where no input has any.
    """
    noise = trajectory.system.grid.noisy
    if not noise:
        return _none(trajectory)
    impulse = _impulses(trajectory, *_noise(trajectory, noise))
    sums = np.zeros((impulse.shape[1] + 1, *impulse.shape[2:] * 2))
    np.cumsum(np.einsum("cki,ckj->kij", impulse, impulse), axis=0, out=sums[1:])
    return np.diff(sums[trajectory.system.grid.read], axis=0)


def inputs_in_gaps(trajectory: Trajectory) -> Array:
    """Covariance (R - 1, n, n) of what the states get between two readings from what inputs may have done
    while they were not recorded; empty where all were. A gap may be long: what comes early in it flows on.
    """
    pieces, unknown = _unrecorded(trajectory)
    if not unknown:
        return _none(trajectory)
    impulse = _impulses(trajectory, pieces, _over_steps(trajectory, unknown))
    fresh = np.einsum("cki,ckj->kij", impulse, impulse)
    return _at_readings(trajectory, 0.5 * fresh, 0.5 * fresh)


def moved_in_gaps(trajectory: Trajectory) -> tuple[Array, Array]:
    """How far the mean of each input is off in each gap (G,), one standard deviation, and what the outputs
    answer to it, (R, Y, G) for one of its unit.
    """
    grid = trajectory.system.grid
    slopes, unknown = _unrecorded(trajectory)
    spread, pieces = list[float](), list[Column]()
    for owner, one in enumerate(unknown):
        mine = [piece for piece in slopes if piece.owner == owner]
        ends = np.append(one.time[1:], grid.time[-1])
        for begin, end, size in zip(one.time, ends, one.value, strict=True):
            inside = np.repeat((grid.time[:-1] >= begin) & (grid.time[:-1] < end), 2)
            if size > 0 and inside.any():
                pieces += [replace(p, owner=len(spread), series=p.series * inside) for p in mine]
                spread.append(float(size / np.sqrt(end - begin)))
    return np.array(spread), sensitivities(trajectory, (), (), pieces, count=len(spread))


def _unrecorded(trajectory: Trajectory) -> tuple[list[Column], list[Samples]]:
    """Slopes of the flows by what was not recorded, owners in order, and how unsure each of it is, as the
    root of a spectral density: channels in their gaps, and before (or after) the recording those that arrive
    late (or early).
    """
    system = trajectory.system
    if not (system.grid.silent or system.delays):
        return [], []
    env, pieces = trajectory.at_ends(), moved_terms(trajectory, tuple(system.grid.silent))
    unknown = list(system.grid.silent.values())
    owners: dict[tuple[str, float], int] = {}
    for term, then in system.delays:
        channel, late = then.arguments
        assert isinstance(channel, Name)
        seconds = float(np.mean(evaluate(late, env, memory=system.ends).value))
        at = {**env, _THEN: evaluate(then, env, memory=system.ends).value}
        asked = rewrite(term.expression, partial(_named, then))
        slope = evaluate(asked, at, frozenset((_THEN,)), system.ends).partials.get(_THEN, 0.0)
        if not seconds or not np.any(slope):
            continue
        if (channel.id, seconds) not in owners:
            owners[channel.id, seconds] = len(unknown)
            unknown.append(unknown_before(system.grid.samples[channel.id], seconds))
        pieces.append(Column(owners[channel.id, seconds], term.into, np.asarray(slope), term.source))
    return pieces, unknown


def _named(then: Apply, one: Apply) -> Name | None:
    return Name(_THEN) if one == then else None


def _none(trajectory: Trajectory) -> Array:
    n = len(trajectory.system.states)
    return np.zeros((0, n, n))


def _noise(trajectory: Trajectory, noise: Mapping[str, Samples]) -> tuple[list[Column], list[Array]]:
    """Slopes of the flows by channels, and the standard deviation (K,) of the integral of each over a step.

    Args:
        noise: by channel, its standard deviation per root of Hz.
    """
    return moved_terms(trajectory, tuple(noise)), _over_steps(trajectory, list(noise.values()))


def _over_steps(trajectory: Trajectory, noise: Sequence[Samples]) -> list[Array]:
    """Standard deviation (K,) of the integral of each noise over a step."""
    grid = trajectory.system.grid
    middle = 0.5 * (grid.time[1:] + grid.time[:-1])
    return [one.at(middle) * np.sqrt(grid.step) for one in noise]


def _at_readings(trajectory: Trajectory, begun: Array, ended: Array) -> Array:
    """Covariance (R - 1, n, n) at each reading since the one before.

    Args:
        begun, ended: (K, n, n) what comes at the beginning and at the end of each step.
    """
    read = trajectory.system.grid.read.astype(np.int64)
    found: Array = gathered(trajectory.which, trajectory.e, read, begun, ended)
    return found


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
