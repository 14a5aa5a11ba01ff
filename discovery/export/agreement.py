"""How far the fixed step is from `discovery.dynamics`, which fitted the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_system, predict, simulate
from discovery.dynamics.samples import Samples
from discovery.export.compiled import compile_model
from discovery.export.makedocument import exportable
from discovery.export.ranges import sampled_inputs
from discovery.export.stepper import Stepper
from discovery.models import Model
from discovery.models.units import differences
from discovery.recordings import Campaign

Array = NDArray[np.float64]

COMPARED_EVERY = 600.0  # s


def agreement(model: Model, campaign: Campaign, recording: str, step_s: float) -> dict[str, dict[str, float]]:
    """Largest deviation of the fixed step from `discovery.dynamics` over a recording, by the unit of outputs.

    Returns:
        `integrator`: under the same inputs, held over each step. `held_inputs`: under the inputs as
        `discovery.dynamics` reads them, temperatures straight between their stamps.
    """
    model = exportable(model, campaign)
    compiled = compile_model(model, step_s)
    u = sampled_inputs(campaign, recording, compiled.inputs, step_s)
    every = max(1, round(COMPARED_EVERY / step_s))
    stepper, found, marks = Stepper(compiled), [], []
    stepper.start(u[0])
    for k in range(every, len(u), every):
        stepper.run(u[k - every : k])
        found.append(stepper.outputs(u[k]))  # as dynamics does: with the inputs of this instant
        marks.append(k * step_s)
    units = [differences(campaign.channels[name].unit) for name in model.outputs]
    if not found:
        return {kind: dict.fromkeys(units, 0.0) for kind in ("integrator", "held_inputs")}
    ticks = np.arange(len(u), dtype=float) * step_s
    data = campaign.recordings[recording]
    held, straight = {}, {}
    for i, name in enumerate(compiled.inputs):
        known = np.isfinite(data.values[name])
        held[name] = Samples(ticks, u[:, i], False)
        straight[name] = Samples(
            data.time[known], data.values[name][known], campaign.channels[name].between == "linear"
        )
    return {
        kind: _largest(units, _deviation(model, recording, samples, np.array(marks), np.array(found)))
        for kind, samples in (("integrator", held), ("held_inputs", straight))
    }


def _largest(units: Sequence[str], deviation: Array) -> dict[str, float]:
    """The largest deviation by unit, of those of each output (Y,)."""
    found: dict[str, float] = {}
    for unit, one in zip(units, deviation.tolist(), strict=True):
        found[unit] = max(found.get(unit, 0.0), one)
    return found


def _deviation(
    model: Model, recording: str, samples: dict[str, Samples], marks: Array, found: Array
) -> Array:
    """Largest deviation (Y,) of each output."""
    time = np.unique(np.concatenate([[0.0], marks, *(s.time[s.time <= marks[-1]] for s in samples.values())]))
    unread = np.full((len(marks), len(model.outputs)), np.nan)
    grid = Grid(recording, time, samples, tuple(model.outputs), np.searchsorted(time, marks), unread)
    values = {name: parameter.value for name, parameter in model.parameters.items()}
    largest: Array = np.max(np.abs(predict(simulate(make_system(model, grid), values)) - found), axis=0)
    return largest
