"""Free runs over the kink of a threshold do not depend on where Newton's method begins."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.dynamics import make_grid, make_system, simulate, trajectory
from discovery.dynamics.system import System
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
TIME = np.arange(0.0, 1001.0, 4.0)
U = np.where((TIME // 200) % 2 == 0, 4.0, 1.0)


def overflowing(inflow: float, over: float, level: float) -> System:
    """A level that an input raises and that flows over an edge."""
    channels = {
        "u": Channel("u", "heat load", "W", None, "held"),
        "y": Channel("y", "temperature", "degC", None, "linear"),
    }
    recording = Recording("r", TIME, {"u": U, "y": np.zeros(len(TIME))})
    values = {"a": inflow, "k": over, "l": level}
    terms = (Term("in", "y", parse("a*u - 0.002*y")), Term("over", "y", parse("-k*max(y - l, 0)")))
    states = {"y": State("y", "degC", None, parse("0"), 0.0)}
    model = Model("m", {name: Parameter(value) for name, value in values.items()}, states, terms, {})
    return make_system(model, make_grid(Campaign("c", channels, {"r": recording}), "r", ["u"], ["y"]))


@pytest.mark.parametrize(("before", "after"), [(0.01, 0.1), (0.05, 0.02)])
@pytest.mark.parametrize(("over", "level"), [(0.05, 2.0), (0.3, 1.0), (1.0, 4.0)])
def test_a_run_close_by_leads_to_the_same_trajectory(
    before: float, after: float, over: float, level: float
) -> None:
    near, system = overflowing(before, over, level), overflowing(after, over, level)
    values = system.model.values()
    alone = simulate(system, values).x
    np.testing.assert_allclose(
        simulate(system, values, near=simulate(near, near.model.values())).x, alone, atol=5e-5
    )
    exact = [0.0]
    for begin, end, u in zip(TIME, TIME[1:], U, strict=False):

        def rate(_: float, y: Array, u: float = u) -> Array:
            return np.array([after * u - 0.002 * y[0] - over * max(y[0] - level, 0.0)])

        exact.append(solve_ivp(rate, (begin, end), exact[-1:], rtol=1e-8).y[0, -1])
    np.testing.assert_allclose(alone[:, 0], exact, atol=0.1 * max(exact))  # in steps of 4 s over the edge


def test_a_law_with_an_unbounded_slope_is_run_in_few_linearisations(monkeypatch: pytest.MonkeyPatch) -> None:
    """Free convection at a body that passes the temperature of the air again and again: at zero the slope of
    |T|^0.28 has no bound, and Newton's method does not settle there.
    """
    channels = {
        "u": Channel("u", "heat load", "W", None, "linear"),
        "y": Channel("y", "temperature", "degC", None, "linear"),
    }
    time = np.arange(0.0, 259200.0, 60.0)
    walk = np.cumsum(np.random.default_rng(0).standard_normal(len(time)))
    air = 0.3 * walk + 15.0 * np.sin(time / 9000.0)
    recording = Recording("r", time, {"u": air, "y": np.zeros(len(time))})
    states = {name: State(name, "degC", None, parse("0"), 0.0) for name in ("y", "z")}
    flows = {
        "c*(abs((u - y)/5)**n - 1)*(u - y) + c*(u - y)": "y",
        "0.05*(y - z)": "z",
        "0.0005*(z - y)": "y",
        "1e-5*abs(u)": "y",
    }
    terms = tuple(Term(flow, into, parse(flow)) for flow, into in flows.items())
    model = Model("m", {"c": Parameter(0.0105), "n": Parameter(0.28)}, states, terms, {})
    system = make_system(model, make_grid(Campaign("c", channels, {"r": recording}), "r", ["u"], ["y"]))
    made = 0
    linearise = trajectory._linearise

    def counted(*args: Any) -> Any:
        nonlocal made
        made += 1
        return linearise(*args)

    monkeypatch.setattr(trajectory, "_linearise", counted)
    found = simulate(system, model.values()).x
    assert made < 15

    def rate(t: float, x: Array) -> Array:
        to_air = np.interp(t, time, air) - x[0]
        flow = 0.0105 * abs(to_air / 5) ** 0.28 * to_air
        load = 1e-5 * abs(np.interp(t, time, air))
        return np.array([flow + load + 0.0005 * (x[1] - x[0]), 0.05 * (x[0] - x[1])])

    exact = solve_ivp(rate, (0.0, time[-1]), [0.0, 0.0], t_eval=time, max_step=60.0, rtol=1e-6).y.T
    assert np.max(np.abs(found - exact)) < 0.05
