"""The trend that a revision holds: how fast wear goes on, and how well that is known."""

from __future__ import annotations

from dataclasses import replace

import pytest

from discovery.export.trend import Trend
from discovery.runtime.wear import RATE, trend_of
from tests.export.test_trend import MODEL
from tests.runtime.small import small

FRESH = replace(small(), model=MODEL)  # a loss of 0.5


def test_a_first_trend_is_drawn_to_none_by_what_is_not_known() -> None:
    clear = trend_of(FRESH, {"loss": (-0.02, 0.001)}, 4.0, 100.0)
    assert clear is not None
    assert clear.at == 100.0
    assert clear.per_day["loss"] == pytest.approx(-0.005, rel=0.01)
    assert clear.sd == pytest.approx(0.0005, rel=0.01)
    vague = trend_of(FRESH, {"loss": (-0.02, 0.2)}, 0.5, 100.0)  # half a day: 4 % a day, give or take 80 %
    assert vague is not None
    assert abs(vague.per_day["loss"]) < 1e-4
    assert vague.sd < RATE


def test_a_later_one_moves_from_the_one_before() -> None:
    before = replace(FRESH, trend=Trend(0.0, {"loss": -0.004, "film": 0.1}, 0.002))
    found = trend_of(before, {"loss": (-0.003, 0.001)}, 3.0, 100.0)
    assert found is not None
    assert found.per_day == pytest.approx({"loss": -0.005, "film": 0.1})
    assert trend_of(FRESH, {}, 3.0, 100.0) is None
