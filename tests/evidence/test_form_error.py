"""Form errors of places: an output sees a place of a body, which answers before the whole body does."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.dynamics import Trajectory, make_grid, make_system, predict, sensitivities, simulate
from discovery.effects.catalogue import Effect, catalogue
from discovery.evidence.form_error import (
    INNER,
    air_columns,
    effect_form,
    inner_columns,
    inside_columns,
    place_columns,
)
from discovery.evidence.whitening import Whitened
from discovery.fitting import Noise, fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.effects.sample import expand, inside, machine_for, trajectory

Array = NDArray[np.float64]

C, HA, POWER, ON = 50e3, 10.0, 200.0, 7200.0  # J/K, W/K, W, s
TIME = np.arange(0.0, 57601.0, 60.0)


@pytest.fixture(scope="module")
def run() -> Trajectory:
    """One body that a step of power warms, seen with 3 um/K."""
    return warmed(y="3*(T - 20)")


def warmed(**shown: str) -> Trajectory:
    """One body that a step of power warms, and what is shown of it."""
    errors = {name: Channel(name, "error", "um", None, "linear") for name in shown}
    channels = {**errors, "u": Channel("u", "heat load", "W", None, "held")}
    values = dict.fromkeys(shown, np.zeros(len(TIME))) | {"u": np.where(TIME >= ON, POWER, 0.0)}
    state = State("T", "degC", C, parse("20"), 0.0, 1 / C)
    terms = (Term("load", "T", parse("u")), Term("air", "T", parse("hA*(20 - T)")))
    outputs = {name: parse(formula) for name, formula in shown.items()}
    model = Model("one", {"hA": Parameter(HA)}, {"T": state}, terms, outputs)
    campaign = Campaign("c", channels, {"r": Recording("r", TIME, values)})
    return simulate(make_system(model, make_grid(campaign, "r", ["u"], tuple(shown))), model.values())


@pytest.mark.parametrize(("form", "edge"), [(0.0, 0.3), (0.2, 0.0), (0.2, 0.3)])
def test_a_level_is_the_restricted_likelihood_with_form_errors_of_a_share(form: float, edge: float) -> None:
    """Dense covariance: w^2 I + form^2 L L' + edge^2 P P', with the gain of the model integrated out
    (Patterson and Thompson, Biometrika 58 (1971) 545), less that without form errors.
    """
    rng = np.random.default_rng(3)
    x, laws, places = np.sin(TIME[::40] / 9000), rng.normal(size=(25, 2)), rng.normal(size=(25, 1))
    read = 2.0 * x + rng.normal(0, 0.5, 25) + laws @ [0.4, -0.3]
    kinds = {"u": ("heat load", "W", None), "y": ("error", "um", 0.5)}
    channels = {name: Channel(name, *kind, "linear") for name, kind in kinds.items()}
    campaign = Campaign("c", channels, {"r": Recording("r", TIME[::40], {"u": x, "y": read})})
    model = Model("gain", {"g": Parameter(1.0)}, {}, (), {"y": parse("g*u")})
    fit = fit_model(model, campaign, ["r"], ["y"])
    both = np.concatenate([laws, places], axis=1)
    seen = Whitened(fit, 1, (both[:, None, :],), np.ones(3), (2, 1))
    off, exact = Noise(("y",), (0.5,), form=form, edge=edge), Noise(("y",), (0.5,))

    def restricted(f: float, e: float) -> float:
        covariance = 0.25 * np.eye(25) + f**2 * laws @ laws.T + e**2 * places @ places.T
        inverse = np.linalg.inv(covariance)
        information = float(x @ inverse @ x)
        left = read @ inverse @ read - (x @ inverse @ read) ** 2 / information
        return -0.5 * float(np.linalg.slogdet(covariance)[1] + np.log(information) + left)

    more = seen.grams(off).level() - seen.grams(exact).level()
    assert more == pytest.approx(restricted(form, edge) - restricted(0.0, 0.0), abs=1e-6)


def test_warmer_air_at_one_body_warms_it_alone() -> None:
    """Closed form: 1 - exp(-t hA/C) where the air is warmer by one than measured, and nothing elsewhere."""
    losses = {"roof": 10.0, "floor": 4.0}
    errors = {f"E_{name}": Channel(f"E_{name}", "error", "um", None, "linear") for name in losses}
    channels = {**errors, "room": Channel("room", "ambient temperature", "degC", None, "linear")}
    values = dict.fromkeys(errors, np.zeros(len(TIME))) | {"room": 20.0 + np.sin(TIME / 5000.0)}
    states = {name: State(name, "degC", C, parse("20"), 0.0, 1 / C) for name in losses}
    terms = tuple(Term("air", name, parse(f"h_{name}*(room - {name})")) for name in losses)
    outputs = {f"E_{name}": parse(name) for name in losses}
    model = Model("hall", {f"h_{n}": Parameter(h) for n, h in losses.items()}, states, terms, outputs)
    campaign = Campaign("c", channels, {"r": Recording("r", TIME, values)})
    run = simulate(make_system(model, make_grid(campaign, "r", ["room"], tuple(errors))), model.values())
    found = air_columns(run, ["room", "a hall that the model does not know"])
    assert found.shape == (len(TIME), 2, 2)
    for k, loss in enumerate(losses.values()):
        assert found[:, k, k] == pytest.approx(1 - np.exp(-TIME * loss / C), abs=1e-9)
        assert not found[:, 1 - k, k].any()


def test_a_place_rises_as_much_as_its_body_in_a_part_of_its_time(run: Trajectory) -> None:
    """Closed form: 3 um/K times a third of P/hA, with a part of the time constant C/hA."""
    found = inner_columns(run)[:, 0, : len(INNER)]
    since = np.maximum(TIME - ON, 0.0)
    for column, part in zip(found.T, INNER, strict=True):
        assert column == pytest.approx(POWER / HA * (1 - np.exp(-since * HA / (part * C))), abs=1e-6)


def test_a_thermometer_sees_a_place_of_a_body_that_also_bends_the_machine() -> None:
    """A body that only its own thermometer shows is the place where this one sits."""
    assert inner_columns(warmed(sensor="T")).shape[2] == 0
    places = inner_columns(warmed(y="3*(T - 20)", sensor="T"))
    assert places.shape[2] == 2 * 2 * len(INNER)  # two flows, two outputs
    alone = inner_columns(warmed(y="3*(T - 20)"))
    seen = [m for m in range(places.shape[2]) if places[:, 1, m].any()]
    assert 3 * places[:, 1, seen] == pytest.approx(alone[:, 0])


def test_an_inside_follows_as_a_second_mass_does(run: Trajectory) -> None:
    """`solve_ivp` with a millionth of the mass C_m behind the surface: t_m = part C/hA, C_m t_m = C t/3."""
    found = inside_columns(run)[:, 0]
    assert found.shape[1] == len(INNER)
    for column, part in zip(found.T, INNER, strict=True):
        late, share = part * C / HA, 1e-6
        mass = share * C / (3 * part)

        def rates(t: float, x: Array, late: float = late, mass: float = mass) -> Array:
            behind = (x[1] - x[0]) / late
            return np.array([(POWER * (t >= ON) + mass * behind - HA * x[0]) / C, -behind])

        # the change by a step of heat, from the step on
        since = TIME[TIME >= ON]
        seen = solve_ivp(rates, (ON, since[-1]), [0.0, 0.0], t_eval=since, rtol=1e-11, atol=1e-11).y[0]
        alone = POWER / HA * (1 - np.exp(-(since - ON) * HA / C))
        expected = 3 * (seen - alone) / share
        assert column[TIME >= ON] == pytest.approx(expected, abs=2e-3 * np.abs(expected).max())


def test_an_inside_and_places_explain_a_bar_of_two_cells_that_a_thermometer_sees() -> None:
    """The front cell is heated, and its thermometer alone is seen: no place of an output is left."""
    run = warmed(sensor="T")
    link = 160.0  # W/K, a Biot number of some 0.1

    def rates(t: float, x: Array) -> Array:
        along = link * (x[1] - x[0])
        heat = POWER if t >= ON else 0.0
        return np.array([(heat + along - HA / 2 * x[0]) / (C / 2), (-along - HA / 2 * x[1]) / (C / 2)])

    bar = solve_ivp(rates, (0.0, TIME[-1]), [0.0, 0.0], t_eval=TIME, max_step=60.0, rtol=1e-8).y
    fitted = sensitivities(run, ("hA",))[:, 0]
    left = bar[0] - (predict(run)[:, 0] - 20)
    left -= fitted @ np.linalg.lstsq(fitted, left, rcond=None)[0]
    columns = np.concatenate([place_columns(run)[:, 0], fitted], axis=1)
    rest = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    assert np.std(left) > 0.05
    assert np.std(rest) < 0.3 * np.std(left)


def test_places_explain_what_lumping_a_bar_of_two_cells_leaves(run: Trajectory) -> None:
    """The front cell is heated and seen; the model has one body of both. It has no neighbour, so no edge."""

    def rates(t: float, x: Array) -> Array:
        link = 40.0 * (x[1] - x[0])
        heat = POWER if t >= ON else 0.0
        return np.array([(heat + link - HA / 2 * x[0]) / (C / 2), (-link - HA / 2 * x[1]) / (C / 2)])

    bar = solve_ivp(rates, (0.0, TIME[-1]), [0.0, 0.0], t_eval=TIME, max_step=60.0, rtol=1e-8).y
    left = 3 * bar[0] - predict(run)[:, 0]
    columns = place_columns(run)[:, 0]
    rest = left - columns @ np.linalg.lstsq(columns, left, rcond=None)[0]
    assert np.std(left) > 1.0
    assert np.std(rest) < 0.1 * np.std(left)


@pytest.mark.parametrize("effect", catalogue().values(), ids=list(catalogue()))
def test_a_step_test_shows_no_operating_points(effect: Effect) -> None:
    """One recording in which no input moves: an effect may be off where its body moves, or nowhere."""
    for h in {h.key: inside(h) for h in expand(effect)}.values():
        run = trajectory(h.added_to(machine_for(effect), dict.fromkeys(h.amplitudes, 0.1)), still=True)
        (columns,) = effect_form([run], [h])
        assert columns.shape[:2] == run.system.grid.readings.shape
        assert np.isfinite(columns).all()
