"""A recording that begins where no other one began: the others do not know how it goes on from there."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import disagreements
from discovery.recordings.compare.seen import Seen

CHANNELS = {
    "heater": Channel("heater", "heat load", "percent", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}


def recorded(name: str, begin: int, end: int, tau: float, clock: float = 1.0) -> Seen:
    """Rows of a step test: a heater at 50 % warms a body by 40 K. `clock`: how much too fast it runs."""
    time = 10.0 * np.arange(begin, end)
    values = {
        "heater": np.full(time.size, 50.0),
        "room": np.full(time.size, 22.0),
        "T": np.round(62.0 - 40.0 * np.exp(-time / tau), 1),
    }
    return Seen(name, Path(f"{name}.csv"), clock * (time - time[0]), values, np.arange(time.size))


@pytest.mark.parametrize("tau", [100.0, 130.0, 165.0, 200.0])
def test_a_step_test_that_goes_on_is_not_damaged(tau: float) -> None:
    """The last third of a step test, which `discovery new` holds out, begins hot: neither its clock nor its
    sensor is wrong.
    """
    assert disagreements([recorded("first", 0, 42, tau), recorded("last", 42, 63, tau)], CHANNELS) == []


def test_one_that_begins_as_the_other_can_be_damaged() -> None:
    pair = [recorded("one", 0, 42, 150.0), recorded("another", 0, 42, 150.0, 1 / 60)]
    assert [one.repair.kind for one in disagreements(pair, CHANNELS)] == ["time"]


def test_no_output_that_both_have_needs_no_repair() -> None:
    """A thermometer that the second recording hardly read: there is nothing to compare the inputs by."""
    pair = [recorded("one", 0, 42, 150.0), recorded("another", 0, 42, 150.0)]
    pair[1].values["T"][3:] = np.nan
    pair[1].values["heater"][20:] = 0.0
    assert disagreements(pair, CHANNELS) == []
