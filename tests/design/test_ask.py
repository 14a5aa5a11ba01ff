"""The next experiment is one that the machine at hand can do."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from discovery.design import question
from discovery.design.next_experiment import STEPS, believed, next_experiment
from discovery.design.patterns import patterns
from discovery.design.question import (
    APART,
    CONFIRM,
    NOTHING_CLOSE,
    aim,
    ask,
    check_the_device,
    look_back,
)
from discovery.diagnosis.context import Context
from discovery.diagnosis.diagnose import diagnose
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from discovery.diagnosis.verdict import UNEXPLAINED, Verdict
from discovery.dynamics import make_grid
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.fitting import Noise
from discovery.models import Model, Parameter, State
from discovery.printed import printed
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests import machine
from tests.diagnosis.parts import context_of
from tests.machine import NOISE, SEEN, Array, Inputs, campaign, changed, model, simulated

PLATE = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "heater": Channel("heater", "heat load", "W", None, "held"),
    "T": Channel("T", "temperature", "degC", 0.1, "linear"),
}


def plate(gain: float) -> Model:
    """A heated plate that starts where it was first read."""
    return Model(
        "plate",
        {"loss": Parameter(0.01, "1/s", 0.0), "gain": Parameter(gain, "K/W/s", 0.0)},
        {"T": State("T")},
        (Term("loss", "T", parse("loss*(T_env - T)")), Term("gain", "T", parse("gain*heater"))),
        {},
    )


def ten_minutes() -> Campaign:
    """Steps of a heater on a plate: closed form between the steps."""
    time = np.arange(0.0, 601.0, 5.0)
    heat, rate = np.where((time // 150) % 2 == 0, 0.0, 10.0), 0.01
    values = [60.0]
    for power in heat[:-1]:
        level = 20.0 + 0.05 * power / rate
        values.append(level + (values[-1] - level) * np.exp(-rate * 5.0))
    rng = np.random.default_rng(0)
    recording = Recording(
        "a",
        time,
        {
            "T_env": np.full(len(time), 20.0),
            "heater": heat,
            "T": np.array(values) + rng.normal(0, 0.1, len(time)),
        },
    )
    return Campaign("plate", PLATE, {"a": recording})


def test_a_heated_plate_is_not_sent_to_pump_for_hours() -> None:
    where = context_of(ten_minutes(), plate(0.04), outputs=["T"])
    fitted = where.baseline.model
    other = fitted.with_values({"gain": 1.3 * fitted.parameters["gain"].value})
    said = next_experiment(where, other, fitted, Noise(("T",), (0.1,)), CONFIRM)
    for word in ("dry", "pump", "speed", "fluid", " h "):
        assert word not in said
    assert "step heater" in said or "full heater" in said
    assert "would confirm the answer within about" in said


def test_a_pattern_starts_where_the_machine_was_read() -> None:
    """Two answers that differ in how they cool down are told apart by standing still, from 60 degC on."""
    where = context_of(ten_minutes(), plate(0.04), outputs=["T"])
    fitted = where.baseline.model
    still = replace(fitted, parameters={**fitted.parameters, "gain": Parameter(0.0, "K/W/s", fixed=True)})
    faster = still.with_values({"loss": 2 * still.parameters["loss"].value})
    said = next_experiment(where, faster, still, Noise(("T",), (0.1,)), APART)
    assert "separates the rivals within about" in said


@pytest.mark.parametrize("wet", [True, False])
def test_a_machine_with_a_pump_is_asked_to_run_it_or_to_stay_dry(wet: bool) -> None:
    where = context_of(campaign(simulated(1)), model())
    fitted = where.baseline.model
    name = "hF" if wet else "loss"
    other = fitted.with_values({name: 1.5 * fitted.parameters[name].value})
    said = next_experiment(where, other, fitted, Noise(tuple(SEEN), (NOISE,) * 3), CONFIRM)
    assert ("pump" in said) == wet
    assert ("dry" in said) != wet


@pytest.mark.parametrize("shown", [False, True])
def test_no_sensor_is_asked_for_where_one_is(shown: bool) -> None:
    """A thermometer on the plate is called T_top, and not as the state is."""
    two = Model(
        "plate",
        {
            "loss": Parameter(0.01, "1/s", 0.0),
            "gain": Parameter(0.04, "K/W/s", 0.0),
            "link": Parameter(0.01, "1/s", 0.0),
        },
        {"plate": State("plate", start=parse("60")), "foot": State("foot", start=parse("60"))},
        (
            Term("loss", "plate", parse("loss*(T_env - plate)")),
            Term("gain", "plate", parse("gain*heater")),
            Term("link", "foot", parse("link*(plate - foot)")),
        ),
        {"T": parse("plate" if shown else "0.5*plate + 0.5*foot")},
    )
    where = context_of(ten_minutes(), two, outputs=["T"])
    fitted = where.baseline.model
    other = fitted.with_values({"gain": 1.3 * fitted.parameters["gain"].value})
    said = next_experiment(where, other, fitted, Noise(("T",), (0.1,)), CONFIRM)
    assert ("sensor on plate" in said) != shown
    assert ("sensor on foot" in said) == shown


def test_a_pattern_confirms_an_effect_where_it_acts_and_takes_its_time() -> None:
    """Heat that comes late: half of the pattern says nothing, nor does what a gain explains."""
    where = context_of(ten_minutes(), plate(0.04), outputs=["T"])
    fitted = where.baseline.model
    late = Term("late", "T", parse("0.02*heater*(time > 330)"))
    more = fitted.with_values({"gain": 1.1 * fitted.parameters["gain"].value})
    noise = Noise(("T",), (0.1,))
    said = next_experiment(where, fitted.with_terms(late), fitted, noise, CONFIRM, believed(where))
    minutes = re.search(r"within about ([\d.]+) min", said)
    assert minutes
    assert 5.5 <= float(minutes[1]) < 8.0
    assert "within about 8.3 s" in next_experiment(where, more, fitted, noise, CONFIRM)
    assert "input patterns of" in next_experiment(where, more, fitted, noise, CONFIRM, believed(where))


def test_an_input_of_no_known_role_is_moved_where_it_is_what_acts() -> None:
    runs = ten_minutes()
    one = runs.recordings["a"]
    lamp = np.where(one.time % 200 < 20, 40.0, 0.0)  # off at its median
    runs = replace(
        runs,
        channels={**PLATE, "lamp": Channel("lamp", "other input", "W", None, "held")},
        recordings={"a": replace(one, values={**one.values, "lamp": lamp})},
    )
    where = context_of(runs, plate(0.04), outputs=["T"])
    fitted = where.baseline.model
    lit = fitted.with_terms(Term("lamp", "T", parse("0.02*lamp")))
    said = next_experiment(where, lit, fitted, Noise(("T",), (0.1,)), CONFIRM, believed(where))
    assert said.startswith("step lamp every 50 s: would confirm the answer within about")


def test_an_effect_of_the_fluid_is_not_confirmed_dry() -> None:
    """The baseline that was fitted without it is bent: it would differ most where no fluid flows."""
    runs = campaign(simulated(1), simulated(2))
    answer = diagnose(model(wet=False), runs, ["r1", "r2"])
    assert [n.hypothesis.effect.word for n in answer.verdict.named] == ["fluid_convection"]
    assert "pump" in answer.question
    assert "dry" not in answer.question


def test_what_has_no_answer_is_not_confirmed() -> None:
    def found(word: str, place: str, run: str | None = None) -> Hypothesis:
        every = machine.claims(model(), word)
        return next(h for h in every if (h.places, h.recording) == ((place,), run))

    law, event = found("friction_speed", "motor"), found("unmeasured_heat", "bed", "r1")
    drag = found("film_drag", "motor")
    said = aim([law, event], None, answered=False)
    assert said.does == "would test the closest effect (friction_speed at motor)"
    said = aim([law], drag, answered=False)
    assert said.does == "would separate the closest effects (friction_speed at motor, or film_drag at motor)"
    assert "answer" not in said.does + said.differ
    assert aim([law, event], None, answered=True).does == "would confirm friction_speed at motor"
    assert aim([law], None, answered=True).does == "would confirm the answer"


def scene(unused: Collection[str]) -> SimpleNamespace:
    """Inputs that a model does not use; ice is never there."""
    return SimpleNamespace(unused=frozenset(unused), largest={"fan": 1.0, "current": 5.0})


def test_what_is_recorded_and_not_used_is_asked_for_before_more_is_recorded() -> None:
    nothing = cast(Verdict, SimpleNamespace(word=UNEXPLAINED, named=(), candidates=()))
    for unused, first in (
        ({"fan", "ice"}, "give the model what is recorded and it does not use (fan)"),
        ({"ice"}, NOTHING_CLOSE),
    ):
        where = cast(Context, SimpleNamespace(scene=scene(unused), unused_readings=[]))
        said = ask(where, cast(Search, None), nothing)
        assert said.startswith(first)
        assert said.endswith(NOTHING_CLOSE)


def test_what_is_not_used_is_asked_for_also_where_something_came_close(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A cell without its current: the lag of its thermometer came closest."""
    near = SimpleNamespace(hypothesis=SimpleNamespace(recording="r1"), rivals=())
    close = cast(Verdict, SimpleNamespace(word=UNEXPLAINED, named=(), candidates=(near,), answer=None))
    where = cast(Context, SimpleNamespace(scene=scene({"current"}), unused_readings=[]))
    monkeypatch.setattr(question, "look_back", lambda *_: "look at r1")
    said = ask(where, cast(Search, None), close)
    assert said == "give the model what is recorded and it does not use (current), and compare; look at r1"


