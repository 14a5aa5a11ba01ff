"""The small regression tree, against that of scikit-learn."""

from __future__ import annotations

import numpy as np
import pytest
from sklearn.tree import DecisionTreeRegressor

from discovery.diagnosis.tree import grown


@pytest.mark.parametrize("depth", [1, 2])
@pytest.mark.parametrize("seed", range(8))
def test_a_tree_is_that_of_scikit_learn(seed: int, depth: int) -> None:
    rng = np.random.default_rng(seed)
    count = int(rng.integers(60, 1500))
    x = rng.normal(size=(count, 4))
    x[:, 1], x[:, 2] = np.round(x[:, 1]), x[:, 2] > 0.3
    target = (x[:, 0] > 0.5) + rng.normal() * x[:, 2] + rng.uniform(0, 1) * rng.normal(size=count)
    target = (target > 0.8).astype(float) if seed % 2 else target
    least = max(count // 50, 1)
    known = DecisionTreeRegressor(max_depth=depth, min_samples_leaf=least, random_state=0).fit(x, target)
    found = grown(x, target, least, depth)
    assert found.predict(x) == pytest.approx(known.predict(x))
    assert found.score(x, target) == pytest.approx(known.score(x, target), abs=1e-9)


def test_what_does_not_vary_is_a_leaf() -> None:
    x = np.linspace(0, 1, 50)[:, None]
    assert grown(x, np.ones(50), 5, 2).below is None
    assert grown(np.zeros((50, 1)), x[:, 0], 5, 2).below is None
