"""Whitening against dense covariances, another Kalman filter, and the densities of scipy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.stats import multivariate_normal
from statsmodels.tsa.statespace.kalman_filter import KalmanFilter

from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.evidence.rows import Rows
from discovery.evidence.whitening import Grams, absorbed
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
    "slow": Noise(("y", "z"), (0.5, 1.2), (0.3, 0.9), None, slow_time=5000.0, heat_time=9000.0),
    "heat": Noise(("y", "z"), (0.5, 1.2), (), {"a": 3.0, "b": 9.0}, slow_time=5000.0, heat_time=9000.0),
    "flows": Noise(("y", "z"), (0.5, 1.2), (), {"a": 3.0, "b": 9.0}, 0.3, slow_time=5000.0, heat_time=9000.0),
    "force": Noise(
        ("y", "z"),
        (0.5, 1.2),
        (),
        {"a": 3.0, "b": 9.0},
        0.3,
        force={"a": (15.0, 1.5)},
        slow_time=5000.0,
        heat_time=9000.0,
    ),
    "everything": Noise(
        ("y", "z"), (0.5, 1.2), (0.3, 0.9), {"a": 3.0, "b": 0.0}, 0.2, slow_time=5000.0, heat_time=9000.0
    ),
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
    sizes = sizes_of_flows(trajectory)
    for i, name in enumerate("ab"):
        floor = (noise.heat or {}).get(name, 0.0)
        heat, share = (noise.force or {}).get(name, (floor, noise.share))
        gain = np.sqrt(heat**2 + (share * sizes[:, i]) ** 2)
        gain *= floor > 0
        answer = np.zeros((count, outs, count))  # to a unit force, held between two readings
        for k in range(count - 1):
            x = np.zeros(2)
            for m in range(grid.read[k], len(grid.time) - 1):
                step = expm(a * (grid.time[m + 1] - grid.time[m]))
                x = step @ x
                if m < grid.read[k + 1]:
                    x += np.linalg.solve(a, (step - np.eye(2)) @ np.eye(2)[i] / CAPACITY[i]) * gain[m]
                answer[grid.read == m + 1, :, k] = SEEN @ x
        flat = answer.reshape(count * outs, count)
        total += (flat @ np.exp(-lag / noise.heat_time) @ flat.T).reshape(total.shape)
    where = np.flatnonzero(grid.measured.ravel())
    return total.reshape(count * outs, -1)[np.ix_(where, where)]


def sizes_of_flows(trajectory: Trajectory) -> Array:
    """Root of the sum of squares of what flows through each body, (K, 2), each term at its smaller end."""
    ends = {name: np.asarray(series) for name, series in trajectory.at_ends().items()}
    link, air = 20.0 * (ends["b"] - ends["a"]), 6.0 * (ends["T"] - ends["b"])

    def lasting(flow: Array) -> Array:
        return np.minimum(flow[::2] ** 2, flow[1::2] ** 2)

    return np.sqrt(np.column_stack([lasting(link), lasting(link) + lasting(air)]))


@pytest.mark.parametrize("name", CASES)
def test_innovations_are_the_rows_of_a_cholesky_factor(name: str, trajectory: Trajectory) -> None:
    noise, measured = CASES[name], trajectory.system.grid.measured
    data = np.random.default_rng(0).standard_normal((*measured.shape, 3))
    data[~measured] = np.nan
    found, logs = make_filter(trajectory).whitened(noise, data)
    triangle = np.linalg.cholesky(dense(trajectory, noise))
    assert np.allclose(found, np.linalg.solve(triangle, data[measured]), atol=1e-7)
    assert logs == pytest.approx(np.log(np.diag(triangle)), abs=1e-7)


def test_the_likelihood_is_the_one_of_another_kalman_filter() -> None:
    """A body read every ten minutes, slow noise and process noise, in the state-space form of statsmodels."""
    step, count = 600.0, 100
    capacity, loss, heat, slow, white = 30e3, 8.0, 3.0, 0.4, 0.5
    slow_time, heat_time = 5000.0, 9000.0
    time: Array = step * np.arange(count, dtype=np.float64)
    y = np.random.default_rng(1).standard_normal(count)
    channels = {
        "y": Channel("y", "error", "um", None, "linear"),
        "T": Channel("T", "ambient temperature", "degC", None, "linear"),
    }
    campaign = Campaign("c", channels, {"r": Recording("r", time, {"y": y, "T": 0 * time})})
    states = {"a": State("a", "degC", capacity, parse("0"), 0.0, 1 / capacity)}
    model = Model("one", {}, states, (Term("air", "a", parse(f"{loss}*(T - a)")),), {"y": parse("2*a")})
    grid = make_grid(campaign, "r", ["T"], ("y",))
    noise = Noise(("y",), (white,), (slow,), {"a": heat}, slow_time=slow_time, heat_time=heat_time)
    z, logs = make_filter(simulate(make_system(model, grid), {})).whitened(noise, y[:, None, None])
    ours = -np.sum(logs) - 0.5 * np.sum(z**2) - 0.5 * count * np.log(2 * np.pi)

    keep, w, v = np.exp([-loss / capacity * step, -step / heat_time, -step / slow_time])
    theirs = KalmanFilter(1, 3)
    theirs.bind(y[None, :].copy())
    theirs["transition"] = np.array([[keep, (1 - keep) / loss, 0.0], [0.0, w, 0.0], [0.0, 0.0, v]])
    theirs["design"] = np.array([[2.0, 0.0, 1.0]])
    theirs["selection"] = np.eye(3)
    theirs["state_cov"] = np.diag([0.0, heat**2 * (1 - w**2), slow**2 * (1 - v**2)])
    theirs["obs_cov"] = np.array([[white**2]])
    theirs.initialize_known(np.zeros(3), np.diag([0.0, heat**2, slow**2]))
    assert ours == pytest.approx(theirs.loglike(), abs=1e-6)


def rows_of(seed: int, count: int = 60, unknowns: int = 3) -> tuple[Array, Array, Array]:
    """Residual and sensitivities (N, 1 + U) that were whitened, spreads (U,) of the unknowns, their block."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((count, 1 + unknowns))
    return rows, np.array([0.3, 2.0, 50.0])[:unknowns], np.repeat(np.arange(6), count // 6)


def grams_of(rows: Array, spread: Array, block: Array) -> Grams:
    logs = np.linspace(-0.5, 0.5, len(rows))
    logdet = np.array([logs[block == b].sum() for b in range(6)])
    size = 1 + len(spread)
    whole = Rows(size, (rows,), (np.arange(size),), (np.searchsorted(block, np.arange(7)),), logdet)
    prior = np.diag([0.0, *(spread**-2.0)])
    return Grams(Noise(("y",), (1.0,)), whole, prior, -float(np.sum(np.log(spread))), np.ones(size))


def test_a_level_is_the_density_of_the_readings_with_all_unknowns_integrated_out() -> None:
    rows, spread, block = rows_of(1)
    gram = grams_of(rows, spread, block)
    deviations = np.exp(np.linspace(-0.5, 0.5, len(rows)))  # of each reading before it was whitened
    slopes = rows[:, 1:] * deviations[:, None]
    density = multivariate_normal(
        np.zeros(len(rows)), np.diag(deviations**2) + slopes @ np.diag(spread**2) @ slopes.T
    )
    expected = density.logpdf(rows[:, 0] * deviations) + 0.5 * len(rows) * np.log(2 * np.pi)
    assert gram.level() == pytest.approx(expected)


def test_the_step_and_its_covariance_are_those_of_ridge_regression() -> None:
    rows, spread, block = rows_of(2)
    _, step, covariance = grams_of(rows, spread, block).solved()
    stacked = np.concatenate([rows[:, 1:], np.diag(1 / spread)])
    target = np.concatenate([rows[:, 0], np.zeros(3)])
    assert step == pytest.approx(np.linalg.lstsq(stacked, target, rcond=None)[0])
    assert covariance == pytest.approx(np.linalg.inv(stacked.T @ stacked))


def test_draws_count_blocks_as_often_as_they_came() -> None:
    """A block that is drawn twice is as readings that stand twice; one that is not drawn is as none."""
    rows, spread, block = rows_of(3)
    weights = np.array([[1.0] * 6, [2.0, 0.0, 1.0, 0.0, 3.0, 0.0]])
    level, step, variance = grams_of(rows, spread, block).marginal(np.array([2, 0]), weights)
    for k, often in enumerate(weights):
        again = np.repeat(np.arange(len(rows)), often[block].astype(int))
        one = grams_of(rows[again], spread, block[again])
        logdet = grams_of(rows, spread, block).rows.logdet * often
        expected, at, covariance = replace(one, rows=replace(one.rows, logdet=logdet)).solved()
        assert level[0, k] == pytest.approx(expected, abs=1e-5)
        assert step[0, k] == pytest.approx(at[[2, 0]], abs=1e-6)
        assert variance[0, k] == pytest.approx(covariance[np.ix_([2, 0], [2, 0])], rel=1e-6)


def test_a_wider_prior_is_that_prior() -> None:
    rows, spread, block = rows_of(8)
    level, step, _ = grams_of(rows, spread, block).marginal(np.arange(3), widths=(1.0, 3.0))
    expected, at, _ = grams_of(rows, 3 * spread, block).solved()
    assert level[1, 0] == pytest.approx(expected)
    assert step[1, 0] == pytest.approx(at)
    assert abs(level[1, 0] - level[0, 0]) > 0.1


def test_form_errors_are_as_wide_as_the_noise_says() -> None:
    rows, spread, block = rows_of(8)
    whole = replace(grams_of(rows, spread, block), form=1)
    expected = grams_of(rows, spread * [3.0, 3.0, 1.0], block).level()
    assert whole.marginal(np.arange(2), widths=(3.0,))[0][0, 0] == pytest.approx(expected)


def test_columns_that_are_taken_out_leave_the_model_without_them() -> None:
    rows, spread, block = rows_of(4)
    whole = replace(grams_of(rows, spread, block), form=1)
    assert whole.without(spread[2:]).level() == pytest.approx(
        grams_of(rows[:, :3], spread[:2], block).level()
    )


def test_one_factor_gives_what_a_model_is_without_its_last_columns_and_with_them() -> None:
    rows, spread, block = rows_of(9)
    whole, sizes = replace(grams_of(rows, spread, block), form=2), np.array([0])
    draws = np.random.default_rng(0).multinomial(6, np.full(6, 1 / 6), 40).astype(float)
    widths = (0.5, 2.0)
    both = whole.marginals(sizes, spread[1:], draws, widths)
    alone = [one.marginal(sizes, draws, widths) for one in (whole.without(spread[1:]), whole)]
    for found, expected in zip(both, alone, strict=True):
        for a, b in zip(found, expected, strict=True):
            assert a == pytest.approx(b, rel=1e-7)


def test_recordings_with_other_columns_add_up_in_their_places() -> None:
    """What acts in one recording only is nothing in another one."""
    rows, spread, block = rows_of(5)
    rows[block >= 3, 2] = 0.0
    whole, none = grams_of(rows, spread, block), np.zeros(0, dtype=np.intp)
    first, second = rows[block < 3], rows[block >= 3][:, [0, 1, 3]]
    edges = np.searchsorted(block, np.arange(7))
    columns = np.arange(4), np.array([0, 1, 3])
    apart = Rows(4, (first, second), columns, (edges[:4], edges[3:] - edges[3]), whole.rows.logdet)
    draws = np.array([[1.0, 0.0, 2.0, 1.0, 3.0, 0.0]])
    for weights in (None, draws):
        level = replace(whole, rows=apart).marginal(none, weights)[0]
        assert level == pytest.approx(whole.marginal(none, weights)[0])


def test_form_errors_of_any_share_are_the_same_rows() -> None:
    """A column scaled by a share, with a coefficient of about one, is the column with one of that share."""
    rows, spread, block = rows_of(7)
    scaled = replace(grams_of(rows, spread, block), scale=np.array([1.0, 1.0, 1.0, 0.2]))
    shrunk = grams_of(rows * [1.0, 1.0, 1.0, 0.2], spread, block)
    assert scaled.level() == pytest.approx(shrunk.level())


def test_what_is_absorbed_is_the_projection_of_ridge_regression() -> None:
    rows, spread, block = rows_of(5)
    found = absorbed(rows, grams_of(rows, spread, block).prior)
    column = np.random.default_rng(6).standard_normal(len(rows))
    stacked = np.concatenate([rows[:, 1:], np.diag(1 / spread)])
    padded = np.concatenate([column, np.zeros(3)])
    left = padded - stacked @ np.linalg.lstsq(stacked, padded, rcond=None)[0]
    inside = found.basis.T @ column
    assert column @ column - inside @ inside == pytest.approx(left @ left)
    residual = np.concatenate([rows[:, 0], np.zeros(3)])
    assert column @ rows[:, 0] - inside @ found.slope == pytest.approx(left @ residual)


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


def test_long_blocks_keep_their_normal_equations_in_few_rows() -> None:
    """A test rig of 2 x 6000 readings took 7 GB: the rows of each of 200 models stood under four noises."""
    rng = np.random.default_rng(5)
    columns = (np.array([0, 1, 3]), np.array([0, 2, 3, 4]))
    edges = (np.array([0, 40, 40, 42, 90]), np.array([0, 30, 60, 90, 120]))  # one block has no reading
    rows = tuple(rng.standard_normal((e[-1], len(c))) for e, c in zip(edges, columns, strict=True))
    whole = Rows(5, rows, columns, edges, np.zeros(8))
    light = whole.lighter()
    assert [len(r) for r in light.rows] == [3 + 0 + 2 + 3, 4 * 4]
    np.testing.assert_allclose(light.by_block(), whole.by_block(), atol=1e-12)
    np.testing.assert_allclose(light.sums, whole.sums, atol=1e-11)
    short = Rows(5, tuple(r[:9] for r in rows), columns, (np.arange(4) * 3, np.arange(4) * 3), np.zeros(6))
    assert short.lighter() is short
