"""How far the fixed step is from `discovery.dynamics`, which fitted the model."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_system, predict, simulate
from discovery.dynamics.samples import Samples
from discovery.export.compiled import compile_model
from discovery.export.makedocument import exportable
from discovery.export.ranges import sampled_inputs
from discovery.export.stepper import Stepper
from discovery.models import Model
from discovery.recordings import Campaign

Array = NDArray[np.float64]

COMPARED_EVERY = 600.0  # s


def agreement(model: Model, campaign: Campaign, recording: str, step_s: float) -> dict[str, float]:
    """Largest deviation [um] of the fixed step from `discovery.dynamics` over a recording.

    Returns:
        `integrator_um`: under the same inputs, held over each step. `held_inputs_um`: under the inputs as
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
    if not found:
        return {"integrator_um": 0.0, "held_inputs_um": 0.0}
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
        "integrator_um": _deviation(model, recording, held, np.array(marks), np.array(found)),
        "held_inputs_um": _deviation(model, recording, straight, np.array(marks), np.array(found)),
    }


def _deviation(
    model: Model, recording: str, samples: dict[str, Samples], marks: Array, found: Array
) -> float:
    time = np.unique(np.concatenate([[0.0], marks, *(s.time[s.time <= marks[-1]] for s in samples.values())]))
    unread = np.full((len(marks), len(model.outputs)), np.nan)
    grid = Grid(recording, time, samples, tuple(model.outputs), np.searchsorted(time, marks), unread)
    values = {name: parameter.value for name, parameter in model.parameters.items()}
    return float(np.max(np.abs(predict(simulate(make_system(model, grid), values)) - found)))
