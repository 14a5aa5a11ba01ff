"""A held input that is logged late: what a fit makes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from discovery.diagnosis.left_open import moved_by
from discovery.dynamics import Grid, Trajectory, make_grid, predict
from discovery.fitting import Noise, fit_model, make_problem, predict_recording
from discovery.fitting.impulses import inputs_in_gaps, late_switches, moved_in_gaps
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
    """Heat that is a little more over the whole step, and more at one end of it than at the other, as a body
    answers that cools by h fan meanwhile.
    """
    r, jitter, white = logged(5, 0.0, 120), 0.3, 0.2
    problem = make_problem(model().with_values(TRUTH), campaign(r), ["r5"], grids=grids(campaign(r)))
    theta = np.array([23.0 if u.is_late else u.start for u in problem.unknowns])
    part = make_filter(problem.run(problem.systems[0], theta))
    rate = TRUTH["h"] * r.values["fan"][:-1]
    keep = np.exp(-rate * INTERVAL)
    even = np.append(0.0, (1 - keep) / rate)
    tilted = even - np.append(0.0, 2 / rate - 2 * (1 - keep) / (rate**2 * INTERVAL))
    switched = np.diff(r.values["load"], prepend=r.values["load"][0]) * TRUTH["g"] * jitter
    answer = np.concatenate([np.diag(switched * even), np.diag(switched * tilted * np.sqrt(3 / 5))], axis=1)
    for k in range(1, len(keep) + 1):
        answer[k] += keep[k - 1] * answer[k - 1]
    triangle = np.linalg.cholesky(answer @ answer.T + white**2 * np.eye(len(answer)))
    data = np.random.default_rng(0).standard_normal((len(answer), 1, 2))
    found, logs = part.whitened(Noise(("T",), (white,), jitter=jitter), data)
    assert found == pytest.approx(np.linalg.solve(triangle, data[:, 0]), abs=1e-7)
    assert logs == pytest.approx(np.log(np.diag(triangle)))


def test_a_switch_at_any_instant_of_a_step_moves_two_bodies_as_exact_runs_say() -> None:
    """A stator of 90 s in a jacket of 6 s, read each minute, a load of 24 kW on or off: exact runs with 400
    instants of the switch (matrix exponentials), against the covariance at the reading behind it.
    """
    capacity, across, water, power = np.array([60e3, 15e3]), 670.0, 2000.0, 24e3
    a = np.array([[-across, across], [across, -across - water]]) / capacity[:, None]
    time, load = INTERVAL * np.arange(11.0), np.where(np.arange(11) >= 5, power, 0.0)
    channels = {n: Channel(n, "temperature", "K", 0.2, "linear") for n in ("stator", "jacket")}
    channels["load"] = CHANNELS["load"]
    run = Recording("r", time, {"load": load, "stator": np.zeros(11), "jacket": np.zeros(11)})
    names = zip(("stator", "jacket"), capacity, strict=True)
    states = {n: State(n, "K", c, parse("0"), 0.0, 1 / c) for n, c in names}
    terms = (
        Term("load", "stator", parse("load")),
        Term("wall", "jacket", parse(f"{across}*(stator - jacket)"), "stator"),
        Term("water", "jacket", parse(f"-{water}*jacket")),
    )
    seen = Campaign("c", channels, {"r": run})
    grid = replace(make_grid(seen, "r", ["load"], ["stator", "jacket"]), unsure={"load": INTERVAL})
    problem = make_problem(Model("two", {}, states, terms, {}), seen, ["r"], grids={"r": grid})
    there = late_switches(problem.run(problem.systems[0], np.array([INTERVAL / 2])))[4] / 12
    inverse = np.linalg.inv(a)
    left = INTERVAL * (np.arange(400) + 0.5) / 400  # from the switch to the reading
    exact = np.array([inverse @ (expm(a * t) - np.eye(2)) @ [power / capacity[0], 0.0] for t in left])
    off = exact - exact.mean(axis=0)
    assert np.sqrt(np.diag(there)) == pytest.approx(exact.std(axis=0), rel=0.1)
    beyond = np.einsum("ri,ij,rj->r", off, np.linalg.inv(there + 0.2**2 * np.eye(2)), off)
    assert beyond.max() < 9.0  # all within three standard deviations, the jacket, too


@pytest.mark.parametrize("late", [120.0, -120.0])
def test_what_an_input_was_before_the_recording_is_not_known(late: float) -> None:
    """A load that arrives 120 s late is not known for so long; what it may have been moves the body as a load
    that is a watt larger until then (the difference of two free runs).
    """
    r = logged(6, 0.0, 120)
    unknown = r.time < 120.0 if late > 0 else r.time >= 7140.0 - 120.0
    r = replace(r, values={**r.values, "more": np.where(unknown, 1.0, 0.0)})
    channels = {**CHANNELS, "more": replace(CHANNELS["load"], name="more")}
    seen = Campaign("c", channels, {r.name: r})

    def run(heat: str) -> Trajectory:
        problem = make_problem(model(heat).with_values(TRUTH), seen, ["r6"])
        return problem.run(problem.systems[0], problem.start)

    arriving = run(f"g*delay(load, {late})")
    acts = inputs_in_gaps(arriving).any(axis=(1, 2))
    assert np.flatnonzero(acts).tolist() == ([0, 1] if late > 0 else [117, 118])
    spread, moved = moved_in_gaps(arriving)
    every = np.linspace(0.0, 7140.0, 4000)
    now, then = (r.values["load"][np.minimum(t // 60, 119).astype(int)] for t in (every, every + 60.0))
    assert spread == pytest.approx([np.sqrt(np.mean((then - now) ** 2))], rel=1e-2)
    larger = predict(run(f"g*(delay(load, {late}) + more)")) - predict(arriving)
    assert moved[:, :, 0] == pytest.approx(larger, abs=1e-9)
    assert not len(moved_in_gaps(run("g*load"))[0])


def test_a_proof_knows_what_late_inputs_make_of_a_free_run() -> None:
    """Against the exact body of a load that switches half a minute before its stamp."""
    seen = campaign(logged(3, 0.0))
    truth = model().with_values(TRUTH)
    run = predict_recording(truth, seen, "r3", ["T"], [0.2])
    expected = logged(3, 30.0).values["T"] - logged(3, 0.0).values["T"]  # of the same noise
    moved = moved_by(run, "load", 30.0)[:, 0]
    assert np.abs(expected).max() > 1.0
    assert np.abs(moved - expected).max() < 0.06 * np.abs(expected).max()  # its mean over a step
