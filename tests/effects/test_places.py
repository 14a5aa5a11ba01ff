"""Where effects are offered, and what they make of terms that somebody wrote down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import exp, inf, log
from pathlib import Path

import numpy as np
import pytest

from discovery.diagnosis.written import written
from discovery.dynamics import predict
from discovery.effects.candidates import candidates
from discovery.effects.catalogue import catalogue
from discovery.effects.form import TERM_PLACES
from discovery.models import Model, read_model, write_model
from discovery.recordings import Channel
from discovery.terms import Term, evaluate, names, parse, substitute
from tests.effects.sample import (
    EVENT_ODDS,
    HIGH,
    ODDS,
    READ,
    claims,
    expand,
    inside,
    sample,
    scene,
    trajectory,
)

DRIVEN = ("viscosity_temperature", "thermal_preload", "windage")
REPLACING = (*TERM_PLACES, "inputs of a recording")
INPUTS = ("drive", "chiller", "emulsion", "pump", "room", "rpm", "servo", "water")
DELAYS = {"drive": 120.0, "chiller": 90.0, "emulsion": 60.0}  # s, of what its author wrote as late


def late(seconds: Mapping[str, float]) -> Model:
    """The sample machine with channels that reach it late."""
    model, _ = sample()
    swaps = {channel: parse(f"delay({channel}, {by})") for channel, by in seconds.items()}
    return replace(
        model, terms=tuple(replace(t, expression=substitute(t.expression, swaps)) for t in model.terms)
    )


def test_a_clock_shifts_what_is_late_already() -> None:
    baseline = late(DELAYS)
    shift = next(h for h in claims(baseline, catalogue()["clock_shift"]) if h.recording == "two")
    shift = shift.at(dict.fromkeys(shift.shapes, 900.0))
    shifted = {c: DELAYS.get(c, 0.0) + 900.0 for c in INPUTS}
    found = predict(trajectory(shift.added_to(baseline)))
    assert np.allclose(found, predict(trajectory(late(shifted))), rtol=0, atol=1e-9)


def test_a_wrong_sensor_of_an_input_is_wrong_in_the_outputs_too() -> None:
    """A sensor of the room that shows 0.5 K too little, where an error follows the difference to the room."""
    model, _ = sample()
    model = replace(model, outputs={**model.outputs, "E_Y": parse("2.0*(table - room)")})
    (entry,) = (
        e for e in catalogue().values() if (e.word, e.place) == ("sensor_offset", "input temperature")
    )
    (h,) = (one for one in claims(model, entry) if one.channels == ("room",) and one.recording == "two")
    assert set(h.shown) == {"E_Y"}
    wrong = {"room": parse("room + 0.5")}
    right = replace(
        model,
        terms=tuple(replace(t, expression=substitute(t.expression, wrong)) for t in model.terms),
        outputs={name: substitute(y, wrong) for name, y in model.outputs.items()},
    )
    found = predict(trajectory(h.added_to(model, {h.amplitudes[0]: -0.5})))
    assert np.allclose(found, predict(trajectory(right)), rtol=0, atol=1e-9)
    assert not np.allclose(found, predict(trajectory(model)), rtol=0, atol=0.1)


def test_a_flow_is_a_factor_on_an_exchange_where_no_fluid_is_read() -> None:
    """Laws of the fluid need its temperature; water of a seal cools a bush by what it carries to the sea."""
    followed = {}
    for without in ((), ("fluid temperature",)):
        model, channels = sample(without)
        entries = [e for e in catalogue().values() if e.word == "input_exchange" and "coolant" in e.formula]
        found = [h for entry in entries for h in claims(model, entry, channels)]
        followed[without] = {name for h in found for name in h.follows if name in ("pump", "spray")}
    assert followed == {(): {"spray"}, ("fluid temperature",): {"pump", "spray"}}


def test_a_fluid_that_is_late_already_is_later() -> None:
    baseline = late(DELAYS)
    later = claims(baseline, catalogue()["fluid_delay"])[0]
    later = later.at(dict.fromkeys(later.shapes, 600.0))
    found = predict(trajectory(later.added_to(baseline)))
    expected = predict(trajectory(late({**DELAYS, "emulsion": 660.0})))
    assert np.allclose(found, expected, rtol=0, atol=1e-9)


def test_a_coolant_may_be_late_or_mixed() -> None:
    """As a fluid: its sensor may stand far from the bodies."""
    baseline, _ = sample()
    later = claims(baseline, catalogue()["fluid_delay_coolant"])[0]
    mixed = claims(baseline, catalogue()["fluid_sump_coolant"])[0]
    assert later.states == mixed.states == ("bed",)
    later = later.at(dict.fromkeys(later.shapes, 600.0))
    found = predict(trajectory(later.added_to(baseline)))
    assert np.allclose(found, predict(trajectory(late({"water": 600.0}))), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("top", "said"), [(24000.0, "1000 rpm"), (620.0, "1000 rpm"), (20.0, "10 rpm"), (0.0, "1000 rpm")]
)
def test_the_size_of_friction_counts_at_a_speed_that_the_machine_has(top: float, said: str) -> None:
    friction = catalogue()["friction_speed"].up_to(top)
    assert friction.at == said
    per = float(said.removesuffix(" rpm"))
    values = {"P_f": 150.0, "speed": per, "m_loss": 1.7}
    assert evaluate(parse(friction.formula), values).value == pytest.approx(150.0)


def test_what_has_no_size_at_a_speed_stays() -> None:
    for word in ("rim_detachment", "evaporation_spinning", "radiation"):
        assert catalogue()[word].up_to(20.0) == catalogue()[word]


def test_what_lags_in_a_model_without_states_is_the_body() -> None:
    """No sensor: a model that answers at once has no body whose time constant a lag could add to."""
    outputs = {"E_Y": parse("0.02*drive"), "E_Z": parse("0.01*drive")}
    still = Model("regression", {}, {}, (), outputs)
    assert claims(still, catalogue()["sensor_lag"]) == []
    assert {h.outputs for h in claims(still, catalogue()["second_time_constant"])} == {("E_Y",), ("E_Z",)}
    assert {h.outputs for h in claims(sample()[0], catalogue()["sensor_lag"])} == {(name,) for name in READ}


def test_a_thermometer_passes_no_joint_and_stands_between_the_masses_that_it_touches() -> None:
    """On a heated plate a lever of 1800 K/K, between -10600 and 14200, was named with 98 %."""
    model = sample()[0]
    for file in ("joint_hysteresis", "joint_hysteresis_body", "second_thermal_mass_lever"):
        shown = {y for h in claims(model, catalogue()[file]) for y in h.shown}
        assert shown == {"E_Y", "E_Z"}, file
    seen = claims(model, catalogue()["second_thermal_mass_reading"])
    assert {(h.states, tuple(h.shown)) for h in seen} == {(("motor",), ("T_motor",))}
    share = seen[0].added_to(model).parameters["share_m_motor"]
    assert (share.min, share.max) == (0.0, 1.0)


@pytest.mark.parametrize("word", [w for w, e in catalogue().items() if e.place in REPLACING])
def test_what_stands_for_a_late_channel_is_written_read_and_simulated(word: str, tmp_path: Path) -> None:
    baseline = late(DELAYS)
    for h in claims(baseline, catalogue()[word]):
        start = dict.fromkeys(h.amplitudes, h.effect.amplitude.fixed or h.effect.amplitude.plausible)
        on = inside(h).added_to(baseline, start)
        write_model(tmp_path / "m.toml", written(on, [h]))
        found = predict(trajectory(read_model(tmp_path / "m.toml")))
        assert np.isfinite(found).all()
        assert np.allclose(found, predict(trajectory(on)), rtol=0, atol=1e-6)


@pytest.mark.parametrize("word", [w for w, e in catalogue().items() if e.amplitude.fixed is not None])
def test_what_is_written_of_an_effect_that_is_on_predicts_as_before(word: str) -> None:
    """A field of collectors "repaired" by the exponent of its flow lost the "- 1": 1.6 K became 13 K."""
    baseline = sample()[0]
    for h in claims(baseline, catalogue()[word]):
        on = inside(h).added_to(baseline, dict.fromkeys(h.amplitudes, h.effect.amplitude.fixed or 0.0))
        before = predict(trajectory(on))
        assert np.allclose(predict(trajectory(written(on, [h]))), before, rtol=0, atol=1e-6)


def test_a_joint_conducts_a_share_more_at_each_link() -> None:
    """The parameters of two links have names of their own, and the heat is a share of what flows there."""
    baseline, _ = sample()
    links = [t for t in baseline.terms if t.source]
    found = claims(baseline, catalogue()["contact_conductance"])
    assert {frozenset(h.states) for h in found} == {frozenset((t.into, t.source)) for t in links}
    assert len({h.amplitudes for h in found}) == len(found)
    warm = {name: 30.0 + 2.0 * k for k, name in enumerate(sorted({t.into for t in links} | set(INPUTS)))}
    known = {**baseline.values(), **warm, "room": 22.0}
    for h in found:
        [term] = h.terms
        [link] = [t for t in links if {t.into, t.source} == {term.into, term.source}]
        flow = float(evaluate(link.expression, known | {s: warm.get(s, 30.0) for s in h.states}).value)
        at = {s: warm.get(s, 30.0) for s in h.states}
        more = float(evaluate(term.expression, known | at | h.values("one", 0.2)).value)
        assert more == pytest.approx(0.2 * (np.mean(list(at.values())) - 22.0) / 10 * flow)


@pytest.mark.parametrize("file", DRIVEN)
def test_losses_come_of_a_recorded_heat_or_of_a_law_of_the_speed(file: str) -> None:
    effect = catalogue()[file]
    single = {h.states for h in expand(effect) if len(h.states) == 1}
    assert single == {("motor",), ("table",)}
    assert {h.states for h in expand(effect, without={"heat load"})} == {("table",)}


def test_friction_may_act_where_the_model_has_no_loss_but_is_shared_by_driven_bodies() -> None:
    states = {h.states for h in expand(catalogue()["friction_speed"])}
    assert states == {("motor",), ("table",), ("bed",), ("motor", "table")}


def test_a_bearing_lies_beside_either_of_them() -> None:
    rings = catalogue()["thermal_preload_rings"]
    assert {h.states[0] for h in expand(rings)} == {"motor", "table"}
    assert ("motor", "motor") not in {h.states for h in expand(rings)}
    assert {h.states for h in expand(rings, without={"heat load"})} == {("table", "motor"), ("table", "bed")}


def test_a_share_of_a_recorded_heat_is_asked_for_where_that_goes() -> None:
    copper = catalogue()["copper_resistance"]
    assert {h.states for h in expand(copper)} == {("motor",)}
    assert not expand(copper, without={"heat load"})


def test_a_current_warms_its_winding_the_more_the_warmer_that_is() -> None:
    """The term of the current itself grows: 25 A**2 8 W/A**2 of copper alone, 10 K above 22 degC."""
    copper = catalogue()["copper_resistance_current"]
    (h,) = expand(copper)
    assert h.states == ("motor",)
    (term,) = h.terms
    found = evaluate(term.expression, {"R_w": 8.0, "servo": 5.0, "motor": 32.0, h.amplitudes[0]: 1.0}).value
    assert found == pytest.approx(0.0393 * 200.0)
    assert not expand(copper, without={"other input"})


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
    found = {h.states for h in claims(model, catalogue()["windage"], channels)}
    assert (("bed",) in found) == friction


def test_air_and_fluid_may_be_late_at_one_body() -> None:
    """A measuring machine: air that was late at its bridge had been late at all of its bodies."""
    model, channels = sample()
    model = replace(model, terms=(*model.terms, Term("air too", "motor", parse("hA*(room - motor)"))))
    found = {h.states for h in claims(model, catalogue()["air_lag"], channels)}
    assert found == {("bed", "motor"), ("bed",), ("motor",)}


def test_heat_that_follows_a_power_is_no_more_than_it() -> None:
    """An extruder: 114 kW from a heater of 0.9 kW. Of a body without a capacity nobody knows the watts."""
    model, channels = sample()
    found = {h.states: h for h in claims(model, catalogue()["input_heat_load"], channels)}
    assert found["bed",].effect.amplitude.most == 3 * HIGH["drive"]  # capacities are known no better
    rates = {name: replace(state, capacity=None) for name, state in model.states.items()}
    found = {
        h.states: h for h in claims(replace(model, states=rates), catalogue()["input_heat_load"], channels)
    }
    assert found["bed",].effect.amplitude.most == inf


def test_no_thermometer_is_set_to_zero() -> None:
    (h, *_) = expand(catalogue()["rezero"])
    assert set(h.shown) == {"E_Y", "E_Z"}


def test_a_heater_next_to_friction_does_not_age() -> None:
    """An extruder: oil that thins out was tried on its heater as well, and moved air was named."""
    model, channels = sample()
    model = replace(model, terms=(*model.terms, Term("heater", "table", parse("loss*drive"))))
    for word in ("wear", "viscosity_friction"):
        alone = [h for h in claims(model, catalogue()[word], channels) if h.states == ("table",)]
        assert {t.name.split(": ")[1] for h in alone for t in h.terms} == {"bearing"}


def test_losses_age_all_together_or_at_one_body() -> None:
    """Whatever their law, from the second recording on: what is common to all is the model's own gain."""
    found = expand(catalogue()["wear"])
    assert {h.states for h in found} == {("motor", "table"), ("motor",), ("table",)}
    assert {(h.recording, h.acting) for h in found} == {("two", ("two",))}
    alone = expand(catalogue()["wear"], without={"heat load", "other input"})
    assert {h.states for h in alone} == {("table",)}


