"""Noise that is always there: process noise that grows with the flows, slow sensor noise, wrong inputs.

    s_i(t)^2 = (level floor_i)^2 + (share flow_i(t))^2

Every body has some unrecorded heat, of an unknown level. The error of a lumped model also grows with the heat
flow through a body, by a share that is small for a nearly exact model and large for a coarse one. Evidence is
integrated over a few values of each, and over slow sensor noise.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory, predict
from discovery.dynamics.trajectory import answers, flows
from discovery.effects.form import FARTHEST
from discovery.evidence.settings import Prior, Setting, with_levels
from discovery.evidence.whitening import Whitened
from discovery.fitting import Fit, Noise
from discovery.fitting.kalman import make_filter
from discovery.fitting.noise import resolution
from discovery.terms import Name

Array = NDArray[np.float64]

_TRIED = (0.0, 0.3, 1.0, 3.0, 10.0, 30.0)  # levels with which a reading noise is sought where none is stated


@dataclass(frozen=True)
class UnknownHeat:
    """Heat of unknown cause at a state, next to its process noise: "none of these" (a latent force)."""

    state: str
    heat: float  # W, or a rate
    share: float  # of what flows through the state
    log_weight: float
    place: tuple[int, int]  # on the grid of both

    def on_top_of(self, setting: Setting) -> Setting:
        """A noise setting with it. What is always there stays: less noise than usual is no unknown cause."""
        usual = (setting.noise.heat or {}).get(self.state, 0.0), setting.noise.share
        both = float(np.hypot(usual[0], self.heat)), float(np.hypot(usual[1], self.share))
        noise = replace(setting.noise, force={**(setting.noise.force or {}), self.state: both})
        return replace(setting, noise=noise, log_weight=setting.log_weight + self.log_weight)


@dataclass(frozen=True)
class UnknownChange:
    """A slow change of one output, of unknown cause, instead of its slow noise: "none of these" where nothing
    heats a body (a joint that snaps, a plate that buckles, a probe that creeps).
    """

    output: str
    times: float  # its standard deviation, in reading noises
    log_weight: float
    place: tuple[int, int]

    def on_top_of(self, setting: Setting) -> Setting:
        """A noise setting with it."""
        noise = setting.noise
        slow = list(noise.slow or (0.0,) * len(noise.white))
        y = noise.outputs.index(self.output)
        slow[y] = max(slow[y], self.times * noise.white[y])
        return replace(
            setting,
            noise=replace(noise, slow=tuple(slow)),
            log_weight=setting.log_weight + self.log_weight,
        )


def floors(
    fit: Fit, share: float, ambient: Collection[str] = (), apart: float = 0.0, own: bool = True
) -> dict[str, float]:
    """Process noise that no state is free of, W at a body, else a rate: a share of what flows through it and
    through the busiest body (their geometric mean: a glass scale that takes 3 W has less of it than a motor
    that takes 150 W, and more than its share), and what flows where the air at a body is not quite as warm as
    the air that is measured. Heat and rates are never compared: a bed may follow the room at 1e-5 K/s while
    other bodies take 300 W.

    Args:
        ambient: channels that measure the air.
        apart: rms difference [K] of the air at a body from these.
        own: what flows through a body counts; not for what comes to a machine later, which may be anywhere.
    """
    largest = flows_at_least(fit.trajectories)
    states = {n: s for n, s in fit.problem.model.states.items() if not s.memory}
    top = {
        kind: max((largest[n] for n, s in states.items() if bool(s.capacity) == kind), default=0.0)
        for kind in (True, False)
    }
    air = dict.fromkeys(states, 0.0)
    for run in fit.trajectories if apart else ():
        size = apart * np.sqrt(np.mean(answers(run, ambient) ** 2, axis=0))
        for name, one in zip(run.system.states, size.tolist(), strict=True):
            air[name] = max(air.get(name, 0.0), one)
    busiest = {n: top[bool(s.capacity)] for n, s in states.items()}
    usual = {n: np.sqrt(most * largest[n]) if own else most for n, most in busiest.items()}
    return {n: float(np.hypot(share * usual[n], air[n])) for n in states}


def flow_sizes(trajectories: Sequence[Trajectory]) -> dict[str, float]:
    """rms of the flow through each state, W or a rate, in the recording where it is largest."""
    found: dict[str, float] = {}
    for trajectory in trajectories:
        size = np.sqrt(np.mean(flows(trajectory) ** 2, axis=0))
        for name, one in zip(trajectory.system.states, size.tolist(), strict=True):
            found[name] = max(found.get(name, 0.0), one)
    return found


def flows_at_least(trajectories: Sequence[Trajectory]) -> dict[str, float]:
    """As `flow_sizes`, but at least what would have to flow for what a free run misses of a body that is read

        C rms(reading - model) / time of process noise    [W, or a rate]

    A model without its only heat has next to no flow, and nothing could be usual there.
    """
    found = flow_sizes(trajectories)
    for run in trajectories:
        system = run.system
        left = system.grid.readings - predict(run)
        for y, output in enumerate(system.grid.outputs):
            shown = system.model.outputs.get(output, Name(output))
            if not isinstance(shown, Name) or shown.id not in found or not system.grid.measured[:, y].any():
                continue
            missed = float(np.sqrt(np.nanmean(left[:, y] ** 2)))
            rate = missed / _process_time(system.grid)
            found[shown.id] = max(found[shown.id], rate / system.model.states[shown.id].scale)
    return found


def _process_time(grid: Grid) -> float:
    """The longest time constant of process noise that is likely [s]: what passes between a few readings
    cannot be told from white noise, and what lasts as long as a recording not from an offset.
    """
    every = min((grid.logged[name] for name in grid.outputs if name in grid.logged), default=0.0)
    return min(max(10800.0, 8 * every), float(grid.time[-1]) / 8)


def neighbours(places: Sequence[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
    """For each place on a grid, the indices of those one step away."""
    index = {place: k for k, place in enumerate(places)}
    found = []
    for place in places:
        steps = [(axis, at + step) for axis, at in enumerate(place) for step in (-1, 1)]
        near = [(*place[:axis], at, *place[axis + 1 :]) for axis, at in steps]
        found.append(tuple(index[one] for one in near if one in index))
    return tuple(found)


def unknown_heat(
    state: str, floor: float, times: Sequence[float], shares: Sequence[float]
) -> tuple[UnknownHeat, ...]:
    """Heat of unknown cause at a state; every size is equally likely.

    Args:
        floor: process noise of the state at level one, W or a rate.
        times: sizes, in multiples of it.
        shares: of what flows through the state.
    """
    weight = -float(np.log(len(times) * len(shares)))
    return tuple(
        UnknownHeat(state, size * floor, share, weight, (i, j))
        for i, size in enumerate(times)
        for j, share in enumerate(shares)
    )


def unknown_change(output: str, times: Sequence[float]) -> tuple[UnknownChange, ...]:
    """A slow change of an output, of unknown cause; every size (in reading noises) is equally likely."""
    weight = -float(np.log(len(times)))
    return tuple(UnknownChange(output, size, weight, (i, 0)) for i, size in enumerate(times))


def reading_noise(
    fit: Fit, stated: Mapping[str, float | None], floor: Mapping[str, float], prior: Prior
) -> Noise:
    """White reading noise: the stated one, else the most likely level with slow noise and process noise of
    any size.

    Process noise far above the usual is offered, so that a mismatch passes for that and not for reading
    noise. Time constants are 2 h of slow noise and 3 h of process noise, a share of shorter recordings, and
    more where readings are rare.
    """
    outputs = fit.problem.outputs
    known = np.array([stated.get(name) is not None for name in outputs])
    longest = max(_process_time(t.system.grid) for t in fit.trajectories)
    start = Noise(outputs, tuple(fit.noise.white), (), None, slow_time=longest / 1.5, heat_time=longest)
    best, lowest = np.array(fit.noise.white), np.inf
    if not known.all():
        seen, least = Whitened(fit, 1), np.array(resolution([s.grid.single for s in fit.problem.systems]))
        for slow in prior.slow:
            for level in _TRIED:
                white, cost = _white_with(seen, start, known, least, floor, prior, level, slow)
                if cost < lowest:
                    best, lowest = white, cost
    return replace(start, white=tuple(float(w) for w in best))


def _white_with(
    seen: Whitened,
    start: Noise,
    known: NDArray[np.bool_],
    least: Array,
    floor: Mapping[str, float],
    prior: Prior,
    level: float,
    slow: float,
) -> tuple[Array, float]:
    """White level (Y,) of unit innovations with given slow and process noise, and its -log likelihood."""
    white, cost = np.array(start.white), np.inf
    for _ in range(4):
        noise = with_levels(replace(start, white=tuple(white)), floor, level, level * prior.share, slow)
        squares, counts, cost = np.zeros(len(white)), np.zeros(len(white)), 0.0
        for part, residual in zip(seen.filters, seen.residuals, strict=True):
            z, log = part.whitened(noise, residual[:, :, None])
            innovation = np.full(residual.shape, np.nan)
            innovation[part.measured] = np.clip(z[:, 0], -FARTHEST, FARTHEST)  # wrong readings
            squares += np.nansum(innovation**2, axis=0)
            counts += part.measured.sum(axis=0)
            cost += float(np.sum(log)) + 0.5 * float(np.nansum(innovation**2))
        factor = np.where(known, 1.0, np.sqrt(squares / np.maximum(counts, 1)))
        white = np.where(known, white, np.maximum(white * np.maximum(factor, 0.2), least))
        if np.all(np.abs(factor - 1) < 0.01):
            break
    return white, cost


def noise_in_free_runs(
    trajectory: Trajectory, noise: Noise, size: Array, only: Sequence[int] | None = None
) -> float:
    """rms of the readings of a free run from reading noise, slow noise, process noise and inputs, in units of
    a size (Y,); `only`: of these outputs.
    """
    variance = (np.array(noise.white) ** 2 + make_filter(trajectory).spread(noise)) / size**2
    mine = slice(None) if only is None else list(only)
    return float(np.sqrt(np.mean(variance[:, mine][trajectory.system.grid.measured[:, mine]])))
