"""A held input that is logged late: what a fit makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.dynamics import Grid, make_grid, predict
from discovery.fitting import Noise, fit_model, make_problem
from discovery.fitting.kalman import make_filter
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
CHANNELS = {
    "load": Channel("load", "heat load", "W", None, "held"),
    "fan": Channel("fan", "cooling power", "1", None, "held"),
    "T": Channel("T", "temperature", "K", 0.2, "linear"),
}
TRUTH = {"g": 0.002, "h": 0.0015}
INTERVAL = 60.0  # s, of the logger


def logged(seed: int, late: float, count: int = 240) -> Recording:
    """dT/dt = g load - h fan T, exactly, read each minute; the load switches `late` s before it is logged."""
    rng = np.random.default_rng(seed)
    time: Array = INTERVAL * np.arange(count, dtype=float)
    load, fan = (np.repeat(rng.choice(levels, count // 12), 12) for levels in ([0.0, 20.0, 50.0], [1.0, 2.0]))
    body = np.zeros(count)
    for k in range(1, count):
        x, rate = body[k - 1], TRUTH["h"] * fan[k - 1]
        for heat, length in ((load[k - 1], INTERVAL - late), (load[k], late)):
            rest = TRUTH["g"] * heat / rate
            x = rest + (x - rest) * np.exp(-rate * length)
        body[k] = x
    read: Array = body + 0.2 * rng.standard_normal(count)
    return Recording(f"r{seed}", time, {"load": load, "fan": fan, "T": read})


def campaign(*recordings: Recording) -> Campaign:
    return Campaign("c", CHANNELS, {r.name: r for r in recordings})


def model(heat: str = "g*load") -> Model:
    parameters = {"g": Parameter(0.003, "K/W/s", 0.0), "h": Parameter(0.001, "1/s", 0.0)}
    terms = (Term("heat", "T", parse(heat)), Term("loss", "T", parse("-h*fan*T")))
    return Model("body", parameters, {"T": State("T", "K", None, parse("0"), 0.0, 1.0)}, terms, {})


def grids(seen: Campaign) -> dict[str, Grid]:
    return {
        name: replace(make_grid(seen, name, ["load", "fan"], ["T"]), unsure={"load": INTERVAL})
        for name in seen.recordings
    }


def test_what_the_logger_is_late_by_is_found_and_keeps_parameters_right() -> None:
    seen = campaign(logged(1, 40.0), logged(2, 15.0))
    names = list(seen.recordings)
    believing, asking = (fit_model(model(), seen, names, grids=g) for g in (None, grids(seen)))
    late = {u.recording: v for u, v in zip(asking.problem.unknowns, asking.theta, strict=True) if u.is_late}
    assert late == {"r1": pytest.approx(40.0, abs=2.0), "r2": pytest.approx(15.0, abs=2.0)}
    for name, value in TRUTH.items():
        p = asking.model.parameters[name]
        assert p.low is not None
        assert p.high is not None
        assert p.low <= value <= p.high
        assert abs(believing.model.parameters[name].value - value) > abs(p.value - value)
    assert set(asking.model.parameters) == set(TRUTH)


@pytest.mark.parametrize("heat", ["g*load", "g*delay(load, 95)", "g*lag(load, 80)", "0.1*g*load**1.5"])
@pytest.mark.parametrize("late", [5.0, 23.0, -50.0])
def test_sensitivities_to_it_against_differences(heat: str, late: float) -> None:
    seen = campaign(logged(3, 0.0))
    problem = make_problem(model(heat).with_values(TRUTH), seen, ["r3"], grids=grids(seen))
    index = [u.is_late for u in problem.unknowns].index(True)
    theta, step = problem.start, np.zeros(len(problem.unknowns))
    theta[index], step[index] = late, 0.3
    found = problem.jacobian(problem.run(problem.systems[0], theta))[:, 0, index]
    up, down = (predict(problem.run(problem.systems[0], theta + s * step))[:, 0] for s in (1.0, -1.0))
    assert found == pytest.approx((up - down) / 0.6, abs=1e-3 * np.max(np.abs(found)))


def test_an_input_that_stands_still_is_the_same_to_the_last_bit() -> None:
    seen = campaign(logged(4, 0.0))
    grid = grids(seen)["r4"]
    moved = grid.shifted({}, {"fan": 20.0})
    still = np.repeat(np.diff(grid.samples["fan"].at(grid.time)) == 0, 2)
    assert np.array_equal(moved.ends["fan"][still], grid.ends["fan"][still])
    assert np.array_equal(moved.ends["load"], grid.ends["load"])
    assert np.array_equal(moved.nodes["fan"], grid.nodes["fan"])


def test_switches_that_come_each_by_another_time_are_whitened_as_a_dense_covariance_says() -> None:
    """An impulse of g times step times jitter at the reading behind it, which dies as the body cools."""
    r, jitter, white = logged(5, 0.0, 120), 0.3, 0.2
    problem = make_problem(model().with_values(TRUTH), campaign(r), ["r5"], grids=grids(campaign(r)))
    theta = np.array([23.0 if u.is_late else u.start for u in problem.unknowns])
    part = make_filter(problem.run(problem.systems[0], theta))
    keep = np.exp(-TRUTH["h"] * INTERVAL * r.values["fan"][:-1])
    answer = np.diag(np.diff(r.values["load"], prepend=r.values["load"][0]) * TRUTH["g"] * INTERVAL * jitter)
    for k in range(1, len(keep) + 1):
        answer[k] += keep[k - 1] * answer[k - 1]
    triangle = np.linalg.cholesky(answer @ answer.T + white**2 * np.eye(len(answer)))
    data = np.random.default_rng(0).standard_normal((len(answer), 1, 2))
    found, logs = part.whitened(Noise(("T",), (white,), jitter=jitter), data)
    assert found == pytest.approx(np.linalg.solve(triangle, data[:, 0]), abs=1e-7)
    assert logs == pytest.approx(np.log(np.diag(triangle)))
