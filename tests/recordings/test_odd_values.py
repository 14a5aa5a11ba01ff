"""Readings that only a fault explains, up to three in a row, and what is none."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings import load_campaign
from discovery.recordings.campaign import Channel
from discovery.recordings.oddvalues import impossible_readings, logger_words, odd_findings, odd_readings
from tests.recordings.conftest import Write, found, with_column

PROBE = Channel("z", "error", "um", None, "linear")


def slow(seed: int = 1) -> NDArray[np.float64]:
    rng = np.random.default_rng(seed)
    return np.asarray(-150.0 * (1.0 - np.exp(-np.arange(200) / 60.0)) + rng.normal(0.0, 2.0, 200))


@pytest.mark.parametrize("code", [-99.0, -127.0, 999.0, 9999.0])
def test_a_code_far_from_all_readings_is_none(code: float) -> None:
    read = np.linspace(20.0, 31.0, 60)
    read[10:50:3] = code
    assert logger_words(read).tolist() == list(range(10, 50, 3))


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


def test_air_may_be_exactly_zero(write: Write) -> None:
    """Calm air read by a coarse sensor touches zero; a sensor that fails there falls to it."""
    air = np.round(2.0 * np.cos(np.arange(600) / 95.0) + 1.95, 1)
    air[np.abs(air) < 0.15] = 0.0
    assert (air == 0.0).sum() > 20
    assert found(write(with_column(1, [f"{value:.1f}" for value in air]))) == []
    air[[20, 21, 22]] = 0.0
    [finding] = found(write(with_column(1, [f"{value:.1f}" for value in air])))
    assert "exactly zero between readings far from zero" in finding


def test_slow_quantised_and_switched_signals_are_no_frozen_sensors(write: Write) -> None:
    random = np.random.default_rng(1)
    slow = 22 + np.cumsum(random.normal(0, 0.02, 600))
    cells = [f"{value:.1f}" for value in slow]  # a sensor of 0.1 degC that changes every few readings
    assert found(write(with_column(1, cells))) == []


def test_a_sensor_that_hung_while_a_body_warmed_is_known_by_the_jump_behind_it(write: Write) -> None:
    """A plate warmed by 0.35 K from one reading to the next; 22 equal readings, and 8 K more."""
    random = np.random.default_rng(2)
    warming = np.round(20.0 + 50.0 * (1.0 - np.exp(-np.arange(140) / 90.0)) + random.normal(0, 0.05, 140), 2)
    assert found(write(with_column(1, [f"{value}" for value in warming]))) == []
    warming[60:82] = warming[60]
    [told] = found(write(with_column(1, [f"{value}" for value in warming])))
    assert "line 62: 'T_env' stays at" in told
    assert "for 22 readings, up to line 83" in told


def test_one_large_step_nearby_does_not_hide_a_sensor_that_hung(write: Write) -> None:
    """A machine that switches cools its plate by 2.5 K from one reading to the next, soon after."""
    random = np.random.default_rng(2)
    warming = np.round(20.0 + 50.0 * (1.0 - np.exp(-np.arange(140) / 90.0)) + random.normal(0, 0.05, 140), 2)
    warming[60:82] = warming[60]
    warming[88:] -= 2.5
    [told] = found(write(with_column(1, [f"{value:.2f}" for value in warming])))
    assert "for 22 readings, up to line 83" in told


def test_a_sensor_that_hangs_until_the_end_of_a_short_recording_shows_no_jump(write: Write) -> None:
    """Nothing is read behind its last 22 equal readings: they may be a body that stands still."""
    warming = np.round(20.0 + np.cumsum(np.random.default_rng(2).normal(0.3, 0.05, 140)), 2)
    warming[118:] = warming[118]
    assert not any("stays at" in told for told in found(write(with_column(1, [f"{v}" for v in warming]))))


def test_a_body_that_stood_still_and_is_heated_is_no_frozen_sensor(write: Write) -> None:
    """Readings to 0.1 K are equal as long as nothing happens; then the body warms, at first fastest."""
    warming = np.r_[np.full(30, 20.0), 20.0 + 25.0 * (1.0 - np.exp(-np.arange(1, 171) / 10.0))]
    random = np.random.default_rng(2)
    warming[100:] += random.normal(0, 0.1, 100)
    assert found(write(with_column(1, [f"{value:.1f}" for value in warming]))) == []


@pytest.mark.parametrize(
    "cells",
    [
        [20.0] * 30 + [55.0] * 30,  # a step stays
        [20.0] * 30 + [59.0] + [25.0] * 30,  # an overshoot: the neighbours differ
        [20.0 + 35.0 * (k % 2) for k in range(60)],  # a signal that is so
        [20.0] * 30 + [32.0] + [20.0] * 30,  # a door
    ],
)
def test_what_moves_is_no_lone_wrong_reading(write: Write, cells: list[float]) -> None:
    told = found(write(with_column(1, [f"{cell}" for cell in cells])))
    assert not any("in one reading" in line or "in a row" in line for line in told)


def test_wrong_readings_in_a_row_are_left_out_and_said(write: Write) -> None:
    path = write(with_column(1, [f"{cell}" for cell in [20.0] * 30 + [55.0, 55.5] + [20.0] * 30]))
    [told] = found(path)
    assert "line 32: 'T_env' is 55 degC in 2 readings in a row between 20 and 20" in told
    assert told.endswith("left out")
    air = next(iter(load_campaign(path).recordings.values())).values["T_env"]
    assert np.flatnonzero(np.isnan(air)).tolist() == [30, 31]


@pytest.mark.parametrize("wrong", [1, 2, 3])
def test_wrong_readings_at_the_start_are_left_out_and_said(write: Write, wrong: int) -> None:
    """A sensor that has not answered yet writes -45: a model that starts there misses the whole recording."""
    steady = 59.8 + 0.2 * np.sin(np.arange(60) / 8.0)
    cells = [-45.0] * wrong + [round(value, 1) for value in steady]
    path = write(with_column(1, [f"{cell}" for cell in cells]))
    [told] = found(path)
    count = "one reading" if wrong == 1 else f"{wrong} readings in a row"
    assert f"line 2: 'T_env' is -45 degC in {count} at the start, before 59.8" in told
    assert told.endswith("left out")


@pytest.mark.parametrize("shift", [0.6, 2.0, 5.0])
def test_a_fast_warm_up_at_the_start_is_no_fault(shift: float) -> None:
    """A nozzle is heated from the first reading on: its steps become smaller, they do not stop at once."""
    read = 220.0 - 195.0 * np.exp(-np.arange(200) / shift) + np.random.default_rng(3).normal(0.0, 0.05, 200)
    assert impossible_readings(Channel("n", "temperature", "degC", None, "linear"), read).size == 0


@pytest.mark.parametrize("rows", [[0], [0, 1], [70, 71]])
def test_what_is_left_out_does_not_disturb_the_comparison_of_recordings(rows: list[int]) -> None:
    read = slow()
    read[rows] += 4300.0
    assert odd_readings(PROBE, read).tolist() == rows


@pytest.mark.parametrize(("gap", "jumps"), [(0.0, 1), (1200.0, 0)])
def test_a_jump_is_none_where_nothing_was_read_for_long(gap: float, jumps: int) -> None:
    """A cell that warms, read every 10 s: 10 K warmer at the next reading, or after 20 minutes of pause."""
    read = 20.0 + 0.02 * np.arange(100) + np.random.default_rng(3).normal(0.0, 0.05, 100)
    read[50:] += 10.0
    time = 10.0 * np.arange(100) + gap * (np.arange(100) >= 50)
    cell = Channel("T_cell", "temperature", "degC", None, "linear")
    said = list(odd_findings(Path("a.csv"), np.arange(2, 102), cell, read, time))
    assert sum("jumps" in finding.what for finding in said) == jumps
