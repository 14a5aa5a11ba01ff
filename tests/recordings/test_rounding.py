"""Readings that stand still show no noise: rounding hides it, and nothing is wrong with them."""

from pathlib import Path

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.levels import level_findings
from discovery.recordings.compare.seen import Seen


def seen(name: str, read: Array) -> Seen:
    time = np.asarray(3.0 * np.arange(read.size), dtype=np.float64)
    return Seen(name, Path(f"{name}.csv"), time, {"T1": read}, np.arange(2, read.size + 2))


def sixteenths(read: Array) -> Array:
    """As a sensor of 1/16 degC writes it with three decimals: 25.562, 25.625, 25.687."""
    return np.asarray(np.floor(1000.0 * np.floor(16.0 * read) / 16.0) / 1000.0)


T1 = Channel("T1", "temperature", "degC", None, "linear")
REST = sixteenths(np.concatenate((np.full(15, 25.57), 25.57 + np.arange(45) / 16.0)))
RAMP = sixteenths(28.4 + 0.19 * np.arange(60) + 0.004 * np.arange(60) ** 1.5)


def test_a_sensor_that_rests_and_then_warms_is_sound() -> None:
    told = list(level_findings([seen("all", np.concatenate((REST, RAMP)))], {"T1": T1}))
    assert told == []


def test_a_recording_at_rest_does_not_make_the_others_noisy() -> None:
    rests = np.concatenate((REST, RAMP[:10]))
    told = list(level_findings([seen("rests", rests), seen("warms", RAMP)], {"T1": T1}))
    assert told == []


@pytest.mark.parametrize("factor", [100.0, 1000.0])
def test_another_unit_halfway_is_still_found(factor: float) -> None:
    read = np.concatenate((RAMP, factor * (RAMP + np.random.default_rng(2).normal(0.0, 0.05, 60))))
    [told] = level_findings([seen("halfway", read)], {"T1": T1})
    assert told.what.endswith("times as noisy from about 3.6 min on")
    assert "e+0" not in told.what
