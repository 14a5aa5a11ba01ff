"""The rule that says when heat is missing, and the formula that it follows where nothing is named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from discovery.diagnosis.context import make_context
from discovery.diagnosis.description import describe
from discovery.diagnosis.regime import of_effects, of_free_heat
from discovery.diagnosis.scales import lags
from discovery.diagnosis.scored import assess
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import catalogue
from discovery.evidence.latent_force import BLOCKS, Forcing, free_forcing
from tests.mismatch.machine import SEEN, Array, campaign, model, simulated
from tests.mismatch.test_ask import plate, ten_minutes


def ruled(heat: Callable[[Array, Array], Array]) -> str:
    """The rule for heat that follows speed and pump, in blocks of a recording."""
    where = make_context(campaign(simulated(1)), model(), ["r1"], tuple(SEEN), [])
    current = assess(where, ())
    (trajectory,) = current.fit.trajectories
    nodes, time = trajectory.at_nodes(), trajectory.system.grid.time
    edges = np.linspace(time[0], time[-1], BLOCKS + 1)
    block = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, BLOCKS - 1)
    mean = [np.bincount(block, nodes[n]) / np.bincount(block) for n in ("speed", "pump")]
    series = {"r1": heat(*mean)}
    return of_free_heat(current, Forcing("bed", 50.0, {"r1": edges}, series, series, np.zeros(0))) or ""


@pytest.mark.parametrize(
    ("heat", "rule"),
    [
        (lambda speed, _: 90.0 * (speed > 250) + 50.0 * (speed > 900), r"speed > \d+"),
        (lambda speed, _: 60.0 * ((speed > 250) & (speed < 650)), r"speed > \d+ and speed <= \d+"),
        (lambda _, pump: 60.0 * (pump > 0.5), r"pump > 0\.5"),
        (lambda _, pump: 60.0 * (pump < 0.5), r"pump <= 0\.5"),
    ],
    ids=["the tighter one", "between", "on", "off"],
)
def test_a_rule_holds_the_tightest_bounds_of_each_variable(
    heat: Callable[[Array, Array], Array], rule: str
) -> None:
    found = re.match(rule, ruled(heat))
    assert found
    variable = rule.split()[0]
    assert variable not in ruled(heat)[found.end() :].split()


def test_lags_of_a_description_are_those_that_recordings_can_show() -> None:
    assert lags(86400.0) == (1800.0, 7200.0)
    assert lags(45.0) == pytest.approx((1.125, 4.5))
    runs = ten_minutes()
    heat, slow = runs.recordings["a"].values["heater"], [0.0]
    for power in heat[:-1]:  # 5 s of a lag of a minute
        slow.append(power + (slow[-1] - power) * float(np.exp(-5.0 / 60.0)))
    values = {**runs.recordings["a"].values, "T": runs.recordings["a"].values["T"] + 0.8 * np.array(slow)}
    runs = replace(runs, recordings={"a": replace(runs.recordings["a"], values=values)})
    where = make_context(runs, plate(0.04), ["a"], ["T"], [])
    current = assess(where, ())
    found = describe(where, current, free_forcing(where, current)[0])
    assert found
    times = [float(t) for t in re.findall(r"lag\(\w+, ([\d.]+)\)", found.formula)]
    assert times
    assert max(times) <= 60.0


@pytest.mark.parametrize(
    ("word", "state", "rule"),
    [
        ("fluid_convection", "bed", r"pump > 0\.5"),
        ("friction_speed", "motor", r"speed > \d+(\.\d+)?"),
        ("fluid_convection_speed", "table", r"pump > 0\.5( and speed > \d+(\.\d+)?)?"),
        ("natural_convection", "bed", None),
    ],
)
def test_a_named_effect_says_itself_when_it_acts(word: str, state: str, rule: str | None) -> None:
    """By its own formula: where the pump gates it, where it needs speed; what always acts has no rule."""
    runs = ["r1", "r2"]
    seen = campaign(*(simulated(int(r[1:])) for r in runs))
    where = make_context(seen, model(), runs, tuple(SEEN), [catalogue()[word]])
    claims = hypotheses(where.baseline.problem.model, seen.channels, tuple(SEEN), runs, where.effects)
    h = next(h for h in claims if h.states == (state,))
    answer = assess(where, (h,), sizes=dict.fromkeys(h.amplitudes, 5.0))
    parameters = {**answer.model.parameters}
    for name in h.amplitudes:  # any size will do: here nothing of the kind acts
        parameters[name] = replace(parameters[name], value=5.0)
    answer = replace(answer, model=replace(answer.model, parameters=parameters))
    found = of_effects(answer, [h], where.baseline.problem.model)
    assert found is None if rule is None else re.fullmatch(rule, found or "")
