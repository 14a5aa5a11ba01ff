"""Which model is best on what was not fitted: a clear lead, a tie, and an interval that covers the truth."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import t

from discovery.evaluation.recommendation import recommend, student95

Array = NDArray[np.float64]


def noise(seed: int, size: float, count: int = 400) -> Array:
    return size * np.random.default_rng(seed).standard_normal(count)


def test_a_clear_lead_has_an_interval_that_holds_the_truth_and_not_zero() -> None:
    found = recommend("E", {"a": [noise(0, 1.0), noise(1, 1.0)], "b": [noise(2, 2.0), noise(3, 2.0)]})
    assert found is not None
    (other,) = found.others
    assert (found.best, other.model, found.ties) == ("a", "b", ())
    assert other.low < other.difference < other.high < -40
    assert other.difference == pytest.approx(-50, abs=5)
    assert found.rms == pytest.approx(1.0, rel=0.1)


def test_models_that_differ_by_chance_tie() -> None:
    rows = {name: [noise(seed, 1.0)] for seed, name in enumerate("abcd")}
    found = recommend("E", rows)
    assert found is not None
    assert len(found.ties) >= 2


def test_the_interval_covers_as_often_as_it_says() -> None:
    """Errors of ratio one, correlated within a piece: 95 % of the intervals hold zero."""
    held = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        smooth = [np.repeat(rng.standard_normal((2, 32)), 12, axis=1) for _ in range(2)]
        found = recommend("E", {"a": list(smooth[0]), "b": list(smooth[1])})
        assert found is not None
        held += found.others[0].tie
    assert held >= 50


def test_a_model_that_ran_away_is_not_recommended() -> None:
    found = recommend(
        "E", {"a": [noise(0, 9.0), noise(1, 9.0)], "b": [noise(2, 5.0), noise(3, 9.0)], "c": []}
    )
    assert found is not None
    assert [one.model for one in found.others] == ["a"]
    assert recommend("E", {"a": [noise(0, 1.0)]}) is None
    assert recommend("E", {}) is None


def test_what_was_not_read_counts_for_nothing() -> None:
    rows = {"a": noise(0, 1.0), "b": noise(1, 3.0)}
    gaps = {name: [np.where(np.arange(400) % 2, one, np.nan)] for name, one in rows.items()}
    found = recommend("E", gaps)
    assert found is not None
    assert found.rms == pytest.approx(float(np.sqrt(np.mean(rows["a"][1::2] ** 2))))


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 7, 8, 29, 100])
def test_the_quantile_of_student_is_that_of_scipy(freedom: int) -> None:
    assert student95(freedom) == pytest.approx(t.ppf(0.975, freedom), rel=1e-12)
