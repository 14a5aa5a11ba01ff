"""States of the runtime, input guards in their order, and the rows that feed it."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.export.compiled import compile_model
from discovery.export.document import Exported, Input, Output
from discovery.export.ranges import InputRange, OutputRange
from discovery.export.seal import Seal
from discovery.export.stepper import Stepper
from discovery.models import Model, State
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.compensator import State as Mode
from discovery.runtime.events import Event
from discovery.runtime.fastforward import fast_forward
from discovery.runtime.guards import Fault, InputGuard, Reading
from discovery.runtime.rows import csv_rows, ticks
from discovery.terms import Term, parse

TEMPERATURE = Input(
    "T", "ambient temperature", "degC", "linear", InputRange(20, 24, -30, 60, 0.5, 0.001, 300.0, 8.0, 3600.0)
)
POWER = Input("P", "heat load", "W", "held", InputRange(0, 800, 0, 2000, None, None, 300.0))


def small(rate: str = "P/1000 - y/600", inputs: tuple[Input, ...] = (POWER,)) -> Exported:
    """One error that follows a power, at most 100 um and 1 um/s."""
    model = Model(
        "small",
        {},
        {"y": State("y", "um", None, parse(0.0), 0.0, 1.0)},
        (Term("t", "y", parse(rate)),),
        {"E": parse("y")},
    )
    outputs = (Output("E", "error", "um", OutputRange(100.0, 1.0)),)
    return Exported(
        model, compile_model(model, 1.0), inputs, outputs, 1, {}, (), {}, Seal("0" * 64, None, None)
    )


def test_the_checks_come_in_order() -> None:
    def fault(reading: Reading | None, now: float = 1000.0) -> Fault:
        guard = InputGuard(TEMPERATURE)
        guard.check(Reading(22.0, 990.0), 990.0)
        found = guard.check(reading, now)
        assert found is not None
        assert found.value == (22.0 if found.fault & ~Fault.UNTRAINED else reading.value if reading else None)
        return found.fault

    assert fault(Reading(22.3, 1000.0)) is Fault.NONE
    assert fault(None) is Fault.NOT_FINITE
    assert fault(Reading(math.nan, 0.0, False)) is Fault.NOT_FINITE
    assert fault(Reading(99.0, 0.0, False)) is Fault.QUALITY
    assert fault(Reading(99.0, 0.0)) is Fault.AGE
    assert fault(Reading(99.0, 1000.0)) is Fault.IMPLAUSIBLE
    assert fault(Reading(30.0, 1000.0)) is Fault.JUMP


def minutes_until_taken(
    spec: Input, before: float, values: list[float], together: bool = False
) -> int | None:
    """Minutes until the first of `values`, one a minute, is taken."""
    guard = InputGuard(spec)
    for k in range(10):
        guard.check(Reading(before + 0.01 * (k % 2), 60.0 * k), 60.0 * k)
    for k, value in enumerate(values):
        now = 60.0 * (10 + k)
        found = guard.check(Reading(value, now), now, together)
        assert found is not None
        if found.value == value:
            return k
        assert found.fault & Fault.JUMP
    return None


@pytest.mark.parametrize(
    ("step", "together", "minutes"),
    [
        (2.5, False, 5),  # a hall door
        (-2.0, False, 5),
        (2.5, True, 1),  # another sensor steps the same way
        (15.0, False, 240),  # no room does that within a minute: hours, but not for good
        (15.0, True, 240),
    ],
)
def test_a_step_is_held_back_until_it_has_stayed(step: float, together: bool, minutes: int) -> None:
    noise = 0.02 * np.sin(np.arange(300.0))
    assert minutes_until_taken(TEMPERATURE, 22.0, list(22.0 + step + noise), together) == minutes


def test_a_loose_contact_is_never_taken() -> None:
    flicker = [22.0 + 3.0 + 2.0 * (k % 2) for k in range(600)]
    assert minutes_until_taken(TEMPERATURE, 22.0, flicker) is None


def test_a_value_that_comes_back_is_taken_at_once() -> None:
    guard = InputGuard(TEMPERATURE)
    for k, value in enumerate([22.0, 25.0, 25.0, 22.1, 25.0]):
        found = guard.check(Reading(value, 60.0 * k), 60.0 * k)
    assert found is not None
    assert (found.value, found.fault) == (22.1, Fault.JUMP)
    assert guard.stayed == 0.0


def test_a_held_input_waits_outside_of_its_training_alone() -> None:
    """Inside it may switch at will; one minute at 20 kW is no heat; a new regime is taken after 5 min."""
    wide = replace(POWER, range=replace(POWER.range, plausible_high=50e3))
    for inside in (0.0, 800.0, 1200.0):
        assert minutes_until_taken(wide, 300.0, [inside]) == 0
    assert minutes_until_taken(wide, 300.0, [20e3] * 3 + [300.0]) == 3
    assert minutes_until_taken(wide, 300.0, [2000.0] * 10) == 4
    cycles = [2000.0 + k if k % 4 < 2 else 300.0 for k in range(40)]  # heavy cuts of 2 min
    guard, taken = InputGuard(wide), []
    for k, value in enumerate(cycles):
        found = guard.check(Reading(value, 60.0 * k), 60.0 * k)
        taken.append(found is not None and found.value == value)
    assert all(taken[20:])


def test_a_value_that_stands_still_is_stale() -> None:
    """Fresh stamps, the same number to the last digit: the sensor of the training never did that for 1 h."""
    guard = InputGuard(TEMPERATURE)
    faults = []
    for k in range(70):
        found = guard.check(Reading(22.123, 60.0 * k), 60.0 * k)
        assert found is not None
        faults.append(found.fault)
    assert faults == [Fault.NONE] * 61 + [Fault.AGE] * 9
    found = guard.check(Reading(22.124, 4200.0), 4200.0)
    assert found is not None
    assert found.fault is Fault.NONE


def test_the_gain_fades_beyond_the_trained_range() -> None:
    guard = InputGuard(TEMPERATURE)
    assert [guard.gain(v) for v in (20.0, 24.0, 26.0, 34.0, 10.0, 40.0)] == [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]
    assert 0.0 < guard.gain(29.0) < 1.0


WIDE = replace(POWER, range=replace(POWER.range, high=2000.0))


def failing() -> Exported:
    """A model that gives no number from 1500 W on."""
    return small("log(1500 - P)/10 - y/600", (WIDE,))


def feed(compensator: Compensator, value: object, first: int, count: int, **options: bool) -> list[float]:
    found = [
        compensator.tick({"P": Reading(value, float(t))}, float(t), **options)
        for t in range(first, first + count)
    ]
    return [tick.offsets["E"] for tick in found]


def test_a_model_failure_freezes_and_ramps_out_after_the_part() -> None:
    compensator = Compensator(failing(), Settings(settle_s=10.0))
    feed(compensator, 100.0, 0, 60)
    assert compensator.state.name == Mode.ACTIVE.name
    frozen = feed(compensator, 1600.0, 60, 100)
    assert compensator.state.name == Mode.FROZEN.name
    assert len(set(frozen)) == 1
    assert frozen[0] < 0.0
    done = feed(compensator, 1600.0, 160, 1, part_done=True)
    assert compensator.state.name == Mode.FAULT.name
    ramp = np.array([frozen[-1], *done, *feed(compensator, 1600.0, 161, 120)])
    assert ramp[-1] == 0.0
    assert np.max(np.abs(np.diff(ramp))) <= 1.0 + 1e-9
    assert feed(compensator, 100.0, 300, 5)[-1] == 0.0  # until it has been good for long enough
    compensator.acknowledge()
    feed(compensator, 100.0, 305, 40)
    assert compensator.state.name == "ACTIVE"


def test_a_fault_ends_by_itself_and_each_change_is_told_once() -> None:
    """5 h without a reading, then good ones: FAULT after 4 h, and back 5 min after the sensor."""
    compensator, told, found = Compensator(small(), Settings(tick_s=60.0, settle_s=600.0)), [], []
    for k in range(600):
        now, value = 60.0 * k, None if 120 <= k < 420 else 100.0
        tick = compensator.tick({"P": Reading(value, now)}, now)
        found.append(tick.state.name)
        told += [(k, event.what) for event in tick.events]
    assert found[120:422] == ["DEGRADED"] * 240 + ["FAULT"] * 62
    assert told == [
        (0, "OFF -> COLD"),
        (10, "COLD -> ACTIVE"),
        (120, "ACTIVE -> DEGRADED"),
        (360, "DEGRADED -> FAULT"),
        (425, "FAULT -> WARM"),
        (435, "WARM -> ACTIVE"),
    ]
    clean = Compensator(small(), Settings(tick_s=60.0))
    for k in range(600):
        clean.tick({"P": Reading(100.0, 60.0 * k)}, 60.0 * k)
    assert compensator.offsets == pytest.approx(clean.offsets, abs=0.01)


def test_an_event_says_cause_and_remedy() -> None:
    compensator = Compensator(small("0*T", (TEMPERATURE,)), Settings(tick_s=60.0))
    events: list[Event] = []
    for k, value in enumerate([22.0, 22.0, 24.6, 24.6, 24.6, 24.6, 24.6, 24.6, 24.6]):
        events += compensator.tick({"T": Reading(value, 60.0 * k)}, 60.0 * k).events
    degraded, accepted = events[1:3]
    assert degraded.what == "COLD -> DEGRADED"
    assert degraded.cause == "T stepped from 22 degC to 24.6 degC"
    assert "once it has stayed for 5 min, or when an operator acknowledges it" in degraded.remedy
    assert str(accepted) == "0.12 h step accepted: T stepped to 24.6 degC and stayed there"


def test_an_operator_may_say_that_a_step_is_right() -> None:
    compensator = Compensator(small("0*T", (TEMPERATURE,)), Settings(tick_s=60.0))
    for k, value in enumerate([22.0, 22.0, 37.0]):
        tick = compensator.tick({"T": Reading(value, 60.0 * k)}, 60.0 * k)
    assert tick.faults["T"] & Fault.JUMP
    tick = compensator.tick({"T": Reading(37.0, 180.0)}, 180.0, acknowledge=True)
    assert not tick.faults["T"] & Fault.JUMP


def test_a_clock_that_is_set_back_is_followed_and_told() -> None:
    """A day back: the model goes on at once, its stamps are not from the past."""
    compensator = Compensator(small(), Settings(tick_s=60.0, settle_s=60.0))
    events, states = list[Event](), []
    for k in range(40):
        now = 60.0 * k + (1e5 if k < 20 else 1e5 - 86400.0)
        tick = compensator.tick({"P": Reading(100.0, now)}, now)
        events += tick.events
        states.append(tick.state.name)
    assert states[2:] == ["ACTIVE"] * 38
    assert [event.what for event in events].count("clock") == 1


def test_a_frozen_model_goes_on_when_it_can() -> None:
    compensator = Compensator(failing(), Settings(settle_s=10.0))
    feed(compensator, 100.0, 0, 60)
    feed(compensator, 1600.0, 60, 30)
    again = feed(compensator, 100.0, 90, 300)
    assert compensator.state.name == "DEGRADED"  # it moves, and has to last
    again += feed(compensator, 100.0, 390, 1)
    assert compensator.state.name == "ACTIVE"
    assert all(math.isfinite(value) for value in again)


def test_off_means_zero_and_the_model_goes_on() -> None:
    compensator = Compensator(small(), Settings(settle_s=10.0))
    feed(compensator, 100.0, 0, 600)
    before = compensator.offsets[0]
    off = feed(compensator, 100.0, 600, 400, enabled=False)
    assert compensator.state.name == Mode.OFF.name
    assert off[-1] == 0.0
    back = feed(compensator, 100.0, 1000, 400)
    assert back[-1] < before < 0.0


def test_offsets_stay_within_their_limit() -> None:
    compensator = Compensator(small())
    found = feed(compensator, 800.0, 0, 4000)
    assert min(found) == -100.0


def test_before_any_good_value_nothing_is_given_out() -> None:
    compensator = Compensator(small())
    assert set(feed(compensator, "no number", 0, 20)) == {0.0}
    assert compensator.state.name == Mode.OFF.name


def test_the_gain_falls_straight_from_half_a_span_to_two() -> None:
    """A span is that of the training, of a temperature at least 5 K, of anything else at least its size."""
    speed = Input("n", "rotation speed", "rpm", "held", InputRange(990, 1000, 0, 9000, None, None, 300.0))
    for spec, values in (
        (TEMPERATURE, (26.5, 29.0, 15.0)),
        (POWER, (1200, 1600, -800)),
        (speed, (1500, 2000)),
    ):
        expected = [1.0, 2 / 3, 2 / 3][: len(values)]
        assert [InputGuard(spec).gain(v) for v in values] == pytest.approx(expected)


def test_the_input_furthest_from_its_training_decides_on_the_gain() -> None:
    found = []
    for temperature in (22.0, 29.0):
        compensator = Compensator(small("P/1000 - y/600 + 0*T", (POWER, TEMPERATURE)))
        for t in map(float, range(60)):
            tick = compensator.tick({"P": Reading(100.0, t), "T": Reading(temperature, t)}, t)
        found.append(tick.offsets["E"])
    assert found[0] < -5.0
    assert found[1] == pytest.approx(2 / 3 * found[0])
    assert tick.faults == {"P": Fault.NONE, "T": Fault.UNTRAINED}


@pytest.mark.parametrize(("gap", "fault"), [(500.0, Fault.JUMP), (700.0, Fault.NONE)])
def test_after_a_gap_a_value_is_not_compared_with_one_from_before(gap: float, fault: Fault) -> None:
    """1.9 K in 500 s is more than 0.5 K and 0.001 K/s; what was 700 s ago says nothing."""
    compensator = Compensator(small("0*T", (TEMPERATURE,)), Settings(catch_up_s=600.0))
    compensator.tick({"T": Reading(22.0, 0.0)}, 0.0)
    assert compensator.tick({"T": Reading(23.9, gap)}, gap).faults["T"] is fault


def bits(
    compensator: Compensator, now: float, value: object = 100.0, **options: bool
) -> tuple[int, set[int]]:
    """The low byte of the status word, and the numbers of the higher bits that are set."""
    status = compensator.tick({"P": Reading(value, now)}, now, **options).status
    return status & 0xFF, {k for k in range(8, 32) if status >> k & 1}


def test_the_status_word_tells_a_late_tick_and_a_clock_that_goes_back() -> None:
    compensator = Compensator(small(), Settings(recover_s=0.0))
    bits(compensator, 0.0)
    assert [bits(compensator, t) for t in (1.0, 2.0)] == [(Mode.COLD.value, set())] * 2
    assert bits(compensator, 7.0) == (Mode.COLD.value, {17})
    for now in (3.0, math.nan, math.inf):
        assert bits(compensator, now)[1] & {20} == {20}
        assert compensator.last == 7.0
    assert bits(compensator, 8.0) == (Mode.COLD.value, set())
    assert bits(compensator, 800.0) == (Mode.WARM.value, {17})  # too long to make up for
    assert bits(compensator, 801.0, None) == (Mode.DEGRADED.value, {8})
    assert bits(Compensator(small()), math.nan)[1] >= {20}


def test_the_status_word_tells_what_an_offset_was_kept_from() -> None:
    compensator = Compensator(small())
    seen = [bits(compensator, float(t), 800.0)[1] for t in range(200)]
    free = seen.index({18})
    assert seen[10:] == [set()] * (free - 10) + [{18}] * (200 - free)
    assert 480.0 * (1 - math.exp(-free / 600)) == pytest.approx(100.0, abs=1.5)
    off = [bits(compensator, 200.0 + t, 800.0, enabled=False) for t in range(110)]
    assert off[:99] == [(Mode.OFF.value, {19})] * 99
    assert off[-1] == (Mode.OFF.value, set())


def test_the_difference_at_a_change_of_model_fades() -> None:
    """The new model says 50 um where 20 um were compensated: 30 um, fading with 100 s."""
    compensator = Compensator(small("0*P"), Settings(bump_s=100.0))
    compensator.succeed({"y": 50.0}, {"E": -20.0})
    ticks_ = [compensator.tick({"P": Reading(1.0, float(t))}, float(t)) for t in range(1200)]
    expected = -50.0 + 30.0 * np.exp(-np.arange(1200) / 100.0)
    assert [tick.offsets["E"] for tick in ticks_] == pytest.approx(expected.tolist())
    flagged = [bool(tick.status >> 16 & 1) for tick in ticks_]
    assert flagged == (30.0 * np.exp(-np.arange(1200) / 100.0) > 1e-3).tolist()


def test_through_a_gap_temperatures_run_straight_and_switches_are_off() -> None:
    """The integral of each input over 25 000 s, in which the room goes from 20 to 24 degC."""
    pump = Input("F", "fluid flow", "1", "held", InputRange(0, 1, 0, 1, None, None, 300.0))
    nozzle = Input("h", "nozzle height", "mm", "held", InputRange(0, 100, 0, 200, None, None, 300.0))
    for spec, before, after, mean in (
        (TEMPERATURE, 20.0, 24.0, 22.0),
        (pump, 1, 1, 0.0),
        (nozzle, 50, 90, 50.0),
    ):
        exported = small(spec.name, (spec,))
        stepper = Stepper(exported.compiled)
        stepper.start(np.array([before], dtype=float))
        fast_forward(exported, stepper, np.array([float(before)]), np.array([float(after)]), 25_000)
        assert stepper.count == 25_000
        assert stepper.x[0] == pytest.approx(25_000 * mean)


def test_trouble_lasts_as_long_as_it_is_said() -> None:
    """Settled after 20 s, an input replaced for 30 s, outputs held for 40 s, and not a tick longer."""

    def modes(value: object, count: int) -> list[str]:
        times = Settings(settle_s=20.0, hold_limit_s=30.0, freeze_limit_s=40.0)
        compensator = Compensator(failing(), times)
        names = []
        for t in range(50 + count):
            compensator.tick({"P": Reading(100.0 if t < 50 else value, float(t))}, float(t))
            names.append(compensator.state.name)
        assert names[:50] == ["COLD"] * 20 + ["ACTIVE"] * 30
        return names[50:]

    assert modes(None, 40) == ["DEGRADED"] * 30 + ["FAULT"] * 10
    assert modes(1600.0, 50) == ["FROZEN"] * 41 + ["FAULT"] * 9


def test_rows_are_read_whatever_stands_in_them() -> None:
    lines = [
        "time,P,T\n",
        "0,1,2\n",
        "x,1,1\n",
        "10,,abc\n",
        "5,9,9\n",
        '20,"3\n',
        "30,4\n",
        "1e300,5,5\n",
        "40,6,7,8\n",
        "\n",
    ]
    rows = list(csv_rows(lines))
    assert [time for time, _ in rows][:2] == [0.0, 10.0]
    assert max(time for time, _ in rows) <= 40.0
    assert math.isnan(rows[1][1]["T"].value)  # type: ignore[arg-type]
    assert "P" not in rows[1][1]
    with pytest.raises(UserError, match="no column 'time'"):
        list(csv_rows(["a,b\n", "1,2\n"]))


def test_ticks_use_what_was_known_by_then() -> None:
    rows = [
        (0.0, {"P": Reading(1.0, 0.0)}),
        (25.0, {"P": Reading(2.0, 25.0)}),
        (30.0, {"P": Reading(3.0, 30.0)}),
    ]
    found = [(now, newest["P"].value) for now, newest in ((n, dict(a)) for n, a in ticks(rows, 10.0))]
    assert found == [(0.0, 1.0), (10.0, 1.0), (20.0, 1.0), (30.0, 3.0)]
    assert [now for now, _ in ticks(rows, 10.0, after=10.0)] == [20.0, 30.0]
    far = [*rows, (1e5, {"P": Reading(4.0, 1e5)})]
    assert [now for now, _ in ticks(far, 10.0)] == [0.0, 10.0, 20.0, 30.0, 1e5]  # the machine was off


@pytest.mark.parametrize("zone", ["UTC", "Europe/Berlin", "America/New_York"])
def test_instants_do_not_depend_on_the_clock_of_the_computer(
    monkeypatch: pytest.MonkeyPatch, zone: str
) -> None:
    """The hours of both changes of summer time, every half hour: none is lost, and naive means UTC."""
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        for day, first in (("2026-03-29", 1774746000.0), ("2026-10-25", 1792890000.0)):
            stamps = [f"{day}T{h:02d}:{m:02d}:00" for h in range(1, 4) for m in (0, 30)]
            rows = list(csv_rows(["time,P", *(f"{stamp},1" for stamp in stamps)]))
            assert [t for t, _ in rows] == [first + 1800.0 * k for k in range(6)]
        [(zoned, _)] = csv_rows(["time,P", "2026-03-29T03:00:00+02:00,1"])
        assert zoned == 1774746000.0
    finally:
        monkeypatch.undo()
        time.tzset()


def test_the_command_says_what_is_missing(model_file: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    model, inputs = str(model_file), ["--inputs", "-"]
    for words, sentence, status in (
        ([model, *inputs], "no key is trusted", 1),
        ([model, "--allow-unsigned", "--inputs", "none.csv"], "there is no such file", 1),
        ([model, "--allow-unsigned", "--inputs", str(tmp_path)], "this is a folder", 1),
        ([str(tmp_path / "none.json"), *inputs], "there is no such file", 1),
        ([model, "--back", "--state", str(tmp_path)], "--back is not possible", 1),
        ([model, *inputs, "--trust", str(tmp_path / "no.pub")], "there is no such key", 1),
        ([model, "--allow-unsigned"], "give the source of the readings: --inputs FILE", 2),
        ([model, "--back"], "--back needs --state", 2),
        ([model, *inputs, "--opcua-demo"], "--inputs and --opcua-demo: the readings have one source", 2),
        ([model, *inputs, "--seconds", "5"], "--seconds cannot be used with --inputs", 2),
        ([model, *inputs, "--learn", "key.pem"], "--learn needs --state", 2),
        ([model, *inputs, "--shadow-hours", "-1"], "--shadow-hours is -1; give 0 or more", 2),
        ([model, *inputs, "--shadow-um", "nan"], "--shadow-um is nan; give 0 or more", 2),
    ):
        done = runner.invoke(app, ["compensate", *words])
        assert done.exit_code == status
        assert sentence in done.output


def test_a_column_that_is_not_there_is_told(model_file: Path) -> None:
    """A file of something else had been run, with exit status 0 and a table of zeros."""
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", "-"]
    some = CliRunner().invoke(app, command, input="time,T_env,speed\n0,20,0\n")
    assert some.exit_code == 1
    assert (
        "there was no offset: P_drive, T_cool, T_fluid, h_nozzle, pump never had a good reading"
        in some.stderr
    )
    assert "the inputs have no column P_drive, T_cool, T_fluid" in some.stderr
    none = CliRunner().invoke(app, command, input="time,a\n0,20\n")
    assert none.exit_code == 1
    assert "name a file with its inputs" in none.stderr
    assert none.stdout == ""


@pytest.mark.parametrize(
    ("text", "status"), [("t;T_env\n0;20\n", 1), ("time,a\n0,20\n", 1), ("time,T_env\n", 0)]
)
def test_inputs_that_are_refused_leave_no_state(
    model_file: Path, tmp_path: Path, text: str, status: int
) -> None:
    memory = tmp_path / "mem"
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", "-", "--state", str(memory)]
    assert CliRunner().invoke(app, command, input=text).exit_code == status
    assert not memory.exists()
    assert CliRunner().invoke(app, command, input="time,T_env\n0,20\n").exit_code == 1
    assert (memory / "active.json").exists()


def test_the_output_may_not_be_what_is_read(model_file: Path, tmp_path: Path) -> None:
    inputs = tmp_path / "in.csv"
    inputs.write_text("time,T_env\n0,20\n")
    for used in (inputs, model_file):
        before = used.read_bytes()
        command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", str(inputs)]
        done = CliRunner().invoke(app, [*command, "--out", str(used)])
        assert (done.exit_code, "--out names the same file" in done.output) == (1, True)
        assert used.read_bytes() == before


def test_inputs_that_cannot_be_read_leave_an_older_output(model_file: Path, tmp_path: Path) -> None:
    inputs, out = tmp_path / "in.csv", tmp_path / "offsets.csv"
    inputs.write_text("t;T_env\n0;20\n")
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", str(inputs), "--out", str(out)]
    assert CliRunner().invoke(app, command).exit_code == 1
    assert not out.exists()
    out.write_text("what was there")
    assert CliRunner().invoke(app, command).exit_code == 1
    assert out.read_text() == "what was there"
    inputs.write_text("time,T_env\n0,20\n")
    assert CliRunner().invoke(app, command).exit_code == 1  # no offset: the others are missing
    assert out.read_text().startswith("time,state,status")
