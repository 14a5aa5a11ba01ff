"""An assessment: the model with a set of effects added, everything refitted, and the evidence for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from discovery.fitting import Fit, Noise, fit_model
from discovery.mismatch.context import Context
from discovery.mismatch.hypotheses import Hypothesis
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

    @cached_property
    def rms(self) -> float:
        """Root mean square of all residuals over their reading noise."""
        white = np.array(self.views[0].noise.white)
        parts = [(r / white).ravel() for r in self.lens.residuals]
        z = np.concatenate(parts)
        return float(np.sqrt(np.nanmean(z**2)))


def assess(
    context: Context,
    chosen: Sequence[Hypothesis],
    noise: Noise | None = None,
    start: Assessment | None = None,
    sizes: Mapping[str, float] | None = None,
) -> Assessment:
    """Refit the model with effects added; evidence with all unknowns and noise levels integrated out
    (Laplace).

    Args:
        chosen: effects to add, amplitudes and shapes at their start.
        noise: noise setting to fit under; default the first.
        start: a fit to take start values from.
        sizes: amplitudes to start from.
    """
    model, priors, offset = context.model, {}, 0.0
    begin = start.fit.model if start is not None else context.baseline.model
    for h in chosen:
        model = h.added_to(model)
        amplitude = h.effect.amplitude
        for name, sd in zip(h.amplitudes, context.spread(h), strict=True):
            if amplitude.fixed is None:
                priors[name] = (0.0, WIDE * sd)
                offset += np.log(2.0) if amplitude.sign else 0.0
        for name, shape in zip(h.shapes, h.effect.shapes, strict=True):
            if not shape.fixed:
                low, high = min(shape.grid), max(shape.grid)
                centre, width = 0.5 * (low + high), max(high - low, 0.3 * abs(high))
                priors[name] = (centre, width)
        offset += float(np.log(h.effect.prior)) - h.cost
    guess = {
        name: p.value
        for name, p in begin.parameters.items()
        if name in model.parameters and not p.per_recording
    }
    guess |= sizes or {}
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
