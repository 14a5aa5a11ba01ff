"""Normal equations against the rows behind them: numpy, scipy and PySINDy say the same."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from discovery.sparse.borrowed import fit_quietly
from discovery.sparse.gram import factor, gram, project_out, solve, total

Array = NDArray[np.float64]


def rows(seed: int, count: int = 120, terms: int = 8) -> tuple[Array, Array]:
    """A regression with three true terms, columns of different sizes, and noise."""
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((count, terms)) * rng.uniform(0.3, 3.0, terms)
    theta = np.zeros(terms)
    theta[rng.choice(terms, 3, replace=False)] = rng.uniform(0.5, 2.0, 3)
    return x, x @ theta + 0.1 * rng.standard_normal(count)


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("threshold", [0.02, 0.1, 0.4])
def test_pysindy_finds_on_the_few_rows_of_a_factor_what_it_finds_on_all(seed: int, threshold: float) -> None:
    import pysindy

    x, y = rows(seed)
    few, target = factor(gram(x, y))
    reference, found = (pysindy.STLSQ(threshold=threshold, alpha=0.05) for _ in range(2))
    fit_quietly(reference, x, y)
    fit_quietly(found, few, target)
    np.testing.assert_allclose(np.ravel(found.coef_), np.ravel(reference.coef_), atol=1e-6)


def test_projection_is_the_regression_on_what_the_nuisance_leaves() -> None:
    x, y = rows(3)
    nuisance, others = np.array([0, 1]), np.arange(2, 8)
    left = project_out(gram(x, y), nuisance, np.zeros(2))
    hat = x[:, nuisance] @ np.linalg.pinv(x[:, nuisance])
    np.testing.assert_allclose(
        left.matrix, (x - hat @ x)[:, others].T @ (x - hat @ x)[:, others], rtol=1e-4, atol=1e-3
    )
    full = np.linalg.lstsq(x, y, rcond=None)[0]
    np.testing.assert_allclose(solve(left, range(6)), full[others], atol=1e-5)


def test_bounds_equal_scipy_on_rows() -> None:
    x, y = rows(4)
    low, high = np.full(8, -0.2), np.full(8, 0.6)
    np.testing.assert_allclose(
        solve(gram(x, y), range(8), low, high), lsq_linear(x, y, bounds=(low, high)).x, atol=1e-4
    )


def test_factor_leaves_the_cost_but_for_a_constant() -> None:
    x, y = rows(5)
    g = gram(x, y)
    r, z = factor(g)
    rng = np.random.default_rng(0)
    costs = [(g.cost(t), float(np.sum((z - r @ t) ** 2))) for t in rng.standard_normal((5, 8))]
    differences = [a - b for a, b in costs]
    np.testing.assert_allclose(differences, differences[0], rtol=1e-8)


def test_weights_count_blocks_as_often_as_drawn() -> None:
    x, y = rows(6)
    blocks = [gram(x[i : i + 40], y[i : i + 40]) for i in (0, 40, 80)]
    drawn = total(blocks, [2, 0, 1])
    twice = np.concatenate([x[:40], x[:40], x[80:]])
    np.testing.assert_allclose(drawn.matrix, twice.T @ twice)
    assert drawn.count == 120