def test_heat_of_any_input_can_age() -> None:
    """Guides of a press rub with its strokes, which are neither a power nor a speed."""
    model, channels = sample({"heat load", "rotation speed", "other input"})
    channels = {**channels, "strokes": Channel("strokes", "other input", "1/min", None, "held")}
    for law, ages in (("P_g*strokes", True), ("P_g*strokes*(room - bed)", False), ("P_g*pump", False)):
        on = replace(model, terms=(*model.terms, Term("guides", "bed", parse(law))))
        found = {h.states for h in claims(on, catalogue()["wear"], channels)}
        assert (("bed",) in found) == ages


def test_an_input_changes_the_exchange_with_air_coolant_or_fluid() -> None:
    """A second pump of the coolant cools a body; they are three claims, each with its medium in its name."""
    entries = ("input_exchange", "input_exchange_coolant", "input_exchange_fluid")
    model, channels = sample()
    effects = [catalogue()[file] for file in entries]
    found = [
        h for e in effects for h in claims(model, e, channels) if h.states == ("bed",) and "cut" in h.follows
    ]
    assert [h.follows for h in found] == [("cut",), ("cut", "water"), ("cut", "emulsion")]
    assert len({h.key for h in found}) == len({h.amplitudes for h in found}) == 3
    warm = {"cut": 0.5, "room": 20.0, "water": 15.0, "emulsion": 30.0, "bed": 25.0}
    flows = [evaluate(h.terms[0].expression, warm | {h.amplitudes[0]: 10.0}).value for h in found]
    assert [float(flow) > 0 for flow in flows] == [False, False, True]


