"""Formulas of outputs that are written in the unit of the file, although recordings are converted."""

from __future__ import annotations

from dataclasses import replace
from math import isclose
from pathlib import Path

import numpy as np

from discovery.errors import UserError
from discovery.fitting import Fit, fit_model
from discovery.recordings import Campaign
from discovery.terms import Apply, Number

MISSED = 0.5  # share of the spread of readings: a model that leaves more may have another unit
BETTER = 0.5  # share of both that the formula in the unit of the file leaves at most


def refuse_file_units(path: Path, name: str, fit: Fit, campaign: Campaign) -> None:
    """Stop at a model whose formula of an output fits its readings only as the file has them.

    A displacement in mm is converted to um. A formula that still gives mm is 1000 times too small, and a
    diagnosis would look for the physics that is missing. Only outputs that the model misses are asked, and
    only a fit of the formula in the other unit decides.

    Args:
        name: of the model, for the message.

    Raises:
        UserError: what to write instead.
    """
    model, outputs = fit.model, fit.problem.outputs
    for y, output in enumerate(outputs):
        factor = campaign.channels[output].factor
        if output not in model.outputs or isclose(factor, 1.0):
            continue
        missed, spread = _rms(fit, y), _spread(fit, y)
        if missed < MISSED * spread:
            continue
        formula = Apply("*", (Number(factor), model.outputs[output]))
        other = replace(fit.problem.model, outputs={**model.outputs, output: formula})
        better = fit_model(other, campaign, list(fit.residuals()), outputs)
        if _rms(better, y) < BETTER * min(missed, spread):
            unit = campaign.channels[output].unit
            raise UserError(
                f"{path}: model '{name}': the formula of output '{output}' gives the unit of the file, but "
                f"recordings are converted to {unit}. Write {factor:g}*(...) under [outputs] of the model: "
                f"its rms is {_rms(better, y):.3g} {unit} then, and {missed:.3g} {unit} now"
            )


def _rms(fit: Fit, y: int) -> float:
    left = np.concatenate([one[:, y] for one in fit.residuals().values()])
    return float(np.sqrt(np.nanmean(left**2)))


def _spread(fit: Fit, y: int) -> float:
    """Standard deviation of the readings of an output."""
    return float(np.nanstd(np.concatenate([t.system.grid.readings[:, y] for t in fit.trajectories])))