def test_an_event_is_looked_at_where_it_was() -> None:
    """No pattern brings a window of the past back."""

    def sun(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
        return (0.0, 0.0, 120.0 * (30000 <= t < 52000))

    said = diagnose(model(), campaign(simulated(1), simulated(2, concealed=sun)), ["r1", "r2"]).question
    assert "confirm" not in said
    assert said.startswith("look at what happened at bed in r2 from 8.")
    assert said.endswith(" h; repeat r2 and see whether it comes again")


def test_of_many_events_the_first_two_are_said() -> None:
    """A heat exchanger: "what happened at ... and what happened at ..." six times, two of them alike."""
    seen = campaign(simulated(1), simulated(2))
    where = cast(Context, SimpleNamespace(campaign=seen))
    offsets = [h for h in machine.claims(model(), "sensor_offset") if h.recording == "r2"][:3]
    assert len({h.where for h in offsets}) == 3
    said = look_back(where, [offsets[0], offsets[0], *offsets[1:]])
    a, b, _ = (f"at {', '.join(h.places)} in r2" for h in offsets)
    assert re.fullmatch(rf"look at what happened {a}.* and {b}.* \(and 1 more\); repeat r2 and .*", said)


def test_a_loss_that_is_another_was_changed_before() -> None:
    seen = campaign(simulated(1), simulated(2))
    wear = next(h for h in machine.claims(model(), "wear") if h.states == ("motor",))
    where = cast(Context, SimpleNamespace(campaign=seen))
    assert look_back(where, [wear]).startswith("look at what was changed at motor before r2; repeat r2")


def test_large_sizes_are_written_out() -> None:
    assert (printed(174.0, 2), printed(73701.4, 4), printed(2e-9)) == ("170", "73700", "2e-09")
    runs = [changed(simulated(s), speed=simulated(s).values["speed"] / 30) for s in (1, 2)]
    said = diagnose(model(), campaign(*runs), ["r1", "r2"]).question
    assert "would have shown" in said
    sizes = re.findall(r" of [\d.e-]+ (\S+)", said)
    assert sizes == ["W/K", "W", "W", "W/K", "W/K"][: len(sizes)]
    assert "e+" not in said


def test_patterns_move_what_the_machine_has() -> None:
    """Half of the time at full speed and load; steps of a twelfth; the pump by a sixth, and dry elsewhere."""
    seen = campaign(simulated(1))
    grids = {"r1": make_grid(seen, "r1", machine.INPUTS, list(SEEN))}
    where = cast(Context, SimpleNamespace(campaign=seen, grids=grids, recordings=("r1",)))
    time = np.linspace(0.0, 43200.0, STEPS + 1)
    found = patterns(where, time)
    high = np.quantile(grids["r1"].samples["speed"].value, 0.95)
    half = found["run 6 h at full speed and P_drive, dry, then stand still for 6 h"]
    assert np.array_equal(half["speed"], np.where(time < 21600.0, high, 0.0))
    assert not half["pump"].any()
    steps = found["step speed and P_drive every 1 h, dry"]["speed"]
    assert np.count_nonzero(np.diff(steps)) == 12
    pump = found["switch the pump every 2 h at full speed and P_drive"]
    assert np.count_nonzero(np.diff(pump["pump"])) == 6
    assert np.all(pump["speed"] == high)
    still = found["stand still and follow the room"]
    assert not still["speed"].any()
    assert not still["pump"].any()


def test_a_coolant_is_stepped_but_never_stays_off() -> None:
    """A flow without a cutting fluid cools the machine: no pattern runs it dry."""
    seen = campaign(simulated(1))
    channels = {n: c for n, c in seen.channels.items() if n != "T_fluid"}
    inputs = [n for n in machine.INPUTS if n != "T_fluid"]
    where = cast(
        Context,
        SimpleNamespace(
            campaign=replace(seen, channels=channels),
            grids={"r1": make_grid(seen, "r1", inputs, list(SEEN))},
            recordings=("r1",),
        ),
    )
    found = patterns(where, np.linspace(0.0, 43200.0, STEPS + 1))
    assert "step pump every 1 h" in found
    assert not [words for words in found if "dry" in words or "switch" in words]
    kept = [inputs["pump"] for words, inputs in found.items() if "step pump" not in words]
    assert all((flow > 0).all() for flow in kept)


def test_what_is_only_measured_is_not_stepped() -> None:
    """Nobody sets the temperature of a column, though a model may be driven by it, nor the sun."""
    seen = campaign(simulated(1))
    fan = replace(seen.channels["pump"], name="pump", role="other input")
    column, sun = replace(fan, between="linear"), replace(fan, unit="W/m^2")
    for channel, there in ((fan, True), (column, False), (sun, False)):
        where = cast(
            Context,
            SimpleNamespace(
                campaign=replace(seen, channels={**seen.channels, "pump": channel}),
                grids={"r1": make_grid(seen, "r1", machine.INPUTS, list(SEEN))},
                recordings=("r1",),
            ),
        )
        found = patterns(where, np.linspace(0.0, 43200.0, STEPS + 1))
        assert any(words.startswith("step pump") for words in found) == there


def test_an_input_is_stepped_alone_while_everything_else_is_on() -> None:
    """An effect of the speed itself shows only at constant power. A pump is switched off and on."""
    seen = campaign(simulated(1))
    grids = {"r1": make_grid(seen, "r1", machine.INPUTS, list(SEEN))}
    where = cast(Context, SimpleNamespace(campaign=seen, grids=grids, recordings=("r1",)))
    found = patterns(where, np.linspace(0.0, 43200.0, STEPS + 1))
    ((_, speed),) = ((words, one) for words, one in found.items() if words.startswith("step speed between"))
    assert np.ptp(speed["P_drive"]) == 0.0 < np.ptp(speed["speed"])
    assert speed["speed"].min() > 0.0 < speed["P_drive"].min()
    assert "step pump between 0 and 1 every 1 h, everything else on" in found


def test_what_is_not_moved_stays_as_it_was_when_the_machine_was_read_first() -> None:
    """From 17 degC on in a room that is 20 degC elsewhere, a machine would seem to warm by itself."""
    cold = ten_minutes()
    one = cold.recordings["a"]
    room = np.where(one.time < 100.0, 17.0, 20.0)
    runs = replace(cold, recordings={"a": replace(one, values={**one.values, "T_env": room})})
    where = context_of(runs, plate(0.04), outputs=["T"])
    for inputs in patterns(where, np.linspace(0.0, 600.0, STEPS + 1)).values():
        assert np.all(inputs["T_env"] == 17.0)


def test_what_is_measured_already_is_asked_before_a_new_experiment() -> None:
    """A machine without a cause, whose thermometers no output shows, needs no new recording yet."""
    where = cast(Context, SimpleNamespace(unused_readings=["T_front", "T_rear"]))
    verdict = Verdict(UNEXPLAINED, cast(Scored, None), (), (), ())
    said = ask(where, cast(Search, None), verdict)
    assert said.startswith("add T_front and T_rear to the `outputs` of the experiment and diagnose again")


def test_what_a_device_shows_in_every_recording_the_machine_may_do() -> None:
    """A cell whose core is warmer than its skin has two thermometers with a lag of 40 s."""
    context = cast(Context, SimpleNamespace(effects=tuple(catalogue().values())))

    def fault(word: str, recording: str | None) -> Hypothesis:
        found = SimpleNamespace(effect=catalogue()[word], recording=recording, where="T_minus")
        return cast(Hypothesis, found)

    once = check_the_device(context, [fault("sensor_drift", "monday")])
    assert once.startswith("check the device and repeat the recording")
    always = check_the_device(context, [fault("sensor_lag", None), fault("sensor_drift", "monday")])
    assert always.startswith("test the device of T_minus apart from the machine")
    assert always.endswith("the machine itself (second_thermal_mass, heater_mass)")
