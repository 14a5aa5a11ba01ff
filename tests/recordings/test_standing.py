"""Sensors that stand still."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.recordings.standing import stood_before


@pytest.mark.parametrize(
    ("readings", "at", "hung"),
    [
        ([20.0, 20.1, 20.3, 20.3, 20.3, 21.4, 21.5], 5, True),
        ([20.0, 20.1, np.nan, 20.3, 20.3, np.nan, 21.4, 21.5], 6, True),
        ([20.0, 20.1, 20.2, 20.3, 20.4, 21.4, 21.5], 5, False),
        ([20.0, 20.0, 20.1, 20.1, 21.4, 21.4, 21.5], 4, False),  # a coarse logger shows all readings twice
        ([20.0, 20.1, 20.3, 20.3, 20.3, 21.4, 21.5], 6, False),
    ],
)
def test_a_sensor_that_hangs_jumps_when_it_shows_its_body_again(
    readings: list[float], at: int, hung: bool
) -> None:
    assert stood_before(np.array(readings), at) == hung
