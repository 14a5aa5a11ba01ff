"""Output-error fits: coverage of intervals, outliers, bounds, what cannot be found, what recordings share."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from discovery.fitting import fit_model, make_problem, predict_recording
from discovery.fitting.covariance import covariance_of
from discovery.fitting.problem import FARTHEST
from discovery.fitting.solve import Solution, _normal, solve
from discovery.fitting.starts import warm_start
from discovery.models import Model, Parameter, State
from discovery.models.reduced import reduced
from discovery.recordings import Campaign, Channel, Recording, load_campaign
from discovery.terms import Number, Term, parse

Array = NDArray[np.float64]
ROOT = Path(__file__).parents[2]
CHANNELS = {
    "u": Channel("u", "heat load", "W", None, "held"),
    "v": Channel("v", "ambient temperature", "degC", None, "held"),
    "y": Channel("y", "error", "um", 0.5, "linear"),
}
TRUTH = {"a": 0.5, "g": 0.02, "k": -0.8}


def truth(u: Array, v: Array, hours: float, a: float = 0.5, g: float = 0.02, k: float = -0.8) -> Array:
    """x' = -a x + g u + k v exactly, inputs held over `hours`, from rest: a recursive filter of scipy."""
    e = np.exp(-a * hours)
    forced = (1 - e) / a * (g * u + k * v)
    return np.concatenate([[0.0], np.asarray(lfilter([1.0], [1.0, -e], forced[:-1]))])


def recording(seed: int, noise: float = 0.5, count: int = 200, **parameters: float) -> Recording:
    rng = np.random.default_rng(seed)
    time = np.arange(count, dtype=np.float64) * 900.0
    u, v = rng.choice([0.0, 300.0, 900.0], count), rng.normal(0, 2, count)
    y = truth(u, v, 0.25, **parameters) + noise * rng.standard_normal(count)
    return Recording(f"r{seed}", time, {"u": u, "v": v, "y": y})


def campaign(*recordings: Recording) -> Campaign:
    return Campaign("c", CHANNELS, {r.name: r for r in recordings})


def model(**changes: Parameter) -> Model:
    parameters = {"a": Parameter(1.0, "1/h", 0.0), "g": Parameter(0.0), "k": Parameter(0.0)} | changes
    state = State("y", "um", None, Number(0.0), 1.0, 1 / 3600)
    terms = tuple(Term(e, "y", parse(e)) for e in ("-a*y", "g*u", "k*v"))
    return Model("first order", parameters, {"y": state}, terms, {}, "h")


@pytest.mark.parametrize("gain", [0.0, 4e-7, 1.0])
def test_a_gain_that_is_wrong_by_orders_bends_no_room_and_no_rate(gain: float) -> None:
    """Two real heaters, each with an inner mass, in a room that nobody recorded: without the right gain, the
    room takes what the heaters do, and a fit ends there.
    """
    heaters = load_campaign(ROOT / "datasets" / "tclab")
    runs = ["random_both_01", "random_h2_04"]
    room = replace(heaters.channels["T_env"], spread=5.0)

    def unknown(r: Recording) -> dict[str, Array]:
        return {"T_env": np.full(len(r.time[::3]), 22.0)}

    thin = {
        name: replace(r, time=r.time[::3], values={c: v[::3] for c, v in r.values.items()} | unknown(r))
        for name, r in heaters.recordings.items()
        if name in runs
    }
    heaters = replace(heaters, channels={**heaters.channels, "T_env": room}, recordings=thin)
    parameters: dict[str, Parameter] = {}
    states: dict[str, State] = {}
    terms: list[Term] = []
    for k in "12":
        y, core = f"T{k}", f"core{k}"
        rates = {f"loss{k}": 1e-3, f"into{k}": 2e-3, f"back{k}": 4e-4, f"gain{k}": gain}
        parameters |= {name: Parameter(value, "1", 0.0) for name, value in rates.items()}
        states |= {y: State(y), core: State(core, "degC", None, parse("T_env"), 5.0)}
        flows = (f"loss{k}*(T_env - {y})", f"gain{k}*heater{k}", f"into{k}*({core} - {y})")
        terms += [Term(e, y, parse(e)) for e in flows]
        terms.append(Term(core, core, parse(f"back{k}*({y} - {core})")))
    built = Model("two masses", parameters, states, tuple(terms), {})
    right = fit_model(built, heaters, runs, guess={"gain1": 5e-3, "gain2": 2.5e-3})
    assert fit_model(built, heaters, runs).cost == pytest.approx(right.cost, rel=0.02)


