"""Guards of the inputs: their checks in order, what they hold back, and the gain outside of the training."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from discovery.export.document import Input
from discovery.export.ranges import InputRange
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.guards import Fault, InputGuard, Reading
from tests.runtime.small import POWER, TEMPERATURE, small


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
