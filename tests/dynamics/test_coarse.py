"""Grids of recordings with far more instants than their physics needs, against recursive filters of scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from discovery.dynamics import make_grid, make_system, predict, sensitivities, simulate
from discovery.dynamics.averaging import independent
from discovery.dynamics.grid import COARSE_NODES, MOST_NODES
from discovery.dynamics.samples import Samples
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
    """Largest difference of the model and any mean of readings that follow its equation exactly."""
    grid = make_grid(campaign(u, expected), "r", ["u"], ["y"])
    assert grid.instants == ROWS
    assert len(grid.time) <= 2 * COARSE_NODES + 100
    found = predict(simulate(make_system(model(drive), grid), model().values()))
    return float(np.max(np.abs(found - grid.readings)))


def test_switches_keep_their_instants_and_ripple_its_mean() -> None:
    """30 K of response are met to a hundredth of a sensor's 0.1 K, however noisy the meter."""
    assert missed(switched(1)) < 1e-3
    assert missed(switched(1, 0.0)) < 1e-5  # nodes at all switches: only a parabola between nodes is left


def test_a_recording_of_months_is_not_averaged_over_what_its_body_does() -> None:
    """115 days, a stamp every 20 s: blocks stay at two minutes, and a body of 20 minutes is met."""
    rows, step, tau = 500_000, 20.0, 1200.0
    u = np.repeat(np.random.default_rng(3).choice([0.0, 400.0, 1500.0], rows // 100), 100)
    e = np.exp(-step / tau)
    y = np.asarray(lfilter([0.0, GAIN * (1 - e)], [1.0, -e], u))
    data = Campaign(
        "c", CHANNELS, {"r": Recording("r", np.asarray(np.arange(rows) * step, float), {"u": u, "y": y})}
    )
    grid = make_grid(data, "r", ["u"], ["y"])
    found = predict(simulate(make_system(model(), grid), {"tau": tau, "gain": GAIN}))
    assert np.max(np.abs(found - grid.readings)) < 1e-3  # of 75 K


def test_a_temperature_that_jumps_keeps_its_instant() -> None:
    """Oil that changes over from 104 to 85 degC within a minute, 27 times: a roll of 30 min is met to 0.1 K.
    With the jump spread over its block, the roll answered 90 s before, and was 0.3 K off there.
    """
    time = np.arange(3000.0) * 60
    oil = np.where((time // 6660) % 2 > 0, 85.0, 104.0) + 0.2 * np.sin(time / 500)
    read = np.where(np.arange(3000) % 4 == 0, 90.0, np.nan)
    channels = {**CHANNELS, "u": Channel("u", "coolant temperature", "degC", None, "linear")}
    data = Campaign("c", channels, {"r": Recording("r", time, {"u": oil, "y": read})})
    values = {"tau": 1800.0, "gain": 1.0}
    runs = []
    for most in (2000, 4000):
        grid = make_grid(data, "r", ["u"], ["y"], coarse=1000, most=most)
        runs.append(predict(simulate(make_system(model(), grid), values)))
    assert np.max(np.abs(runs[0] - runs[1])) < 0.1


def test_a_pulsed_heater_is_averaged() -> None:
    """On for 2 s of 6 s, more switches than nodes: its mean warms the body as it does, within the swing of a
    single pulse.
    """
    u = np.where(np.arange(ROWS) % 12 < 4, 600.0, 0.0)
    assert missed(u) < 2.0 * 600.0 * GAIN / TAU


def test_a_delayed_switch_stays_where_it_is() -> None:
    u = switched(2, 0.0)
    late = np.concatenate([np.full(600, u[0]), u[:-600]])
    bend = GAIN * 600.0 / TAU * 7.5 / 8  # of a mean over 7.5 s with the switch in its middle
    assert missed(u, "delay(u, 300)", response(late)) < bend


def test_every_reading_counts_once() -> None:
    u, rng = switched(3), np.random.default_rng(0)
    y = response(u) + rng.normal(0.0, 0.2, ROWS)
    grid = make_grid(campaign(u, y), "r", ["u"], ["y"])
    assert grid.means is not None
    assert grid.means.counts.sum() == ROWS
    assert np.sum(grid.means.counts * grid.readings) == pytest.approx(y.sum())
    assert len(grid.read) <= COARSE_NODES + 100
    free = predict(simulate(make_system(model(), grid), model().values()))
    left = (grid.readings - free) / grid.sd([0.2])
    assert np.std(left) == pytest.approx(1.0, abs=0.03)  # the noise of a mean is that of one over the root
    assert np.mean(left) == pytest.approx(0.0, abs=0.04)


def test_outputs_that_are_read_at_other_stamps_are_compared_where_they_were_read() -> None:
    """One every row, one every 11 rows, one now and then: each against the same exact response."""
    u = switched(8, 0.0)
    y, rng = response(u), np.random.default_rng(1)
    values = {
        "u": u,
        "y": y,
        "z": np.where(np.arange(ROWS) % 11 == 3, y, np.nan),
        "rare": np.where(rng.random(ROWS) < 0.003, y, np.nan),
    }
    channels = CHANNELS | {name: replace(CHANNELS["y"], name=name) for name in ("z", "rare")}
    data = Campaign("c", channels, {"r": Recording("r", np.asarray(np.arange(ROWS) * STEP, float), values)})
    grid = make_grid(data, "r", ["u"], ["y", "z", "rare"])
    several = replace(model(), outputs={"z": parse("y"), "rare": parse("y")})
    found = predict(simulate(make_system(several, grid), several.values()))
    assert np.nanmax(np.abs(found - grid.readings)) < 1e-4  # of 30 K
    numbers = [f"{name}" for name in ("tau", "gain")]
    trajectory = simulate(make_system(several, grid), several.values())
    slopes = sensitivities(trajectory, numbers)
    for k, name in enumerate(numbers):
        sides = [
            predict(simulate(trajectory.system, several.values() | {name: several.values()[name] * by}))
            for by in (1 + 1e-5, 1 - 1e-5)
        ]
        by_differences = (sides[0] - sides[1]) / (2e-5 * several.values()[name])
        assert slopes[:, :, k] == pytest.approx(by_differences, rel=1e-4, abs=1e-6 * np.abs(slopes).max())


def test_a_sensor_of_whole_steps_is_no_better_for_being_read_more_often() -> None:
    """Steps of 1 K: the error of a mean of 100 readings, against simulated sensors of any noise."""
    rng = np.random.default_rng(5)
    for noise in (0.02, 0.2, 0.4, 1.0):
        true = 20.0 + 0.3 * rng.random(2000).cumsum()
        shown = np.round(true[:, None] + rng.normal(0.0, noise, (2000, 100)))
        error = np.std(shown.mean(axis=1) - true)
        single = np.sqrt(noise**2 + 1 / 12)
        worth = float(independent(np.full((1, 1), 100.0), shown.reshape(-1, 1)[:40000])[0, 0])
        assert single / np.sqrt(worth) == pytest.approx(error, rel=0.35), noise


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
