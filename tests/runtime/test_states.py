"""States of the runtime, its status word, and how it gets over faults, gaps and a change of model."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from discovery.export.document import Exported, Input
from discovery.export.ranges import InputRange
from discovery.export.stepper import Stepper
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.compensator import State as Mode
from discovery.runtime.events import Event
from discovery.runtime.fastforward import fast_forward
from discovery.runtime.guards import Fault, Reading
from tests.runtime.small import POWER, TEMPERATURE, small

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
