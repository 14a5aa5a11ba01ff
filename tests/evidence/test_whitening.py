"""The whitening filter against a dense covariance."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.fitting import Noise
from discovery.fitting.kalman import make_filter
from discovery.fitting.noise import resolution, white_noise
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]

CAPACITY = np.array([30e3, 90e3])
SEEN = np.array([[2.0, 0.5], [-1.0, 3.0]])  # um/K
CASES = {
    "white": Noise(("y", "z"), (0.5, 1.2)),
    "slow": Noise(("y", "z"), (0.5, 1.2), (0.3, 0.9), None, 5000.0, 9000.0),
    "heat": Noise(("y", "z"), (0.5, 1.2), (), {"a": 3.0, "b": 9.0}, 5000.0, 9000.0),
    "everything": Noise(("y", "z"), (0.5, 1.2), (0.3, 0.9), {"a": 3.0, "b": 0.0}, 5000.0, 9000.0),
}


@pytest.fixture(scope="module")
def trajectory() -> Trajectory:
    """Two linked bodies for 20 h, read at irregular times, some of the values missing."""
    rng = np.random.default_rng(5)
    time = np.unique(np.concatenate([np.arange(0.0, 72001.0, 1200.0), rng.integers(1, 7200, 30) * 10.0]))
    read = {n: np.where(rng.random(len(time)) < 0.6, rng.standard_normal(len(time)), np.nan) for n in "yz"}
    channels = {n: Channel(n, "error", "um", None, "linear") for n in "yz"}
    channels["T"] = Channel("T", "ambient temperature", "degC", None, "linear")
    recording = Recording("r", time, {**read, "T": 22 + np.sin(time / 9000)})
    states = {n: State(n, "degC", c, parse("T"), 0.5, 1 / c) for n, c in zip("ab", CAPACITY, strict=True)}
    terms = (Term("link", "a", parse("G*(b - a)"), "b"), Term("air", "b", parse("hA*(T - b)")))
    outputs = {n: parse(f"({row[0]})*a + ({row[1]})*b") for n, row in zip("yz", SEEN, strict=True)}
    model = Model("two", {"G": Parameter(20.0), "hA": Parameter(6.0)}, states, terms, outputs)
    grid = make_grid(Campaign("c", channels, {"r": recording}), "r", ["T"], ("y", "z"))
    return simulate(make_system(model, grid), model.values())


def dense(trajectory: Trajectory, noise: Noise) -> Array:
    """Covariance of the readings in their order, from the definitions; heat is held between readings."""
    grid = trajectory.system.grid
    time = grid.time[grid.read]
    a = np.array([[-20.0, 20.0], [20.0, -26.0]]) / CAPACITY[:, None]
    count, outs = grid.measured.shape
    lag = np.abs(np.subtract.outer(time, time))
    total = np.zeros((count, outs, count, outs))
    for y, white in enumerate(noise.white):
        total[:, y, :, y] += white**2 * np.eye(count)
        if noise.slow:
            total[:, y, :, y] += noise.slow[y] ** 2 * np.exp(-lag / noise.slow_time)
    steps = [expm(a * step) for step in np.diff(time)]
    for i, name in enumerate("ab"):
        answer = np.zeros((count, outs, count))  # to unit heat held over an interval
        for k, step in enumerate(steps):
            x = np.linalg.solve(a, (step - np.eye(2)) @ np.eye(2)[i] / CAPACITY[i])
            for r in range(k + 1, count):
                answer[r, :, k] = SEEN @ x
                x = steps[r] @ x if r < count - 1 else x
        flat = answer.reshape(count * outs, count)
        kernel = (noise.heat or {}).get(name, 0.0) ** 2 * np.exp(-lag / noise.heat_time)
        total += (flat @ kernel @ flat.T).reshape(total.shape)
    where = np.flatnonzero(grid.measured.ravel())
    return total.reshape(count * outs, -1)[np.ix_(where, where)]


@pytest.mark.parametrize("name", CASES)
def test_innovations_are_the_rows_of_a_cholesky_factor(name: str, trajectory: Trajectory) -> None:
    noise, measured = CASES[name], trajectory.system.grid.measured
    data = np.random.default_rng(0).standard_normal((*measured.shape, 3))
    data[~measured] = np.nan
    found, logdet = make_filter(trajectory).apply(noise, data)
    triangle = np.linalg.cholesky(dense(trajectory, noise))
    assert np.allclose(found, np.linalg.solve(triangle, data[measured]), atol=1e-7)
    assert logdet == pytest.approx(np.log(np.diag(triangle)).sum(), abs=1e-7)


@pytest.mark.parametrize(
    ("shown", "step"),
    [
        (np.round(np.linspace(20, 24, 50)), 1.0),  # whole degrees
        (np.round(np.linspace(20, 24, 50) / 0.0625) * 0.0625, 0.0625),  # a 12 bit sensor
        (
            np.array([20.1, 20.1, np.nan, 20.100000000001]),
            0.0201,
        ),  # stands still: a thousandth of what it shows
    ],
)
def test_a_sensor_says_no_more_than_its_steps(shown: Array, step: float) -> None:
    """An equal distribution over a step has the standard deviation step/sqrt(12)."""
    assert resolution([shown[:, None]]) == pytest.approx((step / np.sqrt(12),), rel=1e-6)


def test_a_model_that_meets_a_coarse_sensor_exactly_is_not_believed_more_than_its_steps() -> None:
    readings = np.round(np.linspace(20, 24, 50))[:, None]
    least = resolution([readings])
    assert white_noise(("y",), {}, [0.0 * readings], least).white == least
    assert white_noise(("y",), {"y": 0.1}, [0.0 * readings], least).white == (0.1,)  # what is stated holds
