"""Formulas of outputs that are written in the unit of the file, although recordings are converted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import isclose

import numpy as np

from discovery.errors import RunsAwayError
from discovery.fitting import fit_model
from discovery.models import Model
from discovery.recordings import Campaign, Channel
from discovery.terms import Apply, Number

MISSED = 0.5  # share of the spread of readings that a model with the right unit leaves at most
ASTRAY = 30.0  # times its start: a parameter that a fit moves farther means another unit


def in_file_units(
    model: Model, campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str]
) -> Model:
    """The model, formulas of outputs converted where they are in the unit of the file.

    A displacement in mm is converted to um. A formula that still gives mm is 1000 times too small: the model
    misses the readings, or its parameters leave all reason, and a diagnosis would look for the physics that
    is missing. A formula is converted if a fit fails so as it stands, and none does with it converted.
    """
    for y, output in enumerate(outputs):
        factor = campaign.channels[output].factor
        if output not in model.outputs or isclose(factor, 1.0):
            continue
        formula = Apply("*", (Number(factor), model.outputs[output]))
        other = replace(model, outputs={**model.outputs, output: formula})
        if not _fits(model, campaign, recordings, outputs, y):
            model = other if _fits(other, campaign, recordings, outputs, y) else model
    return model


def converted_notes(written: Model, model: Model, channels: Mapping[str, Channel]) -> Iterator[str]:
    """A sentence for each output whose formula is taken in the unit of the file.

    Args:
        written: the model as its file has it.
    """
    for output, formula in model.outputs.items():
        if written.outputs.get(output) != formula:
            unit, factor = channels[output].unit, channels[output].factor
            yield (
                f"the formula of output '{output}' is taken in the unit of the file, times {factor:g} to "
                f"give {unit}: it fits the readings so, and not as it stands. Write {factor:g}*(...) in the "
                "model to confirm"
            )


def _fits(
    model: Model, campaign: Campaign, recordings: Sequence[str], outputs: Sequence[str], y: int
) -> bool:
    """Whether a fit explains output number `y`, with parameters that stay near their starts."""
    try:
        fit = fit_model(model, campaign, recordings, outputs)
    except RunsAwayError:
        return False
    left = np.concatenate([one[:, y] for one in fit.residuals().values()])
    readings = np.concatenate([t.system.grid.readings[:, y] for t in fit.trajectories])
    starts, found = model.values(), fit.model.values()
    moved = [found[n] / starts[n] for n in model.free if starts[n]]
    near = all(1 / ASTRAY < change < ASTRAY for change in moved if change > 0)
    return near and bool(np.nanstd(left) < MISSED * np.nanstd(readings))
