"""Free runs of a fitted model on a recording that no fit has seen."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import (
    Grid,
    System,
    Trajectory,
    make_grid,
    make_system,
    predict,
    sensitivities,
    simulate,
    start_values,
)
from discovery.dynamics.system import evened, inputs_of, shifted, uncertain
from discovery.fitting.impulses import moved_in_gaps
from discovery.fitting.kalman import innovations, whiten
from discovery.fitting.noise import Noise
from discovery.fitting.problem import read_spread
from discovery.fitting.resolution import parts_needed
from discovery.fitting.solve import bounded_step
from discovery.models import Model, State, expanded
from discovery.recordings import Campaign

Array = NDArray[np.float64]


def predict_recording(
    model: Model,
    campaign: Campaign,
    recording: str,
    outputs: Sequence[str],
    white: Sequence[float] | None = None,
    grid: Grid | None = None,
    known: Mapping[str, float] | None = None,
    zeros: Mapping[str, tuple[float, float]] | None = None,
) -> Trajectory:
    """Free run of a model on a recording, zeroed on its first reading as a controller would be.

    The start values are the declared ones, corrected by the first complete reading alone within their
    spread (one Bayesian step); so are the offsets of inputs known only within a spread, and the parameters of
    which each recording has its own (the zero of a probe). No later reading is used.

    Args:
        outputs: measured channels.
        white: (Y,) reading noise that weighs the first reading against the declared start; default 1 um each.
        grid: default every stamp of an input or a reading, steps divided where the noise would show how far
            they err.
        known: offsets of inputs that a fit found in this recording (`Fit.offset_in`); the first reading
            corrects only the others.
        zeros: mean and spread of the zero of an output, or of the offset of an input, in a recording that no
            fit has seen (`Fit.zeros`).
    """
    model = expanded(model, campaign.channels)
    if grid is None:
        grid = make_grid(campaign, recording, inputs_of(model, campaign, outputs), outputs)
        grid = evened(make_system(model, grid)).grid
        run = predict_recording(model, campaign, recording, outputs, white, grid, known, zeros)
        parts = parts_needed(run, white) if white is not None else 1
        if parts == 1:
            return run
        grid = grid.divided(parts)
    known = known or {}
    not_known = {*outputs, *grid.spread} - {*known}
    others = {name: one for name, one in (zeros or {}).items() if name in not_known}
    grid = replace(grid, spread={**grid.spread, **{name: sd for name, (_, sd) in others.items()}})
    begun = {**known, **{name: mean for name, (mean, _) in others.items()}}
    system = shifted(make_system(model, grid), begun)
    values = model.values(recording)
    noise = np.array(white) if white is not None else np.ones(len(outputs))
    unsure = _unsure(system, noise, known)
    trajectory = simulate(system, values)
    if not any(unsure) or not len(grid.read):
        return trajectory
    residual = grid.readings - predict(trajectory)
    shift = iter(_shift(residual[:1], noise, *_moved(trajectory, unsure)).tolist())
    inputs, own, starts = ({name: next(shift) for name in part} for part in unsure)
    if inputs:
        system = shifted(system, begun | {name: begun.get(name, 0.0) + by for name, by in inputs.items()})
    values = values | {name: values[name] + by for name, by in own.items()}
    return simulate(system, values, start_values(system, values, starts), trajectory)


def from_known_starts(
    run: Trajectory,
    residual: Array,
    white: Array,
    known: Collection[str] = (),
    together: float = 1.0,
    reading: Array | None = None,
    farthest: float = inf,
) -> Array:
    """Residuals (R, Y) of a free run as they would be from the starts that all its readings show.

    A body that no sensor reads may begin far from what one first reading shows, and no model is better or
    worse for that, nor for what inputs did while nobody recorded them. Starts and inputs
    are known within their spread.

    Args:
        residual: readings minus model (R, Y).
        white: (Y,) what a reading misses a free run by.
        known: inputs whose offsets are known in this recording.
        together: readings that count as one, as in the fit (`Fit.together`).
        reading: (Y,) reading noise, within which a start is known that was read; default `white`.
        farthest: spreads by which an input, or a start that was read, may be off. A room that is known
            within 3 K is not 35 K colder, however much better a wrong model looks with it. A machine may
            begin warmer than in any other recording, a probe at another zero, and what each recording has
            of its own may be anything.
    """
    unsure = _unsure(run.system, white if reading is None else reading, known)
    if not (any(unsure) or run.system.grid.silent or run.system.delays) or not len(residual):
        return residual
    parts = _moved(run, unsure), moved_in_gaps(run)
    spread, moved = (np.concatenate(both, axis=-1) for both in zip(*parts, strict=True))
    states = run.system.model.states
    anywhere = [
        *(name in run.system.grid.outputs for name in unsure.inputs),
        *(True for _ in unsure.own),
        *(not states[name].read_as for name in unsure.starts),
    ]
    ends = farthest * spread
    ends[np.flatnonzero(anywhere)] = inf
    return residual - moved @ _shift(residual, white, spread, moved, together, ends)


def innovations_from_known_starts(run: Trajectory, residual: Array, noise: Noise) -> Array:
    """What each reading (R, Y) says beyond those before it, in its standard deviations, from the starts that
    make all readings most likely under a noise.

    The starts of a free run are other ones: where a model misses for hours, they leave its first readings
    for the hours that follow.

    Args:
        residual: readings minus model (R, Y), of the whole recording.
    """
    unsure = _unsure(run.system, np.array(noise.white), ())
    if not any(unsure):
        return innovations(run, noise, residual)
    spread, moved = _moved(run, unsure)
    rows = whiten(run, noise, np.concatenate([residual[:, :, None], moved], axis=2))
    gram = rows[:, 1:].T @ rows[:, 1:] + np.diag(1 / spread**2)
    out = np.full(residual.shape, np.nan)
    shift = np.linalg.solve(gram, rows[:, 1:].T @ rows[:, 0])
    out[run.system.grid.measured] = rows[:, 0] - rows[:, 1:] @ shift
    return out


class Unsure(NamedTuple):
    """What is not exactly known of a recording before its first reading, each with its spread."""

    inputs: dict[str, float]  # their offsets
    own: dict[str, float]  # parameters of which each recording has its own
    starts: dict[str, float]


def _unsure(system: System, white: Array, known: Collection[str]) -> Unsure:
    """What the readings of a recording have to say; `known`: inputs whose offsets are known."""
    noise = dict(zip(system.grid.outputs, white, strict=True))
    inputs = {name: system.grid.spread[name] for name in uncertain(system) if name not in known}
    own = {
        name: p.spread
        for name, p in system.model.parameters.items()
        if p.spread > 0 and not p.fixed and system.grid.recording not in p.values
    }
    starts = {n: sd for n, s in system.model.states.items() if (sd := _spread(system, s, noise)) > 0}
    return Unsure(inputs, own, starts)


def _shift(
    residual: Array,
    white: Array,
    spread: Array,
    moved: Array,
    together: float = 1.0,
    ends: Array | float = inf,
) -> Array:
    """Most likely shifts (K,) of what is not known, given the first rows of a residual (N, Y).

    Args:
        spread, moved: as of `_moved`.
        ends: (K,) the largest shifts.
    """
    seen = np.isfinite(residual)
    c = (moved[: len(residual)] / white[None, :, None])[seen]
    gram = c.T @ c / together + np.diag(1 / spread**2)
    slope = -c.T @ (residual / white)[seen] / together
    most = np.broadcast_to(ends, spread.shape)
    return bounded_step(np.zeros(len(spread)), gram, slope, 0.0, -most, most)


def _moved(run: Trajectory, unsure: Unsure) -> tuple[Array, Array]:
    """Spread (K,) of what is not known, in its order, and what the outputs answer to each (R, Y, K)."""
    spread = np.array([sd for part in unsure for sd in part.values()])
    return spread, sensitivities(run, [*unsure.inputs, *unsure.own], list(unsure.starts))


def _spread(system: System, state: State, white: Mapping[str, float]) -> float:
    """How far a state may start from its start; a state that no fit has seen starts at its stated start."""
    if state.start_sd is not None:
        return state.start_sd
    return read_spread(system, state.name, white) if state.read_as else 0.0
