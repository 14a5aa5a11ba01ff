"""Bayes factors against integration by brute force, and what a refit leaves of a signature."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import lognorm, norm

from discovery.dynamics import make_grid
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import Projected, Slab, products, projected, ranked, scan
from discovery.evidence.settings import Setting
from discovery.evidence.signatures import signatures
from discovery.evidence.whitening import Whitened, absorbed
from discovery.fitting import Noise, fit_model
from tests import machine

Array = NDArray[np.float64]

RNG = np.random.default_rng(3)
Z = np.linalg.qr(RNG.standard_normal((30, 3)))[0] * [4.0, 3.0, 6.0]
RESIDUAL = Z @ [0.5, -0.2, 0.1] + RNG.standard_normal(30)


def slab(median: float = 0.4, factor: float = 3.5, sign: float = 0.0, count: int = 1) -> Slab:
    return Slab(np.full(count, median), np.full(count, factor), np.full(count, sign))


def prior(size: float, median: float = 0.4, factor: float = 3.5, sign: float = 0.0) -> float:
    """Density of a size, by scipy: log-normal in magnitude."""
    share = 0.5 if sign == 0 else float(np.sign(size) == sign)
    return share * float(lognorm.pdf(abs(size), np.log(factor), scale=median))


@pytest.mark.parametrize("sign", [1.0, -1.0, 0.0])
def test_the_prior_of_a_size_is_log_normal_and_zero_at_zero(sign: float) -> None:
    sizes = np.array([-3.0, -0.4, -1e-3, 1e-3, 0.2, 5.0])
    expected = [prior(size, sign=sign) for size in sizes]
    assert slab(sign=sign, count=6).density(sizes) == pytest.approx(expected)
    assert slab(sign=sign).density(np.array([1e-12]))[0] < 1e-6


@pytest.mark.parametrize("factor", [1.5, 3.5, 6.0])
@pytest.mark.parametrize("sign", [1.0, 0.0])
@pytest.mark.parametrize(
    ("mean", "sd"),
    [(0.4, 0.01), (0.4, 0.09), (0.4, 0.11), (1.5, 0.5), (0.0, 0.3), (0.2, 0.3), (0.1, 3.0), (-0.2, 0.3)],
)
def test_the_average_of_the_prior_is_that_of_quadrature(
    mean: float, sd: float, sign: float, factor: float
) -> None:
    """Narrow and wide likelihoods, and both sides of where one form takes over from the other."""

    def integrand(size: float) -> float:
        return prior(size, factor=factor, sign=sign) * float(norm.pdf(size, mean, sd))

    edges = sorted({mean - 9 * sd, 0.0, mean + 9 * sd, 1e-3, -1e-3, 0.1, 1.0})
    whole = sum(quad(integrand, a, b, limit=400)[0] for a, b in pairwise(edges))
    found = slab(factor=factor, sign=sign).average(np.array([mean]), np.array([sd**2]))
    assert found == pytest.approx(np.log(whole), abs=0.03)


@pytest.mark.parametrize("deviations", [3.0, 10.0, 60.0])
def test_a_size_of_the_wrong_sign_cannot_be(deviations: float) -> None:
    """However well it would fit: what is left is the likelihood of nearly nothing, and no gain."""
    sd = 0.01
    found = slab(sign=1.0).average(np.array([-deviations * sd]), np.array([sd**2]))[0]
    gain = 0.5 * deviations**2 + found + np.log(sd * np.sqrt(2 * np.pi))
    assert gain < -1.0


def of_columns(*which: int, scale: float = 1.0) -> Projected:
    """Some columns of Z as signatures, nothing absorbed."""
    z = scale * Z[:, which]
    gram = np.einsum("na,na->a", z, z)
    return Projected(z, np.zeros((0, len(which))), z.T @ RESIDUAL, gram, np.sqrt(gram))


def gain_of(word: str, part: Projected, amplitudes: int, prior_of: Slab) -> float:
    h = Hypothesis(catalogue()[word], (), tuple(f"a{k}" for k in range(amplitudes)))
    (found,) = ranked([h], prior_of, np.zeros(1), [products(part, [h])])
    return found.gain


def factor_of(z: Array, *, median: float = 0.4, sign: float = 0.0) -> float:
    """Bayes factor of one signature by quadrature."""

    def integrand(size: float) -> float:
        ratio = size * (z @ RESIDUAL) - 0.5 * size**2 * (z @ z)
        return prior(size, median, sign=sign) * float(np.exp(ratio))

    parts = [(-30.0, -0.05), (-0.05, 0.0), (0.0, 0.05), (0.05, 1.0), (1.0, 30.0)]
    return sum(quad(integrand, a, b, limit=400)[0] for a, b in parts)


@pytest.mark.parametrize("median", [0.05, 0.4, 5.0])
@pytest.mark.parametrize(("word", "sign"), [("fluid_convection", 1.0), ("sensor_offset", 0.0)])
@pytest.mark.parametrize("column", [0, 1, 2])
def test_a_bayes_factor_is_an_integral(column: int, word: str, sign: float, median: float) -> None:
    found = gain_of(word, of_columns(column), 1, slab(median, sign=sign))
    expected = np.log(factor_of(Z[:, column], median=median, sign=sign))
    assert found == pytest.approx(expected, abs=0.03)


def test_sizes_that_do_not_look_alike_multiply() -> None:
    expected = np.log(factor_of(Z[:, 0])) + np.log(factor_of(Z[:, 1]))
    assert gain_of("rezero", of_columns(0, 1), 2, slab(count=2)) == pytest.approx(expected, abs=0.05)


def test_an_effect_that_is_on_or_off_has_nothing_to_integrate() -> None:
    z = Z[:, 0]
    ratio = z @ RESIDUAL - 0.5 * (z @ z)
    assert gain_of("fluid_delay", of_columns(0), 1, slab()) == pytest.approx(ratio)


def test_what_shows_nothing_gains_nothing() -> None:
    assert gain_of("sensor_offset", of_columns(0, scale=0.0), 1, slab()) == -np.inf


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_what_a_refit_absorbs_whole_gains_nothing(scale: float) -> None:
    """Only rounding is left of it, with which any size would look certain."""
    z = scale * Z[:, :1]
    part = projected(z, absorbed(np.column_stack([RESIDUAL, Z[:, :1]]), np.zeros((2, 2))))
    assert part.gram[0] / part.length[0] ** 2 < 1e-8
    assert gain_of("sensor_offset", part, 1, slab(scale**-1)) < 1.0


def test_noise_settings_and_shapes_are_summed_over() -> None:
    """A claim has two shapes of given weights; each setting has its own level and its own signatures."""
    h = Hypothesis(catalogue()["bed_memory"], (), ("a",), shapes={"t": 1.0})
    two = [h.at({"t": 1.0}, np.log(0.3)), h.at({"t": 2.0}, np.log(0.7))]
    levels = np.array([0.0, 1.5])
    parts = [of_columns(0, 1), of_columns(0, 1, scale=1.3)]
    (found,) = ranked(two, slab(sign=1.0, count=2), levels, [products(part, two) for part in parts])
    weights = np.exp(levels) / np.exp(levels).sum()
    expected = sum(
        weight * share * factor_of(scale * Z[:, column], sign=1.0)
        for weight, scale in zip(weights, (1.0, 1.3), strict=True)
        for column, share in enumerate((0.3, 0.7))
    )
    assert found.gain == pytest.approx(np.log(expected), abs=0.03)
    assert found.odds == pytest.approx(found.gain + h.log_odds)


def test_a_scan_integrates_everything_that_a_refit_could_absorb() -> None:
    """Every claim on a fitted machine: least squares on all unknowns, then quadrature over the size."""
    r = machine.simulated(1)
    baseline = machine.model(wet=False)
    seen, outputs = machine.campaign(r), list(machine.SEEN)
    grids = {"r1": make_grid(seen, "r1", machine.INPUTS, outputs)}
    fit = fit_model(baseline, seen, ["r1"], outputs, grids=grids)
    whitened, noise = Whitened(fit, 1), Noise(tuple(machine.SEEN), (machine.NOISE,) * 3)
    words = ("fluid_convection", "air_convection", "flooded_gap")
    claims = machine.claims(baseline, *words, recordings=["r1"])
    prior_of = slab(8.0, sign=1.0, count=len(claims))
    found = scan(whitened, [Setting(noise, 0.0, 1.0, (0, 0, 0, 0))], claims, prior_of).claims

    belief, slope = fit.problem.prior_rows(fit.theta, fit.together)
    measured = fit.trajectories[0].system.grid.measured
    x = np.concatenate([fit.problem.jacobian(fit.trajectories[0])[measured] / machine.NOISE, slope])
    y = np.concatenate([fit.problem.residual(fit.trajectories[0])[measured] / machine.NOISE, -belief])
    columns = signatures(fit.trajectories[0], claims)[measured] / machine.NOISE
    by_claim = {s.hypothesis.key: s for s in found}
    assert len(by_claim) == len(claims)
    for k, h in enumerate(claims):
        z = np.concatenate([columns[:, k], np.zeros(len(belief))])
        left = z - x @ np.linalg.lstsq(x, z, rcond=None)[0]
        score = by_claim[h.key]
        assert score.share == pytest.approx(np.linalg.norm(left) / np.linalg.norm(z), rel=1e-3, abs=1e-4)
        if score.share < 0.01:
            continue
        dot, gram = left @ (y - x @ np.linalg.lstsq(x, y, rcond=None)[0]), left @ left
        best = dot / gram
        assert score.size[0] == pytest.approx(best, rel=1e-3)
        top = max(best, 1e-3)

        def integrand(size: float, dot: float = dot, gram: float = gram, top: float = top) -> float:
            # the largest exponent is taken out: sizes at which nothing is seen give exp(-large)
            shift = dot * top - 0.5 * gram * top**2
            return prior(size, 8.0, sign=1.0) * float(np.exp(dot * size - 0.5 * gram * size**2 - shift))

        width = 10 / np.sqrt(gram)
        edges = sorted({0.0, max(top - width, 0.0), top, top + width})
        whole = sum(quad(integrand, a, b, limit=400)[0] for a, b in pairwise(edges))
        expected = np.log(whole) + dot * top - 0.5 * gram * top**2
        if expected > -5.0:
            assert score.gain == pytest.approx(expected, abs=0.05 + 1e-3 * abs(expected))
        else:  # what nobody believes is not integrated to the last digit
            assert score.gain < -4.0
    best_claim = found[0].hypothesis
    assert (best_claim.effect.word, best_claim.states) == ("fluid_convection", ("table",))


def test_odds_of_a_place_do_not_change_what_the_readings_say() -> None:
    h = Hypothesis(catalogue()["sensor_offset"], (), ("a",))
    (plain,) = ranked([h], slab(), np.zeros(1), [products(of_columns(0), [h])])
    (rare,) = ranked([replace(h, log_odds=-5.0)], slab(), np.zeros(1), [products(of_columns(0), [h])])
    assert rare.gain == plain.gain
    assert rare.odds == pytest.approx(plain.odds - 5.0)
