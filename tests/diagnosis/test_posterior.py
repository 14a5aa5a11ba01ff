"""The posterior on models whose evidence is written down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.posterior import FAR, WIDTHS, Posterior, posterior
from discovery.diagnosis.scored import Scored
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from tests.diagnosis.parts import bare, dry, wetted

Array = NDArray[np.float64]

BLOCKS = 12  # of each recording
FLUID = Hypothesis(catalogue()["fluid_convection"], ("table",), ("h",))
LAG = Hypothesis(catalogue()["sensor_lag"], (), ("on",), outputs=("E_Y",))


@dataclass(frozen=True)
class Known:
    """A model whose evidence is known: `per_block` (B,) is what each block of time adds."""

    hypotheses: tuple[Hypothesis, ...]
    evidence: float = 0.0
    per_block: Array = field(default_factory=lambda: np.zeros(24))
    forced: str = ""
    prior: float = 0.0
    at_width: Mapping[float, float] = field(default_factory=dict)  # what a width of the priors adds

    @property
    def levels(self) -> Array:
        return np.array([self.evidence - self.prior])

    def drawn(self, _: int, draws: Array, widths: Sequence[float]) -> Array:
        return np.add.outer([self.at_width.get(w, 0.0) for w in widths], draws @ self.per_block)


def known(*models: Known, draws: Array | None = None) -> Posterior:
    evidence = np.array([[m.evidence] for m in models]) if draws is None else draws
    return Posterior(cast(tuple[Scored, ...], models), evidence)


def sigmoid(x: float) -> float:
    return float(1 / (1 + np.exp(-x)))


def test_of_rivals_the_one_that_is_more_likely_over_all_widths_is_the_answer() -> None:
    """At the stated width the fluid is; an answer that is 1 % sure was named first, before one of 97 %."""
    fluid, lag, both = Known((FLUID,), 5.0), Known((LAG,), 4.0), Known((FLUID, LAG), 9.0)
    found = known(fluid, lag, both, draws=np.array([[1.0, 2.0], [5.0, 6.0], [9.0, 9.0]]))
    assert found.instead(cast(Scored, fluid)).hypotheses == lag.hypotheses
    assert found.instead(cast(Scored, both)).hypotheses == both.hypotheses


def test_a_claim_is_as_likely_as_its_odds_say_on_average_over_draws() -> None:
    found = known(Known((FLUID,)), Known(()), draws=np.array([[4.0, 2.0, -1.0], [1.0, 2.0, 1.0]]))
    expected = np.mean([sigmoid(3.0), sigmoid(0.0), sigmoid(-2.0)])
    assert found.of_claims([FLUID]) == pytest.approx(expected)
    assert found.nothing == pytest.approx(1 - expected)


def test_how_many_models_were_tried_says_nothing() -> None:
    few = known(Known((FLUID,), 5.0), Known((), 3.0))
    many = known(Known((FLUID,), 5.0), *(Known((FLUID, LAG), 4.0 - k) for k in range(20)), Known((), 3.0))
    assert many.of_claims([FLUID]) == pytest.approx(few.of_claims([FLUID])) == pytest.approx(sigmoid(2.0))


def test_what_all_models_claim_or_none_is_certain() -> None:
    found = known(Known((FLUID,), 5.0), Known((FLUID, LAG), 3.0))
    assert found.of_claims([FLUID]) == 1.0
    assert found.nothing == 0.0


def test_heat_of_unknown_cause_is_not_nothing() -> None:
    found = known(Known((), 0.0), Known((), 3.0, forced="bed"))
    assert found.nothing == pytest.approx(sigmoid(-3.0))
    assert found.best.forced == "bed"


def test_draws_keep_the_number_of_blocks_of_each_recording() -> None:
    """So evidence that each block adds alike is certain, and evidence of one block is not."""
    context = cast(Context, type("Two", (), {"recordings": ("a", "b"), "blocks": BLOCKS}))
    blocks = 2 * BLOCKS
    even = Known((FLUID,), 2.0, np.full(blocks, 2.0 / blocks))
    lone = Known((LAG,), 2.0, np.where(np.arange(blocks) == 3, 2.0, 0.0))
    found = posterior(context, cast(list[Scored], [even, lone, Known((), 0.0, np.zeros(blocks))]))
    words = ["".join(h.effect.word for h in m.hypotheses) for m in found.models]
    by_word = dict(zip(words, found.evidence, strict=True))
    assert by_word["fluid_convection"] == pytest.approx(2.0)
    assert len(by_word["sensor_lag"]) == thresholds.DRAWS
    assert np.median(by_word["sensor_lag"]) == pytest.approx(2.0)
    spread = 2.0 * np.sqrt(11 / 12)  # multinomial
    assert by_word["sensor_lag"].std() == pytest.approx(spread, rel=0.25)


def test_a_width_of_priors_that_the_readings_contradict_has_no_say() -> None:
    """The evidence of each model is its mean over the widths. Beliefs three times as narrow rule out what the
    first model moves; another model, which moves nothing, must not win for that.
    """
    context = cast(Context, type("One", (), {"recordings": ("a",), "blocks": BLOCKS}))
    moves = Known((FLUID,), 20.0, np.full(12, 20.0 / 12), at_width={1 / 3: -40.0, 3.0: -1.0})
    found = posterior(context, cast(list[Scored], [moves, Known((), 0.0, np.zeros(12))]))
    mean = np.log((np.exp(-40.0) + np.exp(0.0) + np.exp(-1.0)) / 3)
    assert found.of_claims([FLUID]) == pytest.approx(sigmoid(20.0 + mean))


def test_models_that_are_far_off_take_no_part() -> None:
    context = cast(Context, type("One", (), {"recordings": ("a",), "blocks": BLOCKS}))
    models = [Known((FLUID,), evidence, np.zeros(12)) for evidence in (0.0, -FAR + 1, -FAR - 1)]
    assert len(posterior(context, cast(list[Scored], models)).models) == 2


def test_each_block_once_is_what_was_scored() -> None:
    """The draw that is no draw gives the level of a fitted model under each noise setting."""
    for one in (bare(), wetted()):
        blocks = dry().blocks * len(dry().recordings)
        for k in range(len(one.levels)):
            drawn = one.drawn(k, np.ones((1, blocks)))
            assert drawn[0, 0] == pytest.approx(one.levels[k], abs=0.01)


def test_blocks_that_are_drawn_twice_do_not_favour_a_model_with_more_unknowns() -> None:
    """Their noise comes twice, too: on average, a draw is fitted better than the recordings themselves."""
    one = bare()
    near = [k for k in np.argsort(-one.levels)[:3] if one.levels[k] > one.levels.max() - 8.0]
    blocks = dry().blocks * len(dry().recordings)
    draws = np.random.default_rng(1).multinomial(blocks, np.full(blocks, 1 / blocks), 40).astype(float)
    once = np.concatenate([one.drawn(int(k), np.ones((1, blocks)), WIDTHS) for k in near])
    twice = np.concatenate([one.drawn(int(k), draws, WIDTHS) for k in near])
    assert np.mean(twice) > np.mean(once) + 1.0
    found = posterior(dry(), [one])
    expected = np.log(np.exp(once - once.max()).sum() / len(WIDTHS)) + once.max() + one.prior
    assert np.median(found.evidence) == pytest.approx(expected, abs=1e-6)


def test_the_same_models_give_the_same_posterior() -> None:
    first, again = (posterior(dry(), [bare(), wetted()]) for _ in range(2))
    assert np.array_equal(first.evidence, again.evidence)
    assert first.of_claims([wetted().hypotheses[0]]) > 0.95
