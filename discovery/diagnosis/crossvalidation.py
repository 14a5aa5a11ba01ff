"""Free runs on recordings that are left out of the fit: a named effect has to improve them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.coarse_bodies import judging
from discovery.diagnosis.context import Context
from discovery.diagnosis.proof import BLOCKS, FreeRuns, Improvement, block_sums, improvement, surely_better
from discovery.diagnosis.refit import ENOUGH, with_effects
from discovery.diagnosis.scored import Scored
from discovery.dynamics import Grid, predict
from discovery.effects.hypothesis import Hypothesis, Key
from discovery.errors import RunsAwayError
from discovery.evaluation.crossvalidation import Fold, folds
from discovery.fitting import (
    fit_model,
    from_known_starts,
    innovations_from_known_starts,
    predict_recording,
)
from discovery.fitting.noise import readings_as_one
from discovery.recordings import Campaign
from discovery.threads import side_by_side

Array = NDArray[np.float64]
Residuals = tuple[Array, Array]  # (R, Y) of a free run and of the filter

_NONE = 1e-12  # squares of a block without readings; an rms


@dataclass(frozen=True)
class LeftOut:
    """What effects change of recordings that are left out of the fit.

    `free`: rms of free runs in reading noises, on average over the recordings. `gains` (B,): by how much the
    model with the effects predicts each block of time better, in squares of what a reading says beyond those
    before it. `free_gains` (F,): the same in squares of the free runs, in blocks as long as the residuals of
    these are correlated, and `free_logs` (F,) the logarithms of their ratios.
    """

    free: Improvement
    gains: Array
    free_gains: Array = field(default_factory=lambda: np.zeros(0))
    free_logs: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def blocks(self) -> int:
        """Blocks of time that the models with and without the effects predict differently."""
        return int(np.count_nonzero(self.gains))

    @property
    def better(self) -> int:
        """Those that the model with the effects predicts better."""
        return int(np.count_nonzero(np.maximum(self.gains, 0.0)))

    @property
    def sure(self) -> bool:
        """Whether blocks get better by more than chance makes them: from one reading to the next, or, where
        process noise hides a slow law there, in free runs.
        """
        return surely_better(self.gains) or surely_better(self.free_gains, self.free_logs)

    @property
    def matters(self) -> bool:
        """Whether they improve free runs by what a name needs, be it by chance."""
        return self.free.explained >= thresholds.MATTERS

    @property
    def improves(self) -> bool:
        """Whether they improve free runs, by more than a name needs and not by chance."""
        return self.sure and self.matters


def left_out(context: Context, answer: Scored, chosen: Sequence[Hypothesis]) -> dict[Key, LeftOut | None]:
    """What each of some effects of a model changes of free runs on recordings that are left out of the fit in
    turn: of the outputs that it shows in, or of all where it acts in the machine.

    Models are fitted anew to the others, under the process noise of the answer: a single recording does not
    determine a model whose fit takes hours of unrecorded heat for its own. They start as those of an
    experiment do; rms in reading noises. Whether it is by chance is judged by what each reading says beyond
    those before it, under the same noise (log predictive density), block by block: hours of process noise
    decide the rms of a free run.
    None where nothing can be left out, or where recordings left out can say nothing of an effect because it
    does not act in all of them.
    """
    found = _changed(context, answer, [(h,) for h in chosen if h.recording is None])
    return {h.key: found.get((h.key,)) for h in chosen}


def together_left_out(context: Context, answer: Scored, chosen: Sequence[Hypothesis]) -> LeftOut | None:
    """What several effects of a model change together, as in `left_out`. One alone may make free runs worse:
    the lag of a sensor on a body that is really two.
    """
    lasting = tuple(h for h in chosen if h.recording is None)
    return next(iter(_changed(context, answer, [lasting] if lasting else []).values()), None)


def model_left_out(context: Context) -> dict[str, Array]:
    """What free runs of the model without effects leave of recordings (R, Y) that are left out of its fit in
    turn, in the unit of each output; without those on which it runs away. It is fitted as in any experiment.
    """

    def left(fold: Fold) -> dict[str, Array]:
        seen, kept, grids = _without(context, fold)
        options: dict[str, Any] = {"grids": grids, "belief": context.belief, "tolerance": ENOUGH}
        out = {}
        try:
            fit = fit_model(context.model, seen, kept, context.outputs, begin=context.baseline, **options)
            for r in fold.recordings:
                run = predict_recording(
                    fit.model, context.campaign, r, context.outputs, context.white.white, context.grids[r]
                )
                out[r] = run.system.grid.readings - predict(run)
        except RunsAwayError:
            pass
        return out

    every = folds(context.campaign, context.recordings, blocks=0)
    return {name: one for part in side_by_side(left, every) for name, one in part.items()}


def _changed(
    context: Context, answer: Scored, groups: Sequence[tuple[Hypothesis, ...]]
) -> dict[tuple[Key, ...], LeftOut]:
    """What each group of effects of a model changes, by its keys."""
    groups = groups if len(context.recordings) > 1 else ()
    keys = [tuple(h.key for h in group) for group in groups]
    sets = [tuple(o for o in answer.hypotheses if o.key not in own) for own in keys]
    tasks = [
        (effects, fold)
        for effects in ([answer.hypotheses, *sets] if groups else [])
        for fold in folds(context.campaign, context.recordings, blocks=0)
    ]
    left: dict[frozenset[Key], dict[str, Residuals]] = {}
    parts = side_by_side(lambda task: _residuals(context, answer, *task), tasks)
    for (effects, _), part in zip(tasks, parts, strict=True):
        left.setdefault(frozenset(o.key for o in effects), {}).update(part)
    found = {}
    for own, group in zip(keys, groups, strict=True):
        everywhere = any(h.terms or not h.shown for h in group)
        only = set(context.outputs) if everywhere else {name for h in group for name in h.shown}
        judged = judging(context, answer, group)
        mine = [y for y in judged if context.outputs[y] in only]
        without, with_it = left[answer.keys - {*own}], left[answer.keys]
        if without:
            outputs = [context.outputs[y] for y in mine]
            blocks = max(BLOCKS, context.blocks)  # few blocks of many recordings say less than they could
            found[own] = _compared(context.recordings, outputs, without, with_it, mine, blocks)
    return found


def _compared(
    recordings: Sequence[str],
    outputs: Sequence[str],
    without: Mapping[str, Residuals],
    with_it: Mapping[str, Residuals],
    mine: Sequence[int],
    blocks: int,
) -> LeftOut:
    """Residuals of some outputs without and with effects, compared in so many blocks of each recording."""
    one, runs, gains = np.ones(len(mine)), list[FreeRuns](), list[Array]()
    free_gains, free_logs = list[Array](), list[Array]()
    for r in (r for r in recordings if r in without):
        free, beyond = (z[:, mine] for z in without[r])
        then, after = (z[:, mine] for z in with_it[r]) if r in with_it else (None, None)
        runs.append(FreeRuns(free, then, 1.0, one))
        old, new = _sums(beyond, after, blocks)
        gains.append(old - new)
        together = max(readings_as_one([z]) for z in (free, then) if z is not None)
        old, new = _sums(free, then, max(1, int(len(free) / together)))
        free_gains.append(old - new)
        free_logs.append(np.log(np.maximum(old, _NONE) / np.maximum(new, _NONE)))
    found = (np.concatenate(each) for each in (gains, free_gains, free_logs))
    return LeftOut(_on_average(runs, outputs), *found)


def _on_average(runs: Sequence[FreeRuns], outputs: Sequence[str]) -> Improvement:
    """The improvement over recordings, decided by the mean of the logarithms of their rms: one whose
    parameters the others leave open does not drown the rest.
    """
    whole = improvement(runs, outputs)
    each = [improvement([run], outputs).judged for run in runs]
    old, new = (float(np.exp(np.mean(np.log(np.maximum(rms, _NONE))))) for rms in zip(*each, strict=True))
    return replace(whole, started=(old, new, whole.low, whole.high))


def _sums(before: Array, after: Array | None, blocks: int) -> tuple[Array, Array]:
    """Sums of squares of each block of a recording; alike where a model runs away."""
    old, new, _ = block_sums(before, before if after is None else after, blocks)
    return old, new


def _residuals(
    context: Context, answer: Scored, chosen: Sequence[Hypothesis], fold: Fold
) -> dict[str, Residuals]:
    """Residuals (R, Y) over the reading noise on left-out recordings, if the free run stays finite, and what
    each reading says beyond those before it, in its standard deviations.
    """
    model, found = with_effects(context.model, chosen), answer.fit.model.parameters
    model = model.with_values({n: found[n].value for n in model.free if n in found})
    white = np.array(context.white.white)
    seen, kept, grids = _without(context, fold)
    out = {}
    try:
        fit = fit_model(
            model,
            seen,
            kept,
            context.outputs,
            noise=answer.noise,
            grids=grids,
            belief=context.belief,
            begin=answer.fit,
            tolerance=ENOUGH,
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
            left = run.system.grid.readings - predict(run)
            free = from_known_starts(run, left, white, together=fit.together)
            out[name] = free / white, innovations_from_known_starts(run, left, answer.noise)
    except RunsAwayError:
        pass
    return out


def _without(context: Context, fold: Fold) -> tuple[Campaign, list[str], dict[str, Grid]]:
    """Campaign, names and grids of the recordings that a fold keeps."""
    kept = [r for r in context.recordings if r not in fold.recordings]
    seen = replace(context.campaign, recordings={r: context.campaign.recordings[r] for r in kept})
    return seen, kept, {r: context.grids[r] for r in kept}
