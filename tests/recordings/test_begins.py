"""What lies where it lies in other recordings is in the unit, and has the sign, that the campaign states."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import _begins_elsewhere, _goes_elsewhere
from discovery.recordings.compare.repairs import clocks, halves, signs, swaps, units
from discovery.recordings.compare.seen import Seen
from discovery.recordings.units import conversion

NOZZLE = Channel("nozzle", "temperature", "degC", None, "linear")
ROOM = Channel("room", "ambient temperature", "degC", None, "linear")
OIL = Channel("oil", "fluid flow", "l/min", None, "held")


def seen(name: str, values: list[float], channel: str = "nozzle") -> Seen:
    time = np.linspace(0.0, 600.0, len(values))
    return Seen(name, Path(f"{name}.csv"), time, {channel: np.array(values)}, np.arange(len(values)))


@pytest.mark.parametrize(
    ("readings", "right"),
    [
        ([23.7, 60.0, 100.0], True),  # its heater is on, which nobody recorded
        ([np.nan, 23.7, 100.0], True),  # the first reading is missing
        ([74.7, 140.0, 212.0], False),  # the same in degF: 23.7, 60, 100
        ([100.1, 99.5, 100.4], False),  # hot from the start: any unit may be
    ],
)
def test_the_unit_is_right_where_a_temperature_begins_as_elsewhere(
    readings: list[float], right: bool
) -> None:
    to = conversion("degF", "temperature")
    assert to.factor * 74.66 + to.offset == pytest.approx(23.7, abs=0.01)  # what the third case says
    one, others = seen("monday", readings), [seen("tuesday", [25.0, 25.1]), seen("sunday", [21.0, 21.5])]
    known = cast(
        "Any",
        SimpleNamespace(recordings={s.name: s for s in (one, *others)}, channels={"nozzle": NOZZLE}),
    )
    (repair,) = (r for r in units(one, known.channels, [], ["nozzle"]) if "degF" in r.what)
    assert _begins_elsewhere(known, one, repair) is right


@pytest.mark.parametrize(("step", "right"), [(90.0, True), (60.0, True), (0.09, False)])
def test_a_clock_is_right_where_its_interval_is_that_of_others(step: float, right: bool) -> None:
    """A day of another program may agree better with any clock. Read every 90 s as on other days, it is not
    read every 90 ms.
    """
    days = [seen(day, [0.0, 25.0, 70.0, 110.0], "oil") for day in ("monday", "tuesday", "sunday")]
    one, *others = (
        replace(s, time=at * np.arange(4.0)) for s, at in zip(days, (step, 90.0, 60.0), strict=True)
    )
    known = cast("Any", SimpleNamespace(recordings={s.name: s for s in (one, *others)}, channels={}))
    (repair,) = (r for r in clocks(one, {}, [], []) if "minutes" in r.what)
    made = replace(repair, made=one.having({}, time=one.time * (1000.0 if step < 1.0 else 1e-3)))
    assert _goes_elsewhere(known, one, made) is right


@pytest.mark.parametrize(
    ("readings", "right"), [([4.0, 1.0, -4.0, -9.0], True), ([4.0, 33.8, 24.8, 15.8], False)]
)
def test_a_temperature_that_goes_on_smoothly_keeps_its_unit(readings: list[float], right: bool) -> None:
    """From 4 degC on it falls to -9 degC; the same in degF from the second reading on jumps to 33.8."""
    one = seen("monday", readings, "room")
    others = [seen(day, [20.0, 10.0, -5.0, 3.0], "room") for day in ("tuesday", "sunday")]
    known = cast(
        "Any", SimpleNamespace(recordings={s.name: s for s in (one, *others)}, channels={"room": ROOM})
    )
    halved = [r for r in halves(one, known.channels, ["room"], []) if "Fahrenheit" in r.what]
    since = [r for r in halved if np.argmax(one.values["room"] != r.made.values["room"]) == 1]
    assert since
    assert all(_goes_elsewhere(known, one, r) is right for r in since)


@pytest.mark.parametrize(("unit", "right"), [("W/m2", True), ("W", False)])
def test_a_column_in_another_unit_is_right_where_it_lies_as_elsewhere(unit: str, right: bool) -> None:
    """Under snow, sun and power lie where they always lie. Two powers may be swapped."""
    sun, power = [0.0, 400.0, 900.0, 300.0], [0.0, 1.0, 0.5, 0.2]
    one, *others = (
        replace(seen(day, sun, "sun"), values={"sun": np.array(sun), "P": scale * np.array(power)})
        for day, scale in (("monday", 1.0), ("tuesday", 3.0), ("sunday", 3.0))
    )
    channels = {n: Channel(n, "heat load", u, None, "held") for n, u in (("sun", unit), ("P", "W"))}
    by_name = {s.name: s for s in (one, *others)}
    known = cast("Any", SimpleNamespace(recordings=by_name, channels=channels))
    (repair,) = swaps(one, channels, ["sun", "P"], [])
    assert _goes_elsewhere(known, one, repair) is right


@pytest.mark.parametrize(
    ("flow", "said", "right"),
    [
        ([0.0, 25.0, 40.0, 110.0, 70.0, 40.0], "is 10 times too large from", True),
        ([0.0, 25.0, 40.0, 1100.0, 700.0, 400.0], "is 10 times too large from", False),
        ([0.0, 25.0, 40.0, 110.0, 70.0, 40.0], "has the other sign than", True),
        ([0.0, -25.0, -40.0, -110.0, -70.0, -40.0], "has the other sign than", False),
        ([0.0, 25.0, 40.0, 110.0, 70.0, 40.0], "10 times too small", True),
        ([0.0, 2.5, 4.0, 11.0, 7.0, 4.0], "10 times too small", False),
        ([0.0, 25.0, 40.0, 50.0, 50.0, 40.0], "half as large", False),  # both would be usual
    ],
)
def test_a_flow_is_right_where_it_lies_as_elsewhere(flow: list[float], said: str, right: bool) -> None:
    one = seen("monday", flow, "oil")
    others = [seen(day, [0.0, 25.0, 70.0, 110.0], "oil") for day in ("tuesday", "sunday")]
    known = cast(
        "Any", SimpleNamespace(recordings={s.name: s for s in (one, *others)}, channels={"oil": OIL})
    )
    every = (r for family in (units, signs, halves) for r in family(one, known.channels, ["oil"], []))
    found = [r for r in every if said in r.what and np.any(one.values["oil"] != r.made.values["oil"])]
    assert found
    assert all(_goes_elsewhere(known, one, r) is right for r in found)
