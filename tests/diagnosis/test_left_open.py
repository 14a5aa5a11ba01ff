"""What a fit leaves open of free runs, against refits of recordings whose thermometers are off."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.diagnosis.left_open import Absorbed, Known, Usual
from discovery.fitting import Fit, fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign
from discovery.terms import Term, parse
from tests.diagnosis.test_zeros import CAPACITY, CHANNELS, recorded

NAMES = ("r1", "r2", "r3")


def fitted(off: float, *, zero: bool = False) -> Fit:
    """A heated body, fitted to recordings whose sensor of the room shows `off` too much, with or without an
    offset of its own.
    """
    seen = Campaign("hall", CHANNELS, {f"r{k}": recorded(k, off) for k in (1, 2, 3)})
    rest = "room - body - z" if zero else "room - body"
    terms = Term("power", "body", parse("g*P")), Term("air", "body", parse(f"hA*({rest})"))
    parameters = {"g": Parameter(1.0, "1", 0.0), "hA": Parameter(20.0, "W/K", 0.0)}
    parameters |= {"z": Parameter(0.0, "K")} if zero else {}
    states = {"body": State("body", "degC", CAPACITY, parse("body"), 0.02, 1 / CAPACITY)}
    return fit_model(Model("hall", parameters, states, terms, {}), seen, list(NAMES), ["body"])


ROOM = Usual(("room",), 0.1, (), 0.0)


def test_a_zero_shows_what_a_refit_does_not_absorb() -> None:
    """Residuals of a refit to recordings whose room is off by 0.1 K, less those of the fit."""
    fit, other = fitted(0.0), fitted(0.1)
    absorbed = Absorbed.by(fit, ROOM)
    shown = other.residuals()
    for run in fit.trajectories:
        change = shown[run.system.grid.recording] - fit.residuals()[run.system.grid.recording]
        variance = absorbed.variance(run)
        assert np.sqrt(np.mean(change**2)) > 0.02
        np.testing.assert_allclose(np.sqrt(variance[50:]), np.abs(change[50:]), atol=0.01)


def test_nothing_is_left_where_a_parameter_absorbs_it() -> None:
    fit = fitted(0.0, zero=True)
    absorbed = Absorbed.by(fit, ROOM)
    for run in fit.trajectories:
        assert absorbed.variance(run).max() < 1e-6


def test_air_at_a_body_is_off_as_its_thermometer_may_be() -> None:
    """One body in one room: warmer air is the zero of the room."""
    fit = fitted(0.0)
    (run, *_) = fit.trajectories
    air = Absorbed.by(fit, Usual((), 0.0, ("room",), 0.1))
    np.testing.assert_allclose(air.variance(run)[50:], Absorbed.by(fit, ROOM).variance(run)[50:], atol=1e-5)


def test_a_recording_of_the_fit_is_better_known() -> None:
    """Than one that no fit has seen, where parameters are open, too."""
    fit = fitted(0.0)
    known, size = Known(("hA",), np.array([[0.04]])), np.ones(1)
    (run, *_) = fit.trajectories
    seen = known.of_fit(fit, ROOM).rms(run, size, [0])
    assert seen == pytest.approx(np.sqrt(np.mean(Absorbed.by(fit, ROOM).variance(run))))
    alone = replace(known, covariance=np.zeros((1, 1))).of_unseen(ROOM).rms(run, size, [0])
    assert seen < alone < known.of_unseen(ROOM).rms(run, size, [0])
