"""Formulas of outputs that are written in the unit of the file, although recordings are converted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from math import isclose

import numpy as np

from discovery.errors import RunsAwayError
from discovery.fitting import Fit
from discovery.models import Model
from discovery.recordings import Channel
from discovery.terms import Apply, Number

MISSED = 0.5  # share of the spread of readings that a model with the right unit leaves at most
ASTRAY = 30.0  # times its start: a parameter that a fit moves farther means another unit


def in_file_units(
    model: Model, fit: Fit, channels: Mapping[str, Channel], fitted: Callable[[Model], Fit]
) -> tuple[Model, Fit]:
    """A model and its fit, formulas of outputs converted where they are in the unit of the file.

    A displacement in mm is converted to um. A formula that still gives mm is 1000 times too small: the model
    misses the readings, or its parameters leave all reason, and a diagnosis would look for the physics that
    is missing. A formula is converted if the fit fails so as it stands, and not with the formula converted.

    Args:
        model: as the fit began from.
        fitted: fits another model to the same recordings.
    """
    for y, output in enumerate(fit.problem.outputs):
        factor = channels[output].factor
        if output not in model.outputs or isclose(factor, 1.0) or _explains(fit, y):
            continue
        formula = Apply("*", (Number(factor), model.outputs[output]))
        other = replace(model, outputs={**model.outputs, output: formula})
        with suppress(RunsAwayError):
            again = fitted(other)
            model, fit = (other, again) if _explains(again, y) else (model, fit)
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
                f"give {unit}: it fits the readings so, and not as it stands. Write {factor:g}*(...) in the "
                "model to confirm"
            )


def _explains(fit: Fit, y: int) -> bool:
    """Whether a fit explains output number `y`, with parameters that stay near their starts."""
    left = np.concatenate([one[:, y] for one in fit.residuals().values()])
    readings = np.concatenate([t.system.grid.readings[:, y] for t in fit.trajectories])
    before, after = fit.problem.model.values(), fit.model.values()
    moved = [after[n] / before[n] for n in fit.problem.model.free if before[n]]
    near = all(1 / ASTRAY < change < ASTRAY for change in moved if change > 0)
    return near and bool(np.nanstd(left) < MISSED * np.nanstd(readings))
