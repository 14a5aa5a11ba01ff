"""Recursions along a series, against those of scipy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_banded

from discovery.dynamics import series


@pytest.mark.parametrize("count", [1, 2, 3, 60])
@pytest.mark.parametrize("heavy", [0.0, 3.0])
def test_three_diagonals_are_solved(count: int, heavy: float) -> None:
    below, own, above, wanted = np.random.default_rng(count).normal(size=(4, count))
    bands = np.zeros((3, count))
    bands[0, 1:], bands[1], bands[2, :-1] = above[:-1], own + heavy, below[1:]
    found = series.tridiagonal(below, own + heavy, above, wanted)
    assert found == pytest.approx(solve_banded((1, 1), bands, wanted), rel=1e-9)
