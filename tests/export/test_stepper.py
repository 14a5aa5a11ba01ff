"""The fixed step against closed forms, scipy and `discovery.dynamics`."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm
from scipy.optimize import fsolve

from discovery.errors import UserError
from discovery.export.agreement import agreement
from discovery.export.compiled import compile_model
from discovery.export.stepper import Stepper
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign
from discovery.terms import Term, parse


def _chain(gain: float) -> Model:
    """Three coupled rates; `gain` makes them stiff."""
    states = {name: State(name, "um", None, parse(0.0), 0.0, 1.0) for name in "pqr"}
    terms = (
        Term("1", "p", parse("g*(q - p) + u")),
        Term("2", "q", parse("0.1*(p - q) - 0.02*q")),
        Term("3", "r", parse("q - 0.5*r + 2*u")),
    )
    return Model("chain", {"g": Parameter(gain)}, states, terms, {"y": parse("p + 2*q - r")})


@pytest.mark.parametrize("gain", [0.001, 0.3, 20.0])
def test_linear_models_are_exact_however_stiff(gain: float) -> None:
    h, u = 10.0, np.random.default_rng(2).normal(size=(50, 1))
    a = np.array([[-gain, gain, 0.0], [0.1, -0.12, 0.0], [0.0, 1.0, -0.5]])
    block = np.zeros((4, 4))
    block[:3, :3], block[:3, 3] = a, [1.0, 0.0, 2.0]
    step = expm(block * h)
    stepper, x = Stepper(compile_model(_chain(gain), h)), np.zeros(3)
    stepper.start(u[0])
    for row in u:
        x = step[:3, :3] @ x + step[:3, 3] * row[0]
        y = stepper.step(row)
        assert y is not None
        np.testing.assert_allclose(stepper.x, x, rtol=1e-11, atol=1e-11)
        assert y[0] == pytest.approx(x[0] + 2 * x[1] - x[2], abs=1e-10)


def _tunnel(law: str, sky: str = "5.67e-8*((air + 273.15)**4 - (deep + 273.15)**4)") -> Model:
    """Two layers that nobody reads, between a body that begins where the canopy is and a cellar."""
    states = {
        "top": State("top", "degC", 2e4, parse("canopy"), 0.0, 5e-5),
        "mid": State("mid", "degC", 9e4, None, None, 1 / 9e4),
        "deep": State("deep", "degC", 3e5, None, None, 1 / 3e5),
        "sum": State("sum", "degC", None, None, None, 1.0),
    }
    terms = (
        Term("down", "mid", parse("G*(top - mid)"), "top"),
        Term("deeper", "deep", parse(f"{law}*(mid - deep)"), "mid"),
        Term("cellar", "deep", parse("2*(11 - deep)")),
        Term("sky", "deep", parse(sky)),
        Term("all that came", "sum", parse("air")),
    )
    return Model("tunnel", {"G": Parameter(6.0)}, states, terms, {"y": parse("deep - top")})


@pytest.mark.parametrize("law", ["3", "3*abs(mid - deep + 0.1)**0.25"])
def test_what_nobody_reads_begins_in_the_balance_of_its_terms(law: str) -> None:
    """Against the root of scipy; what has no balance, an integral, begins at zero."""
    stepper = Stepper(compile_model(_tunnel(law), 10.0))
    assert stepper.compiled.inputs == ("air", "canopy")
    stepper.start(np.array([4.0, 31.0]))

    def net(x: np.ndarray) -> list[float]:
        mid, deep = x
        down = (3.0 if law == "3" else 3.0 * abs(mid - deep + 0.1) ** 0.25) * (mid - deep)
        sky = 5.67e-8 * (277.15**4 - (deep + 273.15) ** 4)
        return [6.0 * (31.0 - mid) - down, down + 2.0 * (11.0 - deep) + sky]

    mid, deep = fsolve(net, [20.0, 15.0], xtol=1e-13)
    np.testing.assert_allclose(stepper.x, [31.0, mid, deep, 0.0], rtol=1e-9)


def test_nonlinear_terms_converge_with_second_order() -> None:
    model = Model(
        "radiating",
        {},
        {"T": State("T", "degC", 1e4, parse("80"), 0.0, 1e-4)},
        (Term("r", "T", parse("1.5*(u - T) + 5.67e-8*((u + 273.15)**4 - (T + 273.15)**4)")),),
        {"T": parse("T")},
    )

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        return 1e-4 * (1.5 * (20 - x) + 5.67e-8 * (293.15**4 - (x + 273.15) ** 4))

    truth = solve_ivp(rate, (0, 7200), [80.0], rtol=1e-11, atol=1e-11).y[0, -1]
    errors = []
    for h in (120.0, 60.0, 30.0):
        stepper = Stepper(compile_model(model, h))
        stepper.start(np.array([20.0]))
        errors.append(abs(stepper.run(np.full((round(7200 / h), 1), 20.0))[-1, 0] - truth))
    assert errors[0] < 5e-3
    assert 3.3 < errors[0] / errors[1] < 4.7
    assert 3.3 < errors[1] / errors[2] < 4.7


def test_agrees_with_the_dynamics_that_fitted_the_model(model: Model, campaign: Campaign) -> None:
    found = agreement(model, campaign, "fit", 10.0)
    assert max(found["integrator"].values()) < 2e-3
    assert max(found["held_inputs"].values()) < 0.05


def test_a_delay_is_exact_for_held_inputs_and_holds_before_the_start() -> None:
    model = Model(
        "late", {}, {"x": State("x", "um", None, parse(0.0), 0.0, 1.0)}, (), {"y": parse("delay(u, 25)")}
    )
    stepper = Stepper(compile_model(model, 10.0))
    u = np.array([3.0, 5.0, 9.0, 1.0, 4.0, 4.0])[:, None]
    stepper.start(u[0])
    # u(t - 25 s) averaged over each step: half of the one 2 steps before, half of the one 3 before
    assert stepper.run(u)[:, 0].tolist() == [3.0, 3.0, 3.0, 4.0, 7.0, 5.0]


def test_a_play_follows_only_beyond_its_width() -> None:
    model = Model(
        "joint", {}, {"x": State("x", "um", None, parse("u"), 0.0, 1.0)}, (), {"y": parse("play(u, 1)")}
    )
    stepper = Stepper(compile_model(model, 1.0))
    u = np.array([0.0, 0.5, 3.0, 2.5, 1.5, 0.0, 0.2])[:, None]
    stepper.start(u[0])
    assert stepper.run(u)[:, 0].tolist() == [0.0, 0.0, 2.0, 2.0, 2.0, 1.0, 1.0]


def test_a_step_that_is_not_finite_changes_nothing() -> None:
    model = Model(
        "fragile",
        {},
        {"x": State("x", "um", None, parse(1.0), 0.0, 1.0)},
        (Term("t", "x", parse("log(u)")),),
        {"y": parse("x")},
    )
    stepper = Stepper(compile_model(model, 1.0))
    stepper.start(np.array([1.0]))
    before = stepper.snapshot()
    assert stepper.step(np.array([-1.0])) is None
    assert stepper.step(np.array([np.nan])) is None
    assert stepper.step(np.array([np.inf])) is None
    assert stepper.x == before.x
    assert stepper.count == before.count
    y = stepper.step(np.array([math.e]))
    assert y is not None
    assert y[0] == pytest.approx(2.0)


def test_a_snapshot_continues_bit_for_bit(model: Model) -> None:
    compiled = compile_model(model, 10.0)
    rng = np.random.default_rng(3)
    u = rng.uniform([0, 20, 20, 0, 0], [900, 24, 30, 1, 900], size=(400, 5))
    assert compiled.inputs == ("P_drive", "T_env", "T_fluid", "pump", "speed")
    stepper = Stepper(compiled)
    stepper.start(u[0])
    stepper.run(u[:200])
    kept = stepper.snapshot()
    first = stepper.run(u[200:])
    other = Stepper(compiled)
    other.restore(kept)
    assert np.array_equal(other.run(u[200:]), first)


@pytest.mark.parametrize("seconds", ["u", "x", "-5", "1e9"])
def test_a_delay_that_no_controller_can_keep_is_refused(seconds: str) -> None:
    states = {"x": State("x", "um", None, parse(0.0), 0.0, 1.0)}
    model = Model("late", {}, states, (), {"y": parse(f"delay(u, {seconds})")})
    with pytest.raises(UserError, match="delay of u"):
        compile_model(model, 10.0)
