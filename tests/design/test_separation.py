"""What readings to come would say, by the normal densities of scipy and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import multivariate_normal

from discovery.design.separation import separation
from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.fitting import Noise
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
TIME = np.arange(0.0, 24 * 600.0, 600.0)


def body(shown: str, start_sd: float = 0.0) -> Trajectory:
    """A body of 1000 J/K under 0.1 W, as an output shows it."""
    heat = {"k": Parameter(0.1, "W")}
    states = {"x": State("x", "degC", 1000.0, parse("0"), start_sd, 1e-3)}
    model = Model("m", heat, states, (Term("heat", "x", parse("k")),), {"E": parse(shown)})
    channels = {"E": Channel("E", "error", "um", 1.0, "linear")}
    campaign = Campaign("c", channels, {"r": Recording("r", TIME, {"E": np.zeros(24)})})
    return simulate(make_system(model, make_grid(campaign, "r", [], ["E"])), {"k": 0.1})


def expected(gap: Array, covariance: Array) -> float:
    """Expected log of the ratio of two densities that differ in their means alone."""
    density = multivariate_normal(np.zeros(len(gap)), covariance)
    return float(density.logpdf(np.zeros(len(gap))) - density.logpdf(gap))


@pytest.mark.parametrize("count", [1, 7, 24])
def test_readings_add_up_as_densities_do(count: int) -> None:
    """Slow noise, a start and a parameter that may be off, and the readings up to an instant alone."""
    noise, ramp = Noise(("E",), (2.0,), (1.0,), slow_time=3600.0), TIME / 1000.0
    found = separation(body("x + 0.001*time"), body("x", 0.5), noise, {"k": 0.3, "gone": 1.0})
    slow = np.exp(-np.abs(np.subtract.outer(TIME, TIME)) / 3600.0)
    covariance = 4.0 * np.eye(24) + slow + 0.25 + 0.09 * np.outer(ramp, ramp)
    assert found[count - 1] == pytest.approx(expected(0.001 * TIME[:count], covariance[:count, :count]))


def test_unrecorded_heat_hides_what_looks_like_it() -> None:
    """The covariance of the integral of first-order noise; heat at a body that is not there hides nothing."""
    sd, tau = 0.05, 3 * 3600.0
    heat = Noise(("E",), (0.3,), (), {"x": sd, "gone": 9.0}, heat_time=tau)
    found = separation(body("x + 0.0002*time"), body("x"), heat)[-1]
    faded, apart = np.exp(-TIME / tau), np.exp(-np.abs(np.subtract.outer(TIME, TIME)) / tau)
    walk = 2 * tau * np.minimum.outer(TIME, TIME) + tau**2 * (np.add.outer(faded, faded) - apart - 1)
    covariance = 0.09 * np.eye(24) + (sd / 1000.0) ** 2 * walk
    assert found == pytest.approx(expected(0.0002 * TIME, covariance), rel=0.02)
    assert found < 0.1 * expected(0.0002 * TIME, 0.09 * np.eye(24))


def test_each_output_counts_in_its_own_noise() -> None:
    """Two outputs of noises 2 and 0.5: the evidence is the sum of that of each."""

    def both(first: str, other: str) -> Trajectory:
        states = {"x": State("x", "degC", 1000.0, parse("0"), 0.0, 1e-3)}
        model = Model("m", {}, states, (), {"E": parse(first), "F": parse(other)})
        channels = {n: Channel(n, "error", "um", 1.0, "linear") for n in "EF"}
        read = {n: np.zeros(24) for n in "EF"}
        campaign = Campaign("c", channels, {"r": Recording("r", TIME, read)})
        return simulate(make_system(model, make_grid(campaign, "r", [], ["E", "F"])), {})

    noise = Noise(("E", "F"), (2.0, 0.5))
    found = separation(both("x + 1", "x + 1"), both("x", "x"), noise)
    assert found == pytest.approx(0.5 * (1 / 4 + 1 / 0.25) * np.arange(1, 25))


def test_process_noise_that_grows_with_the_flow_hides_more() -> None:
    """0.1 W flow through the body: a share of it adds to the floor as squares do."""
    plain, flowing = (
        Noise(("E",), (0.3,), (), {"x": heat}, share, heat_time=3 * 3600.0)
        for heat, share in ((0.05, 0.0), (0.03, 0.4))
    )  # sqrt(0.03^2 + (0.4*0.1)^2) = 0.05
    pair = body("x + 0.0002*time"), body("x")
    assert separation(*pair, flowing) == pytest.approx(separation(*pair, plain))
