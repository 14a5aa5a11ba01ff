"""Equations (7) to (9) and the thermobalance as models."""

from __future__ import annotations

from pathlib import Path

import pytest

from discovery.models import Model, read_model
from discovery.models.equations import equations
from discovery.models.reduced import reduced
from discovery.models.superposition import superposition
from discovery.models.thermobalance import thermobalance
from discovery.recordings import Channel
from discovery.terms import text

DATA = Path(__file__).parents[2] / "datasets" / "nmv5000"
CHANNELS = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "P": Channel("P", "heat load", "W", None, "held"),
    "pump": Channel("pump", "fluid flow", "1", None, "held"),
    "E": Channel("E", "error", "um", 0.5, "linear"),
    "A": Channel("A", "error", "um/m", 1.4, "linear"),
}


def rates(model: Model) -> dict[str, str]:
    """Right-hand side of each state as one text."""
    return {
        name: " + ".join(text(t.expression) for t in model.terms if t.into == name) for name in model.states
    }


def test_equation_9_letter_by_letter() -> None:
    model = reduced(["T_env", "P", "pump"], ["E", "A"], CHANNELS)
    assert rates(model)["E"] == "p1_E*E + p2_E*T_env + p3_E*P + p4_E*pump + p5_E"
    assert {name: model.parameters[name].unit for name in ("p1_A", "p2_A", "p3_A", "p4_A", "p5_A")} == {
        "p1_A": "1/h",
        "p2_A": "um/m/K/h",
        "p3_A": "um/m/W/h",
        "p4_A": "um/m/h",
        "p5_A": "um/m/h",
    }


def test_equation_7_is_the_case_of_one_input() -> None:
    model = superposition(["T_env"], ["E"], CHANNELS)
    assert rates(model) == {"E_by_T_env": "p1_E*E_by_T_env + p2_E*(T_env + p3_E)"}
    assert text(model.outputs["E"]) == "E_by_T_env"


def test_equation_8_letter_by_letter() -> None:
    model = superposition(["T_env", "P", "pump"], ["E"], CHANNELS)
    assert rates(model) == {
        "E_by_T_env": "p1_E*E_by_T_env + p2_E*(T_env + p3_E)",
        "E_by_P": "p4_E*E_by_P + p5_E*(P + p6_E)",
        "E_by_pump": "p7_E*E_by_pump + p8_E*(pump + p9_E)",
    }
    assert text(model.outputs["E"]) == "E_by_T_env + E_by_P + E_by_pump"
    assert set(model.parameters) - set(model.free) == {
        "p6_E",
        "p9_E",
    }  # only their steady sum can be found jointly


@pytest.mark.parametrize(("file", "fluid"), [("thermobalance.toml", True), ("dry_thermobalance.toml", False)])
def test_the_file_of_the_dataset_is_what_the_builder_makes(file: str, fluid: bool) -> None:
    assert read_model(DATA / file) == thermobalance(fluid=fluid)


def test_conduction_conserves_energy() -> None:
    links = [term for term in thermobalance().terms if term.source]
    assert len(links) == 5
    assert all({term.into, term.source} < set(thermobalance().states) for term in links)


def test_equations_are_readable() -> None:
    model = thermobalance(fluid=False)
    lines = equations(model)
    assert lines[0].startswith(
        "4.5e+04 [J/K] * d/dt table = 20 [W/K]*(c_body_1 - table) + 3 [W/K]*(T_env - table)"
    )
    assert "d/dt bed = (T_env - bed)/9e+04 [s]" in lines
    assert "E_R0T = 1.9205*(table - 22 [degC])" in lines
    found = equations(reduced(["P"], ["E"], CHANNELS).with_values({"p1_E": -0.4, "p2_E": 0.012, "p3_E": -2}))
    assert found == ["d/dt E = -0.4 [1/h]*E + 0.012 [um/W/h]*P - 2 [um/h]"]


def test_what_leaves_a_body_is_subtracted() -> None:
    line = equations(thermobalance(fluid=False))[1]
    assert line.endswith("- 20 [W/K]*(c_body_1 - table)")
