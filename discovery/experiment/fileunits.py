"""Formulas of outputs that are written in the unit of the file, although recordings are converted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from math import isclose

import numpy as np

from discovery.errors import RunsAwayError
from discovery.fitting import Fit, fit_model
from discovery.models import Model
from discovery.recordings import Campaign, Channel
from discovery.terms import Apply, Number

MISSED = 0.5  # share of the spread of readings: a model that leaves more may have another unit
BETTER = 0.5  # share of both that the formula in the unit of the file leaves at most


def refitted_in_file_units(model: Model, fit: Fit, campaign: Campaign) -> tuple[Model, Fit]:
    """The model and its fit, formulas of outputs converted where they are in the unit of the file.

    A displacement in mm is converted to um. A formula that still gives mm is 1000 times too small, and a
    diagnosis would look for the physics that is missing. Only outputs that the model misses are asked, and
    only a fit with the formula converted decides.

    Args:
        model: as the fit began from.
    """
    outputs = fit.problem.outputs
    for y, output in enumerate(outputs):
        factor = campaign.channels[output].factor
        if output not in model.outputs or isclose(factor, 1.0):
            continue
        missed, spread = _rms(fit, y), _spread(fit, y)
        if missed < MISSED * spread:
            continue
        formula = Apply("*", (Number(factor), model.outputs[output]))
        other = replace(model, outputs={**model.outputs, output: formula})
        try:
            better = fit_model(other, campaign, list(fit.residuals()), outputs)
        except RunsAwayError:
            continue
        if _rms(better, y) < BETTER * min(missed, spread):
            model, fit = other, better
    return model, fit


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
                f"give {unit}: as it stands, it misses the readings. Write {factor:g}*(...) in the model "
                "to confirm"
            )


def _rms(fit: Fit, y: int) -> float:
    left = np.concatenate([one[:, y] for one in fit.residuals().values()])
    return float(np.sqrt(np.nanmean(left**2)))


def _spread(fit: Fit, y: int) -> float:
    """Standard deviation of the readings of an output."""
    return float(np.nanstd(np.concatenate([t.system.grid.readings[:, y] for t in fit.trajectories])))
