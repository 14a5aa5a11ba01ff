"""A room temperature that nobody recorded: what creeps may be the room, and no sensor is blamed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import disagreements
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
