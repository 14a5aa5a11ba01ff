"""Time constants, settling times and the symmetry check against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.evaluation.settling import settling
from discovery.evaluation.symmetry import symmetry

HOURS = np.arange(0.0, 15.01, 0.2)


def test_an_exponential_settles_after_2_3_time_constants() -> None:
    """exp(-t/tau) = 0.1 at t = 2.303 tau."""
    found = settling(HOURS * 3600.0, -20.0 * (1 - np.exp(-HOURS / 2.0)))
    assert found is not None
    assert found.tau_h == pytest.approx(2.0, rel=1e-6)
    assert found.change == pytest.approx(-20.0, rel=1e-6)
    assert found.settled_h == pytest.approx(2.0 * np.log(10.0), abs=0.3)  # readings are 0.2 h apart
    assert found.largest == pytest.approx(20.0 * (1 - np.exp(-7.5)), rel=1e-3)


def test_the_standard_error_holds_the_time_constant() -> None:
    """Over 200 noisy repeats, two standard errors hold the truth in 95 % of the cases (90 to 99 here)."""
    rng = np.random.default_rng(1)
    clean = 10.0 * (1 - np.exp(-HOURS / 3.0))
    hits = 0
    for _ in range(200):
        found = settling(HOURS * 3600.0, clean + rng.normal(0.0, 0.4, len(HOURS)))
        assert found is not None
        hits += abs(found.tau_h - 3.0) < 1.96 * found.tau_sd
    assert 180 <= hits <= 198


def test_noise_alone_has_no_time_constant_and_a_slow_one_does_not_settle() -> None:
    rng = np.random.default_rng(2)
    assert settling(HOURS * 3600.0, rng.normal(0.0, 0.4, len(HOURS))) is None
    slow = settling(HOURS * 3600.0, 10.0 * (1 - np.exp(-HOURS / 12.0)))
    assert slow is not None
    assert slow.tau_h == pytest.approx(12.0, rel=1e-3)
    assert np.isnan(slow.settled_h)
    assert settling(HOURS[:5], HOURS[:5]) is None


def test_symmetry_is_kept_by_noise_and_broken_by_heat_from_one_side() -> None:
    rng = np.random.default_rng(3)
    drift = np.linspace(0.0, 6.0, 200)
    noise = rng.normal(0.0, 0.5, 200)
    kept = symmetry(noise, {"E_Y0C": drift})
    broken = symmetry(drift + noise, {"E_Y0C": drift, "E_Z0T": rng.normal(0.0, 1.0, 200)})
    assert kept is not None
    assert broken is not None
    assert kept.noise == pytest.approx(0.5, rel=0.15)
    assert kept.kept(1.0)
    assert broken.slow == pytest.approx(np.sqrt(12.0), rel=0.05)  # rms of a ramp from 0 to 6
    assert not broken.kept(1.0)
    assert broken.follows == "E_Y0C"
    assert broken.correlation > 0.9
