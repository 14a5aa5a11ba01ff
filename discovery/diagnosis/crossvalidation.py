"""Free runs on recordings left out of the fit: a name has to hold where the fit has not been."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis.context import Context
from discovery.diagnosis.proof import FreeRuns, Improvement, improvement
from discovery.diagnosis.scored import Scored, with_effects
from discovery.dynamics.system import predict
from discovery.effects.hypothesis import Hypothesis
from discovery.errors import RunsAwayError
from discovery.evaluation.crossvalidation import folds
from discovery.fitting import fit_model, predict_recording

Array = NDArray[np.float64]


def left_out(context: Context, answer: Scored, h: Hypothesis) -> Improvement | None:
    """What an effect changes of free runs on recordings that are left out of the fit in turn.

    Models are fitted anew to the others, and start, as those of an experiment are; rms in reading noises.
    None where nothing can be left out, or where recordings left out can say nothing of an effect because it
    does not act in all of them.
    """
    if len(context.recordings) < 2 or h.recording is not None:
        return None
    rest = tuple(o for o in answer.hypotheses if o.key != h.key)
    without = _residuals(context, answer, rest)
    with_it = _residuals(context, answer, answer.hypotheses)
    one = np.ones(len(context.outputs))
    runs = [
        FreeRuns(without[run], with_it.get(run), 1.0, one) for run in context.recordings if run in without
    ]
    return improvement(runs, context.outputs) if runs else None


def _residuals(context: Context, answer: Scored, chosen: Sequence[Hypothesis]) -> dict[str, Array]:
    """Readings minus free run (R, Y) over the reading noise, of each recording that does not run away."""
    model, found = with_effects(context.model, chosen), answer.fit.model.parameters
    model = model.with_values({n: found[n].value for n in model.free if n in found})
    white, out = np.array(context.white.white), {}
    for fold in folds(context.campaign, context.recordings, blocks=0):
        kept = [r for r in context.recordings if r not in fold.recordings]
        seen = replace(context.campaign, recordings={r: context.campaign.recordings[r] for r in kept})
        grids = {r: context.grids[r] for r in kept}
        try:
            fit = fit_model(
                model, seen, kept, context.outputs, grids=grids, belief=context.belief, begin=answer.fit
            )
            for name in fold.recordings:
                run = predict_recording(
                    fit.model,
                    context.campaign,
                    name,
                    context.outputs,
                    answer.noise.white,
                    context.grids[name],
                )
                out[name] = (run.system.grid.readings - predict(run)) / white
        except RunsAwayError:
            continue
    return out
