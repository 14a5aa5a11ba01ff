"""What the verdict `nothing` may hide: a change of that size is found in 19 of 20 recordings."""

from __future__ import annotations

import numpy as np

from discovery.runtime.changes import Change, Seen
from discovery.runtime.unseen import limit

LEAST = 11.0


def test_a_change_of_the_size_that_is_printed_would_almost_surely_have_been_seen() -> None:
    rng = np.random.default_rng(3)
    slope = rng.normal(size=400)
    change = Change(np.array([0]), np.ones((1, 1)))

    def seen(size: float) -> Seen:
        rows = np.column_stack([size * slope + rng.normal(size=400), slope])
        return Seen(rows.T @ rows)

    size = limit(seen(0.0), change, LEAST)
    usual = Change(change.columns, size * change.root)

    def share(times: float) -> float:
        return float(np.mean([seen(times * size).log_odds(usual) > LEAST for _ in range(400)]))

    assert 0.9 < share(1.0) < 0.99
    assert share(0.5) < 0.2
    assert share(0.0) == 0.0
