"""The rule that says when heat is missing, and the formula that it follows where nothing is named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from discovery.diagnosis.description import describe
from discovery.diagnosis.regime import of_effects, of_free_heat
from discovery.diagnosis.scored import Scored
from discovery.evidence.latent_force import BLOCKS, Force, latent_forces
from tests.design.test_ask import plate, ten_minutes
from tests.diagnosis.parts import claim_of, context_of, scored_of
from tests.machine import Array, campaign, model, simulated


@cache
def undisturbed() -> Scored:
    """One recording of the machine with its own model."""
    return scored_of(context_of(campaign(simulated(1)), model()))


def ruled(heat: Callable[[Array, Array], Array]) -> str:
    """The rule for heat that follows speed and pump, in blocks of a recording."""
    current = undisturbed()
    (trajectory,) = current.fit.trajectories
    nodes, time = trajectory.at_nodes(), trajectory.system.grid.time
    edges = np.linspace(time[0], time[-1], BLOCKS + 1)
    block = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, BLOCKS - 1)
    mean = [np.bincount(block, nodes[n]) / np.bincount(block) for n in ("speed", "pump")]
    series = {"r1": heat(*mean)}
    return of_free_heat(current, Force("bed", 50.0, {"r1": edges}, series, series, np.zeros(0))) or ""


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


def test_a_description_follows_what_recordings_can_show() -> None:
    """A lag of a minute in ten minutes: what is said of the missing heat has time constants of that order."""
    runs = ten_minutes()
    heat, slow = runs.recordings["a"].values["heater"], [0.0]
    for power in heat[:-1]:  # 5 s of a lag of a minute
        slow.append(power + (slow[-1] - power) * float(np.exp(-5.0 / 60.0)))
    values = {**runs.recordings["a"].values, "T": runs.recordings["a"].values["T"] + 0.8 * np.array(slow)}
    runs = replace(runs, recordings={"a": replace(runs.recordings["a"], values=values)})
    where = context_of(runs, plate(0.04), outputs=["T"])
    current = scored_of(where)
    force = latent_forces(current.seen, current.settings[current.best], where.floor)[0]
    assert force.state == "T"
    found = describe(where, current, force)
    assert found
    assert found.gain > 3.0
    times = [float(t) for t in re.findall(r"lag\(\w+, ([\d.]+)\)", found.formula)]
    assert all(time <= 60.0 for time in times)


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
    where = context_of(campaign(simulated(1)), model(), [word])
    h = claim_of(where, word, state)
    found = scored_of(where, h)
    theta = found.fit.theta.copy()
    for k, u in enumerate(found.fit.problem.unknowns):
        if u.name in h.amplitudes:  # any size will do: here nothing of the kind acts
            theta[k] = 5.0
    runs = tuple(found.fit.problem.run(t.system, theta) for t in found.fit.trajectories)
    answer = replace(found, fit=replace(found.fit, theta=theta, trajectories=runs))
    rules = of_effects(answer, [h], where.baseline.problem.model)
    assert rules is None if rule is None else re.fullmatch(rule, rules or "")
