"""Where effects are offered, and what they make of terms that somebody wrote down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.dynamics.system import predict
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model, read_model, write_model
from discovery.terms import Term, parse, substitute
from tests.mismatch.sample import CHANNELS, RUNS, expand, inside, sample, trajectory

DRIVEN = ("friction_speed", "viscosity_temperature", "thermal_preload", "windage")
REPLACING = ("fluid terms", "cooling terms", "inputs of a recording")
INPUTS = ("drive", "chiller", "emulsion", "pump", "room", "rpm")
DELAYS = {"drive": 120.0, "chiller": 90.0, "emulsion": 60.0}  # s, of what its author wrote as late


def late(seconds: Mapping[str, float]) -> Model:
    """The sample machine with channels that reach it late."""
    model, _ = sample()
    swaps = {channel: parse(f"delay({channel}, {by})") for channel, by in seconds.items()}
    return replace(
        model, terms=tuple(replace(t, expression=substitute(t.expression, swaps)) for t in model.terms)
    )


def claims(model: Model, word: str) -> list[Hypothesis]:
    return hypotheses(model, CHANNELS, ("E_Y", "E_Z"), RUNS, [catalogue()[word]])


def test_a_clock_shifts_what_is_late_already() -> None:
    baseline = late(DELAYS)
    shift = next(
        h for h in claims(baseline, "clock_shift") if h.recording == "two" and 900.0 in h.shapes.values()
    )
    shifted = {c: DELAYS.get(c, 0.0) + 900.0 for c in INPUTS}
    found = predict(trajectory(shift.added_to(baseline)))
    assert np.allclose(found, predict(trajectory(late(shifted))), rtol=0, atol=1e-9)


def test_a_fluid_that_is_late_already_is_later() -> None:
    baseline = late(DELAYS)
    later = next(h for h in claims(baseline, "fluid_delay") if 600.0 in h.shapes.values())
    found = predict(trajectory(later.added_to(baseline)))
    expected = predict(trajectory(late({**DELAYS, "emulsion": 660.0})))
    assert np.allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("word", [w for w, e in catalogue().items() if e.place in REPLACING])
def test_what_stands_for_a_late_channel_is_written_read_and_simulated(word: str, tmp_path: Path) -> None:
    baseline = late(DELAYS)
    for h in claims(baseline, word):
        start = dict.fromkeys(h.amplitudes, h.effect.amplitude.fixed or h.effect.amplitude.plausible)
        on = inside(h).added_to(baseline, start)
        write_model(tmp_path / "m.toml", on)
        found = predict(trajectory(read_model(tmp_path / "m.toml")))
        assert np.isfinite(found).all()
        assert np.allclose(found, predict(trajectory(on)), rtol=0, atol=1e-6)


@pytest.mark.parametrize("file", DRIVEN)
def test_losses_come_of_a_recorded_heat_or_of_a_law_of_the_speed(file: str) -> None:
    effect = catalogue()[file]
    assert {h.states for h in expand(effect)} == {("motor",), ("table",)}
    assert {h.states for h in expand(effect, without={"heat load"})} == {("table",)}


def test_a_bearing_lies_beside_either_of_them() -> None:
    rings = catalogue()["thermal_preload_rings"]
    assert {h.states for h in expand(rings)} == {("motor", "table"), ("table", "motor")}
    assert {h.states for h in expand(rings, without={"heat load"})} == {("table", "motor")}


@pytest.mark.parametrize("file", ["wear", "copper_resistance"])
def test_a_share_of_a_recorded_heat_is_asked_for_where_that_goes(file: str) -> None:
    assert {h.states for h in expand(catalogue()[file])} == {("motor",)}
    assert not expand(catalogue()[file], without={"heat load"})


@pytest.mark.parametrize(
    ("law", "friction"),
    [
        ("P_b*cut*(rpm/1000)", True),
        ("P_b*delay(rpm, 60)", True),
        ("P_b*cut", False),
        ("P_b*rpm*(room - bed)", False),
        ("P_b*rpm*(emulsion - 22)", False),
        ("P_b*rpm*bed", False),
    ],
)
def test_what_holds_a_temperature_is_an_exchange_and_no_friction(law: str, friction: bool) -> None:
    model, channels = sample()
    model = replace(model, terms=(*model.terms, Term("law", "bed", parse(law))))
    found = hypotheses(model, channels, ("E_Y", "E_Z"), RUNS, [catalogue()["wear_speed"]])
    assert {h.states for h in found} == ({("table",), ("bed",)} if friction else {("table",)})


def test_a_body_has_one_law_of_wear() -> None:
    """A share of the heat where that is recorded, also beside a law of the speed."""
    model, channels = sample()
    both = replace(model, terms=(*model.terms, Term("law", "motor", parse("P_b*(rpm/1000)"))))
    wear = [effect for effect in catalogue().values() if effect.word == "wear"]
    found = hypotheses(both, channels, ("E_Y", "E_Z"), RUNS, wear)
    laws = {(*h.states, h.effect.amplitude.name) for h in found}
    assert laws == {("motor", "wear"), ("table", "P_wear")}
    assert {h.recording for h in found} == {"two"}
