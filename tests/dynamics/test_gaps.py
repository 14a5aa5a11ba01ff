"""Gaps in the readings of a machine without inputs: no step of an integration is as long as the gap."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.dynamics import make_grid, make_system
from discovery.dynamics.system import evened
from discovery.evaluation.crossvalidation import cross_validate
from discovery.fitting import fit_model, predict_recording
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
NOISE, RATES = 0.01, {"a": 1.0, "b": 0.5, "c": 0.3, "d": 0.8}
TIME = np.arange(0.0, 40.0, 0.1)
CHANNELS = {name: Channel(name, "other output", "1", NOISE, "linear") for name in ("hare", "lynx")}


def prey_and_predator(gap: tuple[float, float] = (0.0, 0.0), seed: int = 1) -> tuple[Campaign, Array]:
    """Counts (T, 2) of Lotka and Volterra without those of a gap, and what scipy integrates."""

    def rates(_: float, z: Array) -> list[float]:
        return [z[0] - 0.5 * z[0] * z[1], 0.3 * z[0] * z[1] - 0.8 * z[1]]

    true = solve_ivp(rates, (0.0, TIME[-1]), [2.0, 1.0], t_eval=TIME, rtol=1e-10, atol=1e-12).y.T
    counted = true + np.random.default_rng(seed).normal(0.0, NOISE, true.shape)
    counted[0] = true[0]
    counted[(gap[0] < TIME) & (gap[1] > TIME)] = np.nan
    values = dict(zip(CHANNELS, counted.T, strict=True))
    return Campaign("meadow", CHANNELS, {"first": Recording("first", TIME, values)}), true


def model(off: float = 1.0) -> Model:
    """The right law, its numbers `off` times the true ones."""
    return Model(
        "meadow",
        {name: Parameter(off * value, "1/s") for name, value in RATES.items()},
        {name: State(name, "1") for name in CHANNELS},
        (
            Term("births", "hare", parse("a*hare")),
            Term("eaten", "hare", parse("-b*hare*lynx")),
            Term("fed", "lynx", parse("c*hare*lynx")),
            Term("deaths", "lynx", parse("-d*lynx")),
        ),
        {},
    )


@pytest.mark.parametrize("gap", [(10.0, 26.0), (14.0, 40.5)], ids=["in the middle", "to the end"])
def test_a_free_run_goes_through_a_gap_as_scipy_does(gap: tuple[float, float]) -> None:
    campaign, true = prey_and_predator(gap)
    run = predict_recording(model(), campaign, "first", list(CHANNELS), [NOISE, NOISE])
    at = run.system.grid.time
    expected = np.column_stack([np.interp(at, TIME, column) for column in true.T])
    assert at[-1] == TIME[-1]
    assert np.diff(at).max() < 0.25
    assert np.abs(run.x - expected).max() < 0.03


def test_a_fit_through_a_gap_finds_the_law() -> None:
    campaign, _ = prey_and_predator((10.0, 26.0))
    fit = fit_model(model(1.03), campaign, ["first"], list(CHANNELS))
    for name, value in RATES.items():
        assert fit.model.parameters[name].value == pytest.approx(value, rel=2e-3)


def test_blocks_that_are_left_out_are_predicted_to_their_noise() -> None:
    campaign, _ = prey_and_predator()
    fit = fit_model(model(1.03), campaign, ["first"], list(CHANNELS))
    found = cross_validate(fit.model, campaign, ["first"], list(CHANNELS), fit.noise)
    for name in CHANNELS:
        assert found["blocks"][name] == pytest.approx(NOISE, rel=0.5)


def test_bursts_of_readings_and_linear_laws_keep_their_steps() -> None:
    """Most of the time passes in pauses: they are the usual step. A linear law has no steps that err."""
    time = np.concatenate([100.0 * k + 0.1 * np.arange(10) for k in range(20)])
    values = {name: np.ones(len(time)) for name in CHANNELS}
    bursts = Campaign("bursts", CHANNELS, {"first": Recording("first", time, values)})
    grid = make_grid(bursts, "first", [], list(CHANNELS))
    assert grid.evened() is grid
    campaign, _ = prey_and_predator((10.0, 26.0))
    grid = make_grid(campaign, "first", [], list(CHANNELS))
    assert grid.step.max() > 15.0
    assert evened(make_system(model(), grid)).grid.step.max() < 0.25
    linear = Model("linear", {}, {"hare": State("hare", "1")}, (Term("decay", "hare", parse("-hare")),), {})
    assert evened(make_system(linear, grid)).grid is grid
