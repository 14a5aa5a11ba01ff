"""Sets of every size on normal equations: planted terms, signs, moving poles, against scipy."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from discovery.sparse.bank import filtered
from discovery.sparse.gram import Gram, gram, solve
from discovery.sparse.search import Families, Search, plain, together

TRUE = (1, 4, 6)
NONE: NDArray[np.intp] = np.array([], int)


@pytest.fixture(scope="module")
def planted() -> Gram:
    """Twelve columns, some of them near twins, three of them true."""
    rng = np.random.default_rng(1)
    x = rng.standard_normal((200, 12))
    x[:, 7] = x[:, 6] + 0.3 * x[:, 7]
    x[:, 2] = 20 * (x[:, 1] + 0.3 * x[:, 2])
    return gram(x, 2 * x[:, 1] - x[:, 4] + 1.5 * x[:, 6] + 0.1 * rng.standard_normal(200))


def test_what_was_planted_is_found(planted: Gram) -> None:
    path = Search(planted, plain(12), NONE).path(6)
    assert [len(one) for one in path] == list(range(7))
    assert path[3].members == TRUE
    np.testing.assert_allclose(path[3].theta[np.argsort(path[3].family)], [2, -1, 1.5], atol=0.05)


def test_a_library_without_columns_has_the_empty_set_alone() -> None:
    nothing = gram(np.zeros((5, 0)), np.arange(5.0))
    assert [len(one) for one in Search(nothing, plain(0), NONE).path(3)] == [0]


def test_a_term_that_two_others_imitate_together_is_found() -> None:
    rng = np.random.default_rng(5)
    speed = rng.uniform(0, 1.2, 400)
    x = np.column_stack([speed, speed**2, speed**3, rng.standard_normal((400, 4))])
    g = gram(x, 6 * speed**2 + x[:, 4] + 0.5 * rng.standard_normal(400))
    assert (1, 4) in [one.members for one in Search(g, plain(7), NONE).path(5)]


def test_no_set_is_worse_than_a_smaller_one_and_none_than_elimination(planted: Gram) -> None:
    path = Search(planted, plain(12), NONE).path(12)
    for small, large in pairwise(path):
        assert large.gain >= small.gain - 1e-6
        ends = [planted.cost(solve(planted, [j for j in large.members if j != out])) for out in large.members]
        assert planted.square - small.gain <= min(ends) + 1e-6


def test_what_stays_is_in_every_set(planted: Gram) -> None:
    assert all({0, 3} <= set(one.members) for one in Search(planted, plain(12), np.array([0, 3])).path(6))


def test_signs_are_kept_as_scipy_keeps_them(planted: Gram) -> None:
    low, high = np.zeros(12), np.full(12, np.inf)
    search = Search(planted, plain(12, low, high), NONE)
    for one in search.path(5):
        assert (one.theta >= -1e-12).all()
    found = search.of(np.arange(12))
    rng = np.random.default_rng(1)
    x = rng.standard_normal((200, 12))
    x[:, 7] = x[:, 6] + 0.3 * x[:, 7]
    x[:, 2] = 20 * (x[:, 1] + 0.3 * x[:, 2])
    y = 2 * x[:, 1] - x[:, 4] + 1.5 * x[:, 6] + 0.1 * rng.standard_normal(200)
    np.testing.assert_allclose(found.theta, lsq_linear(x, y, bounds=(low, high)).x, atol=1e-3)


def lagged(drive: NDArray[np.float64], taus: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T, m) responses of a drive with steps of 60 s, held."""
    left = np.ascontiguousarray(drive[:-1, None])
    read = np.arange(len(drive))
    found = filtered(left, left, np.full(len(left), 60.0), read, taus, np.zeros((1, len(taus))))
    return np.asarray(found[:, 0])


def test_a_bank_of_filters_is_the_exact_response_to_a_step() -> None:
    drive, taus = np.ones(200), np.array([300.0, 4000.0])
    time = 60.0 * np.arange(200)
    np.testing.assert_allclose(lagged(drive, taus), 1 - np.exp(-time[:, None] / taus), rtol=1e-10, atol=1e-12)


def test_time_constants_move_between_the_points_of_their_grid() -> None:
    """Two masses of one drive, neither on the grid, and a decoy."""
    rng = np.random.default_rng(3)
    drives = [np.repeat(rng.choice([0.0, 1.0, 2.0], 60), 50) for _ in range(2)]
    taus = np.geomspace(300.0, 40000.0, 24)
    x = np.column_stack([lagged(d, taus) for d in drives])
    y = lagged(drives[0], np.array([1100.0, 9000.0])) @ np.array([1.0, 2.0])
    y = y + 0.05 * rng.standard_normal(len(y))
    free = np.full(2, np.inf)
    search = Search(gram(x, y), Families(np.array([0, 24]), np.array([24, 24]), -free, free), NONE)
    two = search.path(2)[-1]
    order = np.argsort(two.place)
    found = taus[0] * (taus[1] / taus[0]) ** two.place[order]
    assert two.members == (0, 0)
    np.testing.assert_allclose(found, [1100.0, 9000.0], rtol=0.03)
    np.testing.assert_allclose(two.theta[order], [1.0, 2.0], rtol=0.03)
    assert together(two) is None
