"""Systems that are no machine tools: outputs that move each other."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest
from scipy.integrate import solve_ivp

from discovery.fitting import fit_model
from discovery.frames import campaign_from_frames
from discovery.models.model import TIME_UNITS
from discovery.sparse.discover import discover
from discovery.sparse.discovery import Discovery
from discovery.sparse.options import SparseOptions
from discovery.terms import names, text


def two_tanks(seed: int) -> pd.DataFrame:
    """A pump fills a tank that empties into another one, both in proportion to their levels [cm]."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.choice([0.0, 0.5, 1.0], 12), 20)
    upper = lower = 5.0
    read = []
    for pump in u:
        read.append((upper, lower))
        for _ in range(100):
            out = 0.01 * upper
            upper, lower = upper + 0.1 * (0.2 * pump - out), lower + 0.1 * (out - 0.02 * lower)
    levels = np.array(read) + 0.05 * rng.standard_normal((len(u), 2))
    table = {"u": u, "upper": levels[:, 0], "lower": levels[:, 1]}
    return pd.DataFrame(table, index=10.0 * np.arange(len(u)))


@pytest.mark.parametrize("role", ["other output", "error"])
def test_outputs_that_move_each_other_are_found_together(role: str) -> None:
    """The lower level follows the upper one, which is measured: no hidden body stands for it. Where nothing
    warms the outputs, errors are outputs like any other.
    """
    channels = {"u": {"role": "other input", "unit": "1"}}
    channels |= {y: {"role": role, "unit": "mm"} for y in ("upper", "lower")}
    campaign = campaign_from_frames({"a": two_tanks(0), "b": two_tanks(1)}, channels)
    found = discover(campaign, ["a", "b"], ["upper", "lower"], SparseOptions(bootstraps=0))
    assert set(found.model.states) == {"upper", "lower"}
    assert found.report["groups"][0]["kept"] == ["upper: u", "upper: upper", "lower: upper", "lower: lower"]
    size = 1000.0 if role == "error" else 1.0  # errors count in um
    rates = TIME_UNITS[found.model.time_unit] * np.array([0.2 * size, -0.01, 0.01, -0.02])
    np.testing.assert_allclose([p.value for p in found.model.parameters.values()], rates, rtol=0.05)


SPRINGS = np.array([[-3.25, 1.25], [2.5, -2.5]])  # 1/s2
DAMPERS = np.array([[-0.25, 0.10], [0.20, -0.20]])  # 1/s
STIFFER = np.array([0.02, -0.04])  # 1/(mm2 s2), of the spring between the masses


def two_masses(seed: int) -> pd.DataFrame:
    """A force [N] moves a mass, and a spring that is stiffer the longer it is moves a second one [mm]."""
    rng = np.random.default_rng(seed)
    force = np.repeat(rng.choice([-4.0, 0.0, 4.0], 30), 20)
    x, v, read = np.zeros(2), np.zeros(2), []
    for f in force:
        read.append(x)
        for _ in range(100):
            longer = x[1] - x[0]
            v = v + 0.001 * (SPRINGS @ x + DAMPERS @ v + STIFFER * longer**3 + np.array([2.0 * f, 0.0]))
            x = x + 0.001 * v
    places = np.array(read) + 0.02 * rng.standard_normal((len(force), 2))
    return pd.DataFrame(
        {"F": force, "x1": places[:, 0], "x2": places[:, 1]}, index=0.1 * np.arange(len(force))
    )


def test_masses_with_a_spring_between_them_are_found_together() -> None:
    channels = {"F": {"role": "other input", "unit": "N"}}
    channels |= {x: {"role": "other output", "unit": "mm"} for x in ("x1", "x2")}
    campaign = campaign_from_frames({"a": two_masses(0), "b": two_masses(1)}, channels)
    found = discover(campaign, ["a", "b"], ["x1", "x2"], SparseOptions(bootstraps=0))
    law = {label: found.model.parameters[n].value for label, n in _coefficients(found).items()}
    true = {"x1_rate: F": 2.0}
    for i, x in enumerate(("x1", "x2")):
        for j, other in enumerate(("x1", "x2")):
            true |= {f"{x}_rate: {other}": SPRINGS[i, j], f"{x}_rate: {other}_rate": DAMPERS[i, j]}
    true |= {"x1_rate: (x2 - x1)**3": STIFFER[0], "x2_rate: (x1 - x2)**3": -STIFFER[1]}
    assert set(law) == set(true)
    np.testing.assert_allclose([law[label] for label in true], list(true.values()), rtol=0.05)


