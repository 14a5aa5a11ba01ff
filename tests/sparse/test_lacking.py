"""Outputs that no sum of lags describes: what a model lacks does not take away what it has."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

from discovery.frames import campaign_from_frames
from discovery.sparse.discover import discover
from discovery.sparse.options import SparseOptions

CHANNELS = {"P": {"role": "heat load", "unit": "W"}, "E": {"role": "error", "unit": "um"}}


def bent(seed: int) -> pd.DataFrame:
    """The root of a level that a load fills and a linear outlet empties; read finely, noise unknown."""
    rng = np.random.default_rng(seed)
    P = np.repeat(rng.choice([0.0, 50.0, 150.0, 400.0], 60), 60)
    level, read = 0.0, []
    for load in P:
        read.append(20 * np.sqrt(level) + 0.01 * rng.standard_normal())
        level += 60.0 / 1800.0 * (load / 100.0 - level)
    return pd.DataFrame({"P": P, "E": read}, index=60.0 * np.arange(len(P)))


def test_a_gain_is_that_of_the_best_line_where_the_noise_is_far_below_what_is_missed() -> None:
    campaign = campaign_from_frames({"a": bent(0), "b": bent(1)}, CHANNELS)
    found = discover(campaign, ["a", "b"], ["E"], SparseOptions(bootstraps=0, form="masses"))
    assert [point.names for point in found.path if point.chosen] == [("1", "P")]
    gains = [p.value for name, p in found.model.parameters.items() if "gain" in name]
    root = 2 * np.sqrt([0.0, 50.0, 150.0, 400.0])
    assert gains == [pytest.approx(np.polyfit([0.0, 50.0, 150.0, 400.0], root, 1)[0], rel=0.1)]


def zeroed(seed: int) -> pd.DataFrame:
    """A fast and a slow response, as slow as a recording is long, from a probe that stands anywhere."""
    rng = np.random.default_rng(seed)
    P = np.repeat(rng.choice([0.0, 100.0, 300.0], 8), 30)
    fast = slow = 0.0
    read = []
    for load in P:
        read.append(fast + slow)
        fast += 60.0 / 600.0 * (0.03 * load - fast)
        slow += 60.0 / 9000.0 * (-0.1 * load - slow)
    E = np.array(read) + rng.uniform(-15, 15) + 0.2 * rng.standard_normal(len(P))
    return pd.DataFrame({"P": P, "E": E}, index=60.0 * np.arange(len(P)))


def test_zeros_that_lie_far_apart_and_a_slow_mass_are_fitted_as_they_were_found() -> None:
    frames = {name: zeroed(k) for k, name in enumerate("abcdef")}
    found = discover(
        campaign_from_frames(frames, CHANNELS),
        list(frames),
        ["E"],
        SparseOptions(bootstraps=0, form="masses"),
    )
    values = {name: p.value for name, p in found.model.parameters.items()}
    taus = sorted(value for name, value in values.items() if "tau" in name)
    assert taus == [pytest.approx(600, rel=0.35), pytest.approx(9000, rel=0.35)]