def test_what_begins_acts_in_the_recordings_that_were_made_later() -> None:
    model, channels = sample()
    three = replace(scene(model, channels), recordings=("a", "b"), after={"a": ("a", "c", "b"), "b": ("b",)})
    (wear, *_) = found = candidates(model, [catalogue()["wear"]], three)
    assert {h.recording for h in found} == {"b"}  # what is so from the first one on is the model's own
    assert wear.acting == ("b",)
    switch = wear.added_to(model).parameters[wear.switch]
    assert [switch.at(run) for run in ("a", "b", "c", "earlier")] == [0.0, 1.0, 0.0, 0.0]


def test_the_first_recording_is_the_oldest_one_not_the_first_in_the_list() -> None:
    model, channels = sample()
    after = {"a": ("a", "c", "b"), "b": ("b",)}
    seen = replace(scene(model, channels), recordings=("b", "a"), after=after)
    assert {h.recording for h in candidates(model, [catalogue()["wear"]], seen)} == {"b"}


@pytest.mark.parametrize(
    ("recordings", "claimed"), [(("a",), {"a"}), (("a", "b"), {"a", "b", None})], ids=["one", "two"]
)
def test_what_a_single_recording_shows_is_claimed_of_that_recording(
    recordings: tuple[str, ...], claimed: set[str | None]
) -> None:
    model, channels = sample()
    drifts = [e for e in catalogue().values() if e.word == "sensor_drift"]
    found = candidates(model, drifts, replace(scene(model, channels), recordings=recordings))
    assert {h.recording for h in found} == claimed


