"""An input known only within a spread: what a fit makes of it, what a first reading tells of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.dynamics import make_grid, make_system, predict, sensitivities, simulate, start_values
from discovery.dynamics.system import shifted
from discovery.fitting import fit_model, make_problem, predict_recording
from discovery.fitting.fit import written_with
from discovery.fitting.noise import readings_as_one
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
CHANNELS = {
    "load": Channel("load", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear", 1.0),
    "T": Channel("T", "temperature", "degC", 0.2, "linear"),
}
TRUTH = {"g": 0.002, "h": 0.0015}
START_SD, NOISE = 0.4, 0.2


def cold(rng: np.random.Generator, name: str, off: float | None = None, count: int = 240) -> Recording:
    """A body that starts cold in a room that is `off` from the 23 degC that everybody believes.

    dT/dt = h (room - T) + g load, exactly, the load held over 30 s.
    """
    off = float(rng.normal(0.0, 1.0)) if off is None else off
    time, load = (
        np.arange(count, dtype=float) * 30.0,
        np.repeat(rng.choice([0.0, 10.0, 25.0], count // 20), 20),
    )
    body: Array = np.empty(count)
    body[0] = 23.0 + off + rng.normal(0.0, START_SD)
    keep = np.exp(-TRUTH["h"] * 30.0)
    for k in range(1, count):
        rest = 23.0 + off + TRUTH["g"] / TRUTH["h"] * load[k - 1]
        body[k] = rest + (body[k - 1] - rest) * keep
    read: Array = body + NOISE * rng.standard_normal(count)
    return Recording(name, time, {"load": load, "room": np.full(count, 23.0), "T": read}, f"{off:.12g}")


def campaign(*recordings: Recording, spread: float = 1.0) -> Campaign:
    channels = CHANNELS | {"room": replace(CHANNELS["room"], spread=spread)}
    return Campaign("c", channels, {r.name: r for r in recordings})


def model(start: str = "room", start_sd: float = START_SD) -> Model:
    parameters = {"g": Parameter(0.003, "K/W/s", 0.0), "h": Parameter(0.001, "1/s", 0.0)}
    state = State("T", "degC", None, parse(start), start_sd, 1.0)
    terms = tuple(Term(e, "T", parse(e)) for e in ("h*(room - T)", "g*load"))
    return Model("body", parameters, {"T": state}, terms, {})


def test_parameters_and_rooms_lie_in_their_intervals_19_times_in_20() -> None:
    """40 campaigns of 4 recordings, each in a room of its own: pooled coverage of 95 % intervals."""
    inside = dict.fromkeys(("parameters", "rooms"), 0)
    runs, each = 40, 4
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        rooms = [cold(rng, f"r{i}") for i in range(each)]
        fit = fit_model(model(), campaign(*rooms), [r.name for r in rooms])
        for name, value in TRUTH.items():
            p = fit.model.parameters[name]
            assert p.low is not None
            assert p.high is not None
            inside["parameters"] += p.low <= value <= p.high
        for r in rooms:
            found, error = fit.offsets["room"][r.name]
            inside["rooms"] += abs(found - float(r.note)) <= 1.96 * error
    assert 0.90 <= (inside["parameters"] + inside["rooms"]) / (runs * (each + 2)) <= 0.98, inside


def test_a_room_taken_for_certain_spoils_what_a_spread_keeps() -> None:
    rng = np.random.default_rng(1)
    rooms = [cold(rng, f"r{i}", off) for i, off in enumerate((1.5, -1.2, 1.8))]
    names = [r.name for r in rooms]
    off = {
        s: fit_model(model(), campaign(*rooms, spread=s), names).model.parameters["h"].value for s in (0, 1)
    }
    assert off[1] == pytest.approx(TRUTH["h"], rel=0.02)
    assert abs(off[0] - TRUTH["h"]) > 3 * abs(off[1] - TRUTH["h"])


def test_an_unseen_run_takes_its_room_from_the_first_reading_alone() -> None:
    """Bayes by hand: first reading 24.5 of noise 0.2 on a start spread of 0.4 and a room spread of 1."""
    r = cold(np.random.default_rng(2), "r", 1.5)
    r.values["T"][0] = 24.5
    fitted = model().with_values(TRUTH)
    run = predict_recording(fitted, campaign(r), "r", ["T"], [NOISE])
    gain = 1.0 / (1.0 + START_SD**2 + NOISE**2)
    assert run.system.grid.offset["room"] == pytest.approx(1.5 * gain)
    assert run.x[0, 0] == pytest.approx(23.0 + 1.5 * gain * (1.0 + START_SD**2))
    later = replace(r, values={**r.values, "T": np.concatenate([r.values["T"][:1], r.values["T"][1:] + 9.0])})
    again = predict_recording(fitted, campaign(later), "r", ["T"], [NOISE])
    assert np.array_equal(run.x, again.x)


def test_the_same_sensor_is_off_by_as_much_in_an_unseen_run() -> None:
    """Three rooms that are 2 K warmer than recorded; of the fourth the first reading says nothing."""
    rng = np.random.default_rng(9)
    rooms = [cold(rng, name, 2.0) for name in ("r1", "r2", "r3", "new")]
    seen = campaign(*rooms)
    read = replace(model(), states={"T": State("T", "degC", scale=1.0)})  # it begins at its first reading
    fit = fit_model(read, seen, ["r1", "r2", "r3"])
    mean, spread = fit.zeros["room"]
    assert 1.5 < mean < 2.0
    assert spread < 1.0

    def missed(zeros: dict[str, tuple[float, float]] | None) -> float:
        run = predict_recording(fit.model, seen, "new", ["T"], [NOISE], zeros=zeros)
        return float(np.sqrt(np.mean((run.system.grid.readings - predict(run))[-80:] ** 2)))

    assert missed(fit.zeros) < 0.35 * missed(None)


def test_without_a_spread_nothing_is_estimated() -> None:
    r = cold(np.random.default_rng(3), "r", 0.7)
    fit = fit_model(model(), campaign(r, spread=0.0), ["r"])
    assert fit.offsets == {}
    assert fit.together >= 1.0  # readings that hang together count for the start, too
    assert not any(u.is_offset for u in fit.problem.unknowns)


def test_the_offset_is_no_parameter_of_the_fitted_model() -> None:
    r = cold(np.random.default_rng(4), "r", 0.7)
    fit = fit_model(model(), campaign(r), ["r"])
    assert set(fit.model.parameters) == {"g", "h"}
    assert [u.name for u in fit.problem.unknowns if u.is_offset] == ["room"]
    assert fit.trajectories[0].at_ends()["room"][0] == pytest.approx(23.0 + fit.offsets["room"]["r"][0])  # type: ignore[index]


@pytest.mark.parametrize(
    "loss", ["h*(room - T)", "h*(delay(room, 90) - T)", "h*lag(room - T, 200)", "h*(max(room, 20) - T)"]
)
@pytest.mark.parametrize("start", ["room", "where(room > 20, 2*room - 23, T)", "23"])
@pytest.mark.parametrize("start_sd", [0.0, 0.5])
def test_sensitivities_to_the_offset_against_differences(loss: str, start: str, start_sd: float) -> None:
    base = model(start, start_sd)
    base = replace(base, terms=(Term("loss", "T", parse(loss)), base.terms[1])).with_values(TRUTH)
    problem = make_problem(base, campaign(cold(np.random.default_rng(5), "r")), ["r"])
    theta, index = problem.start, [u.is_offset for u in problem.unknowns].index(True)
    found = problem.jacobian(problem.run(problem.systems[0], theta))[:, 0, index]
    step = np.zeros(len(theta))
    step[index] = 1e-3
    up, down = (predict(problem.run(problem.systems[0], theta + s * step))[:, 0] for s in (1.0, -1.0))
    assert found == pytest.approx((up - down) / 2e-3, abs=1e-4 * np.max(np.abs(found)) + 1e-9)


def test_shifting_a_system_is_recording_other_values() -> None:
    r = cold(np.random.default_rng(6), "r", 0.0)
    warm = replace(r, values={**r.values, "room": r.values["room"] + 0.8})
    both = []
    for one, offset in ((r, 0.8), (warm, 0.0)):
        system = make_system(model(), make_grid(campaign(one), "r", ["load", "room"], ["T"]))
        system = shifted(shifted(system, {"room": 5.0}), {"room": offset})  # the last word counts
        both.append(simulate(system, TRUTH, start_values(system, TRUTH)))
    assert both[0].x == pytest.approx(both[1].x)
    assert sensitivities(both[0], ["room"]) == pytest.approx(sensitivities(both[1], ["room"]))


def test_a_lasting_misfit_does_not_outvote_what_is_known_of_a_room() -> None:
    """The model lacks a constant 8 K: it is not put down to a room that is known within 1 K."""
    r = cold(np.random.default_rng(7), "r", 0.0)
    lifted = replace(r, values={**r.values, "T": r.values["T"] + 8.0 * (r.time > 600.0)})
    unstated = campaign(lifted)
    unstated = replace(unstated, channels={**CHANNELS, "T": replace(CHANNELS["T"], noise=None)})
    fixed = {n: Parameter(v, fixed=True) for n, v in TRUTH.items()}
    fit = fit_model(replace(model(), parameters=fixed), unstated, ["r"])
    assert fit.together > 50
    assert abs(fit.offsets["room"]["r"][0]) < 1.0


def test_readings_that_count_as_one() -> None:
    """White: one. A first-order process of decay a: (1 + a)/(1 - a). A constant: all of them."""
    rng = np.random.default_rng(8)
    white = rng.standard_normal((4000, 2))
    assert readings_as_one([white]) == pytest.approx(1.0, abs=0.2)
    slow = white.copy()
    for k in range(1, len(slow)):
        slow[k] += 0.8 * slow[k - 1]
    assert readings_as_one([slow[:2000], slow[2000:]]) == pytest.approx(9.0, rel=0.2)
    assert readings_as_one([np.ones((300, 1))]) > 290
    assert readings_as_one([np.zeros((10, 1))]) == 1.0


def test_a_fit_written_another_way_keeps_its_numbers() -> None:
    rooms = [cold(np.random.default_rng(seed), f"r{seed}") for seed in (9, 10)]
    seen = campaign(*rooms)
    fit = fit_model(model(), seen, ["r9", "r10"])
    twin = replace(fit.model, terms=(Term("both", "T", parse("g*load + h*(room - T)")),))
    again = written_with(fit, twin, seen)
    assert again.model.parameters == fit.model.parameters
    assert again.offsets == fit.offsets
    for a, b in zip(again.trajectories, fit.trajectories, strict=True):
        assert a.x == pytest.approx(b.x)


def test_what_is_one_number_in_a_fit_may_be_written_for_each_recording() -> None:
    """A clock that is ahead in one recording is a number of that recording in the repaired model."""
    seen = campaign(*(cold(np.random.default_rng(seed), f"r{seed}") for seed in (9, 10)))
    fit = fit_model(model(), seen, ["r9", "r10"])
    name = fit.model.free[0]
    found = fit.model.parameters[name]
    each = replace(found, per_recording=True, values=dict.fromkeys(["r9", "r10"], found.value))
    again = written_with(fit, replace(fit.model, parameters={**fit.model.parameters, name: each}), seen)
    assert again.model.parameters[name].values == pytest.approx({"r9": found.value, "r10": found.value})
    for a, b in zip(again.trajectories, fit.trajectories, strict=True):
        assert a.x == pytest.approx(b.x)


def test_a_memory_that_begins_at_rest_is_no_unknown_when_a_fit_is_written_another_way() -> None:
    """Of two recordings one begins with a load: only there what the memory holds is fitted."""
    begins, rests = (cold(np.random.default_rng(seed), f"r{seed}") for seed in (9, 10))
    begins.values["load"][:20], rests.values["load"][:] = 25.0, 0.0
    begins.values["T"][0], rests.values["T"][:] = 40.0, rests.values["room"]
    seen = campaign(begins, rests)
    terms = (Term("air", "T", parse("h*(room - T)")), Term("late", "T", parse("g*lag(load, 300)")))
    states = {"T": State("T", "degC")}  # begins at its first reading
    fit = fit_model(replace(model(), terms=terms, states=states), seen, ["r9", "r10"])
    held = [u.recording for u in fit.problem.unknowns if u.name == "lag_1"]
    assert held == ["r9"]
    again = written_with(fit, fit.model, seen)
    for a, b in zip(again.trajectories, fit.trajectories, strict=True):
        assert a.x == pytest.approx(b.x)


def test_masses_that_are_warm_together_share_a_first_reading() -> None:
    """The start is the mean of two normal masses given their sum with noise, in closed form."""
    states = {
        "a": State("a", "degC", None, parse("2.0"), 3.0, 1.0),
        "b": State("b", "degC", None, parse("1.0"), 0.5, 1.0, start_with={"a": 0.8}),
    }
    terms = (Term("a cools", "a", parse("-h*a")), Term("b cools", "b", parse("-h*b/9")))
    two = Model("two", {"h": Parameter(0.001, "1/s", 0.0)}, states, terms, {"T": parse("a + b")})
    seen = campaign(Recording("r", np.array([0.0, 60.0]), {"T": np.array([11.0, np.nan])}))
    found = predict_recording(two, seen, "r", ["T"], [NOISE]).x[0]
    covariance = np.array([[9.0, 0.8 * 9.0], [0.8 * 9.0, 0.8**2 * 9.0 + 0.25]])
    sums = covariance.sum(axis=1)
    expected = [2.0, 1.0] + sums / (covariance.sum() + NOISE**2) * (11.0 - 3.0)
    assert found == pytest.approx(expected)


def test_the_starts_of_bodies_share_what_recordings_say_of_them() -> None:
    """Recordings say of each body how far its starts are off; the mean over the bodies counts as two more."""
    states = {name: State(name, "degC", 3e3, parse("room")) for name in ("a", "b")}
    terms = (Term("air a", "a", parse("G*(room - a)")), Term("air b", "b", parse("H*(room - b)")))
    parameters = {"G": Parameter(10.0, "W/K", 0.0), "H": Parameter(10.0, "W/K", 0.0)}
    outputs = {"T": parse("a + b - room"), "S": parse("b - a + room")}  # no first reading shows a start
    bodies = Model("bodies", parameters, states, terms, outputs)
    channels = {**CHANNELS, "S": replace(CHANNELS["T"], name="S")}
    time, rng = np.arange(0.0, 900.0, 10.0), np.random.default_rng(4)

    def cooling(name: str) -> Recording:
        warm = {"T": 6.5 * np.exp(-time / 300.0), "S": -5.5 * np.exp(-time / 300.0)}
        read = {n: 20.0 + rise + NOISE * rng.standard_normal(90) for n, rise in warm.items()}
        return Recording(name, time, {"room": np.full(90, 20.0), **read})

    runs = [cooling(f"r{k}") for k in range(3)]
    for count in (1, 3):
        seen = Campaign("c", channels, {run.name: run for run in runs[:count]})
        fit = fit_model(bodies, seen, list(seen.recordings))
        found, squares = fit.problem.start_spreads(), {}
        for name in states:
            mine = [i for i, u in enumerate(fit.problem.unknowns) if u.name == name]
            squares[name] = np.mean(fit.theta[mine] ** 2 + np.diag(fit.covariance)[mine])
        mean = sum(squares.values()) / 2
        for name in states:
            expected = np.sqrt((2 * mean + count * squares[name]) / (2 + count))
            assert found[name] == pytest.approx(expected, rel=0.25)  # a fit ends when steps are below 10 %
            assert fit.model.states[name].start_sd == found[name]


def test_a_body_whose_start_nothing_shows_may_begin_as_warm_as_the_others() -> None:
    states = {name: State(name, "degC", 3e3, parse("room")) for name in ("a", "b")}
    terms = (Term("air a", "a", parse("G*(room - a)")), Term("air b", "b", parse("G*(room - b)")))
    parameters = {"G": Parameter(10.0, "W/K", 0.0), "k": Parameter(1e-6, "1", fixed=True)}
    hidden = Model("hidden", parameters, states, terms, {"T": parse("a + k*b")})
    time = np.arange(0.0, 600.0, 10.0)
    read = 20.0 + 5.0 * np.exp(-time / 300.0) + NOISE * np.random.default_rng(5).standard_normal(60)
    fit = fit_model(hidden, campaign(Recording("r", time, {"room": np.full(60, 20.0), "T": read})), ["r"])
    found = fit.problem.start_spreads()
    assert found["b"] > 2.0


def test_a_temperature_that_nobody_reads_stays_near_what_its_author_believes() -> None:
    """A loss to a cellar that is too small to be seen: its heat shows at most, and not how cold it is."""
    rng = np.random.default_rng(3)
    terms = (*model().terms, Term("cellar", "T", parse("k*(T_c - T)")))
    parameters = {**model().parameters, "T_c": Parameter(8.0, "degC"), "k": Parameter(1e-6, "1/s", 0.0)}
    below = replace(model(), terms=terms, parameters=parameters)
    fit = fit_model(below, campaign(cold(rng, "a", 0.0), cold(rng, "b", 0.0)), ["a", "b"])
    cellar = fit.model.parameters["T_c"]
    assert cellar.value == pytest.approx(8.0, abs=20.0)
    assert cellar.low is not None
    assert cellar.high is not None
    assert 20.0 < cellar.high - cellar.low < 45.0  # as wide as what was believed


def test_a_recording_may_begin_with_a_switch_on() -> None:
    """A heater with a mass of its own was cold before its first sample, and is no other heater for that."""
    tau, every = 300.0, 30.0
    rng = np.random.default_rng(5)
    time = every * np.arange(400.0)
    runs = []
    for name in ("a", "b"):
        load = np.repeat(rng.permutation([25.0, 10.0, 20.0, 5.0]), 100)
        heater, body = 0.0, 23.0
        read = np.empty(len(time))
        for k, heat in enumerate(load):
            read[k] = body + NOISE * rng.standard_normal()
            for _ in range(30):  # steps of a second
                heater, body = (
                    heater + (heat - heater) / tau,
                    body + TRUTH["h"] * (23.0 - body) + TRUTH["g"] * heater,
                )
        values = {"load": load, "room": np.full(len(time), 23.0), "T": read}
        runs.append(Recording(name, time, values))
    terms = tuple(Term(e, "T", parse(e)) for e in ("h*(room - T)", "g*lag(load, tau)"))
    parameters = {**model().parameters, "tau": Parameter(100.0, "s", 1.0)}
    states = {"T": State("T", "degC", None, parse("room"), None, 1.0)}
    heated = replace(model(), terms=terms, parameters=parameters, states=states)
    found = fit_model(heated, campaign(*runs, spread=0.0), ["a", "b"]).model.parameters["tau"]
    assert found.low is not None
    assert found.high is not None
    assert found.low < tau < found.high
    assert found.value == pytest.approx(tau, rel=0.1)


def test_a_hidden_mass_need_not_begin_as_warm_as_its_body() -> None:
    """A galvo whose second recording begins warm: the mass behind its mount was not yet as warm as the mount.
    It was found 40 % too fast, with a draught in that recording; here nothing was known of it (1 to 2212 s).
    """
    every, tau, part, rng = 30.0, 1200.0, 0.4, np.random.default_rng(6)
    runs = []
    for name, begun in (("cold", 0), ("warm", 10)):  # the warm one 300 s after it was switched on
        load = np.repeat([25.0, *rng.choice([0.0, 10.0, 25.0], 12)], 20)
        body = mass = 23.0
        read = np.empty(len(load))
        for k, heat in enumerate(load):
            read[k] = body + 0.05 * rng.standard_normal()
            for _ in range(30):  # steps of a second
                flow = TRUTH["g"] * heat + TRUTH["h"] * (23.0 - body) + part * TRUTH["h"] * (mass - body)
                body, mass = body + flow, mass + (body - mass) / tau
        time: Array = every * np.arange(len(load) - begun, dtype=np.float64)
        values = {"load": load[begun:], "room": np.full(len(time), 23.0), "T": read[begun:]}
        runs.append(Recording(name, time, values))
    terms = tuple(Term(e, "T", parse(e)) for e in ("h*(room - T)", "g*load", "k*(lag(T, tau) - T)"))
    hidden = {"k": Parameter(0.001, "1/s", 0.0), "tau": Parameter(600.0, "s", 1.0)}
    states = {"T": State("T", "degC", None, parse("room"), None, 1.0)}
    whole = replace(model(), terms=terms, parameters={**model().parameters, **hidden}, states=states)
    fit = fit_model(whole, campaign(*runs, spread=0.0), ["cold", "warm"])
    found = {name: fit.model.parameters[name] for name in ("tau", "k")}
    for name, true in (("tau", tau), ("k", part * TRUTH["h"])):
        low, high = found[name].low, found[name].high
        assert low is not None
        assert high is not None
        assert low < true < high
        assert high - low < 0.2 * true


def test_what_a_memory_of_an_input_holds_lies_in_the_range_of_the_input() -> None:
    """A heater began at -0.4 of its power, and its model met every reading."""
    terms = (Term("heat", "T", parse("g*lag(lag(load, 300), 300)")), Term("air", "T", parse("h*(room - T)")))
    warm = Term("wall", "T", parse("h*(lag(room, 900) - T)"))
    lagging = replace(model(), terms=(*terms, warm))
    time = np.arange(0.0, 1200.0, 30.0)
    loads = {"a": np.where(time < 600, 10.0, 25.0), "b": np.where(time < 600, 25.0, 5.0)}
    rooms = np.full(40, 23.0)
    runs = [Recording(name, time, {"load": load, "room": rooms, "T": rooms}) for name, load in loads.items()]
    problem = make_problem(lagging, campaign(*runs), ["a", "b"])
    ranges = {(u.recording, u.low, u.high) for u in problem.unknowns if u.is_start and u.spread == "moved"}
    of_load = {("a", -10.0, 15.0), ("b", -25.0, 0.0)}  # from zero to the largest load
    assert ranges == of_load | {("a", -np.inf, np.inf), ("b", -np.inf, np.inf)}
