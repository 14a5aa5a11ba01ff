"""The search: which effects, added to the model and refitted, make the readings most likely."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.fitting import Fit, Noise, fit_model
from discovery.mismatch.context import Context
from discovery.mismatch.evidence import Board, Score, by_claim, make_board, scores
from discovery.mismatch.events import place_events
from discovery.mismatch.hypotheses import Hypothesis, hypotheses
from discovery.mismatch.lens import Lens, View, log_mean_exp
from discovery.models import Model

Array = NDArray[np.float64]

REFITS = 6  # claims that are refitted at each step
ENOUGH = 1e-5  # relative change of the cost that ends a refit: far below one unit of log evidence
NAMED = 6.0  # log evidence that a claim has to add to be taken up
MINOR = 0.1  # share of the plausible size below which an effect is the coarseness of a model with few bodies


@dataclass(frozen=True)
class Assessment:
    """The model with a set of effects added and everything refitted."""

    hypotheses: tuple[Hypothesis, ...]
    model: Model  # fitted, with intervals
    fit: Fit
    lens: Lens
    views: tuple[View, ...]
    evidence: float

    @property
    def best_view(self) -> View:
        """The noise setting that explains the residual best."""
        return max(self.views, key=lambda view: view.level)

    @cached_property
    def rms(self) -> float:
        """Root mean square of all residuals over their reading noise."""
        white = np.array(self.views[0].noise.white)
        parts = [(r / white).ravel() for r in self.lens.residuals]
        z = np.concatenate(parts)
        return float(np.sqrt(np.nanmean(z**2)))


def assess(context: Context, chosen: Sequence[Hypothesis], noise: Noise | None = None, start: Assessment | None = None) -> Assessment:
    """Refit the model with effects added; evidence with all unknowns and noise levels integrated out (Laplace).

    Args:
        chosen: effects to add, amplitudes and shapes at their start.
        noise: noise setting to fit under; default the first.
        start: a fit to take start values from.
    """
    model, priors, offset = context.model, {}, 0.0
    begin = start.fit.model if start is not None else context.baseline.model
    for h in chosen:
        model = h.added_to(model)
        amplitude = h.effect.amplitude
        for name, sd in zip(h.amplitudes, context.spread(h), strict=True):
            if amplitude.fixed is None:
                priors[name] = (0.0, sd)
                offset += np.log(2.0) if amplitude.sign else 0.0
        for name, shape in zip(h.shapes, h.effect.shapes, strict=True):
            if not shape.fixed:
                low, high = min(shape.grid), max(shape.grid)
                centre, width = 0.5 * (low + high), max(high - low, 0.3 * abs(high))
                priors[name] = (centre, width)
        offset += float(np.log(h.effect.prior)) - h.cost
    guess = {name: p.value for name, p in begin.parameters.items() if name in model.parameters and not p.per_recording}
    fit = fit_model(
        model,
        context.campaign,
        context.recordings,
        context.outputs,
        noise=noise or context.settings[0],
        grids=context.grids,
        priors=priors,
        belief=context.belief,
        guess=guess,
        max_rounds=25,
        tolerance=ENOUGH,
    )
    lens = Lens(fit)
    views = tuple(lens.view(setting) for setting in context.settings)
    evidence = float(log_mean_exp(np.array([view.level for view in views]))) + offset
    return Assessment(tuple(chosen), fit.model, fit, lens, views, evidence)


@dataclass(frozen=True)
class Look:
    """All claims scored on what an assessment leaves."""

    board: Board
    claims: tuple[Score, ...]


def look(context: Context, current: Assessment) -> Look:
    """Score every effect at every place on what the present model leaves."""
    model = current.fit.problem.model
    found = hypotheses(model, context.campaign.channels, context.outputs, context.recordings, context.effects)
    taken = {h.key for h in current.hypotheses}
    found = [h for h in found if h.key not in taken]
    spread = {a: s for h in found for a, s in zip(h.amplitudes, context.spread(h), strict=True)}
    found = place_events(current.lens, current.best_view, found, spread)
    board = make_board(current.lens, current.views, found, np.array([spread[a] for h in found for a in h.amplitudes]))
    return Look(board, tuple(by_claim(scores(board))))


@dataclass(frozen=True)
class Search:
    """The course of a search: the fit without any effect, the best model found, and everything tried."""

    baseline: Assessment
    best: Assessment
    tried: tuple[Assessment, ...]
    looks: tuple[Look, ...]  # one per model that was taken up, the last on what the best model leaves

    @property
    def gain(self) -> float:
        """Log evidence of the best model over the baseline."""
        return self.best.evidence - self.baseline.evidence


def search(context: Context, most: int = 3, tell: Callable[[str], None] = lambda _: None) -> Search:
    """Add effects one by one while each adds evidence, then question each one taken up."""
    current = assess(context, (), context.settings[0])
    current = assess(context, (), current.best_view.noise, current)
    baseline, tried, looks = current, [], [look(context, current)]
    for _ in range(most):
        first = looks[-1].claims[0].gain if looks[-1].claims else 0.0
        pool = [c for c in looks[-1].claims[:REFITS] if c.gain > max(2.0, 0.2 * first)]
        attempts = [a for c in pool if (a := _try(context, current, (*current.hypotheses, c.hypothesis))) is not None]
        if not attempts:
            break
        step = max(attempts, key=lambda a: a.evidence)
        tried += [a for a in attempts if matters(context, a, a.hypotheses[-1])]
        if step.evidence - current.evidence < NAMED or not matters(context, step, step.hypotheses[-1]):
            break
        tell(f"{step.hypotheses[-1].effect.title} at {', '.join(step.hypotheses[-1].places)}")
        current = step
        looks.append(look(context, current))
        if recurs(current.hypotheses):
            break
    if len(current.hypotheses) > 1 and not recurs(current.hypotheses):
        current, more = _question(context, current)
        tried += more
        looks.append(look(context, current))
    return Search(baseline, current, tuple(tried), tuple(looks))


def matters(context: Context, attempt: Assessment, h: Hypothesis) -> bool:
    """Whether an effect has a size that physics would give it.

    A model with few bodies is a little wrong everywhere; with enough readings that shows, as effects of a few per cent of
    the usual size. They are not what is missing.
    """
    if h.effect.amplitude.fixed is not None or not h.effect.is_physics:
        return True
    model = attempt.fit.model
    sizes = [abs(model.parameters[n].values.get(h.recording or "", model.parameters[n].value)) for n in h.amplitudes]
    return any(size >= MINOR * sd for size, sd in zip(sizes, context.spread(h), strict=True))


def recurs(chosen: Sequence[Hypothesis]) -> bool:
    """Whether heat without a record was taken up twice: then it is no event, and looking for a third one is idle."""
    return sum(h.effect.word == "unmeasured_heat" for h in chosen) > 1


def _try(context: Context, current: Assessment, chosen: tuple[Hypothesis, ...]) -> Assessment | None:
    try:
        return assess(context, chosen, current.best_view.noise, current)
    except UserError:  # a combination under which the model runs away is no explanation
        return None


def _question(context: Context, current: Assessment) -> tuple[Assessment, list[Assessment]]:
    """Take each effect out, see what would stand in its place, and drop what is not needed."""
    tried: list[Assessment] = []
    for h in current.hypotheses:
        others = tuple(o for o in current.hypotheses if o.key != h.key)
        if len(others) == len(current.hypotheses) or h.key not in {o.key for o in current.hypotheses}:
            continue
        without = _try(context, current, others)
        if without is None:
            continue
        tried.append(without)
        pool = [c for c in look(context, without).claims[: REFITS // 2] if c.hypothesis.key != h.key and c.gain > 2.0]
        attempts = [a for c in pool if (a := _try(context, without, (*others, c.hypothesis))) is not None]
        attempts = [a for a in attempts if all(matters(context, a, o) for o in a.hypotheses)]
        tried += attempts
        best = max([*attempts, current], key=lambda a: a.evidence)
        current = best if best.evidence > without.evidence + NAMED else without
    return current, tried
