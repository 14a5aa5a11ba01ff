"""Systems that are no machine tools: outputs that move each other."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from discovery.frames import campaign_from_frames
from discovery.models.model import TIME_UNITS
from discovery.sparse.discover import discover
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
