"""A step test that is cut into two parts: no input moves in either, so they cannot disagree."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import disagreements
from discovery.recordings.compare.seen import Seen

CHANNELS = {
    "heater": Channel("heater", "heat load", "W", None, "held"),
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "block": Channel("block", "temperature", "degC", None, "linear"),
}


def part(first: float, last: float, room: str, settles: float) -> Seen:
    time = np.arange(first, last, 10.0)
    air = 22.0 + (0.02 * np.sin(time) if room == "recorded" else 0.0 * time)
    values: dict[str, NDArray[np.float64]] = {
        "heater": np.full(time.size, 50.0),
        "T_env": air,
        "block": 64.0 - 41.5 * np.exp(-time / settles) + 0.1 * np.sin(7.0 * time),
    }
    constant = frozenset({"T_env"} if room == "unknown" else ())
    name = f"from {first:g}"
    return Seen(name, Path(f"{name}.csv"), time - first, values, np.arange(time.size), constant)


@pytest.mark.parametrize("room", ["unknown", "recorded"])
@pytest.mark.parametrize("settles", [130.0, 165.0])  # s; called milliseconds, and called a drift
def test_the_end_of_a_step_test_agrees_with_its_begin(room: str, settles: float) -> None:
    found = disagreements([part(0.0, 420.0, room, settles), part(420.0, 640.0, room, settles)], CHANNELS)
    assert [one.repair.what for one in found] == []


def test_a_drift_may_be_the_air_that_nobody_recorded() -> None:
    """A block in a room that warms: a number in the campaign file is no record of the room."""

    def run(name: str, warms: float) -> Seen:
        time = np.arange(0.0, 6000.0, 20.0)
        on = (time % 2000.0 < 1000.0) * 50.0
        block = np.zeros(time.size)
        for k in range(1, time.size):
            block[k] = block[k - 1] + 20.0 * (on[k - 1] * 0.8 - block[k - 1]) / 400.0
        values = {
            "heater": on,
            "T_env": np.full(time.size, 22.0),
            "block": 22.0 + block + warms * time / 6000.0,
        }
        return Seen(name, Path(f"{name}.csv"), time, values, np.arange(time.size), frozenset({"T_env"}))

    found = disagreements([run("a", 0.0), run("b", 0.0), run("c", 0.0), run("d", 20.0)], CHANNELS)
    assert [one.repair.what for one in found] == []
