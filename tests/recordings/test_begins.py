"""A temperature that begins as it does in another recording is in the unit that the campaign states."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.agreement import _begins_elsewhere
from discovery.recordings.compare.repairs import units
from discovery.recordings.compare.seen import Seen
from discovery.recordings.units import conversion

NOZZLE = Channel("nozzle", "temperature", "degC", None, "linear")


def seen(name: str, values: list[float]) -> Seen:
    time = np.linspace(0.0, 600.0, len(values))
    return Seen(name, Path(f"{name}.csv"), time, {"nozzle": np.array(values)}, np.arange(len(values)))


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