def test_every_recorded_input_may_be_heat_a_path_or_a_factor() -> None:
    """Each input of a role at each place, not the first alone; what the model has already is not offered: the
    motor has heat by the square of its current, and may lack a share in proportion.
    """
    heat = {(h.channels, h.states) for h in expand(catalogue()["input_heat"])}
    everywhere = {((name,), (body,)) for name in ("cut", "spray") for body in ("motor", "table", "bed")}
    assert heat == everywhere | {(("servo",), (body,)) for body in ("motor", "table", "bed")}
    square = {(h.channels, h.states) for h in expand(catalogue()["input_heat_current"])}
    assert square == {(("servo",), ("table",)), (("servo",), ("bed",))}
    path = {(h.channels, h.outputs) for h in expand(catalogue()["input_path"])}
    assert {c for (c,), _ in path} >= {"cut", "spray", "drive", "rpm", "pump"}
    assert {y for _, y in path} == {("E_Y",), ("E_Z",)}
    model, _ = sample()
    known = replace(model, terms=(*model.terms, Term("cut", "bed", parse("loss*cut"))))
    left = {(h.channels, h.states) for h in claims(known, catalogue()["input_heat"])}
    assert left == heat - {(("cut",), ("bed",))}
    fixed = replace(model, terms=(*model.terms, Term("cut", "bed", parse("0.5*cut"))))
    assert {(h.channels, h.states) for h in claims(fixed, catalogue()["input_heat"])} == heat  # it may be off


