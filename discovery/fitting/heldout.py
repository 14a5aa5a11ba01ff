"""Free runs of a fitted model on a recording that no fit has seen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
from discovery.dynamics.system import inputs_of, shifted, uncertain
from discovery.fitting.problem import read_spread
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
) -> Trajectory:
    """Free run of a model on a recording, zeroed on its first reading as a controller would be.

    The start values are the declared ones, corrected by the first complete reading alone within their
    spread (one Bayesian step); so are the offsets of inputs known only within a spread. No later reading is
    used.

    Args:
        outputs: measured channels.
        white: (Y,) reading noise that weighs the first reading against the declared start; default 1 um each.
        known: offsets of inputs that a fit found in this recording (`Fit.offset_in`); the first reading
            corrects only the others.
    """
    model = expanded(model, campaign.channels)
    grid = grid or make_grid(campaign, recording, inputs_of(model, campaign, outputs), outputs)
    known = known or {}
    system = shifted(make_system(model, grid), known)
    values = model.values(recording)
    noise = white if white is not None else np.ones(len(outputs))
    spreads = {
        name: sd
        for name, state in system.model.states.items()
        if (sd := _spread(system, state, dict(zip(outputs, noise, strict=True)))) > 0
    }
    inputs = tuple(name for name in uncertain(system) if name not in known)
    trajectory = simulate(system, values)
    if not (spreads or inputs) or not len(grid.read):
        return trajectory
    residual = grid.readings - predict(trajectory)
    seen = np.isfinite(residual[0])
    sd = np.array(noise)[seen]
    spread = np.array([*(grid.spread[n] for n in inputs), *spreads.values()])
    c = sensitivities(trajectory, inputs, list(spreads))[0][seen] / sd[:, None]
    gram = c.T @ c + np.diag(1 / spread**2)
    shift = np.linalg.solve(gram, c.T @ (residual[0][seen] / sd))
    if inputs:
        system = shifted(system, dict(zip(inputs, shift[: len(inputs)].tolist(), strict=True)))
    moved = dict(zip(spreads, shift[len(inputs) :].tolist(), strict=True))
    return simulate(system, values, start_values(system, values, moved), trajectory)


def _spread(system: System, state: State, white: Mapping[str, float]) -> float:
    """How far a state may start from its start; a state that no fit has seen starts at its stated start."""
    if state.start_sd is not None:
        return state.start_sd
    return read_spread(system, state.name, white) if state.read_as else 0.0
