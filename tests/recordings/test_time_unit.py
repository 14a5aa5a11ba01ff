"""In which unit a clock of bare numbers counts: small things that warm within minutes leave a doubt."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.firsthour.odds import probabilities
from discovery.recordings.timeunit import time_odds


@pytest.mark.parametrize("step", [1.0, 10.0])
def test_a_small_heater_in_seconds_is_not_surely_in_minutes(step: float) -> None:
    """A heater on a board warms for ten minutes; length and speed of it say the same thing once."""
    clock = np.arange(0.0, 620.0, step)
    shares = probabilities(time_odds(clock, [64.0 - 41.5 * np.exp(-clock / 130.0)]))
    assert shares["s"] > 0.1
    assert shares["min"] < 0.9  # it is marked as doubtful


def test_a_motor_winding_read_each_second_for_three_minutes_is_not_surely_in_minutes() -> None:
    """A robot's motor, 3 min under 14 A: it was said to be three hours, without a question mark."""
    clock = np.arange(0.0, 181.0)
    warm = np.where(clock < 40.0, 1 - np.exp(-clock / 30.0), 0.74 * np.exp(-(clock - 40.0) / 60.0))
    shares = probabilities(time_odds(clock, [22.8 + 14.0 * warm]))
    assert shares["s"] > 0.2
    assert shares["min"] < 0.9  # it is marked as doubtful


def test_a_machine_of_hours_is_surely_in_seconds() -> None:
    clock = np.arange(0.0, 30000.0, 10.0)
    shares = probabilities(time_odds(clock, [40.0 - 18.0 * np.exp(-clock / 5000.0)]))
    assert shares["s"] > 0.9


def test_a_machine_whose_clock_ends_at_600_is_in_minutes() -> None:
    clock = np.arange(0.0, 600.0, 1.0)
    shares = probabilities(time_odds(clock, [40.0 - 18.0 * np.exp(-clock / 80.0)]))
    assert next(iter(shares)) == "min"


def test_a_counter_of_microseconds_is_a_possible_answer() -> None:
    """A board counts in us and reads each second; the file does not say so. It is not surely in ms."""
    clock = 1e6 * np.arange(250.0)
    shares = probabilities(time_odds(clock, [24.6 + 5.5 * np.exp(-np.arange(250.0) / 60.0)]))
    assert shares["us"] > 0.1
    assert shares["ms"] < 0.9
