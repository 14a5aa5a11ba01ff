"""Systems that are no machine tools: outputs that move each other."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from discovery.frames import campaign_from_frames
from discovery.models.model import TIME_UNITS
from discovery.sparse.discover import discover
from discovery.sparse.discovery import Discovery
from discovery.sparse.options import SparseOptions


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