def test_nothing_rubs_in_the_sun() -> None:
    """A solar field with a constant flow lacked "oil that gets thinner", 98 %, in the heat of the sun."""
    model, channels = sample()
    lit = {**channels, "cut": Channel("cut", "other input", "W/m**2", None, "linear")}
    shone = replace(model, terms=(*model.terms, Term("cut", "bed", parse("loss*cut"))))
    for word in ("wear", "viscosity_friction"):
        found = {t.name for h in claims(shone, catalogue()[word], channels) for t in h.terms}
        assert any(name.endswith(": cut") for name in found)
        found = {t.name for h in claims(shone, catalogue()[word], lit) for t in h.terms}
        assert found
        assert not any(name.endswith(": cut") for name in found)


def test_no_path_reaches_a_temperature_but_as_heat() -> None:
    """An error may follow an input at once; a thermometer shows what its body takes up."""
    model, channels = sample()
    warm = {**channels, "motor": Channel("motor", "temperature", "degC", None, "linear")}
    both = replace(scene(model, warm), outputs=("E_Y", "motor"))
    found = candidates(model, [e for e in catalogue().values() if e.word == "input_path"], both)
    assert {h.outputs for h in found} == {("E_Y",)}


def test_two_channels_of_a_role_are_both_asked_for() -> None:
    model, channels = sample()
    other = {**channels, "oil": replace(channels["emulsion"], name="oil")}
    dry = replace(model, terms=tuple(t for t in model.terms if t.name != "fluid"))
    found = {(h.channels, h.states) for h in claims(dry, catalogue()["fluid_convection"], other)}
    assert {channels[0] for channels, _ in found} == {"emulsion", "oil"}


def test_one_law_on_a_group_of_bodies_has_one_size() -> None:
    model, channels = sample()
    air = Term("air at motor", "motor", parse("hA*(room - motor)"))
    shared = catalogue()["radiation"]
    assert shared.shared
    found = claims(replace(model, terms=(*model.terms, air)), shared, channels)
    (both,) = (h for h in found if len(h.states) > 1)
    assert set(both.states) == {"motor", "bed"}
    assert len(both.amplitudes) == 1
    assert {t.into for t in both.terms} == {"motor", "bed"}


def test_a_law_on_a_group_may_leave_bodies_out() -> None:
    """It keeps its size; of one body it is another candidate, and what enters two bodies has no parts."""
    model, channels = sample()
    air = (Term(f"air at {b}", b, parse(f"hA*(room - {b})")) for b in ("motor", "table"))
    found = claims(replace(model, terms=(*model.terms, *air)), catalogue()["radiation"], channels)
    every = next(h for h in found if len(h.states) == 3)
    fewer = every.without(["bed"])
    assert fewer is not None
    assert set(fewer.states) == {"motor", "table"}
    assert [t.into for t in fewer.terms] == [t.into for t in every.terms if t.into != "bed"]
    assert fewer.amplitudes == every.amplitudes
    assert fewer.log_odds == pytest.approx(every.log_odds - log(3.0))
    assert every.widens(fewer)
    assert every.without(["bed", "table"]) is None
    path = claims(model, catalogue()["conduction_path"], channels)[0]
    assert path.without([]) is None


