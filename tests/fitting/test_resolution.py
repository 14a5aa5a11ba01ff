"""Steps of a nonlinear law are divided until the noise hides what the integration errs by."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from discovery.dynamics import predict
from discovery.fitting import fit_model, predict_recording
from discovery.frames import campaign_from_frames
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign
from discovery.terms import Term, parse

WORTH = 1.5


def spring() -> tuple[Campaign, np.ndarray]:
    """Place [mm] and speed of a mass on a stiffening spring, x'' = -1.5 (x + x^3), with few readings."""
    time = 0.2 * np.arange(120)
    path = solve_ivp(
        lambda _, z: [z[1], -WORTH * (z[0] + z[0] ** 3)],
        (0, time[-1]),
        [1.0, 0.0],
        t_eval=time,
        rtol=1e-10,
    ).y.T
    read = path + 0.01 * np.random.default_rng(1).standard_normal(path.shape)
    channels = {"x": {"role": "other output", "unit": "mm"}, "v": {"role": "other output", "unit": "mm/s"}}
    return campaign_from_frames({"a": pd.DataFrame(read, time, ["x", "v"])}, channels), path


def law(k: float) -> Model:
    states = {"x": State("x", "mm", scale=1.0), "v": State("v", "mm/s", scale=1.0)}
    terms = (Term("moves", "x", parse("v")), Term("pulls", "v", parse("0 - k*(x + x**3)")))
    return Model("spring", {"k": Parameter(k, "1/s/s")}, states, terms, {}, "s")


def test_a_swing_with_few_readings_has_its_own_coefficient() -> None:
    campaign, _ = spring()
    fit = fit_model(law(1.48), campaign, ["a"], guess={"k": 1.48})
    k = fit.model.parameters["k"]
    assert len(fit.trajectories[0].system.grid.time) > 120
    assert k.value == pytest.approx(WORTH, rel=5e-4)
    assert (k.low or 0) < WORTH < (k.high or 0)


def test_a_free_run_is_as_exact_as_its_readings() -> None:
    campaign, path = spring()
    run = predict_recording(law(WORTH), campaign, "a", ["x", "v"], [0.01, 0.01])
    exact = fit_model(law(WORTH), campaign, ["a"], guess={"k": WORTH}).trajectories[0]
    assert run.system.grid.time.size == exact.system.grid.time.size
    assert np.sqrt(np.mean((predict(exact) - path) ** 2)) < 0.004
