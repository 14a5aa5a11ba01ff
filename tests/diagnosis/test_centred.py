"""Intervals are centred where a model is best under form errors, which a fit does not know."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.diagnosis import centred as module
from discovery.diagnosis.centred import centred
from discovery.diagnosis.scored import MOVED, Scored, scored
from tests.diagnosis.parts import dry, wetted


def moved(one: Scored, factor: float) -> Scored:
    """The same model with its effect at another size."""
    theta = one.fit.theta.copy()
    theta[index(one)] *= factor
    runs = tuple(one.fit.problem.run(t.system, theta) for t in one.fit.trajectories)
    return scored(dry(), one.hypotheses, replace(one.fit, theta=theta, trajectories=runs))


def index(one: Scored) -> int:
    (h,) = one.hypotheses
    return [u.name for u in one.fit.problem.unknowns].index(h.amplitudes[0])


def test_a_fit_that_stands_off_its_optimum_is_moved_there() -> None:
    elsewhere = moved(wetted(), 1.6)
    assert elsewhere.beyond()[1] > MOVED
    gram = elsewhere.grams[0]
    assert len(gram.solved()[1]) - gram.form == len(elsewhere.seen.moving)  # form errors come last
    found = centred(dry(), elsewhere)
    assert found.beyond()[1] < MOVED
    best = float(wetted().fit.theta[index(wetted())])
    assert float(found.fit.theta[index(found)]) == pytest.approx(best, rel=0.1)


def test_a_fit_that_stands_at_its_optimum_stays() -> None:
    here = centred(dry(), wetted())
    assert centred(dry(), here) is here


def test_a_look_that_reaches_too_far_is_not_believed(monkeypatch: pytest.MonkeyPatch) -> None:
    """No part of the step is better: the interval is centred where the fit stands."""
    elsewhere = moved(wetted(), 1.6)
    (name,) = elsewhere.hypotheses[0].amplitudes
    at = float(elsewhere.fit.theta[index(elsewhere)])
    monkeypatch.setattr(module, "_here", lambda one: 0.0 if one is elsewhere else -1.0)
    assert centred(dry(), elsewhere) is elsewhere
    low, high = elsewhere.interval(name) or (np.nan, np.nan)
    assert (low + high) / 2 == pytest.approx(at, rel=1e-6)