def test_a_jet_spreads_over_two_linked_bodies_with_a_size_at_each() -> None:
    """What the fluid wets already, and what no link joins, is no pair."""
    model, channels = sample()
    link = Term("motor to bed", "bed", parse("G_mt*(motor - bed)"), "motor")
    found = claims(replace(model, terms=(*model.terms, link)), catalogue()["displaced_jet"], channels)
    assert {h.states for h in found} == {("motor",), ("bed",), ("motor", "bed")}
    both = next(h for h in found if len(h.states) == 2)
    assert both.amplitudes == ("G_jet_motor_side", "G_jet_bed_side")
    assert [(t.into, t.source) for t in both.terms] == [("motor", None), ("bed", None)]
    assert [set(both.amplitudes) & names(t.expression) for t in both.terms] == [{a} for a in both.amplitudes]
    alone = [h for h in found if len(h.states) == 1]
    assert all(both.widens(h) and not h.widens(both) for h in alone)
    assert not both.widens(both)


@pytest.mark.parametrize("file", ["displaced_jet_moved", "displaced_jet_moved_away"])
def test_a_nozzle_was_moved_only_where_no_channel_says_where_it_points(file: str) -> None:
    model, channels = sample()
    moved = catalogue()[file]
    assert not claims(model, moved, channels)
    assert {h.recording for h in expand(moved)} == {"two"}


@pytest.mark.parametrize("word", ["air_convection", "conduction_path", "sensor_offset", "wear"])
def test_an_effect_has_the_same_odds_at_however_many_places(word: str) -> None:
    """The odds of a word (of an event: in each recording) are shared by its places."""
    model, channels = sample()
    found = candidates(model, [catalogue()[word]], scene(model, channels))
    for run in {h.recording for h in found if h.effect.is_event} or {None}:
        total = sum(exp(h.log_odds) for h in found if run is None or h.recording == run)
        assert total == pytest.approx(EVENT_ODDS if run else ODDS)


def test_only_an_effect_that_may_follow_several_inputs_names_its_input() -> None:
    path = expand(catalogue()["input_path"])
    assert {h.where for h in path} >= {"E_Y from cut", "E_Z from rpm"}
    assert all(" from " not in h.where for h in expand(catalogue()["fluid_convection"]))


def test_friction_answers_to_the_oil_next_to_its_body() -> None:
    """The table turns in the oil of the bed, which is read: 100 W at 22 degC, exp(-0.3) of it at 32."""
    model, channels = sample()
    found = claims(model, catalogue()["viscosity_friction_neighbour"], channels)
    linked = {frozenset((t.into, t.source)) for t in model.terms if t.source}
    assert {frozenset(h.states) for h in found} <= linked
    (one, *_) = (h for h in found if h.states[0] == "table")
    (body, oil), (term, *_) = one.states, one.terms
    known = dict.fromkeys(names(term.expression), 1.0) | {one.amplitudes[0]: 1.0, body: 90.0}
    (k,) = one.shapes

    def heat(at: float) -> float:
        return float(evaluate(term.expression, {**known, k: 0.03, oil: at}).value)

    assert heat(22.0) == 0.0
    assert heat(32.0) / heat(42.0) == pytest.approx((np.exp(-0.3) - 1) / (np.exp(-0.6) - 1))


@pytest.mark.parametrize(
    "word", ["input_missed", "displaced_jet_missed", "joint_hysteresis", "copper_resistance_current"]
)
def test_a_share_of_all_is_no_end_of_its_range(word: str) -> None:
    """A fit that ends at a bound has no size: a pump that ran dry was lost, and heat took its place."""
    assert catalogue()[word].amplitude.ends[1] > 1.0


def test_a_joint_without_capacities_is_a_term_at_each_of_its_bodies() -> None:
    """Rates in K/h: what leaves one body is not what enters the other, so each has a number of its own."""
    model, channels = sample()
    rates = {name: replace(s, capacity=None) for name, s in model.states.items()}
    own = tuple(t for t in model.terms if {t.into, t.source} != {"motor", "table"})
    joint = (
        Term("joint", "table", parse("k_t*(motor - table)")),
        Term("joint back", "motor", parse("-k_m*(motor - table)")),
    )
    both = replace(model, states=rates, terms=(*own, *joint))
    (one,) = [
        h
        for h in claims(both, catalogue()["joint_loosening"], channels)
        if set(h.states) == {"motor", "table"}
    ]
    assert {t.into for t in one.terms} == {"motor", "table"}
    assert len(one.amplitudes) == 1
    assert "motor" in one.amplitudes[0]
    paths = claims(both, catalogue()["conduction_path"], channels)
    assert not any(set(h.states) == {"motor", "table"} for h in paths)
