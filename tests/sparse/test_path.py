"""Supports of every size: planted terms, groups, signs, and what PySINDy's optimisers find on the same
matrix.
"""

from itertools import pairwise

import numpy as np
import pytest
from discovery.sparse.optimisers import Optimiser, pysindy_path
from discovery.sparse.path import backward, best_of_each_size, forward
from numpy.typing import NDArray

from discovery.sparse.gram import Gram, gram, solve

TRUE = {1, 4, 6}


@pytest.fixture(scope="module")
def planted() -> Gram:
    """Twelve columns, some of them near twins, three of them true."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal((200, 12))
    x[:, 7] = x[:, 6] + 0.3 * x[:, 7]
    x[:, 2] = 20 * (x[:, 1] + 0.3 * x[:, 2])
    return gram(x, 2 * x[:, 1] - x[:, 4] + 1.5 * x[:, 6] + 0.1 * rng.standard_normal(200))


def test_backward_finds_what_was_planted(planted: Gram) -> None:
    assert {frozenset(s) for s in backward(planted)} >= {frozenset(TRUE)}
    assert {frozenset(s) for s in best_of_each_size(planted, 12)} >= {frozenset(TRUE)}


def test_a_term_that_two_others_imitate_together_is_found() -> None:
    rng = np.random.default_rng(5)
    speed = rng.uniform(0, 1.2, 400)
    x = np.column_stack([speed, speed**2, speed**3, rng.standard_normal((400, 4))])
    g = gram(x, 6 * speed**2 + x[:, 4] + 0.5 * rng.standard_normal(400))
    assert {frozenset(s) for s in best_of_each_size(g, 5)} >= {frozenset({1, 4})}


def test_each_step_back_costs_as_little_as_any(planted: Gram) -> None:
    path = backward(planted)
    for small, large in pairwise(path[1:]):
        best = min(planted.cost(solve(planted, [j for j in large if j != out])) for out in large)
        assert planted.cost(solve(planted, small)) == pytest.approx(best, rel=1e-5)


def test_always_stays(planted: Gram) -> None:
    assert all({0, 3} <= set(s) for s in [*backward(planted, (0, 3)), *forward(planted, 6, (0, 3))])
    assert backward(planted, (0, 3))[0] == (0, 3)


def test_groups_are_limited(planted: Gram) -> None:
    groups: NDArray[np.intp] = np.arange(12) // 3  # 1 | 4 | 6 in groups 0, 1 and 2
    for support in forward(planted, 6, groups=groups, max_groups=2):
        assert len(set(groups[list(support)])) <= 2


def test_signs_are_kept(planted: Gram) -> None:
    low = np.zeros(12)
    for support in forward(planted, 5, low=low, high=np.full(12, np.inf)):
        assert (solve(planted, support, low, np.full(12, np.inf)) >= -1e-12).all()
    smallest = {frozenset(s) for s in backward(planted, (), low, np.full(12, np.inf)) if len(s) <= 3}
    assert all(4 not in s for s in smallest)  # its true coefficient is negative


@pytest.mark.parametrize("kind", ["stlsq", "ssr", "sr3"])
def test_optimisers_of_pysindy_find_what_was_planted(planted: Gram, kind: Optimiser) -> None:
    assert {frozenset(s) for s in pysindy_path(planted, kind)} >= {frozenset(TRUE)}
    assert all(0 in s for s in pysindy_path(planted, kind, (0,)))
