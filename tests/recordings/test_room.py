"""A room temperature that nobody recorded: what creeps may be the room, and no sensor is blamed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import agree_both_ways, disagreements
from discovery.recordings.compare.crossprediction import CrossPrediction
from discovery.recordings.compare.repairs import drifting
from discovery.recordings.compare.seen import Seen
from tests.recordings.test_pace import CHANNELS, heated


@pytest.mark.parametrize(("set_by_hand", "blamed"), [(False, ["odd"]), (True, [])])
def test_a_sensor_drifts_in_a_room_that_is_recorded(set_by_hand: bool, blamed: list[str]) -> None:
    """A number in the campaign file is no record of the room."""
    channels = {**CHANNELS, "room": Channel("room", "ambient temperature", "degC", None, "linear")}
    constant = frozenset({"room"} if set_by_hand else ())
    runs = [in_a_room(heated(f"run{k}", k), 0.0, constant) for k in range(4)]
    found = disagreements([*runs, in_a_room(heated("odd", 9), 40.0, constant)], channels)
    assert [(one.recording, one.repair.kind) for one in found] == [(name, "drift") for name in blamed]


def in_a_room(one: Seen, warmer: float, constant: frozenset[str]) -> Seen:
    """The same in a room of 22 degC; its temperature rises by so much more over the recording."""
    read = one.values["T"] + warmer * one.time / one.time[-1]
    values = {**one.values, "T": read, "room": np.full(one.time.size, 22.0)}
    return replace(one, values=values, constant=constant)


def test_a_load_that_hardly_moves_may_be_wrong_as_well() -> None:
    """Its body is slower than the recordings: 60 % more power than recorded look like a drift."""

    def slow(name: str, share: float, seed: int) -> Seen:
        rng = np.random.default_rng(seed)
        time = np.linspace(0.0, 3600.0, 200)
        watts = 800.0 + rng.normal(0.0, 5.0, time.size)
        warm, part = np.zeros(time.size), 1.0 - np.exp(-time[1] / 1500.0)
        for k in range(1, time.size):
            warm[k] = warm[k - 1] + part * (0.02 * share * watts[k - 1] - warm[k - 1])
        values = {"heater": watts, "T": 22.0 + warm + rng.normal(0.0, 0.05, time.size)}
        return Seen(name, Path(f"{name}.csv"), time, values, np.arange(time.size))

    channels = {**CHANNELS, "room": Channel("room", "ambient temperature", "degC", None, "linear")}
    runs = [in_a_room(slow(f"run{k}", 1.0, k), 0.0, frozenset()) for k in range(4)]
    [one] = disagreements([*runs, in_a_room(slow("odd", 1.6, 9), 0.0, frozenset())], channels)
    assert one.repair.kind == "drift"
    assert "or 'heater' is larger or smaller than recorded" in one.repair.what
    assert one.repair.do == "check its zero and its holder, and the scale of 'heater'"
    moving = [in_a_room(heated(f"run{k}", k), 0.0, frozenset()) for k in range(4)]
    [other] = disagreements([*moving, in_a_room(heated("odd", 9), 40.0, frozenset())], channels)
    assert other.repair.what.endswith("no recorded input explains it")


def test_of_two_recordings_each_predicts_the_other_without_a_drift() -> None:
    """A drift of fitted size fits a little of anything; the other recording may not be predicted at all."""
    channels = {**CHANNELS, "room": Channel("room", "ambient temperature", "degC", None, "linear")}
    same, odd = in_a_room(heated("a", 1), 0.0, frozenset()), in_a_room(heated("b", 2), 40.0, frozenset())
    other = replace(same, values={**same.values, "T": 22.0 + 5.0 * np.sin(same.time / 900.0)})
    for one, agree in ((same, True), (other, False)):
        known = CrossPrediction([one, odd], channels, ["heater", "room"], ["T"], [0.0, 300.0, 600.0, 3000.0])
        repair = drifting(odd, "T", 40.0 / odd.time[-1], "degC")
        assert agree_both_ways(known, repair, ["T"]) is agree
    [found] = disagreements([same, odd], channels)
    assert (found.recording, found.repair.kind) == ("b", "drift")
    assert not [one for one in disagreements([other, odd], channels) if one.repair.kind == "drift"]
