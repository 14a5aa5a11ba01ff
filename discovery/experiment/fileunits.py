"""Formulas of outputs that are written in the unit of the file, although recordings are converted."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from math import isclose, log

import numpy as np
from numpy.typing import NDArray

from discovery.errors import RunsAwayError
from discovery.fitting import Fit
from discovery.models import Model
from discovery.recordings import Channel
from discovery.terms import Apply, Number

MISSED = 0.5  # share of the spread of readings that a model with the right unit leaves at most
ASTRAY = 1.0  # log of the factor by which a fit moves a parameter at most if the unit is right
LESS = 0.85  # of the rms, over all outputs: what is left once a formula has the right unit


def in_file_units(
    model: Model, fit: Fit, channels: Mapping[str, Channel], fitted: Callable[[Model], Fit]
) -> tuple[Model, Fit]:
    """A model and its fit, formulas of outputs converted where they are in the unit of the file.

    A displacement in mm is converted to um. A formula that still gives mm is 1000 times too small: the model
    misses the readings, or its parameters are far from what their author believes, and a diagnosis would look
    for the physics that is missing. An author who forgets the unit does so in all formulas of one unit, or in
    a single one. They are converted if the fit then leaves less, and its parameters stay near their starts
    or are nearer than before.

    Args:
        model: as the fit began from.
        fitted: fits another model to the same recordings.
    """
    mine = [y for y in fit.problem.outputs if y in model.outputs and not isclose(channels[y].factor, 1.0)]
    unit, written = {y: (channels[y].unit, channels[y].factor) for y in mine}, model.outputs
    together = [tuple(y for y in mine if unit[y] == one) for one in dict.fromkeys(unit.values())]
    for some in dict.fromkeys([*together, *((y,) for y in mine)]):
        left = [y for y in some if model.outputs[y] == written[y]]
        if all(_explains(fit, y) for y in left):
            continue
        formulas = {y: Apply("*", (Number(channels[y].factor), written[y])) for y in left}
        other = replace(model, outputs={**model.outputs, **formulas})
        with suppress(RunsAwayError):
            again = fitted(other)
            if _strayed(again) < max(_strayed(fit), ASTRAY) and _left(again, fit) < LESS:
                model, fit = other, again
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


def _explains(fit: Fit, output: str) -> bool:
    """Whether a fit explains an output, with parameters that stay near their starts."""
    y = fit.problem.outputs.index(output)
    readings = np.concatenate([t.system.grid.readings[:, y] for t in fit.trajectories])
    return _strayed(fit) < ASTRAY and bool(_rms(fit)[y] < MISSED * np.nanstd(readings))


def _strayed(fit: Fit) -> float:
    """Log of the largest factor by which a fit moves a parameter."""
    before, after = fit.problem.model.values(), fit.model.values()
    moved = [after[n] / before[n] for n in fit.problem.model.free if before[n]]
    return max((abs(log(change)) for change in moved if change > 0), default=0.0)


def _left(fit: Fit, other: Fit) -> float:
    """rms of a fit over that of another one, the geometric mean over the outputs."""
    return float(np.exp(np.mean(np.log(_rms(fit) / _rms(other)))))


def _rms(fit: Fit) -> NDArray[np.float64]:
    """Standard deviation (Y,) of what a fit leaves of each output."""
    left = np.concatenate(list(fit.residuals().values()))
    return np.asarray(np.maximum(np.nanstd(left, axis=0), 1e-300))
