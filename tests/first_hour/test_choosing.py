"""Which kind of first model wins: a simpler one where parts left out cannot tell it from the best."""

from __future__ import annotations

import pytest

from discovery.firsthour.choosing import Score, as_good


@pytest.mark.parametrize(
    ("simple", "best", "wins"),
    [
        ((0.60, 0.55), (0.55, 0.58), True),  # better here, worse there
        ((0.60, 0.60), (0.55, 0.55), False),  # worse in every part by the same
        ((0.80, 0.50), (0.40, 0.52), False),  # the parts differ, but it is far off
        ((0.59, 0.60, 0.61), (0.57, 0.60, 0.62), True),
    ],
)
def test_a_simpler_kind_wins_where_the_parts_cannot_tell(
    simple: tuple[float, ...], best: tuple[float, ...], wins: bool
) -> None:
    one, other = (Score(n, sum(f) / len(f), f) for n, f in (("simple", simple), ("best", best)))
    assert as_good(one, other) is wins


def test_the_best_is_as_good_as_itself() -> None:
    alone = Score("regression", 0.4, (0.4,))
    assert as_good(alone, alone)
    assert not as_good(Score("reduced", 0.41, (0.41,)), alone)
