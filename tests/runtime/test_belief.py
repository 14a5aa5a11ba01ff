"""One recording after the other into a straight line through readings: the textbook update of a Gaussian."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.runtime.belief import Belief, Finding, update_belief
from discovery.terms import parse

Array = NDArray[np.float64]
CHANNELS = {
    "u": Channel("u", "heat load", "W", None, "held"),
    "E": Channel("E", "error", "um", 1.0, "linear"),
}
LEVEL = 0.5  # um, residual of the fit
WALK = 0.03 * 2.0  # a parameter of 2 may age by 3 % from one recording to the next


def taken_in(
    k: float, sd: float, left: float = LEVEL, low: float = 0.0, count: int = 100
) -> tuple[Belief, Finding, float]:
    """`E = k u` with a residual of +-`left` into a belief of 2 +- `sd`; and the sum of the squares of u."""
    u = np.random.default_rng(7).uniform(1.0, 3.0, count)
    signs = np.tile([1.0, -1.0], count // 2)
    signs -= u * (signs @ u) / (u @ u)  # no slope in it
    signs /= np.sqrt(np.mean(signs**2))
    model = Model(
        "line",
        {"k": Parameter(2.0, min=low)},
        {"x": State("x", "um", None, parse("0"), 0.0, 1.0)},
        (),
        {"E": parse("k*u")},
    )
    recording = Recording(
        "r", np.linspace(0.0, 900.0 * (count - 1), count), {"u": u, "E": k * u + left * signs}
    )
    before = Belief(model, model, ("k",), np.array([[sd**2]]), np.array([sd]), 0.0)
    after, finding = update_belief(before, {"E": LEVEL}, Campaign("c", CHANNELS, {"r": recording}), "r")
    return after, finding, float(u @ u) / LEVEL**2


def test_what_is_known_and_what_is_read_add_up() -> None:
    after, finding, told = taken_in(2.15, 0.05)
    prior = 0.05**2 + WALK**2
    variance = 1 / (1 / prior + told)
    assert after.covariance[0, 0] == pytest.approx(variance)
    p = after.model.parameters["k"]
    assert p.value == pytest.approx(2.0 + 0.15 * told * variance, rel=1e-6)
    assert (p.low, p.high) == pytest.approx(
        (p.value - 1.96 * variance**0.5, p.value + 1.96 * variance**0.5), abs=1e-4
    )
    assert finding.verdict == "drift"
    assert finding.moved == {"k": (2.0, p.value)}
    assert finding.readings == 100
    assert finding.after == pytest.approx(1.0, abs=0.01)
    assert finding.before == pytest.approx(np.sqrt(1 + 0.15**2 * told / 100))
    gain = 0.15**2 * told - 0.15**2 / (prior + 1 / told)
    assert (after.gain, after.effective) == pytest.approx((gain, 1 - variance / prior), rel=1e-6)
    assert finding.p_value == pytest.approx(chi2.sf(gain, 1.0), rel=1e-6)


def test_an_interval_stays_within_what_is_possible() -> None:
    after, _, _ = taken_in(2.0, 0.05, low=1.999)
    assert after.model.parameters["k"].low == 1.999


def test_what_was_known_too_well_may_move_by_a_step_of_the_walk() -> None:
    """Three times the 0.01 of the first fit stand against 2.15: it moves by more than twice that."""
    after, _, told = taken_in(2.15, 0.01)
    assert 0.15 * told / (1 / 0.03**2 + told) > 2 * 0.03
    variance = 1 / (1 / WALK**2 + told)
    assert after.covariance[0, 0] == pytest.approx(variance, rel=1e-6)
    assert after.model.parameters["k"].value == pytest.approx(2.0 + 0.15 * told * variance, rel=1e-6)


def test_a_prior_widens_to_three_times_the_first_fit_and_no_further() -> None:
    after, _, told = taken_in(2.001, 0.01)
    assert after.covariance[0, 0] == pytest.approx(1 / (1 / 0.03**2 + told), rel=1e-6)


def test_a_step_within_the_noise_is_no_drift() -> None:
    after, finding, _ = taken_in(2.01, 0.05)
    assert (finding.verdict, finding.moved) == ("noise", {})
    assert after.model.parameters["k"].value > 2.005  # learnt all the same


def test_a_significant_step_that_costs_nearly_nothing_is_no_drift() -> None:
    """With 5000 readings 0.4 % are certain, and the residual is as good as new."""
    _, finding, _ = taken_in(2.02, 0.05, count=5000)
    assert finding.p_value < 1e-3
    assert finding.before < 1.1
    assert (finding.verdict, finding.moved) == ("noise", {})


def test_of_what_no_parameter_explains_nothing_is_learnt() -> None:
    after, finding, _ = taken_in(2.1, 0.05, left=1.7 * LEVEL)
    assert (finding.verdict, finding.moved) == ("new effect", {})
    assert after.model.parameters["k"].value == 2.0
    assert after.covariance[0, 0] == pytest.approx(0.05**2 + WALK**2)
    _, finding, _ = taken_in(2.1, 0.05, left=1.5 * LEVEL)
    assert finding.verdict == "drift"


def test_a_handful_of_readings_is_no_new_effect() -> None:
    for count, verdict in ((6, {"noise", "drift"}), (8, {"new effect"})):
        _, finding, _ = taken_in(2.0, 0.05, left=2.5 * LEVEL, count=count)
        assert finding.verdict in verdict
