"""Free runs of a fitted model on a recording that no fit has seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory, make_grid, make_system, sensitivities, simulate, start_values
from discovery.dynamics.system import inputs_of, predict, shifted, uncertain
from discovery.models import Model, expanded
from discovery.recordings import Campaign

Array = NDArray[np.float64]


def predict_recording(
    model: Model,
    campaign: Campaign,
    recording: str,
    outputs: Sequence[str],
    white: Sequence[float] | None = None,
    grid: Grid | None = None,
) -> Trajectory:
    """Free run of a model on a recording, zeroed on its first reading as a controller would be.

    The start values are the declared ones, corrected by the first complete reading alone within their
    spread (one Bayesian step); so are the offsets of inputs known only within a spread. No later reading is
    used.

    Args:
        outputs: measured channels.
        white: (Y,) reading noise that weighs the first reading against the declared start; default 1 um each.
    """
    model = expanded(model, campaign.channels)
    grid = grid or make_grid(campaign, recording, inputs_of(model, campaign, outputs), outputs)
    system = make_system(model, grid)
    values = model.values(recording)
    start = start_values(system, values)
    free = [name for name in system.states if model.states[name].start_sd > 0]
    inputs = uncertain(system)
    trajectory = simulate(system, values, start)
    if not (free or inputs) or not len(grid.read):
        return trajectory
    residual = grid.readings - predict(trajectory)
    seen = np.isfinite(residual[0])
    sd = np.array(white if white is not None else np.ones(len(outputs)))[seen]
    spread = np.array([*(grid.spread[n] for n in inputs), *(model.states[n].start_sd for n in free)])
    c = sensitivities(trajectory, inputs, free)[0][seen] / sd[:, None]
    gram = c.T @ c + np.diag(1 / spread**2)
    shift = np.linalg.solve(gram, c.T @ (residual[0][seen] / sd))
    if inputs:
        system = shifted(system, dict(zip(inputs, shift[: len(inputs)].tolist(), strict=True)))
        start = start_values(system, values)
    for name, change in zip(free, shift[len(inputs) :], strict=True):
        start[system.states.index(name)] += change
    return simulate(system, values, start, trajectory.x)
