"""Steps of a nonlinear law are divided until the noise hides what the integration errs by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

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


def warm(gain: float, loss: float, heat: np.ndarray) -> np.ndarray:
    """Temperature [K] of a body under a heat [W] that is held from reading to reading, every 60 s."""
    found, kept = np.zeros(len(heat)), np.exp(-60.0 * loss)
    for k in range(1, len(heat)):
        found[k] = kept * found[k - 1] + (1.0 - kept) * gain / loss * heat[k - 1]
    return found


def test_a_body_that_is_faster_than_its_readings_has_intervals_as_wide_as_they_are() -> None:
    """Its law is linear, and so its run is exact. Its slopes are not: within a step, the loss does not follow
    a straight line. With whole steps, intervals were three quarters of what they should be.
    """
    rng = np.random.default_rng(1)
    heat = rng.choice([0.0, 100.0, 300.0], 200)
    read = warm(1 / 300, 1 / 30, heat) + 0.2 * rng.standard_normal(200)

    def left(p: np.ndarray) -> Any:
        return (read - warm(float(p[0]), float(p[1]), heat)) / 0.2

    exact = least_squares(left, [1 / 300, 1 / 30], x_scale=[0.001, 0.01], xtol=1e-12)
    slopes = np.asarray(exact.jac, dtype=float)
    sds = np.sqrt(np.diag(np.linalg.inv(slopes.T @ slopes)))
    channels: dict[str, dict[str, Any]] = {
        "P": {"role": "heat load", "unit": "W"},
        "T": {"role": "temperature", "unit": "degC", "noise": 0.2},
    }
    table = pd.DataFrame({"P": heat, "T": read}, 60.0 * np.arange(200))
    terms = (Term("heat", "T", parse("g*P")), Term("loss", "T", parse("0 - h*T")))
    parameters = {"g": Parameter(0.004, "K/J", 0.0), "h": Parameter(0.05, "1/s", 0.0)}
    body = Model("body", parameters, {"T": State("T", "degC", None, parse("0"), 0.0, 1.0)}, terms, {})
    fit = fit_model(body, campaign_from_frames({"a": table}, channels), ["a"])
    for name, value, sd in zip("gh", exact.x, sds, strict=True):
        p = fit.model.parameters[name]
        assert p.value == pytest.approx(value, rel=1e-5)
        assert ((p.high or 0) - (p.low or 0)) / 2 == pytest.approx(1.96 * sd, rel=0.04)