def test_intervals_cover_the_truth_19_times_in_20() -> None:
    """150 recordings with noise: 95 % intervals hold the truth in 90 to 98 %, for each parameter."""
    inside = dict.fromkeys(TRUTH, 0)
    runs = 150
    for seed in range(runs):
        r = recording(seed)
        fitted = fit_model(model(a=Parameter(0.6, "1/h", 0.0)), campaign(r), [r.name]).model
        for name, value in TRUTH.items():
            p = fitted.parameters[name]
            assert p.low is not None
            assert p.high is not None
            inside[name] += p.low <= value <= p.high
    for name, count in inside.items():
        assert 0.90 <= count / runs <= 0.98, (name, count)


def test_intervals_follow_the_residual_where_no_noise_is_stated() -> None:
    """Coverage again, the noise estimated from the readings."""
    unstated = {name: replace(channel, noise=None) for name, channel in CHANNELS.items()}
    inside = 0
    for seed in range(100):
        r = recording(seed, noise=1.7)
        p = fit_model(
            model(a=Parameter(0.6, "1/h", 0.0)), Campaign("c", unstated, {r.name: r}), [r.name]
        ).model.parameters["g"]
        assert p.low is not None
        assert p.high is not None
        inside += p.low <= TRUTH["g"] <= p.high
    assert 0.89 <= inside / 100 <= 0.99


def test_two_recordings_are_better_than_one() -> None:
    widths = []
    for names in (["r0"], ["r0", "r1"]):
        p = fit_model(model(), campaign(recording(0), recording(1)), names).model.parameters["a"]
        assert p.low is not None
        assert p.high is not None
        widths.append(p.high - p.low)
    assert widths[1] < 0.85 * widths[0]


def test_outliers_pull_less_with_a_robust_loss() -> None:
    r = recording(3)
    values = dict(r.values)
    values["y"] = values["y"].copy()
    values["y"][[20, 77, 140]] += np.array([125.0, -90.0, 60.0])
    spoiled = campaign(replace(r, values=values))
    clean = fit_model(model(), campaign(r), ["r3"]).model.parameters["a"].value
    found = [
        fit_model(model(), spoiled, ["r3"], loss=loss).model.parameters["a"].value
        for loss in ("linear", "cauchy")
    ]
    assert abs(found[1] - clean) < 0.01
    assert abs(found[1] - clean) < 0.3 * abs(found[0] - clean)


