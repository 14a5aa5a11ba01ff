"""A body that is hot when a recording begins is no fault of its sensor: it cools, or it is held."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.seen import Seen
from discovery.recordings.compare.temperatures import starts

Array = NDArray[np.float64]
TIME = np.linspace(0.0, 3600.0, 240)
HELD = 100.0 + 0.3 * np.sin(TIME / 7.0)
NAMES = ("bed", "frame", "chamber", "nozzle")
CHANNELS = [Channel(name, "temperature", "degC", None, "linear") for name in NAMES]


def seen(name: str, nozzle: Array) -> Seen:
    slow = {n: 22.0 + k + 8.0 * TIME / 3600.0 for k, n in enumerate(NAMES[:-1])}
    return Seen(name, Path(f"{name}.csv"), TIME, {**slow, "nozzle": nozzle}, np.arange(len(TIME)))


def warmed() -> Array:
    """From the room to 100 degC, where its controller holds it."""
    return np.asarray(np.minimum(HELD, 22.0 + TIME / 10.0))


@pytest.mark.parametrize(
    ("nozzle", "sound"),
    [
        (HELD, True),  # held from the first reading on, as elsewhere later
        (22.0 + 78.0 * np.exp(-TIME / 900.0), True),  # it cools
        (HELD - 30.0, False),  # held where no other recording has it
        (47.0 + 20.0 * TIME / 3600.0, False),  # a sensor that is off by 25 K warms with the machine
    ],
)
def test_a_hot_start(nozzle: Array, sound: bool) -> None:
    recordings = [seen("monday", warmed()), seen("tuesday", warmed()), seen("friday", nozzle)]
    found = list(starts(recordings, CHANNELS))
    assert ([f.channel for f in found] == []) is sound


def test_a_cold_start_among_warm_ones() -> None:
    """It starts as its siblings do: nothing is wrong, though the other recordings begin with a hot nozzle."""
    cooling = 22.0 + 78.0 * np.exp(-TIME / 900.0)
    recordings = [seen("monday", cooling), seen("tuesday", cooling), seen("friday", warmed())]
    assert list(starts(recordings, CHANNELS)) == []


def test_only_one_other_temperature_agrees_with_nothing() -> None:
    """A sensor that is off by 25 K, next to the room alone."""
    room = np.full(len(TIME), 21.0)

    def two(name: str, bed: Array) -> Seen:
        return Seen(name, Path(f"{name}.csv"), TIME, {"bed": bed, "frame": room}, np.arange(len(TIME)))

    cold = 22.0 + 20.0 * TIME / 3600.0
    found = list(starts([two("a", cold), two("b", cold), two("c", cold + 125.0)], CHANNELS[:2]))
    assert [f.channel for f in found] == ["bed"]
    assert "126 K above 'frame'" in found[0].what


def test_the_air_around_a_machine_that_begins_hot_is_as_it_always_is() -> None:
    """A cell was read from the end of another test on: the air, at 22.6 degC, started 21.9 K below both."""
    air = Channel("air", "ambient temperature", "degC", None, "linear")

    def cell(name: str, start: float, room: float) -> Seen:
        body = start + 10.0 * TIME / 3600.0
        series = {"air": room + 0.0 * TIME + np.sin(TIME / 500.0), "bed": body, "frame": body + 0.3}
        return Seen(name, Path(f"{name}.csv"), TIME, series, np.arange(len(TIME)))

    cold = [cell("a", 23.0, 22.0), cell("b", 24.0, 23.0)]
    assert list(starts([*cold, cell("hot", 44.5, 22.6)], [*CHANNELS[:2], air])) == []
    off = list(starts([*cold, cell("cold", 23.0, 1.1)], [*CHANNELS[:2], air]))
    assert [f.channel for f in off] == ["air"]
