"""Units that fit pass, units that do not are named."""

import dataclasses
import re

import pytest

from discovery.models import Model, Parameter, State
from discovery.models.dimensions import check_dimensions, with_coefficient_units
from discovery.models.reduced import reduced
from discovery.models.superposition import superposition
from discovery.models.thermobalance import thermobalance
from discovery.recordings import Channel
from discovery.terms import Number, Term, parse

UNITS = {
    "T_env": "degC",
    "T_fluid": "degC",
    "T_cool": "degC",
    "pump": "1",
    "speed": "rpm",
    "P_drive": "W",
    "h_nozzle": "mm",
    "E_Y0C": "um",
    "E_Z0T": "um",
    "E_R0T": "um",
    "E_A0C": "um/m",
}
CHANNELS = {
    name: Channel(name, "error" if unit[:2] == "um" else "other input", unit, None, "held")
    for name, unit in UNITS.items()
}
INPUTS, ERRORS = ["T_env", "P_drive", "T_fluid", "pump"], ["E_Y0C", "E_A0C"]


@pytest.mark.parametrize(
    "model",
    [
        thermobalance(),
        thermobalance(variant="printed"),
        reduced(INPUTS, ERRORS, CHANNELS),
        superposition(INPUTS, ERRORS, CHANNELS),
    ],
)
def test_hand_built_models_fit(model: Model) -> None:
    assert check_dimensions(model, CHANNELS) == []


def one(expression: str, units: dict[str, str], capacity: float | None = 1000.0) -> list[str]:
    state = State("x", "degC", capacity, Number(20.0), 0.5, 1.0)
    parameters = {name: Parameter(1.0, unit) for name, unit in units.items()}
    return check_dimensions(
        Model("m", parameters, {"x": state}, (Term("t", "x", parse(expression)),), {}), CHANNELS
    )


@pytest.mark.parametrize(
    ("expression", "units"),
    [
        ("G*(T_env - x)", {"G": "W/K"}),
        ("hA*A*(T_env - x)", {"hA": "W/m**2/K", "A": "m**2"}),
        ("0.3*P_drive", {}),
        ("G*(speed/600)**m*(T_fluid - x)", {"G": "W/K", "m": "1"}),
        ("G*(speed/n0)**m*(T_fluid - x)", {"G": "W/K", "n0": "rpm", "m": "1"}),
        ("where(speed > 100, a*P_drive, 0)", {"a": "1"}),
        ("a*P_drive*exp(-k*(x - 22))", {"a": "1", "k": "1/K"}),
        ("G*(lag(T_fluid, tau) - x)", {"G": "W/K", "tau": "s"}),
        ("G*(lag(T_fluid, 60*tau) - x)", {"G": "W/K", "tau": "min"}),
        ("P_full*pump", {"P_full": "W"}),
        ("a*P_drive*0.5**(part/whole)", {"a": "1", "part": "um", "whole": "um"}),
        ("s*A*((x + 273.15)**4 - (T_env + 273.15)**4)", {"s": "W/m**2/K**4", "A": "m**2"}),
    ],
)
def test_what_fits(expression: str, units: dict[str, str]) -> None:
    assert one(expression, units) == []


@pytest.mark.parametrize(
    ("expression", "units", "word"),
    [
        ("G*(T_env - x)", {"G": "W/K/m"}, r"dimension of W/m where W is expected; G in W/K would fit"),
        ("P_drive + x", {}, "different dimensions"),
        ("G*(T_env - speed)", {"G": "W/K"}, "different dimensions"),
        ("a*P_drive*exp(k*x)", {"a": "1", "k": "1"}, "pure number"),
        ("P_drive**x", {}, "exponent"),
        ("P_drive*pump*G", {"G": "W"}, r"W\*\*2 where W is expected; G without a unit would fit"),
        ("G*(lag(T_env, x) - x)", {"G": "W/K"}, "'x' has the dimension of K where s is expected"),
        ("G*(lag(T_env, tau) - x)", {"G": "W/K", "tau": "min"}, "'tau' counts in 60 s where s is expected"),
        ("G*(T_env - x)", {"G": "kW/K"}, "counts in 1000 W where W is expected.*; G in W/K would fit"),
        ("a*(P_drive + P_more)", {"a": "1", "P_more": "kW"}, "the unit of .P_drive. is"),
        ("share*P_drive", {"share": "percent"}, "counts in 0.01 W"),
        ("G*(T_env - x)", {"G": "9**9**9**9"}, "is not known"),
        ("max(P_drive, x)", {}, "different dimensions"),
        ("G*(T_env - x)", {"G": "furlongs_of_heat"}, "not known"),
    ],
)
def test_what_does_not(expression: str, units: dict[str, str], word: str) -> None:
    sentences = one(expression, units)
    assert len(sentences) == 1
    assert re.search(word, sentences[0])


def test_the_unit_of_a_coefficient_follows_from_what_it_multiplies() -> None:
    expressions = ("g1*speed", "g2*(pump*(T_env - 21.9))", "g3*x", "g4*(P_drive*speed**2)", "g5*1")
    state = State("x", "um", None, Number(0.0), 1.0, 1 / 3600)
    terms = tuple(Term(e, "x", parse(e)) for e in expressions)
    parameters = {f"g{k}": Parameter(1.0, "um/h") for k in range(1, 6)}
    model = Model("found", parameters, {"x": state}, terms, {}, "h")
    assert len(check_dimensions(model, CHANNELS)) == 4
    mended = with_coefficient_units(model, CHANNELS)
    assert check_dimensions(mended, CHANNELS) == []
    assert [p.unit for p in mended.parameters.values()] == [
        "um/h/rpm",
        "um/h/K",
        "um/h/um",
        "um/h/(W*rpm**2)",
        "um/h",
    ]


def test_a_rate_is_compared_with_the_state_and_the_time_unit() -> None:
    assert one("(T_env - x)/tau", {"tau": "s"}, capacity=None) == []
    assert "degC/s is expected" in one("k*P_drive", {"k": "K"}, capacity=None)[0]
    assert "counts in 0.0002778 degC/s" in one("(T_env - x)/tau", {"tau": "h"}, capacity=None)[0]


def test_a_hidden_state_has_a_clock_of_its_own() -> None:
    """A file counts in hours, the memory behind a lag() in seconds."""
    for scale, tau, fits in (
        (1.0, "s", True),
        (1 / 3600, "h", True),
        (1.0, "h", False),
        (1 / 3600, "s", False),
    ):
        state = State("x", "degC", None, Number(20.0), 0.5, scale)
        term = Term("t", "x", parse("(T_env - x)/tau"))
        model = Model("m", {"tau": Parameter(1.0, tau)}, {"x": state}, (term,), {}, "h")
        assert (check_dimensions(model, CHANNELS) == []) is fits


def test_a_measured_state_counts_as_its_channel() -> None:
    state = State("E_Y0C", "mm", None, Number(0.0), 0.5, 1.0)
    (said,) = check_dimensions(Model("m", {}, {"E_Y0C": state}, (), {}), CHANNELS)
    assert "output 'E_Y0C': 'E_Y0C' counts in 1000 um where um is expected" in said


def test_an_output_is_compared_with_its_channel() -> None:
    model = thermobalance()
    wrong = dataclasses.replace(model, outputs={"E_R0T": parse("T_ref*G_c1_c2")})
    assert "output 'E_R0T'" in check_dimensions(wrong, CHANNELS)[0]
