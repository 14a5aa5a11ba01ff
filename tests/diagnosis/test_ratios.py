"""A size that readings leave open by itself, and its ratio to a loss that they show."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from discovery.diagnosis.left_open import Known
from discovery.diagnosis.ratios import known_ratio


def scored(covariance: np.ndarray) -> Any:
    """A model with a heat of 60 K/h and a loss of 3/h, and another size that has nothing to do with them."""
    names, values = ("q", "k", "other"), (60.0, 3.0, 5.0)
    parameters = {n: SimpleNamespace(value=v) for n, v in zip(names, values, strict=True)}
    fit = SimpleNamespace(model=SimpleNamespace(parameters=parameters))
    return cast("Any", SimpleNamespace(fit=fit, known=lambda: Known(names, covariance)))


def test_the_ratio_is_known_where_both_are_open() -> None:
    """q and k are off by the same share, of any size, and by 2 % each on its own: q/k = 20 within
    1.96 sqrt(2) 2 % = 5.5 %.
    """
    own, shared = np.diag([60.0, 3.0, 5.0]) * 0.02, 100.0 * np.array([60.0, 3.0, 0.0])
    found = known_ratio(scored(own @ own + np.outer(shared, shared)), "q")
    assert found is not None
    assert found.to == "k"
    assert found.value == pytest.approx(20.0)
    half = 1.96 * np.sqrt(2) * 0.02
    assert (found.low, found.high) == pytest.approx((20 * (1 - half), 20 * (1 + half)), rel=1e-4)


def test_what_is_open_by_itself_has_no_ratio() -> None:
    assert known_ratio(scored(np.diag([60.0, 3.0, 5.0]) ** 2), "q") is None
    assert known_ratio(scored(np.eye(3)), "unknown") is None