def test_a_fit_that_will_not_come_near_its_goal_ends_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the heat a model cannot reach what the whole one leaves. With a goal in reach, the end is the
    same as without one. One step is enough here to judge: so simple a fit takes few."""
    monkeypatch.setattr("discovery.fitting.solve._SETTLED", 1)
    r = campaign(recording(3))
    poor = replace(model(g=Parameter(0.0, fixed=True)), terms=model().terms[::2])
    whole = fit_model(model(), r, ["r3"])
    free = fit_model(poor, r, ["r3"], noise=whole.noise)
    far, near = (
        fit_model(poor, r, ["r3"], noise=whole.noise, goal=goal) for goal in (whole.cost, 1.01 * free.cost)
    )
    assert far.ended_early
    assert far.cost > 2 * whole.cost
    assert not near.ended_early
    assert near.cost == pytest.approx(free.cost)


def test_bounds_hold() -> None:
    fitted = fit_model(model(g=Parameter(0.005, "1", 0.0, 0.01)), campaign(recording(0)), ["r0"]).model
    assert fitted.parameters["g"].value == pytest.approx(0.01, abs=1e-6)


def test_no_parameter_runs_away_for_ever() -> None:
    """Two bodies that are one would send a conductance to infinity, and the arithmetic with it."""
    start = {"a": Parameter(2.0, "1/h", 0.0), "g": Parameter(-0.02), "k": Parameter(0.0, max=9.0)}
    low, high = make_problem(model(**start), campaign(recording(0)), ["r0"]).bounds
    assert low[:3].tolist() == pytest.approx([0.0, -0.02 * FARTHEST, -np.inf])
    assert high[:3].tolist() == pytest.approx([2.0 * FARTHEST, 0.02 * FARTHEST, 9.0])


def test_a_fixed_parameter_stays() -> None:
    fit = fit_model(model(k=Parameter(-0.5, fixed=True)), campaign(recording(0)), ["r0"])
    assert fit.model.parameters["k"].value == -0.5
    assert fit.model.free == ("a", "g")


def test_what_has_no_effect_is_named() -> None:
    silent = recording(0)
    values = {**silent.values, "v": np.zeros(200)}
    fit = fit_model(model(), campaign(replace(silent, values=values)), ["r0"])
    assert "no effect on any reading, so these recordings cannot determine it: k" in fit.unidentified


def test_two_parameters_that_do_the_same_are_named() -> None:
    twice = model(g2=Parameter(0.01)).with_terms(Term("again", "y", parse("g2*u")))
    fit = fit_model(twice, campaign(recording(0)), ["r0"])
    assert "not separated from other parameters by these recordings: g, g2" in fit.unidentified
    assert fit.model.parameters["g"].value + fit.model.parameters["g2"].value == pytest.approx(0.02, rel=0.05)


def told(theta: list[float], columns: list[list[float]]) -> tuple[Array, list[str]]:
    """Covariance and sentences for `a` (not below 0), `g` and `k` at theta, of a start that plays no part."""
    problem = make_problem(model(), campaign(recording(0)), ["r0"])
    assert [u.name for u in problem.unknowns] == ["a", "g", "k", "y"]
    jacobian = np.column_stack([*columns, [0.0] * 4])
    return covariance_of(problem, jacobian.T @ jacobian, np.array([*theta, 0.0]))


def test_a_number_that_its_interval_drowns_is_named_unless_it_lies_at_its_bound() -> None:
    """Standard errors of 1, 1/2 and 1/4: 1.96 of them are more than the value, or less."""
    columns = [[1.0, 0, 0, 0], [0, 2.0, 0, 0], [0, 0, 4.0, 0]]
    covariance, sentences = told([1.97, -0.99, 0.5], columns)
    assert np.diag(covariance)[:3] == pytest.approx([1.0, 1 / 4, 1 / 16])
    assert sentences == []
    _, sentences = told([1.95, -0.97, 0.48], columns)
    assert sentences == ["not determined (95 % interval wider than the value): a, g, k"]
    _, sentences = told([0.0, 0.0, 0.5], columns)  # nothing is lost at zero, which is where `a` ends
    assert sentences == ["not determined (95 % interval wider than the value): g"]


@pytest.mark.parametrize(("angle", "apart"), [(2e-4, True), (0.5e-4, False), (0.0, False)])
def test_parameters_that_do_nearly_the_same_are_named(angle: float, apart: bool) -> None:
    """Two columns at an angle: the share that is their own is its sine."""
    size = 1e6
    a, g = [size, 0.0, 0, 0], [size * np.cos(angle), size * np.sin(angle), 0, 0]
    covariance, sentences = told([1.0, 1.0, 1.0], [a, g, [0, 0, 9.0, 0]])
    said = "not separated from other parameters by these recordings: a, g"
    assert [text for text in sentences if "separated" in text] == ([] if apart else [said])
    for i in (0, 1):
        own = (size * np.sin(angle)) ** -2.0 if angle else np.inf
        assert covariance[i, i] == pytest.approx(own, rel=1e-2)
    assert covariance[2, 2] == pytest.approx(1 / 81)


def test_a_parameter_of_each_recording() -> None:
    """The load heats more in one recording than in the other; the pole is shared."""
    both = campaign(recording(0, g=0.02), recording(1, g=0.03))
    fitted = fit_model(model(g=Parameter(0.0, per_recording=True)), both, ["r0", "r1"]).model
    assert fitted.parameters["g"].values["r0"] == pytest.approx(0.02, rel=0.03)
    assert fitted.parameters["g"].values["r1"] == pytest.approx(0.03, rel=0.03)
    assert fitted.parameters["a"].value == pytest.approx(0.5, rel=0.03)
    ends = fitted.parameters["g"].intervals
    assert ends["r0"][0] < 0.02 < ends["r0"][1] < ends["r1"][0] < 0.03 < ends["r1"][1]


def test_an_event_of_one_recording_stays_out_of_all_others() -> None:
    """The load heats more in one recording; the others, unseen ones too, keep the common value."""
    more = Parameter(0.0, per_recording=True, values={"r1": 0.001})
    event = model().with_terms(Term("event", "y", parse("more*u")), parameters={"more": more})
    both = campaign(recording(0, g=0.02), recording(1, g=0.03))
    found = fit_model(event, both, ["r0", "r1"]).model.parameters["more"]
    assert found.values["r1"] == pytest.approx(0.01, rel=0.1)
    assert found.at("r0") == found.at("unseen") == 0.0


def test_start_values_are_found_within_their_spread() -> None:
    r = recording(0, noise=0.05)
    shifted = replace(r, values={**r.values, "y": r.values["y"] + 1.5 * np.exp(-0.5 * r.time / 3600)})
    known = Campaign("c", {**CHANNELS, "y": replace(CHANNELS["y"], noise=0.05)}, {"r0": shifted})
    fit = fit_model(model(), known, ["r0"])
    start = fit.theta[[u.is_start for u in fit.problem.unknowns]]
    assert start[0] == pytest.approx(1.5, abs=0.1)
    exact = replace(model(), states={"y": replace(model().states["y"], start_sd=0.0)})
    assert not any(u.is_start for u in fit_model(exact, known, ["r0"]).problem.unknowns)


def test_a_prediction_uses_the_first_reading_and_no_later_one() -> None:
    r = recording(0)
    fitted = fit_model(model(), campaign(r), ["r0"]).model
    spoiled = replace(
        r, values={**r.values, "y": np.concatenate([r.values["y"][:1], r.values["y"][1:] * 0 + 999.0])}
    )
    a, b = (predict_recording(fitted, campaign(one), "r0", ["y"], [0.5]) for one in (r, spoiled))
    assert np.array_equal(a.x, b.x)
    moved = replace(r, values={**r.values, "y": np.concatenate([r.values["y"][:1] + 1.0, r.values["y"][1:]])})
    assert predict_recording(fitted, campaign(moved), "r0", ["y"], [0.5]).x[0, 0] > a.x[0, 0] + 0.5


def test_a_recording_without_readings_runs_from_its_declared_start() -> None:
    blind = recording(0)
    blind = replace(blind, values={**blind.values, "y": np.full(200, np.nan)})
    found = predict_recording(model().with_values(TRUTH), campaign(blind), "r0", ["y"])
    exact = truth(blind.values["u"], blind.values["v"], 0.25)
    assert np.interp(blind.time, found.system.grid.time, found.x[:, 0]) == pytest.approx(
        exact.tolist(), abs=1e-6
    )


@pytest.mark.parametrize("a", [0.5, 4.0])
def test_start_values_alone_are_near(a: float) -> None:
    """Time constants of 2 h and 15 min within a step of the grid; what they settle at, within a fifth."""
    data = recording(0, noise=0.01, a=a, g=0.04 * a, k=-1.6 * a)
    begun = warm_start(reduced(["u", "v"], ["y"], CHANNELS), campaign(data), ["r0"], ["y"])
    p = {name: parameter.value for name, parameter in begun.parameters.items()}
    assert -1.5 * a < p["p1_y"] < -a / 1.5
    assert [p["p2_y"] / -p["p1_y"], p["p3_y"] / -p["p1_y"]] == pytest.approx([0.04, -1.6], rel=0.2)


def test_start_values_come_from_the_recordings_that_hold_the_error() -> None:
    one, blind = recording(0), recording(1)
    blind = replace(blind, values={n: series for n, series in blind.values.items() if n != "y"})
    nothing = reduced(["u", "v"], ["y"], CHANNELS)
    alone = warm_start(nothing, campaign(one), ["r0"], ["y"])
    both = warm_start(nothing, campaign(one, blind), ["r0", "r1"], ["y"])
    for name, parameter in alone.parameters.items():
        assert both.parameters[name].value == pytest.approx(parameter.value, rel=1e-4)


def test_a_start_that_a_formula_sets_moves_with_its_parameters() -> None:
    """A body begins settled at P/hA above the room. However far the first guess of hA was off, fit and free
    run begin at the same place, and the spread of the start is around that place, not around the guess.
    """
    time, power, hA, C = np.arange(0.0, 4 * 3600.0 + 1, 60.0), 100.0, 4.0, 30e3
    after = np.where(time < 7200, power, 0.0)
    y = power / hA * np.where(time < 7200, 1.0, np.exp(-hA / C * (time - 7200)))
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "T": Channel("T", "temperature", "degC", 0.01, "linear"),
    }
    campaign = Campaign("c", channels, {"r": Recording("r", time, {"P": after, "T": 20.0 + y})})
    terms = (Term("heat", "T", parse("P")), Term("air", "T", parse("hA*(20 - T)")))
    states = {"T": State("T", "degC", C, parse("20 + P/hA"), 0.05, 1 / C)}
    fit = fit_model(Model("m", {"hA": Parameter(9.0, "W/K", 0.0)}, states, terms, {}), campaign, ["r"])
    assert fit.model.parameters["hA"].value == pytest.approx(hA, rel=1e-3)
    assert np.abs(fit.theta[[u.is_start for u in fit.problem.unknowns]]).max() < 0.01
    free = predict_recording(fit.model, campaign, "r", ("T",), (0.01,))
    np.testing.assert_allclose(free.x[:, 0], fit.trajectories[0].x[:, 0], atol=0.01)
    np.testing.assert_allclose(free.x[:, 0], 20 + y, atol=0.02)


@pytest.mark.parametrize(("every", "least"), [(1, 1.0), (8, 0.01)], ids=["white noise", "interpolated"])
def test_a_noise_that_is_not_stated_begins_with_how_rough_readings_are(
    every: int, least: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Start values are far off (rms of 40 noises), and yet outputs weigh from the first step as in the end; a
    logger that draws lines between every eighth reading leaves no roughness.
    """
    r = recording(5, noise=1.7)
    y, k = r.values["y"], np.arange(len(r.time))
    logged = replace(r, values={**r.values, "y": np.interp(k, k[::every], y[::every])})
    unstated = {name: replace(channel, noise=None) for name, channel in CHANNELS.items()}
    begun: list[float] = []

    def noted(*args: Any, **options: Any) -> Solution:
        begun.append(args[2].white[0])
        return solve(*args, **options)

    monkeypatch.setattr("discovery.fitting.fit.solve", noted)
    fit = fit_model(model(a=Parameter(0.05)), Campaign("c", unstated, {"r5": logged}), ["r5"])
    expected = 1.7 if every == 1 else least * float(np.std(logged.values["y"]))
    assert begun[0] == pytest.approx(expected, rel=0.35 if every == 1 else 1e-9)
    assert begun[-1] == pytest.approx(fit.noise.white[0], rel=0.03)
    assert float(np.std(fit.residuals()["r5"])) == pytest.approx(fit.noise.white[0], rel=0.03)


def test_sensitivities_whose_squares_overflow_are_told_by_the_normal_equations_alone() -> None:
    """A model that is nearly unstable: pytest turns a warning into an error."""
    gram, _ = _normal([([0], np.full((2, 1), 1e200))], np.ones(2), 1, "linear")
    assert np.isinf(gram).all()
