"""Faults of the measuring chain on a small log, by hand."""

import numpy as np

from discovery.virtual import faults
from discovery.virtual.log import Columns

NAN = np.nan


def log() -> Columns:
    return {
        "time": np.array([0.0, 60.0, 120.0, 180.0, 240.0]),
        "T": np.array([20.0, 21.0, 22.0, 23.0, 24.0]),
        "E": np.array([1.0, NAN, 2.0, NAN, 3.0]),
        "F": np.array([5.0, NAN, 6.0, NAN, 7.0]),
    }


def test_offset_and_drift() -> None:
    np.testing.assert_array_equal(faults.sensor_offset(log(), "E", 4.0, 100.0)["E"], [1, NAN, 6, NAN, 7])
    drifted = faults.sensor_drift(log(), "E", 86400.0 / 60.0, 120.0)["E"]  # 1 a minute from 120 s on
    np.testing.assert_allclose(drifted, [1, NAN, 2, NAN, 5])


def test_a_scale_is_wrong() -> None:
    np.testing.assert_allclose(faults.sensor_gain(log(), "E", 0.1)["E"], [1.1, NAN, 2.2, NAN, 3.3])
    about = faults.sensor_gain(log() | {"air": np.full(5, 20.0)}, "T", -0.5, "air")["T"]
    np.testing.assert_allclose(about, [20.0, 20.5, 21.0, 21.5, 22.0])


def test_one_reading_is_wrong() -> None:
    np.testing.assert_array_equal(faults.outlier(log(), "E", 50.0, 61.0)["E"], [1, NAN, 52, NAN, 3])


def test_all_readings_jump() -> None:
    jumped = faults.rezero(log(), {"E": 1.0, "F": -2.0}, 120.0)
    np.testing.assert_array_equal(jumped["E"], [1, NAN, 3, NAN, 4])
    np.testing.assert_array_equal(jumped["F"], [5, NAN, 4, NAN, 5])


def test_a_sensor_lags() -> None:
    late = faults.sensor_lag(log(), "E", 120.0)["E"]
    share = 1 - np.exp(-1.0)
    second = 1 + share
    np.testing.assert_allclose(late, [1, NAN, second, NAN, second + (3 - second) * share])


def test_a_clock_is_ahead() -> None:
    shifted = faults.clock_shift(log(), ["E", "F"], 90.0)
    np.testing.assert_array_equal(shifted["time"], [0, 60, 90, 120, 180, 210, 240])
    np.testing.assert_array_equal(shifted["E"], [NAN, NAN, 1, NAN, NAN, 2, NAN])
    np.testing.assert_array_equal(shifted["T"], [20, 21, NAN, 22, 23, NAN, 24])


def test_an_output_lags_between_its_readings() -> None:
    y = np.column_stack([np.zeros(200), np.ones(200)])
    y[0, 1] = 0.0
    shown = faults.lagging(1, 50.0, y, 10.0)
    np.testing.assert_array_equal(shown[:, 0], y[:, 0])
    np.testing.assert_allclose(shown[5, 1], 1 - np.exp(-5 * 10.0 / 50.0))
