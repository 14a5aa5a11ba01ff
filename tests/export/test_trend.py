"""Parameters that move by date: in steps of the runtime, and with the time of a recording."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.export.compiled import compile_model
from discovery.export.stepper import Stepper
from discovery.export.trend import DAY_S, LONGEST_S, Trend, read_trend
from discovery.models import Model, Parameter, State
from discovery.terms import Term, parse

MODEL = Model(
    "worn",
    {"loss": Parameter(0.5, "1", 0.2, 1.0)},
    {"y": State("y", "um", None, parse(0.0), 0.0, 1.0)},
    (Term("t", "y", parse("loss*P/1000 - y/600")),),
    {"E": parse("y")},
)
STEPS = 1440  # of a day
TREND = Trend(1000.0, {"loss": -0.05}, 0.01)


def test_it_moves_within_the_bounds_and_for_a_month_at_most() -> None:
    def at(days: float) -> float:
        return TREND.values(MODEL, 1000.0 + days * DAY_S)["loss"]

    assert [at(-1.0), at(0.0), at(2.0)] == pytest.approx([0.5, 0.5, 0.4])
    assert at(20.0) == 0.2
    slow = Trend(0.0, {"loss": -0.001}, 0.01)
    assert slow.values(MODEL, 2 * LONGEST_S) == slow.values(MODEL, LONGEST_S)


def test_a_recording_sees_what_the_runtime_does() -> None:
    since, u = 1000.0 + DAY_S, np.full((STEPS, 1), 300.0)
    step = DAY_S / STEPS
    moving = Stepper(compile_model(TREND.moving(MODEL, since), step))
    moving.start(u[0])
    retuned = Stepper(compile_model(MODEL, step))
    beside = retuned.twin()
    retuned.start(u[0])
    beside.start(u[0])
    for k in range(STEPS):
        retuned.retune(TREND.values(MODEL, since + k * step))
        retuned.step(u[k])
        beside.step(u[k])
    assert beside.x == pytest.approx(retuned.x)  # a twin has the same parameters
    assert moving.run(u)[-1] == pytest.approx(retuned.x, rel=1e-3)
    assert retuned.x[0] == pytest.approx(0.4 * 0.3 * 600.0, rel=5e-3)


def test_a_document_without_it_has_none() -> None:
    assert read_trend({}) is None
    assert read_trend({"trend": TREND.document()}) == TREND
