"""The start of a further recording: moments of a mixture, against samples drawn from it."""

from __future__ import annotations

import numpy as np

from discovery.sparse.masses import next_start


def test_a_further_start_is_a_mixture_of_those_seen_and_one_unseen() -> None:
    rng = np.random.default_rng(0)
    seen = [
        (np.array([1.0, 2.0]), np.array([[0.5, 0.1], [0.1, 0.2]])),
        (np.array([-1.0, 0.0]), np.array([[0.1, 0.0], [0.0, 0.3]])),
    ]
    unseen = np.zeros(2), np.array([[4.0, 1.0], [1.0, 2.0]])
    count = 40_000  # of each seen recording; the unseen one has half the weight
    drawn = [rng.multivariate_normal(*one, size=count) for one in seen]
    drawn.append(rng.multivariate_normal(*unseen, size=count // 2))
    samples = np.concatenate(drawn)
    mean, covariance = next_start(seen, unseen)
    assert np.allclose(mean, samples.mean(axis=0), atol=0.02)
    assert np.allclose(covariance, np.cov(samples.T), atol=0.04)
