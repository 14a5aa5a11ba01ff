"""Sensitivities against differences: linear and nonlinear terms, lag, delay, play, start values, candidate
terms.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.dynamics import (
    Column,
    System,
    make_grid,
    make_system,
    predict,
    sensitivities,
    simulate,
    start_values,
)
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, evaluate, parse

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    """Six hours of a smooth temperature and a switched heat every 20 s, a reading every 10 minutes."""
    time = np.arange(0.0, 6 * 3600.0 + 1, 20.0)
    rng = np.random.default_rng(2)
    heat = rng.choice([0.0, 100.0, 300.0], 13)[(time / 1800).astype(int)]
    values = {
        "T": 22 + 3 * np.sin(time / 4000),
        "P": heat,
        "y": np.where(np.arange(len(time)) % 30 == 0, 0.0, np.nan),
    }
    channels = {
        "T": Channel("T", "ambient temperature", "degC", None, "linear"),
        "P": Channel("P", "heat load", "W", None, "held"),
        "y": Channel("y", "error", "um", None, "linear"),
    }
    return Campaign("six hours", channels, {"r": Recording("r", time, values)})


def two_bodies(expression: str, output: str, **parameters: float) -> Model:
    """Two linked bodies, one heated; `expression` is a further heat flow into the first."""
    given = {"G": 20.0, "hA": 6.0, "loss": 0.6} | parameters
    states = {
        "a": State("a", "degC", 40e3, parse("T"), 0.5, 1 / 40e3),
        "b": State("b", "degC", 90e3, parse("T"), 0.5, 1 / 90e3),
    }
    terms = (
        Term("link", "a", parse("G*(b - a)"), "b"),
        Term("air", "b", parse("hA*(T - b)")),
        Term("drive", "a", parse("loss*P")),
        Term("extra", "a", parse(expression)),
    )
    return Model("two", {k: Parameter(v) for k, v in given.items()}, states, terms, {"y": parse(output)})


def together(model: Model, part: float) -> Model:
    """The model whose body b begins off its start with a."""
    states = dict(model.states)
    states["b"] = replace(states["b"], start_with={"a": part})
    return replace(model, states=states)


CASES = {
    "linear": two_bodies("k*(T - a)", "2*a + b", k=5.0),
    "bodies that are warm together": together(two_bodies("k*(T - a)", "2*a + b", k=5.0), 0.7),
    "lag and bodies that are warm together": together(
        two_bodies("k*(lag(a, tau) - a)", "a", k=9.0, tau=900.0), 2.0
    ),
    "bilinear": two_bodies("k*P*(T - a)", "a*b/20", k=0.02),
    "natural convection": two_bodies("k*(abs(T - a) + 0.01)**m*(T - a)", "a", k=3.0, m=0.25),
    "radiation": two_bodies("-eps*5.67e-8*((a + 273.15)**4 - (T + 273.15)**4)", "a", eps=2.0),
    "saturation": two_bodies("k*tanh((T - a)/w)", "a", k=50.0, w=4.0),
    "viscosity": two_bodies("k*P*exp(-c*(a - 22))", "a", k=0.3, c=0.03),
    "lag of an input": two_bodies("k*lag(P, tau)", "a", k=0.5, tau=1500.0),
    "lag of a state": two_bodies("k*(lag(a, tau) - a)", "a", k=15.0, tau=3000.0),
    "delay of a straight input": two_bodies("k*(delay(T, d) - a)", "a", k=15.0, d=1230.0),
    "delay of a held input": two_bodies("k*delay(P, d)", "a", k=0.5, d=1230.0),
    "output with a parameter": two_bodies("k*(T - a)", "c*a + lag(b, tau)", k=5.0, c=1.7, tau=2000.0),
    "play of an input": two_bodies("k*(play(T, w) - a)", "a", k=5.0, w=0.4),
}


def run(system: System, values: dict[str, float], start: Array) -> Array:
    return predict(simulate(system, values, start))[:, 0]


@pytest.mark.parametrize("name", CASES)
def test_parameters_and_starts(name: str, campaign: Campaign) -> None:
    model = CASES[name]
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    values = model.values()
    start = start_values(system, values)
    free = list(values)
    moving = ["a", "b", *(s for s in system.states if system.model.states[s].memory)]
    found = sensitivities(simulate(system, values, start), free, moving)[:, 0, :]
    for k, parameter in enumerate(free):
        step = 1e-3 * abs(values[parameter]) if parameter != "d" else 20.0  # a delay moves by whole samples
        up = run(system, values | {parameter: values[parameter] + step}, start)
        down = run(system, values | {parameter: values[parameter] - step}, start)
        assert _alike(found[:, k], (up - down) / (2 * step))
    for k, state in enumerate(moving):
        up, down = (run(system, values, start_values(system, values, {state: by})) for by in (1e-3, -1e-3))
        assert _alike(found[:, len(free) + k], (up - down) / 2e-3)


@pytest.mark.parametrize("flow", ["(k + d*time/21600)*(T - a)", "k*(T - a)"])
def test_a_parameter_that_changes_bit_by_bit(flow: str, campaign: Campaign) -> None:
    """As one in front of the share of time that has passed, in a flow and in an output."""
    where, wanted = ("2*a + b", "k") if "d" in flow else ("(c + d*time/21600)*a", "c")
    model = two_bodies(flow, where, k=5.0, d=0.0, **({} if wanted == "k" else {"c": 2.0}))
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    at = simulate(system, model.values(), start_values(system, model.values()))
    grown = sensitivities(at, [wanted], grown=system.grid.time / 21600.0)
    assert _alike(grown[:, 0, 0], sensitivities(at, ["d"])[:, 0, 0])
    assert not _alike(grown[:, 0, 0], sensitivities(at, [wanted])[:, 0, 0])


def _alike(found: Array, expected: Array) -> bool:
    """Within 1 % of the largest."""
    return bool(np.max(np.abs(found - expected)) < 0.01 * np.max(np.abs(expected)) + 1e-9)


@pytest.mark.parametrize("candidate", ["T - a", "P*(T - a)", "abs(b - a)*(b - a)", "(a + 273.15)**4/1e8"])
def test_a_candidate_column_is_the_slope_at_zero_of_a_model_with_that_term(
    candidate: str, campaign: Campaign
) -> None:
    base = CASES["natural convection"]
    grown = base.with_terms(
        Term("new", "b", parse(f"theta*({candidate})"), "a"), parameters={"theta": Parameter(0.0)}
    )
    system = make_system(base, make_grid(campaign, "r", base.inputs, ["y"]))
    trajectory = simulate(system, base.values())
    series = evaluate(parse(candidate), trajectory.at_ends(), memory=system.ends).value
    column = sensitivities(trajectory, (), (), [Column(0, "b", np.asarray(series), "a")])[:, 0, 0]
    larger = make_system(grown, make_grid(campaign, "r", grown.inputs, ["y"]))
    step = 1e-3 / float(np.max(np.abs(series)))
    start = start_values(larger, grown.values())
    up, down = (run(larger, grown.values() | {"theta": sign * step}, start) for sign in (1.0, -1.0))
    assert _alike(column, (up - down) / (2 * step))


def test_the_width_of_a_play_behind_a_body(campaign: Campaign) -> None:
    model = two_bodies("0*a", "play(a, w)", w=0.4)
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    values, start = model.values(), start_values(system, model.values())
    found = sensitivities(simulate(system, values, start), ["w"])[:, 0, 0]
    assert _alike(
        found, (run(system, values | {"w": 0.41}, start) - run(system, values | {"w": 0.39}, start)) / 0.02
    )


def test_a_play_begins_where_its_body_does(campaign: Campaign) -> None:
    """Else the first reading, which zeroes a free run, says nothing of the start of a body in its seat."""
    model = two_bodies("0*a", "play(a, w)", w=0.4)
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    values = model.values()
    found = sensitivities(simulate(system, values, start_values(system, values)), (), ["a"])[:, 0, 0]
    up, down = (run(system, values, start_values(system, values, {"a": by})) for by in (1e-3, -1e-3))
    slope = (up - down) / 2e-3
    assert slope[0] == pytest.approx(1.0)
    assert found[0] == pytest.approx(1.0)


def test_what_leaves_one_body_enters_the_other(campaign: Campaign) -> None:
    """Without losses the heat in both bodies is the heat that came in, exactly."""
    model = two_bodies("0*a", "40e3*(a - 22) + 90e3*(b - 22)", hA=0.0)
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    data = campaign.recordings["r"]
    stored = run(system, model.values(), np.array([22.0, 22.0]))
    came = np.concatenate([[0.0], np.cumsum(0.6 * data.values["P"][:-1] * np.diff(data.time))])
    assert np.allclose(stored, came[np.isfinite(data.values["y"])], rtol=1e-10, atol=1e-3)


def test_a_runaway_model_is_a_sentence(campaign: Campaign) -> None:
    from discovery.errors import UserError

    model = two_bodies("k*(a - T)**3", "a", k=1e6)
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    with pytest.raises(UserError, match=r"diverges on recording 'r'; check signs"):
        simulate(system, model.values())


def test_a_power_of_a_value_below_zero_is_a_sentence(campaign: Campaign) -> None:
    from discovery.errors import UserError

    model = two_bodies("k*(-P - 1.0)**1.5", "a", k=1.0)
    system = make_system(model, make_grid(campaign, "r", model.inputs, ["y"]))
    with pytest.raises(UserError, match=r"its term '.*' is not a number at 0 s: a power, root"):
        simulate(system, model.values())
