"""Evidence in closed form against integration by brute force, and what a refit leaves of a signature."""

from __future__ import annotations

from dataclasses import replace
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad
from scipy.stats import norm

from discovery.diagnosis.context import make_context
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import Board, by_claim, make_board, scores
from discovery.evidence.signatures import signatures
from discovery.evidence.whitening import Lens, View
from discovery.fitting import Noise
from tests.mismatch import machine

Array = NDArray[np.float64]

RNG = np.random.default_rng(3)
Z = RNG.standard_normal((30, 2))
RESIDUAL = Z @ [0.5, -0.2] + RNG.standard_normal(30)


def board(word: str, amplitudes: int, spread: float, levels: tuple[float, ...] = (0.0,)) -> Board:
    """One hypothesis with the first columns of Z for signature, longer under each further noise level."""
    h = Hypothesis(catalogue()[word], (), tuple(f"a{k}" for k in range(amplitudes)))
    noise, unused = Noise(("y",), (1.0,)), cast(Lens, None)
    views = tuple(View(unused, noise, RESIDUAL, level, np.zeros((0, 0))) for level in levels)
    columns = tuple(Z[:, :amplitudes] * (1 + 0.3 * k) for k in range(len(levels)))
    lengths = tuple(np.linalg.norm(c, axis=0) for c in columns)
    return Board(
        (h,), np.full(amplitudes, spread), views, columns, lengths, np.zeros(amplitudes, dtype=np.intp)
    )


def factor(z: Array, *sizes: float) -> float:
    """Likelihood ratio of given amplitudes against none."""
    left = RESIDUAL - z @ np.array(sizes)
    return float(np.exp(0.5 * RESIDUAL @ RESIDUAL - 0.5 * left @ left))


@pytest.mark.parametrize("spread", [0.05, 1.0, 20.0])
def test_an_amplitude_of_known_sign(spread: float) -> None:
    prior = norm(0, spread)
    whole = quad(lambda a: 2 * prior.pdf(a) * factor(Z[:, :1], a), 0, 40, points=[0.3, 0.6, 1.0])[0]
    assert scores(board("fluid_convection", 1, spread))[0].gain == pytest.approx(np.log(whole), abs=1e-5)


@pytest.mark.parametrize("spread", [0.05, 1.0, 20.0])
def test_an_amplitude_of_unknown_sign(spread: float) -> None:
    prior = norm(0, spread)
    whole = quad(lambda a: prior.pdf(a) * factor(Z[:, :1], a), -40, 40, points=[0.0, 0.3, 0.6, 1.0])[0]
    assert scores(board("sensor_offset", 1, spread))[0].gain == pytest.approx(np.log(whole), abs=1e-5)


def test_two_amplitudes_at_once() -> None:
    prior, grid = norm(0, 0.8), np.linspace(-4, 4, 801)
    a, b = np.meshgrid(grid, grid, indexing="ij")
    gain = a * (Z[:, 0] @ RESIDUAL) + b * (Z[:, 1] @ RESIDUAL)
    gram = Z.T @ Z
    gain -= 0.5 * (gram[0, 0] * a**2 + 2 * gram[0, 1] * a * b + gram[1, 1] * b**2)
    whole = np.sum(prior.pdf(a) * prior.pdf(b) * np.exp(gain)) * 0.01**2
    assert scores(board("rezero", 2, 0.8))[0].gain == pytest.approx(np.log(whole), abs=1e-4)


def test_an_effect_that_is_on_or_off_has_nothing_to_integrate() -> None:
    assert scores(board("fluid_delay", 1, 1.0))[0].gain == pytest.approx(np.log(factor(Z[:, :1], 1.0)))


def test_noise_levels_are_integrated_out() -> None:
    """Evidence is summed over noise levels, each as likely before the readings as the others."""
    prior, levels = norm(0, 1.0), (0.0, 1.5, -2.0)
    wholes = [
        quad(
            lambda a, z=Z[:, :1] * (1 + 0.3 * k): prior.pdf(a) * factor(z, a), -40, 40, points=[0.0, 0.3, 0.6]
        )[0]
        for k in range(3)
    ]
    expected = np.log(np.exp(levels) @ wholes / np.sum(np.exp(levels)))
    assert scores(board("sensor_offset", 1, 1.0, levels))[0].gain == pytest.approx(expected, abs=1e-5)


