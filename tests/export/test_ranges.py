"""Ranges, steps, rates and limits that a runtime gets, on recordings whose numbers one can work out."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.export.compiled import Compiled, compile_model
from discovery.export.ranges import InputRange, OutputRange, input_range, output_ranges
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.recordings.roles import ROLES
from discovery.terms import Term, parse

CHANNELS = {
    "T": Channel("T", "ambient temperature", "degC", None, "linear"),
    "P": Channel("P", "heat load", "W", None, "held"),
    "x": Channel("x", "other input", "1", None, "linear"),
}


def campaign(**recordings: dict[str, list[float]]) -> Campaign:
    """The values of each recording under its stamps in `t`."""
    return Campaign(
        "c",
        CHANNELS,
        {
            name: Recording(name, np.array(v["t"]), {n: np.array(s) for n, s in v.items() if n != "t"})
            for name, v in recordings.items()
        },
    )


def test_an_input_has_the_margins_of_the_recording_that_needs_most() -> None:
    """0.06 K a minute in one, a jump of 2 K between stamps of 2 min in the other: 7 of them make 15 min."""
    slow = {"t": [60.0 * k for k in range(61)], "T": [20.0 + 0.06 * k for k in range(61)]}
    jump = {"t": [120.0 * k for k in range(31)], "T": [25.0] * 15 + [27.0] * 16}
    usual = next(iter(ROLES["ambient temperature"].ranges.values())).usual
    for recordings in ({"a": slow, "b": jump}, {"b": jump, "a": slow}):
        found = input_range(campaign(**recordings), list(recordings), "T")
        assert found.step is not None
        assert found.rate is not None
        assert (found.low, found.high, found.age_s) == (20.0, 27.0, 600.0)
        assert (found.plausible_low, found.plausible_high) == usual
        assert (found.step, found.rate) == pytest.approx((6.0, 3 * 2.0 / 840.0))


def test_readings_that_are_not_there_are_no_steps() -> None:
    series = [np.nan, 20.0, np.nan, 21.0, np.nan]
    found = input_range(campaign(a={"t": [0.0, 10.0, 20.0, 30.0, 40.0], "T": series}), ["a"], "T")
    assert (found.low, found.high, found.step, found.age_s) == (20.0, 21.0, 3.0, 100.0)


def test_what_was_recorded_is_plausible() -> None:
    """Also beyond what is usual; where nothing is usual, ten times as far as the recordings went."""
    hot = input_range(campaign(a={"t": [0.0, 60.0], "T": [-90.0, 190.0]}), ["a"], "T")
    assert (hot.plausible_low, hot.plausible_high) == (-90.0, 190.0)
    other = input_range(campaign(a={"t": [0.0, 60.0], "x": [3.0, 5.0]}), ["a"], "x")
    assert (other.plausible_low, other.plausible_high) == (-17.0, 25.0)


def test_what_is_switched_may_take_any_step() -> None:
    found = input_range(campaign(a={"t": [0.0, 60.0, 120.0], "P": [0.0, 800.0, 0.0]}), ["a"], "P")
    assert found == InputRange(0.0, 800.0, found.plausible_low, found.plausible_high, None, None, 300.0)


def sums(rate: str) -> Compiled:
    states = {"y": State("y", "um", None, parse("0"), 0.0, 1.0)}
    return compile_model(Model("m", {}, states, (Term("t", "y", parse(rate)),), {"E": parse("y")}), 10.0)


def test_an_output_may_go_half_beyond_and_twice_as_fast_as_it_went() -> None:
    """0.05 um/s for 20 min, in one recording up and in another down for half as long."""
    up = {"t": [0.0, 1210.0], "P": [50.0, 50.0]}
    down = {"t": [0.0, 610.0], "P": [-80.0, -80.0]}
    found = output_ranges(sums("P/1000"), campaign(a=up, b=down), ["a", "b"])["E"]
    assert found.limit == pytest.approx(1.5 * 0.05 * 1210.0, rel=0.01)
    assert found.rate == pytest.approx(2 * 0.08)


def test_an_output_that_stands_still_may_move_a_little() -> None:
    still = {"t": [0.0, 600.0], "P": [0.0, 0.0]}
    assert output_ranges(sums("P/1000"), campaign(a=still), ["a"])["E"] == OutputRange(1.0, 1e-3)


def test_a_model_that_runs_away_in_fixed_steps_is_told() -> None:
    """y' = y^2 + 1 is tan(t): no number after pi/2 s, whatever the step."""
    still = {"t": [0.0, 7200.0], "P": [1.0, 1.0]}
    with pytest.raises(UserError, match=r"diverges after 10 s of recording 'a' with a fixed step of 10 s"):
        output_ranges(sums("y**2 + P"), campaign(a=still), ["a"])
