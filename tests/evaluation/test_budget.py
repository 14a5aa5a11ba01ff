"""Energy and fluid budget against integrals done by hand."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.evaluation.budget import budget
from discovery.evaluation.tables import budget_tables
from discovery.fitting import predict_recording
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "T_fluid": Channel("T_fluid", "fluid temperature", "degC", None, "linear"),
    "flow": Channel("flow", "fluid flow", "l/min", None, "held"),
    "E": Channel("E", "error", "um", 1.0, "linear"),
}


def run(terms: tuple[Term, ...], capacity: float | None = 50e3) -> tuple[Campaign, Model]:
    """2 h; 100 W in the first hour; fluid at 30 degC, 12 l/min in the second hour; room 20 degC."""
    time = np.arange(0.0, 7201.0, 60.0)
    values = {
        "P": np.where(time < 3600, 100.0, 0.0),
        "T_env": np.full(len(time), 20.0),
        "T_fluid": np.full(len(time), 30.0),
        "flow": np.where(time >= 3600, 12.0, 0.0),
        "E": np.zeros(len(time)),
    }
    scale = 1.0 / capacity if capacity else 1.0
    states = {n: State(n, "degC", capacity, parse("20"), 0.0, scale) for n in ("x", "z")}
    model = Model("two", {}, states, terms, {"E": parse("x + z")})
    return Campaign("c", CHANNELS, {"r": Recording("r", time, values)}), model


def test_heat_that_enters_is_stored_or_leaves() -> None:
    """0.36 MJ of loss into x; joint of 20 W/K to z; all of it stays: 0.36 MJ / (2 x 50 kJ/K) = 3.6 K."""
    campaign, model = run((Term("loss", "x", parse("P")), Term("joint", "z", parse("20*(x - z)"), "x")))
    trajectory = predict_recording(model, campaign, "r", ["E"])
    found = budget(trajectory, campaign)
    assert found is not None
    assert found.entering == pytest.approx({"loss": 0.36})
    assert sum(found.stored.values()) == pytest.approx(0.36, rel=1e-9)
    assert found.gap == pytest.approx(0.0, abs=1e-9)
    # what z holds came through the joint (trapezoids of 60 s: a part in a thousand)
    assert found.moved["joint"] == pytest.approx(found.stored["z"], rel=1e-3)
    assert float(np.sum(trajectory.x[-1] - 20.0)) * 50e3 == pytest.approx(0.36e6, rel=1e-9)


def test_the_fluid_cools_by_what_it_gives() -> None:
    """A body that its size holds at 20 degC takes 40 W/K x 10 K for an hour: 1.44 MJ from 0.72 m3,
    which cools by 1.44 MJ/(4.15 MJ/m3K x 0.72 m3) = 0.482 K.
    """
    campaign, model = run((Term("fluid", "x", parse("40*(flow/12)*(T_fluid - x)")),), capacity=1e9)
    found = budget(predict_recording(model, campaign, "r", ["E"]), campaign)
    assert found is not None
    assert found.fluid["heat to the machine [MJ]"] == pytest.approx(1.44, rel=1e-3)
    assert found.fluid["volume [m3]"] == pytest.approx(0.72, rel=1e-6)
    assert found.fluid["drop of the fluid [K]"] == pytest.approx(0.482, rel=2e-3)
    assert found.fluid["hours pumped"] == pytest.approx(1.0)
    assert found.fluid["over the room [K]"] == pytest.approx(10.0)


def test_a_model_without_heat_capacities_has_no_budget() -> None:
    campaign, model = run((Term("itself", "x", parse("20 - x")),), capacity=None)
    assert budget(predict_recording(model, campaign, "r", ["E"]), campaign) is None


def test_a_table_of_many_recordings_has_three_columns() -> None:
    """Sizes of a small board, 1 to 8 kJ, in the unit that they need."""
    one = {"stored": {"board": 0.001}, "gap": 0.0, "fluid": {}}
    found = {f"run {k}": one | {"entering": {"heater": k * 1e-3}} for k in (3, 1, 2, 8, 5, 7, 4, 6)}
    (heat,) = budget_tables(found)
    assert heat.title == "Heat into the bodies [kJ]"
    assert heat.header == ("Term", "smallest of 8 recordings", "median", "largest")
    assert heat.rows[0][0] == "heater"
    assert heat.rows[0][1:] == pytest.approx((1.0, 4.5, 8.0))
    (heat,) = budget_tables({name: found[name] for name in list(found)[:3]})
    assert heat.header == ("Term", "run 3", "run 1", "run 2")
