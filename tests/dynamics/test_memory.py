"""Lag, delay and play against plain loops."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.dynamics import make_grid, make_system, predict, simulate
from discovery.dynamics.series import lag_ends, play
from discovery.errors import UserError
from discovery.models import Model, Parameter
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import parse


def campaign(between: str) -> Campaign:
    time = np.arange(0.0, 7201.0, 60.0)
    u = np.sin(time / 700) + (time > 3000)
    channels = {
        "u": Channel("u", "other input", "1", None, between),  # type: ignore[arg-type]
        "y": Channel("y", "error", "um", None, "linear"),
    }
    return Campaign("c", channels, {"r": Recording("r", time, {"u": u, "y": np.zeros(len(time))})})


def output(between: str, expression: str, **values: float) -> NDArray[np.float64]:
    from discovery.models import State
    from discovery.terms import Number

    given = {name: Parameter(value) for name, value in values.items()}
    model = Model(
        "m", given, {"still": State("still", "", None, Number(0.0), 0.0)}, (), {"y": parse(expression)}
    )
    c = campaign(between)
    return predict(simulate(make_system(model, make_grid(c, "r", model.inputs, ["y"])), model.values()))[:, 0]


def test_lag_is_a_first_order_filter_that_starts_settled() -> None:
    data = campaign("held").recordings["r"]
    expected, x = [], data.values["u"][0]
    for k in range(len(data.time)):
        expected.append(x)
        x = data.values["u"][k] + (x - data.values["u"][k]) * np.exp(-60.0 / 500.0)
    assert np.allclose(output("held", "lag(u, tau)", tau=500.0), expected, atol=1e-12)


def test_delay_looks_back_and_holds_the_first_value_before() -> None:
    data = campaign("linear").recordings["r"]
    expected = np.interp(data.time - 250.0, data.time, data.values["u"])
    assert np.allclose(output("linear", "delay(u, d)", d=250.0), expected, atol=1e-12)
    held = output("held", "delay(u, 120)")
    assert np.array_equal(held[2:], data.values["u"][:-2])
    assert held[0] == data.values["u"][0]


@pytest.mark.parametrize("width", [0.0, 0.1, 0.7, 5.0])
def test_play_follows_only_beyond_its_width(width: float) -> None:
    u = campaign("held").recordings["r"].values["u"]
    y = u[0]
    expected = [y]
    for x in u[1:]:
        y = max(x - width, min(x + width, y))
        expected.append(y)
    assert np.allclose(play(u, width)[0], expected)
    assert np.allclose(output("held", "play(u, w)", w=width), expected)


def test_a_missing_input_is_a_sentence() -> None:
    c = campaign("held")
    with pytest.raises(UserError, match="no value of 'v'"):
        make_grid(c, "r", ["v"], ["y"])


def test_readings_stay_where_they_were_taken() -> None:
    """Irregular readings between stamps of the inputs become nodes of their own."""
    rng = np.random.default_rng(0)
    inputs, reads = np.arange(0.0, 1001.0, 100.0), np.sort(rng.uniform(0, 1000, 7))
    time = np.union1d(inputs, reads)
    u = np.where(np.isin(time, inputs), time / 1000, np.nan)
    y = np.where(np.isin(time, reads), time, np.nan)
    channels = campaign("linear").channels
    grid = make_grid(
        Campaign("c", channels, {"r": Recording("r", time, {"u": u, "y": y})}), "r", ["u"], ["y"]
    )
    assert np.array_equal(grid.time[grid.read], reads)
    assert np.array_equal(grid.readings[:, 0], reads)
    assert np.allclose(grid.nodes["u"], grid.time / 1000)


@pytest.mark.parametrize("tau", [20.0, 300.0, 1e7])
def test_a_lag_of_a_straight_input_trails_by_its_time_constant(tau: float) -> None:
    """A ramp of slope c: y = u - c tau (1 - exp(-t/tau)), whatever the steps."""
    time = np.array([0.0, 10.0, 70.0, 400.0, 410.0, 2000.0])
    ramp = 5.0 + 0.3 * time
    ends = np.column_stack([ramp[:-1], ramp[1:]]).ravel()
    found = lag_ends(ends, np.diff(time), tau)
    expected = ramp - 0.3 * tau * -np.expm1(-time / tau)
    assert found[1::2] == pytest.approx(expected[1:], rel=1e-6)
    assert found[0::2] == pytest.approx(expected[:-1], rel=1e-6)
