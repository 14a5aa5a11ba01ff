"""The search for a set of effects: what it asks of models with fewer effects."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import pytest

from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from tests.diagnosis.parts import bare, dry, wetted


def worse(one: Scored, by: float) -> Scored:
    """The same model with less evidence, as if its fit had ended in another optimum."""
    settings = tuple(replace(s, log_weight=s.log_weight - by) for s in one.settings)
    return replace(one, settings=settings)


def test_a_model_with_fewer_effects_is_also_fitted_from_the_larger_one() -> None:
    search = Search(dry())
    search.keep(worse(bare(), 50.0))
    search.keep(wetted())
    (without,) = search.reduced(wetted(), [()], inf)
    assert without is not None
    assert without.evidence == pytest.approx(bare().evidence, abs=2.0)  # it settles under its own noise
    assert search.baseline is search.reduced(wetted(), [()], inf)[0]


def test_what_was_better_before_is_kept() -> None:
    search = Search(dry())
    search.keep(worse(bare(), -50.0))
    search.keep(wetted())
    (without,) = search.reduced(wetted(), [()], inf)
    assert without is not None
    assert without.evidence == pytest.approx(bare().evidence + 50.0)


def test_a_model_far_below_the_best_is_fitted_to_its_optimum_only_where_that_matters() -> None:
    """Without the fluid, the cost is hundreds of units above that of the whole model."""
    search = Search(dry())
    search.keep(wetted())
    (early,) = search.reduced(wetted(), [()])
    (exact,) = search.reduced(wetted(), [()], inf)
    assert early is not None
    assert exact is not None
    assert early.fit.ended_early
    assert not exact.fit.ended_early
    assert early.evidence < exact.evidence < wetted().evidence - 40.0


def test_a_model_is_its_own_largest_part() -> None:
    search = Search(dry())
    search.keep(wetted())
    assert search.reduced(wetted(), [wetted().hypotheses], inf)[0] is search.best
