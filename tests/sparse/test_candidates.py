"""What the search may choose from, by the roles of the channels: written out by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.drives import Inputs, make_drives, make_inputs, mass_drives
from discovery.sparse.families import candidates
from discovery.sparse.options import SparseOptions
from discovery.sparse.rates import Candidate
from discovery.terms import Number, text

ROLES = {
    "air": ("ambient temperature", "degC"),
    "fluid": ("fluid temperature", "degC"),
    "pump": ("fluid flow", "1"),
    "rpm": ("rotation speed", "rpm"),
    "drive": ("heat load", "W"),
    "high": ("nozzle height", "mm"),
    "oil": ("other input", "degC"),
    "E": ("error", "um"),
}
CHANNELS = {n: Channel(n, role, unit, None, "held") for n, (role, unit) in ROLES.items()}


def campaign(**values: list[float]) -> Campaign:
    """Two stamps of every channel: 20 and 23 degC of air, all else 0 and 1, where nothing is said."""
    given = {n: [0.0, 1.0] for n in ROLES} | {"air": [20.0, 23.0]} | values
    data = {n: np.array(series) for n, series in given.items()}
    return Campaign("c", CHANNELS, {"r": Recording("r", np.array([0.0, 60.0]), data)})


def inputs(asked: list[str] | None = None, **values: list[float]) -> Inputs:
    return make_inputs(campaign(**values), ["r"], asked)


def test_what_moves_drives_and_what_was_asked_for() -> None:
    still = {"rpm": [500.0, 500.0], "pump": [1.0, 1.0]}
    assert inputs(None, **still).names == ("air", "fluid", "drive", "high", "oil")
    found = inputs(["rpm", "pump", "drive"], **still)
    assert found.names == ("rpm", "drive")  # a pump that never stops is no gate
    assert (found.gate, found.reference) == (None, 20.0)
    assert inputs(fluid=[np.nan, np.nan]).of("fluid temperature") == ()


def test_the_pump_is_a_share_and_the_air_the_zero() -> None:
    found = inputs()
    assert (found.gate, found.reference, found.bodies) == ("pump", 21.5, ("oil",))
    assert inputs(pump=[0.0, 4.0]).gate == "pump/4"


@pytest.mark.parametrize(("name", "said"), [("E", "has the role error"), ("fan", "not a channel")])
def test_what_cannot_drive_is_refused(name: str, said: str) -> None:
    with pytest.raises(UserError, match=said):
        inputs([name])


def test_what_drives_a_hidden_mass() -> None:
    assert mass_drives(inputs(["air", "fluid", "pump", "drive", "oil", "high"])) == [
        "air - 21.5",
        "fluid - 21.5",
        "oil - 21.5",
        "drive",
        "high",
        "pump*(air - 21.5)",
        "pump*(fluid - 21.5)",
        "pump*drive",
        "pump",
    ]
    assert mass_drives(inputs(["drive", "fluid"])) == ["fluid - 20", "drive"]


def test_masses_of_air_and_bodies_begin_in_balance_and_others_at_rest() -> None:
    found = make_drives(inputs(["air", "pump", "drive", "oil"]), campaign())
    assert set(found.settled) == {"air - 21.5", "oil - 21.5"}
    assert found.integrals == ()  # a temperature is no charge
    with pytest.raises(UserError, match="'velocity'"):
        make_drives(inputs(["drive"]), campaign(), ["velocity**2"])
    laws = make_drives(inputs(["drive", "high"]), campaign(), ["linear", "product", "drive**3"])
    assert laws.expressions == ("drive", "high", "drive*high", "drive**3")


def offered(
    family: str,
    asked: list[str],
    capacity: float | None = 1e4,
    bounds: dict[str, tuple[float, float]] | None = None,
) -> list[Candidate]:
    """Of two bodies `a` and `b`."""
    states = {n: State(n, "degC", capacity, Number(20.0), 0.0, 1.0) for n in ("a", "b")}
    model = Model("m", {}, states, (), {})
    return candidates(
        ["a", "b"],
        model,
        campaign(),
        inputs(asked),
        [family],
        SparseOptions.model_validate({"bounds": bounds or {}}),
    )


ALL = ["air", "fluid", "pump", "rpm", "drive", "high", "oil"]


@pytest.mark.parametrize(
    ("family", "asked", "free", "upwards"),
    [
        ("linear", ALL, {"1", "rpm", "drive", "oil"}, {"air - a", "fluid - a"}),
        ("wet", ALL, {"pump*drive"}, {"pump*(fluid - a)", "pump*(abs(rpm) > 1)*(fluid - a)"}),
        ("wet", ["fluid", "drive"], set(), set()),
        (
            "rotation",
            ALL,
            {"(rpm/1000)**1.5", "(rpm/1000)**2", "(rpm/1000)**3"},
            {"rpm/1000*(air - a)"},
        ),
        ("natural", ["air"], set(), {"(air - a)*abs(air - a)**0.25"}),
        ("radiation", ["air"], set(), {"((air + 273.15)/300)**4 - ((a + 273.15)/300)**4"}),
        ("load", ["air", "drive"], {"drive*(a - air)/100", "(drive/100)**2"}, set()),
    ],
)
def test_each_family_has_its_terms(family: str, asked: list[str], free: set[str], upwards: set[str]) -> None:
    mine = [c for c in offered(family, asked) if c.into == "a"]
    assert {text(c.expression) for c in mine if c.low == -np.inf} == free
    assert {text(c.expression) for c in mine if c.low == 0.0} == upwards
    assert len(mine) == len(free | upwards)


def test_a_jet_that_points_aside_wets_more_of_one_body_and_less_of_another() -> None:
    plain = campaign()
    run = replace(
        plain.recordings["r"], values={**plain.recordings["r"].values, "side": np.array([0.0, 1.0])}
    )
    channels = {**CHANNELS, "side": Channel("side", "nozzle side", "1", None, "held")}
    aside = replace(plain, channels=channels, recordings={"r": run})
    found = make_inputs(aside, ["r"], ["fluid", "pump", "side"])
    model = Model("m", {}, {"a": State("a", "degC", 1e4, Number(20.0), 0.0, 1.0)}, (), {})
    offers = candidates(["a"], model, aside, found, ["wet"], SparseOptions())
    assert {(text(c.expression), c.low) for c in offers} == {
        ("pump*(fluid - a)", 0.0),
        ("pump*side*(fluid - a)", -np.inf),
    }


def test_bodies_of_known_capacity_exchange_their_heat_and_others_follow_each_other() -> None:
    once = [(c.into, c.source, text(c.expression)) for c in offered("coupling", ["air", "pump"])]
    assert once == [("b", "a", "a - b"), ("b", "a", "pump*(a - b)")]
    each = [(c.into, c.source, text(c.expression)) for c in offered("coupling", ["air"], None)]
    assert each == [("a", None, "b - a"), ("b", None, "a - b")]


def test_a_bound_holds_the_start_too() -> None:
    (one, _) = offered("drive*y", ["drive"], bounds={"drive*y": (2.0, 3.0)})
    assert (one.low, one.high) == (2.0, 3.0)
    assert 2.0 <= one.start <= 3.0
    with pytest.raises(UserError, match="not a term of its library"):
        offered("drive*y", ["drive"], bounds={"air*y": (2.0, 3.0)})


def test_a_second_mass_belongs_to_its_own_body() -> None:
    states = {n: State(n, "degC", 1e4, Number(20.0), 0.0, 1.0) for n in ("a", "b", "a_mass_1", "b_mass_1")}
    model = Model("m", {}, states, (), {})
    found = candidates(["a", "b"], model, campaign(), inputs(["air"]), ["second mass"], SparseOptions())
    assert [(c.into, text(c.expression), c.low) for c in found] == [
        ("a", "a_mass_1 - a", 0.0),
        ("b", "b_mass_1 - b", 0.0),
    ]
