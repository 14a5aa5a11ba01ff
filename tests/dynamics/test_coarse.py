"""Grids of recordings with far more instants than their physics needs, against recursive filters of scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from discovery.dynamics import make_grid, make_system, simulate
from discovery.dynamics.grid import COARSE_NODES, MOST_NODES, Samples
from discovery.dynamics.system import predict
from discovery.fitting import fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Number, Term, parse

Array = NDArray[np.float64]
STEP, ROWS = 0.5, 120_000  # s: 16.7 h
TAU, GAIN = 400.0, 0.05  # s, K/W: 30 K at full power
CHANNELS = {
    "u": Channel("u", "heat load", "W", None, "held"),
    "y": Channel("y", "error", "um", None, "linear"),
}


def response(u: Array, tau: float = TAU, gain: float = GAIN) -> Array:
    """x' = (gain u - x)/tau from rest, u held from each stamp to the next, exactly."""
    e = np.exp(-STEP / tau)
    return np.asarray(lfilter([0.0, gain * (1 - e)], [1.0, -e], u), dtype=np.float64)


def switched(seed: int, ripple: float = 5.0) -> Array:
    """Power (ROWS,) in W that switches at any stamp, 60 times, with the ripple of its meter."""
    rng = np.random.default_rng(seed)
    edges = np.sort(rng.integers(0, ROWS, 60))
    level = rng.choice([0.0, 150.0, 600.0], 61)[np.searchsorted(edges, np.arange(ROWS), side="right")]
    return np.asarray(level + rng.normal(0.0, ripple, ROWS))


def campaign(u: Array, y: Array | None = None) -> Campaign:
    time = np.arange(len(u), dtype=np.float64) * STEP
    return Campaign(
        "c", CHANNELS, {"r": Recording("r", time, {"u": u, "y": response(u) if y is None else y})}
    )


def model(drive: str = "u") -> Model:
    parameters = {"tau": Parameter(TAU, "s", 10.0), "gain": Parameter(GAIN, "K/W", 0.0)}
    state = State("y", "um", None, Number(0.0), 0.0, 1.0)
    return Model("one", parameters, {"y": state}, (Term("e", "y", parse(f"(gain*{drive} - y)/tau")),), {})


def missed(u: Array, drive: str = "u", expected: Array | None = None) -> float:
    """Largest difference at any reading that the coarse grid takes."""
    grid = make_grid(campaign(u), "r", ["u"], ["y"])
    assert grid.instants == ROWS
    assert len(grid.time) <= 2 * COARSE_NODES + 100
    at = np.searchsorted(STEP * np.arange(ROWS), grid.time[grid.read])
    found = predict(simulate(make_system(model(drive), grid), model().values()))[:, 0]
    return float(np.max(np.abs(found - (response(u) if expected is None else expected)[at])))


def test_switches_keep_their_instants_and_ripple_its_mean() -> None:
    """30 K of response are met to a hundredth of a sensor's 0.1 K, however noisy the meter."""
    assert missed(switched(1)) < 1e-3
    assert missed(switched(1, 0.0)) < 1e-9  # nodes at all switches: the very same steps


def test_a_pulsed_heater_is_averaged() -> None:
    """On for 2 s of 6 s, more switches than nodes: its mean warms the body as it does, within the swing of a
    single pulse.
    """
    u = np.where(np.arange(ROWS) % 12 < 4, 600.0, 0.0)
    assert missed(u) < 2.0 * 600.0 * GAIN / TAU


def test_a_delayed_switch_stays_where_it_is() -> None:
    u = switched(2, 0.0)
    late = np.concatenate([np.full(600, u[0]), u[:-600]])
    assert (
        missed(u, "delay(u, 300)", response(late)) < 2e-2
    )  # intervals of 7.5 s: 30 K (7.5/400)^2 / 8 and less


def test_readings_stay_single_ones() -> None:
    u, rng = switched(3), np.random.default_rng(0)
    y = response(u) + rng.normal(0.0, 0.2, ROWS)
    grid = make_grid(campaign(u, y), "r", ["u"], ["y"])
    at = np.searchsorted(STEP * np.arange(ROWS), grid.time[grid.read])
    assert np.array_equal(grid.readings[:, 0], y[at])
    assert len(at) == -(-ROWS // 15)
    assert at[0] == 0


@pytest.mark.parametrize("rows", [500, MOST_NODES])
def test_ordinary_recordings_keep_every_stamp(rows: int) -> None:
    u = switched(4)[:rows]
    grid = make_grid(campaign(u, response(u)), "r", ["u"], ["y"])
    assert grid.instants == 0
    assert np.array_equal(grid.time, STEP * np.arange(rows))
    assert np.array_equal(grid.samples["u"].value, u)
    assert np.array_equal(grid.readings[:, 0], response(u))


def test_few_readings_are_all_kept() -> None:
    u = switched(5)
    y = np.where(np.arange(ROWS) % 401 == 0, response(u), np.nan)
    grid = make_grid(campaign(u, y), "r", ["u"], ["y"])
    assert np.array_equal(grid.time[grid.read], STEP * np.flatnonzero(np.isfinite(y)))


def test_means_of_what_stays_constant_are_the_constant() -> None:
    """To the last bit, also where the sums over stamps are long and odd: transition matrices are shared."""
    time = np.cumsum(np.random.default_rng(1).uniform(0.1, 0.7, 5000))
    nodes = time[::37]
    for linear in (False, True):
        value = np.where(time < time[2500], 0.1, 12.3)
        mean = Samples(time, value, linear).averaged(nodes).value
        assert set(mean[:60]) == {0.1}
        assert set(mean[70:]) == {12.3}


def test_means_of_a_straight_channel() -> None:
    """Around each node: a parabola is a twelfth of the square of the window above its value."""
    time = np.arange(0.0, 2000.0, 0.5)
    nodes = time[::40]
    mean = Samples(time, (time - 700.0) ** 2, True).averaged(nodes).value[1:-1]
    assert mean == pytest.approx((nodes[1:-1] - 700.0) ** 2 + 20.0**2 / 12, abs=0.05)


def test_a_long_recording_is_fitted_within_its_intervals() -> None:
    u, rng = switched(6), np.random.default_rng(2)
    noisy = campaign(u, response(u) + rng.normal(0.0, 0.2, ROWS))
    start = replace(
        model(), parameters={"tau": Parameter(200.0, "s", 10.0), "gain": Parameter(0.02, "K/W", 0.0)}
    )
    fit = fit_model(start, noisy, ["r"])
    for name, value in (("tau", TAU), ("gain", GAIN)):
        p = fit.model.parameters[name]
        assert p.low is not None
        assert p.high is not None
        assert p.low < value < p.high
        assert p.high - p.low < 0.003 * value
    assert fit.noise.white[0] == pytest.approx(0.2, rel=0.03)