def _coefficients(found: Discovery) -> dict[str, str]:
    """Name of the parameter of each term that was chosen, by its label."""
    free = iter(found.model.free)
    return {label: next(free) for label in found.report["groups"][0]["kept"]}


def drawn(seed: int) -> pd.DataFrame:
    """Water that a current warms by its square, and that cold water cools while some is drawn."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.choice([0.0, 4.0, 10.0], 20), 40)
    draw = np.repeat(rng.choice([0.0, 0.0, 1.0], 32), 25)
    inlet = 12 + 2 * np.sin(np.arange(800) / 90)
    water, read = 20.0, []
    for i, flow, cold in zip(current, draw, inlet, strict=True):
        read.append(water)
        water += 10 * (1e-4 * (20 - water) + 2e-4 * i**2 + 1e-3 * flow * (cold - water))
    table = {"current": current, "draw": draw, "T_inlet": inlet, "T_room": 20.0 + 0.0 * inlet}
    water_read = np.array(read) + 0.05 * rng.standard_normal(len(read))
    return pd.DataFrame(table | {"T": water_read}, index=10.0 * np.arange(800))


def test_a_temperature_has_squares_of_currents_and_what_a_flow_carries() -> None:
    roles = {
        "current": ("other input", "A"),
        "draw": ("fluid flow", "1"),
        "T_inlet": ("fluid temperature", "degC"),
        "T_room": ("ambient temperature", "degC"),
        "T": ("temperature", "degC"),
    }
    channels = {name: {"role": role, "unit": unit} for name, (role, unit) in roles.items()}
    campaign = campaign_from_frames({"a": drawn(0), "b": drawn(1)}, channels)
    found = discover(campaign, ["a", "b"], ["T"], SparseOptions(bootstraps=0))
    kept = found.report["groups"][0]["kept"]
    assert "T_body: (current/100)**2" in kept
    assert "T_body: draw*(T_inlet - T_body)" in kept
    assert "T_body: current" not in kept


def room(seed: int) -> pd.DataFrame:
    """A room with a radiator, a window to the air outside, and a heavy wall that the air cools as well."""
    rng = np.random.default_rng(seed)
    heat = np.repeat(rng.choice([0.0, 500.0, 1000.0, 2000.0], 36), 8)
    outside = 3.0 + 5.0 * np.sin(2 * np.pi * (np.arange(288) / 96 - rng.uniform())) + rng.uniform(-2, 2)
    inside, wall, read = 19.0, 16.0, []
    for power, cold in zip(heat, outside, strict=True):
        read.append(inside)
        for _ in range(15):
            moved = 135 * (cold - inside) + 540 * (wall - inside) + 3 * power
            wall += 60 / 3.6e6 * (72 * (inside - wall) + 16 * (cold - wall))
            inside += 60 / 3.6e6 * moved
    table = {"outside": outside, "heat": heat, "T": np.array(read) + 0.05 * rng.standard_normal(288)}
    return pd.DataFrame(table, index=900.0 * np.arange(288))


def test_a_wall_between_a_room_and_the_air_outside_is_found() -> None:
    """It is not read, colder than the room at first, and its time constant is none of a list."""
    channels = {
        "outside": {"role": "ambient temperature", "unit": "degC"},
        "heat": {"role": "heat load", "unit": "W"},
        "T": {"role": "temperature", "unit": "degC"},
    }
    campaign = campaign_from_frames({str(seed): room(seed) for seed in range(4)}, channels)
    found = discover(campaign, ["0", "1", "2"], ["T"], SparseOptions(bootstraps=0))
    values = found.model.values()
    law = {text(term.expression): names(term.expression) & set(values) for term in found.model.terms}
    rates = {re.sub(r".*\*\(?|\)|\d", "", one): values[min(used)] for one, used in law.items() if "_p" in one}
    true = {"outside - T_body": 0.135, "heat": 0.003}
    true |= {"T_body_mass - T_body": 0.54 * 72 / 88, "outside_mass - T_body": 0.54 * 16 / 88}
    assert set(rates) - {"T_body_p"} == set(true)  # a little constant heat does no harm
    np.testing.assert_allclose([rates[one] for one in true], list(true.values()), rtol=0.15)
    times = [values[f"{name}_tau"] for name in found.model.states if "_mass" in name]
    np.testing.assert_allclose(times, 3.6e6 / 88, rtol=0.3)


def test_the_voltage_and_the_temperature_of_a_battery_are_found_together() -> None:
    """Each in the form of its kind: a sum of responses to the current, and a body that its square warms."""
    channels = {
        "I": {"role": "other input", "unit": "A"},
        "T_room": {"role": "ambient temperature", "unit": "degC"},
        "U": {"role": "other output", "unit": "V"},
        "T": {"role": "temperature", "unit": "degC"},
    }
    campaign = campaign_from_frames({"a": battery(0), "b": battery(1)}, channels)
    found = discover(campaign, ["a", "b"], ["U", "T"], SparseOptions(bootstraps=0))
    kept = {group["outputs"][0]: group["kept"] for group in found.report["groups"]}
    assert set(kept["T"]) == {"T_body: T_room - T_body", "T_body: (I/100)**2"}
    assert {one.split(",")[0] for one in kept["U"]} == {"1", "I", "lag(I", "integral(I)"}
    fit = fit_model(found.model, campaign, ["a", "b"], ["U", "T"])
    np.testing.assert_allclose(fit.noise.white, [0.002, 0.05], rtol=0.1)


def battery(seed: int) -> pd.DataFrame:
    """A cell of 2 Ah between 3 and 4 V, warmed by the square of its current."""
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.permutation([-4.0, -2.0, 0.0, 0.0, 2.0, 4.0] * 4), 30)
    room = 23.0 + np.sin(np.arange(len(current)) / 70)
    charge, slow, warm, read = 0.5, 0.0, 23.0, []
    for i, air in zip(current, room, strict=True):
        read.append((3.2 + 0.8 * charge - 0.03 * i - slow, warm))
        slow += 10 / 200 * (0.02 * i - slow)
        charge -= 10 * i / 7200
        warm += 10 / 60 * (0.05 * i**2 - 0.1 * (warm - air))
    noise = np.array([0.002, 0.05]) * rng.standard_normal((len(current), 2))
    table = np.array(read) + noise
    return pd.DataFrame(
        {"I": current, "T_room": room, "U": table[:, 0], "T": table[:, 1]},
        index=10.0 * np.arange(len(current)),
    )


def axis(seed: int) -> pd.DataFrame:
    """Speed [rad/s] of an axis under a torque [Nm]: it is slowed by oil and by dry friction, and sticks."""
    rng = np.random.default_rng(seed)
    torque = np.repeat(rng.choice([-3.0, -1.5, -0.3, 0.0, 0.3, 1.5, 3.0], 20), 40)
    speed, read = 0.0, []
    for m in torque:
        read.append(speed)
        for _ in range(50):
            drive = 50.0 * m - 0.5 * speed
            if speed == 0.0 and abs(drive) <= 20.0:
                continue
            after = speed + 0.0002 * (drive - 20.0 * np.sign(speed or drive))
            speed = 0.0 if speed * after < 0 else after
    speeds = np.array(read) + 0.2 * rng.standard_normal(len(torque))
    return pd.DataFrame({"M": torque, "w": speeds}, index=0.01 * np.arange(len(torque)))


def test_dry_friction_is_a_sign_and_no_polynomial() -> None:
    channels = {"M": {"role": "other input", "unit": "N*m"}, "w": {"role": "other output", "unit": "rad/s"}}
    campaign = campaign_from_frames({"a": axis(0), "b": axis(1)}, channels)
    found = discover(campaign, ["a", "b"], ["w"], SparseOptions(bootstraps=0))
    law = {re.sub(r"tanh\(w/.*\)", "sign", label): n for label, n in _coefficients(found).items()}
    assert set(law) == {"w: M", "w: w", "w: sign"}
    values = [found.model.parameters[law[label]].value for label in ("w: M", "w: w", "w: sign")]
    np.testing.assert_allclose(values, [50.0, -0.5, -20.0], rtol=0.05)


def swinging(seed: int) -> pd.DataFrame:
    """Place [mm] of a mass that swings out on a spring that is stiffer the further it is out."""
    rng = np.random.default_rng(seed)
    x, v, read = float(rng.uniform(1, 2)), float(rng.uniform(-2, 2)), []
    for _ in range(1000):
        read.append(x)
        for _ in range(20):
            v += 0.001 * (-x - 0.5 * x**3 - 0.3 * v)
            x += 0.001 * v
    return pd.DataFrame(
        {"x": np.array(read) + 0.005 * rng.standard_normal(1000)}, index=0.02 * np.arange(1000)
    )


def test_a_recording_may_begin_in_the_middle_of_a_motion() -> None:
    channels = {"x": {"role": "other output", "unit": "mm"}}
    campaign = campaign_from_frames({"a": swinging(0), "b": swinging(1)}, channels)
    found = discover(campaign, ["a", "b"], ["x"], SparseOptions(bootstraps=0))
    law = {label: found.model.parameters[n].value for label, n in _coefficients(found).items()}
    assert set(law) == {"x_rate: x", "x_rate: x**3", "x_rate: x_rate"}
    np.testing.assert_allclose(
        [law["x_rate: x"], law["x_rate: x**3"], law["x_rate: x_rate"]], [-1.0, -0.5, -0.3], rtol=0.03
    )


def cell(seed: int) -> pd.DataFrame:
    """Voltage of a cell of 10 mOhm, and 5 mOhm more after 30 s, under currents that change every few seconds;
    its open-circuit voltage is a curve of its charge.
    """
    rng = np.random.default_rng(seed)
    current = np.repeat(rng.choice([0.0, 2.0, 5.0, 12.0, -6.0], 400), 10)
    charge, slow, read = 0.9, 0.0, []
    for i in current:
        read.append(3.0 + charge - 0.1 * np.sin(5 * charge) - 0.4 * np.exp(-10 * charge) - 0.010 * i - slow)
        slow += (0.005 * i - slow) / 30
        charge -= i / 20_000
    volts = np.array(read) + 0.002 * rng.standard_normal(len(current))
    return pd.DataFrame({"I": current, "U": volts}, index=1.0 * np.arange(len(current)))


def test_the_resistance_of_a_cell_is_found_under_a_curve_that_the_model_lacks() -> None:
    channels = {"I": {"role": "other input", "unit": "A"}, "U": {"role": "other output", "unit": "V"}}
    campaign = campaign_from_frames({name: cell(k) for k, name in enumerate("abc")}, channels)
    options = SparseOptions(bootstraps=0, form="masses")
    found = discover(campaign, ["a", "b", "c"], ["U"], options)
    kept = found.report["groups"][0]["kept"]
    direct = found.model.parameters[f"U_gain{kept.index('I')}"].value
    assert direct == pytest.approx(-0.010, rel=0.1)


def prey_and_predator(seed: int) -> pd.DataFrame:
    """Lotka and Volterra: dh/dt = 1.1 h - 0.4 h l, dl/dt = 0.1 h l - 0.4 l, without any input."""
    rng = np.random.default_rng(seed)
    begin, time = [rng.uniform(5, 15), rng.uniform(3, 8)], 0.1 * np.arange(600)

    def rates(_: float, z: np.ndarray[tuple[int], np.dtype[np.float64]]) -> list[float]:
        return [1.1 * z[0] - 0.4 * z[0] * z[1], 0.1 * z[0] * z[1] - 0.4 * z[1]]

    path = solve_ivp(rates, (0.0, time[-1]), begin, t_eval=time, rtol=1e-9).y.T
    counted = path + 0.05 * rng.standard_normal((600, 2))
    return pd.DataFrame(counted, index=time, columns=["hare", "lynx"])


def test_an_expression_of_two_outputs_makes_them_one_system() -> None:
    """Each alone has no channel of the other's name."""
    frames = {f"r{seed}": prey_and_predator(seed) for seed in (0, 1)}
    roles = {name: {"role": "other output", "unit": "1"} for name in ("hare", "lynx")}
    campaign = campaign_from_frames(frames, roles)
    options = SparseOptions(form="rates", library=("linear", "hare*lynx"), stable=False, bootstraps=0)
    found = discover(campaign, list(frames), ["hare", "lynx"], options)
    model = fit_model(found.model, campaign, list(frames), ["hare", "lynx"]).model
    values = sorted(
        p.value * TIME_UNITS["s"] / TIME_UNITS[model.time_unit] for p in model.parameters.values()
    )
    assert values == pytest.approx([-0.4, -0.4, 0.1, 1.1], rel=0.02)
