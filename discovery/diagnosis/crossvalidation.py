"""Free runs on recordings left out of the fit: what evidence on the recordings themselves cannot say."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import inf

import numpy as np

from discovery.dynamics.system import predict
from discovery.errors import RunsAwayError
from discovery.evaluation.crossvalidation import folds
from discovery.fitting import Noise, predict_recording
from discovery.mismatch.assess import Assessment, assess, misfits, refit
from discovery.mismatch.context import Context
from discovery.mismatch.hypothesis import Hypothesis


def left_out(context: Context, answer: Assessment, noise: Noise) -> float:
    """rms of free runs, in units of the reading noise, with the effects of an answer.

    Each recording of the diagnosis in turn (or a quarter of them) is left out, the model fitted anew to the
    others under a noise setting, and run freely on what was left out. A recording with an event of its own
    cannot be predicted and is not run. nan where nothing can be left out, inf where a fit or a free run
    runs away.

    Quarters of a single recording do not serve: how the level at their ends is met outweighs what an effect
    does (true sensor lags of two real heaters had shares of -0.8 and -25).
    """
    events = {h.recording for h in answer.hypotheses if h.recording}
    white = np.array(noise.white)
    squares, count = 0.0, 0
    for left, seen in _folds(context):
        try:
            model = refit(seen, _known(answer, seen), noise, answer).model
            for name in (r for r in left if r not in events):
                run = predict_recording(
                    model, context.campaign, name, context.outputs, noise.white, context.grids[name]
                )
                z = (run.system.grid.readings - predict(run)) / white
                squares, count = squares + float(np.nansum(z**2)), count + int(np.isfinite(z).sum())
        except RunsAwayError:  # the others alone do not hold it: it runs away
            return inf
    return float(np.sqrt(squares / count)) if count else float("nan")


def least_added(context: Context, answer: Assessment, without: Assessment, noise: Noise) -> float:
    """Log evidence for what an answer has and another has not that comes from each left-out recording, the
    least of them: evidence of all recordings less evidence of the others is how likely they make it.

    The mean square of a free run drowns in everyday heat where a Kalman filter still sees an effect. -inf
    where a fit runs away.
    """
    gain = answer.evidence - without.evidence
    added = [inf]
    for _, seen in _folds(context):
        try:
            a, b = (assess(seen, _known(o, seen), noise, o).evidence for o in (answer, without))
        except RunsAwayError:
            return -inf
        added.append(gain - (a - b))
    return min(added)


def least_taken(context: Context, answer: Assessment, without: Assessment, noise: Noise) -> float:
    """What an answer takes off the negative log-likelihood of each group of recordings that would be left
    out, in the fit to all of them, the least.

    No leaving out is needed where this is large: a few sizes that are common to all recordings cannot follow
    each of them by chance.
    """
    before, after = misfits(without, noise), misfits(answer, noise)
    return min((sum(before[r] - after[r] for r in left) for left, _ in _folds(context)), default=-inf)


def _folds(context: Context) -> Iterator[tuple[tuple[str, ...], Context]]:
    """What is left out, and the context that sees the others."""
    for fold in folds(context.campaign, context.recordings, blocks=0):
        kept = tuple(r for r in context.recordings if r not in fold.recordings)
        yield fold.recordings, replace(context, recordings=kept, grids={r: context.grids[r] for r in kept})


def _known(answer: Assessment, seen: Context) -> tuple[Hypothesis, ...]:
    """What of an answer acts in the recordings of a context."""
    return tuple(h for h in answer.hypotheses if h.recording is None or h.recording in seen.recordings)
