"""Up to three wrong readings in a row are left out as one is, and `check` says so."""

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.oddvalues import impossible_readings

PROBE = Channel("z", "error", "um", None, "linear")


def slow(seed: int = 1) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    return np.asarray(-150.0 * (1.0 - np.exp(-np.arange(200) / 60.0)) + rng.normal(0.0, 2.0, 200))


@pytest.mark.parametrize("rows", [[70], [70, 71], [70, 71, 72], [40, 41, 90, 120, 121, 122]])
def test_left_out(rows: list[int]) -> None:
    read = slow()
    read[rows] += 4300.0
    assert impossible_readings(PROBE, read).tolist() == rows


def test_sound_readings_between_wrong_ones_stay() -> None:
    read = slow()
    read[[70, 71, 74, 75]] += 4300.0
    assert impossible_readings(PROBE, read).tolist() == [70, 71, 74, 75]


def test_what_lasts_or_fades_is_no_fault() -> None:
    lasts = slow()
    lasts[70:74] += 4300.0  # four readings: the probe was moved, or the machine
    assert impossible_readings(PROBE, lasts).size == 0
    heated = 25.0 + np.random.default_rng(2).normal(0.0, 0.05, 200)
    heated[70:73] += [180.0, 195.0, 200.0]
    heated[73:] += 200.0 * np.exp(-np.arange(1, 128) / 1.5)  # a nozzle: hot for three readings, then it cools
    sensor = Channel("nozzle", "temperature", "degC", None, "linear")
    assert impossible_readings(sensor, heated).size == 0
