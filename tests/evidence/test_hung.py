"""Sensors that hang: what they repeat is set aside."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.evidence.hung import Hung, without_hung
from discovery.recordings import Campaign, Channel, Recording

TIME = np.arange(0.0, 1680.0, 12.0)


def warmed(first: int = 60, last: int = 81) -> Campaign:
    """A plate that its heater warms by some 0.35 K from one reading to the next, seen by two sensors, one of
    which hangs; every third cell is empty.
    """
    random = np.random.default_rng(2)
    plate = 20.0 + 50.0 * (1.0 - np.exp(-np.arange(140) / 90.0))
    seen = {name: np.round(plate + random.normal(0, 0.05, 140), 2) for name in ("hung", "well")}
    seen["hung"][first : last + 1] = seen["hung"][first]
    seen["hung"][::3] = np.nan
    channels = {name: Channel(name, "temperature", "degC", None, "linear") for name in seen}
    channels["P"] = Channel("P", "heat load", "W", None, "held")
    load = np.where(np.arange(140) < 60, 40.0, 50.0)
    return Campaign("plate", channels, {"a": Recording("a", TIME, {**seen, "P": load})})


def test_what_a_sensor_repeats_is_set_aside_but_for_its_first_reading() -> None:
    campaign = warmed()
    cleaned, found = without_hung(campaign, ["hung", "well"])
    before, after = (c.recordings["a"].values["hung"] for c in (campaign, cleaned))
    rows = [k for k in range(61, 82) if k % 3]  # where it was read
    assert found == (Hung("hung", "a", TIME[61], TIME[80], before[61], len(rows)),)
    assert np.isnan(after[rows[1:]]).all()
    kept = [k for k in range(140) if k not in rows[1:]]
    assert after[kept] == pytest.approx(before[kept], nan_ok=True)
    assert cleaned.recordings["a"].values["well"] is campaign.recordings["a"].values["well"]


@pytest.mark.parametrize(
    ("first", "last", "outputs"), [(60, 60, ["hung"]), (110, 139, ["hung"]), (60, 81, [])]
)
def test_nothing_else_is_set_aside(first: int, last: int, outputs: list[str]) -> None:
    """Not what moves, nor what may stand still to the end, nor what is no output."""
    campaign = warmed(first, last)
    assert without_hung(campaign, outputs) == (campaign, ())
