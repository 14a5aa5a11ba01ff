"""An assessment: the model with a set of effects added, everything refitted, and the evidence for it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discovery.fitting import Fit, Noise, fit_model
from discovery.mismatch.context import Context
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.lens import Lens, View, log_mean_exp
from discovery.models import Model

WIDE = 3.0  # sizes are refitted with so many times their usual spread: a large effect must not look smaller
ENOUGH = 1e-5  # relative change of the cost that ends a refit: far below one unit of log evidence


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

    def rms(self, apart: Collection[str] = ()) -> float:
        """Root mean square of the residuals over their reading noise, but those of some recordings."""
        white = np.array(self.views[0].noise.white)
        runs = [t.system.grid.recording for t in self.fit.trajectories]
        parts = zip(runs, self.lens.residuals, strict=True)
        z = np.concatenate([(r / white).ravel() for run, r in parts if run not in apart])
        return float(np.sqrt(np.nanmean(z**2)))


def misfits(answer: Assessment, noise: Noise) -> dict[str, float]:
    """Negative log-likelihood of each recording under a noise, at the fit: 1/2 z^2 of its innovations and the
    logs of their scales.
    """
    found = {}
    parts = zip(answer.fit.trajectories, answer.lens.filters, answer.lens.residuals, strict=True)
    for trajectory, part, residual in parts:
        z, half = part.apply(noise, residual[:, :, None])
        found[trajectory.system.grid.recording] = 0.5 * float(np.sum(z**2)) + half
    return found


def with_effects(context: Context, chosen: Sequence[Hypothesis]) -> Model:
    """The model with effects added, nothing fitted."""
    model = context.model
    # what moves the zero of a sensor comes behind what smooths it: no lag makes a slope of a jump
    for h in sorted(chosen, key=lambda h: h.shifts_the_zero):
        model = h.added_to(model)
    return model


def refit(
    context: Context,
    chosen: Sequence[Hypothesis],
    noise: Noise,
    start: Assessment | None = None,
    sizes: Mapping[str, float] | None = None,
) -> Fit:
    """The model with effects added, everything fitted to the recordings of the context.

    Args:
        chosen: effects to add, amplitudes and shapes at their start.
        noise: noise setting to fit under.
        start: a fit to take start values from.
        sizes: amplitudes to start from.
    """
    priors = {}
    for h in chosen:
        for name, sd in zip(h.amplitudes, context.spread(h), strict=True):
            if h.effect.amplitude.fixed is None:
                priors[name] = (0.0, WIDE * sd)
        for name, shape in zip(h.shapes, h.effect.shapes, strict=True):
            if not shape.fixed:
                low, high = min(shape.grid), max(shape.grid)
                centre, width = 0.5 * (low + high), max(high - low, 0.3 * abs(high))
                priors[name] = (centre, width)
    return fit_model(
        with_effects(context, chosen),
        context.campaign,
        context.recordings,
        context.outputs,
        noise=noise,
        grids=context.grids,
        priors=priors,
        belief=context.belief,
        guess=sizes,
        begin=start.fit if start is not None else context.baseline,
        max_rounds=25,
        tolerance=ENOUGH,
    )


def assess(
    context: Context,
    chosen: Sequence[Hypothesis],
    noise: Noise | None = None,
    start: Assessment | None = None,
    sizes: Mapping[str, float] | None = None,
) -> Assessment:
    """Refit the model with effects added; evidence with all unknowns and noise levels integrated out
    (Laplace).

    Arguments as for `refit`; `noise` is the first setting by default.
    """
    fit = refit(context, chosen, noise or context.settings[0], start, sizes)
    lens = Lens(fit)
    views = tuple(lens.view(setting) for setting in context.settings)
    evidence = float(log_mean_exp(np.array([view.level for view in views])))
    for h in chosen:
        evidence += float(np.log(h.effect.prior)) - h.cost
        if h.effect.amplitude.sign and h.effect.amplitude.fixed is None:
            evidence += len(h.amplitudes) * float(np.log(2.0))  # a known sign halves what it could have been
    return Assessment(tuple(chosen), fit.model, fit, lens, views, evidence)
