"""Readings once a day: steps are a share of what separates the readings, and still exact enough."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.dynamics import make_grid
from discovery.fitting import predict_recording
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
HOUR = 3600.0


def recorded(every: float, days: float = 60.0) -> Campaign:
    """A reservoir with held inflows, read every so many seconds; the readings do not matter."""
    time = np.arange(0.0, days * 24 * HOUR, every)
    inflow = np.random.default_rng(3).uniform(0.0, 40.0, time.size)
    channels = {
        "inflow": Channel("inflow", "other input", "1", None, "held"),
        "level": Channel("level", "other output", "1", 0.01, "linear"),
    }
    values = {"inflow": inflow, "level": np.full(time.size, 4.0)}
    return Campaign("lake", channels, {"r": Recording("r", time, values)})


@pytest.mark.parametrize(
    ("every", "step"),
    [(60.0, 60.0), (HOUR, 600.0), (3 * HOUR, 1350.0), (24 * HOUR, 3 * HOUR)],
    ids=["minutes", "hours", "three hours", "days"],
)
def test_steps_follow_the_readings_from_hours_on(every: float, step: float) -> None:
    grid = make_grid(recorded(every, days=10.0), "r", ["inflow"], ["level"])
    assert set(grid.step.tolist()) == {step}


def test_a_law_that_is_not_linear_runs_as_scipy_runs_it() -> None:
    campaign, k, size = recorded(24 * HOUR), 4.0, 40.0 * HOUR  # time constants of 10 h and more
    model = Model(
        "lake",
        {"k": Parameter(k, "1"), "size": Parameter(size, "s")},
        {"level": State("level", "1")},
        (Term("in", "level", parse("inflow/size")), Term("out", "level", parse("-k*level*sqrt(level)/size"))),
        {},
    )
    data = campaign.recordings["r"]
    run = predict_recording(model, campaign, "r", ["level"], [0.01])

    def rate(_: float, z: Array, flow: float) -> Array:
        return (flow - k * z * np.sqrt(z)) / size

    x, exact = 4.0, [4.0]
    for flow in data.values["inflow"][:-1]:
        day = solve_ivp(rate, (0, 24 * HOUR), [x], args=(flow,), rtol=1e-9, atol=1e-9)
        x = float(day.y[0, -1])
        exact.append(x)
    swing = float(np.std(exact))
    assert swing > 0.5
    assert np.abs(run.x[run.system.grid.read, 0] - exact).max() < 0.01 * swing
