"""A room temperature that nobody recorded: what creeps may be the room, and no sensor is blamed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import disagreements
from discovery.recordings.compare.seen import Seen
from tests.recordings.test_pace import CHANNELS, heated


@pytest.mark.parametrize(("spread", "blamed"), [(0.0, ["odd"]), (5.0, [])])
def test_a_sensor_drifts_in_a_room_that_is_known(spread: float, blamed: list[str]) -> None:
    room = Channel("room", "ambient temperature", "degC", None, "linear", spread=spread)
    channels = {**CHANNELS, "room": room}
    runs = [in_a_room(heated(f"run{k}", k)) for k in range(4)] + [in_a_room(heated("odd", 9), 40.0)]
    found = disagreements(runs, channels)
    assert [(one.recording, one.repair.kind) for one in found] == [(name, "drift") for name in blamed]


def in_a_room(one: Seen, drift: float = 0.0) -> Seen:
    """A room of 22 degC beside it, and a drift of its temperature over the recording."""
    drifting = one.values["T"] + drift * one.time / one.time[-1]
    return replace(one, values={**one.values, "T": drifting, "room": np.full(one.time.size, 22.0)})
