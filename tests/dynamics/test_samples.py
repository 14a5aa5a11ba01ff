"""A straight channel that is shifted in time: a curve without corners, and the same at its stamps."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from discovery.dynamics import make_grid
from discovery.dynamics.samples import Samples
from discovery.recordings import Campaign, Channel, Recording

Array = NDArray[np.float64]
STEP = 60.0


def wandering() -> Samples:
    rng = np.random.default_rng(0)
    return Samples(np.cumsum(rng.uniform(1.0, 5.0, 40)), rng.standard_normal(40).cumsum(), True)


def test_the_curve_is_that_of_scipy() -> None:
    """But for the first and the last interval, where scipy guesses a slope from three stamps."""
    samples = wandering()
    inside = np.linspace(samples.time[1], samples.time[-2], 500)
    expected = PchipInterpolator(samples.time, samples.value)(inside)
    assert samples.smooth(inside) == pytest.approx(expected, abs=1e-12)
    assert samples.smooth(samples.time) == pytest.approx(samples.value, abs=1e-12)


def test_the_curve_stays_within_the_values_on_either_side() -> None:
    samples = wandering()
    time = np.linspace(samples.time[0] - 9.0, samples.time[-1] + 9.0, 2000)
    k = np.clip(np.searchsorted(samples.time, time) - 1, 0, 38)
    low, high = (f(samples.value[k], samples.value[k + 1]) for f in (np.minimum, np.maximum))
    assert np.all((samples.smooth(time) >= low - 1e-12) & (samples.smooth(time) <= high + 1e-12))


def test_what_is_read_once_or_twice_has_a_curve_too() -> None:
    time = np.array([-1.0, 1.0, 3.0])
    assert Samples(np.array([0.0]), np.array([4.0]), True).smooth(time).tolist() == [4.0, 4.0, 4.0]
    two = Samples(np.array([0.0, 2.0]), np.array([4.0, 8.0]), True)
    assert two.smooth(time).tolist() == [4.0, 6.0, 8.0]


def test_a_shift_past_a_stamp_has_no_corner() -> None:
    """Each node comes past a stamp there: with straight lines, the cost of a shift would have a kink."""
    rng = np.random.default_rng(1)
    time: Array = STEP * np.arange(60.0)
    values = {"room": 20 + rng.standard_normal(60).cumsum(), "body": np.full(60, 20.0)}
    channels = {
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "body": Channel("body", "temperature", "degC", 0.1, "linear"),
    }
    grid = make_grid(Campaign("c", channels, {"r": Recording("r", time, values)}), "r", ["room"], ["body"])
    before, at, behind = (grid.logged_late("room", STEP + by) for by in (-0.01, 0.0, 0.01))
    inner = slice(6, -6)
    assert (behind - at)[inner] == pytest.approx((at - before)[inner], abs=1e-4)
    assert np.abs(behind - before)[inner].max() > 1e-4
