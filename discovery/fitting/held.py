"""A model with given parameters as a fit: only start values are fitted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from discovery.fitting.fit import Fit, fit_model
from discovery.fitting.problem import make_problem
from discovery.models import Model
from discovery.recordings import Campaign


def held_fit(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    errors: Mapping[str, float] | None = None,
) -> Fit:
    """Return a fit with the parameters of the model; only start values are fitted.

    Args:
        errors: standard errors of parameters, where they are known; the others have none.
    """
    fixed = {name: replace(p, fixed=True) for name, p in model.parameters.items()}
    fit = fit_model(replace(model, parameters=fixed), campaign, recordings, outputs)
    grids = {s.grid.recording: s.grid for s in fit.problem.systems}
    problem = make_problem(model, campaign, recordings, outputs, grids)
    found = {u.key: float(value) for u, value in zip(fit.problem.unknowns, fit.theta, strict=True)}
    theta = np.array([found.get(u.key, u.start) for u in problem.unknowns])
    variances = [
        (errors or {}).get(u.name, np.nan) ** 2 if not u.is_nuisance else 0.0 for u in problem.unknowns
    ]
    return replace(
        fit,
        problem=problem,
        theta=theta,
        covariance=np.diag(variances),
        trajectories=tuple(problem.run(s, theta) for s in problem.systems),
        unidentified=(),
    )