def test_a_claim_averages_over_its_shapes_and_pays_for_searched_instants() -> None:
    one = scores(board("bed_memory", 1, 1.0))[0]
    other = replace(one, gain=one.gain - 2.0)
    mean = np.log(0.5 * (np.exp(one.gain) + np.exp(other.gain)))
    (claim,) = by_claim([one, other])
    assert claim.gain == pytest.approx(mean + np.log(catalogue()["bed_memory"].prior))
    costly = replace(one, hypothesis=replace(one.hypothesis, cost=4.0))
    assert by_claim([costly])[0].gain == pytest.approx(one.gain + np.log(0.5) - 4.0)


def test_what_a_refit_absorbs_is_no_evidence() -> None:
    """Shares are what least squares on all parameters and start values leaves of a signature."""
    r = machine.simulated(1)
    context = make_context(machine.campaign(r), machine.model(), ["r1"], list(machine.SEEN), [])
    lens, noise = Lens(context.baseline), replace(context.settings[0], slow=(), heat=None)
    view = lens.view(noise)
    words = ("fluid_convection", "air_convection", "radiation", "friction_speed")
    effects = [catalogue()[w] for w in words]
    found = hypotheses(machine.model(), machine.CHANNELS, machine.SEEN, ["r1"], effects)
    sheet = {
        s.hypothesis.key + tuple(s.hypothesis.shapes.values()): s
        for s in scores(make_board(lens, [view], found, np.ones(len(found))))
    }
    trajectory = context.baseline.trajectories[0]
    slopes, prior = lens.jacobians[0].reshape(-1, len(context.baseline.theta)), lens.priors[1]
    x = np.concatenate([slopes / machine.NOISE, prior])
    columns = signatures(trajectory, found).reshape(len(slopes), -1) / machine.NOISE
    for k, h in enumerate(found):
        column = np.concatenate([columns[:, k], np.zeros(len(prior))])
        left = column - x @ np.linalg.lstsq(x, column, rcond=None)[0]
        share = sheet[h.key + tuple(h.shapes.values())].share
        assert share == pytest.approx(np.linalg.norm(left) / np.linalg.norm(column), rel=1e-4)
    absorbed = [
        s.share for s in sheet.values() if s.hypothesis.effect.word in ("radiation", "air_convection")
    ]
    assert min(absorbed) < 0.02  # air at a body that has it already
    assert max(s.share for s in sheet.values() if s.hypothesis.effect.word == "fluid_convection") > 0.1


def test_which_recording_comes_first_says_nothing() -> None:
    """A size is plausible by the heat that it moves where it moves most: one recording may be dry."""
    wet, dry = machine.simulated(1), machine.simulated(2)
    dry = machine.changed(dry, pump=np.zeros(len(dry.time)))
    effect = catalogue()["fluid_convection"]
    found = []
    for order in (["r1", "r2"], ["r2", "r1"]):
        context = make_context(
            machine.campaign(wet, dry), machine.model(wet=False), order, tuple(machine.SEEN), [effect]
        )
        claims = hypotheses(context.model, context.campaign.channels, tuple(machine.SEEN), order, [effect])
        found.append({h.states: (context.spread(h), context.minor(h)) for h in claims})
    for states, sizes in found[0].items():
        assert np.allclose(sizes, found[1][states], rtol=1e-3)


def test_an_exchange_is_held_against_the_link_that_the_model_has() -> None:
    """With the pump always on, a flooded gap is conductance beside conductance: half of that of the link."""
    runs = [machine.simulated(seed) for seed in (1, 2)]
    runs = [machine.changed(run, pump=np.ones(len(run.time))) for run in runs]
    effects = [catalogue()[word] for word in ("flooded_gap", "fluid_convection")]
    context = make_context(
        machine.campaign(*runs), machine.model(), ["r1", "r2"], tuple(machine.SEEN), effects
    )
    claims = hypotheses(context.model, context.campaign.channels, tuple(machine.SEEN), ("r1", "r2"), effects)
    half = {h.states: context.half_a_link(h) for h in claims}
    fitted = context.baseline.model.parameters
    assert half["motor", "table"] == pytest.approx((0.5 * fitted["G_mt"].value,))
    assert half["table", "bed"] == pytest.approx((0.5 * fitted["G_tb"].value,))
    assert half["motor", "bed"] == half["motor",] == (0.0,)
