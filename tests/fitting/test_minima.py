"""A fit that looks for other minima: a dead time that is believed to be one period longer."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.fitting import fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
STEP, LATE, GAIN, LOSS, NOISE = 30.0, 120.0, 0.002, 0.004, 0.1


def recorded() -> Campaign:
    """A body that is heated every 20 min, by another power each time, and answers 2 min late: exactly."""
    rng = np.random.default_rng(0)
    time: Array = STEP * np.arange(400.0)
    load = np.repeat(np.tile([0.0, 100.0], 10) * (1 + 0.15 * rng.choice([-1, 1], 20)), 20)
    late: Array = np.concatenate([np.zeros(int(LATE / STEP)), load])[: len(load)]
    body, kept = np.zeros(len(load)), np.exp(-LOSS * STEP)
    for k in range(1, len(load)):
        rest = GAIN / LOSS * late[k - 1]
        body[k] = rest + (body[k - 1] - rest) * kept
    channels = {
        "load": Channel("load", "heat load", "W", None, "held"),
        "T": Channel("T", "temperature", "degC", NOISE, "linear"),
    }
    read = body + NOISE * rng.standard_normal(len(load))
    return Campaign("c", channels, {"r": Recording("r", time, {"load": load, "T": read})})


def believed(late: float) -> Model:
    parameters = {
        "g": Parameter(GAIN, "K/W/s", 0.0),
        "h": Parameter(LOSS, "1/s", 0.0),
        "late": Parameter(late, "s", 0.0, 3000.0),
    }
    terms = (Term("loss", "T", parse("-h*T")), Term("heat", "T", parse("g*delay(load, late)")))
    return Model("late", parameters, {"T": State("T", "degC", None, parse("0"), 0.1, 1.0)}, terms, {})


@pytest.mark.parametrize("late", [900.0, 1300.0])
def test_a_better_minimum_is_found(late: float) -> None:
    """Heat that comes one period later looks nearly the same."""
    near, found = (fit_model(believed(late), recorded(), ["r"], minima=m) for m in (False, True))
    assert near.model.parameters["late"].value == pytest.approx(LATE + 1200.0, rel=0.02)
    assert near.cost > 1e6
    assert found.model.parameters["late"].value == pytest.approx(LATE, rel=0.01)
    assert found.cost < 0.6 * 400


def test_the_only_minimum_stays_as_it_is() -> None:
    near, found = (fit_model(believed(100.0), recorded(), ["r"], minima=m) for m in (False, True))
    assert np.array_equal(near.theta, found.theta)
    assert near.model.parameters["late"].value == pytest.approx(LATE, rel=0.01)
