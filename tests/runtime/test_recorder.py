"""What the running loop records says the same as the ticks themselves."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.dynamics import predict
from discovery.export.document import Exported
from discovery.export.knowledge import problem_of
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.guards import Reading
from discovery.runtime.learning import Learner
from discovery.runtime.recorder import ROW_S
from discovery.runtime.shadow import predictions

HOUR = 3600.0


def test_a_row_holds_what_came_between_the_rows(exported: Exported, minutes: np.ndarray) -> None:
    """A coolant that swings within minutes and a power that switches show the same errors as in the ticks,
    and so does an error every second, of which each row keeps one.
    """
    names = list(exported.compiled.inputs)
    compensator, learner, tick = (
        Compensator(exported, Settings(tick_s=10.0, settle_s=0.0)),
        Learner(None),
        10.0,
    )
    learner.begin(compensator)
    power, coolant = names.index("P_drive"), names.index("T_cool")
    shown = []
    for k in range(round(10 * HOUR / tick)):
        now = tick * k
        values = minutes[int(now // 60.0)].copy()
        values[power] = 900.0 * (now % 400.0 < 100.0)
        values[coolant] += 0.9 * np.sin(2 * np.pi * now / 240.0)
        readings = {n: Reading(v, now) for n, v in zip(names, values.tolist(), strict=True)}
        compensator.tick(readings, now)
        errors = {n: Reading(v, now) for n, v in predictions(compensator).items()}
        learner.observe(compensator, errors, now)
        shown.append([now + exported.compiled.step_s, *predictions(compensator).values()])
    seen = learner.seen
    assert min(np.diff(seen.times)) >= ROW_S - 1e-6
    assert len(seen.times) == pytest.approx(10 * HOUR / ROW_S, rel=0.1)
    outputs = list(predictions(compensator))
    campaign = seen.campaign(exported)
    problem = problem_of(exported.model, campaign, ["running"], outputs)
    again = predict(problem.run(problem.systems[0], problem.start))
    ticks = np.array(shown)
    late = ticks[:, 0] > 5 * HOUR  # the start is forgotten
    settled = np.array(seen.times)[problem.systems[0].grid.read] > 5 * HOUR
    spread = ticks[late, 1:].std(axis=0)
    for j in range(len(outputs)):
        there = np.interp(np.array(seen.times)[settled], ticks[:, 0], ticks[:, 1 + j])
        assert np.abs(again[settled, j] - there).max() < 0.05 * spread[j]


def test_inputs_that_are_not_known_for_minutes_have_their_usual_mean(
    exported: Exported, minutes: np.ndarray
) -> None:
    """A kill loses the rows since the last copy; the last minute says little of them."""
    names = list(exported.compiled.inputs)
    compensator, learner = Compensator(exported, Settings(tick_s=60.0, settle_s=0.0)), Learner(None)
    learner.begin(compensator)
    power = names.index("P_drive")
    for k in [*range(120), *range(160, 170)]:
        values = minutes[k].copy()
        values[power] = 900.0 * (k % 3 == 2)  # 900 W in the last minute before the gap
        readings = {n: Reading(v, 60.0 * k) for n, v in zip(names, values.tolist(), strict=True)}
        compensator.tick(readings, 60.0 * k)
        learner.observe(compensator, readings, 60.0 * k)
    rows = dict(zip(learner.seen.times, learner.seen.inputs, strict=True))
    assert rows[60.0 * 118][power] == 0.0
    assert rows[60.0 * 119][power] == pytest.approx(300.0, rel=0.1)
