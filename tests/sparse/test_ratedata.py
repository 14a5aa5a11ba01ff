"""What the search over rates sees of recordings: fewer stamps that say the same."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings import Campaign, Channel, Recording, sample_input
from discovery.sparse.ratedata import (
    make_rate_data,
    readings_that_show,
    rough_noise,
    thinned,
)

Array = NDArray[np.float64]
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "air": Channel("air", "ambient temperature", "degC", None, "linear"),
    "E": Channel("E", "error", "um", None, "linear"),
    "F": Channel("F", "error", "um", 0.7, "linear"),
}


def campaign(count: int, error: Array) -> Campaign:
    time = np.linspace(0.0, 10.0 * (count - 1), count)
    values = {"P": np.floor(time / 500.0) % 3, "air": np.full(count, 20.0), "E": error, "F": error}
    return Campaign("c", CHANNELS, {"r": Recording("r", time, values)})


def test_thinned_recordings_say_the_same_with_fewer_stamps() -> None:
    whole = campaign(10_000, np.arange(10_000.0))
    few = thinned(whole, ["r"], ["E"], ["P", "air"], 250).recordings["r"]
    data = whole.recordings["r"]
    kept = np.flatnonzero(np.isfinite(few.values["P"]))
    assert np.array_equal(kept, np.arange(0, 10_000, 50))  # where it changes
    assert np.array_equal(sample_input(few, CHANNELS["P"], data.time), data.values["P"])
    assert np.array_equal(few.values["air"], data.values["air"])  # straight between its stamps
    read = np.flatnonzero(np.isfinite(few.values["E"]))
    assert len(set(np.diff(read))) == 1
    assert len(read) < 5_000
    assert np.array_equal(few.values["E"][read], data.values["E"][read])
    assert np.array_equal(few.values["F"], data.values["F"])  # is not asked for


def test_few_readings_all_stay() -> None:
    whole = campaign(300, np.arange(300.0))
    few = thinned(whole, ["r"], ["E"], ["P"], 250).recordings["r"]
    assert np.array_equal(few.values["E"], whole.recordings["r"].values["E"])


def test_the_first_weights_are_stated_or_a_fiftieth_of_what_was_seen() -> None:
    readings = np.tile([-3.0, 3.0], 200)
    data = make_rate_data(campaign(400, readings), ["r"], ["E", "F"], ["P", "air"], 4)
    assert rough_noise(data).white == pytest.approx((0.02 * 3.0, 0.7))


def test_every_block_has_a_reading() -> None:
    """The third quarter of the hours holds none: two of eight blocks."""
    readings = np.where((np.arange(400) >= 200) & (np.arange(400) < 300), np.nan, 1.0)
    data = make_rate_data(campaign(400, readings), ["r"], ["E"], ["P", "air"], 4)
    of, grid = data.blocks.of[0], data.grids["r"]
    assert data.blocks.count == 6
    assert all(np.isfinite(grid.readings[of == block]).any() for block in range(6))


def test_what_rings_keeps_eight_readings_a_period_and_noise_keeps_none() -> None:
    noise = 0.3 * np.random.default_rng(0).standard_normal(10_000)
    ringing, slow = (np.sin(2 * np.pi * np.arange(10_000) / period) for period in (40, 2_500))
    assert readings_that_show(campaign(10_000, ringing), ["r"], ["E"]) >= 8 * 10_000 / 40
    assert readings_that_show(campaign(10_000, slow + noise), ["r"], ["E"]) <= 1_000
