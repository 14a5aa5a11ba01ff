"""The rule that says when heat is missing, and the formula that it follows where nothing is named."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discovery.diagnosis.description import _library, describe
from discovery.diagnosis.regime import of_effects, of_free_heat
from discovery.diagnosis.scored import Scored
from discovery.evidence.latent_force import BLOCKS, Force
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
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


def test_a_description_has_lags_that_recordings_can_show() -> None:
    """Ten minutes: time constants of seconds, not those of a machine tool."""
    where = context_of(ten_minutes(), plate(0.04), outputs=["T"])
    said = " ".join(text for text, _ in _library(where, scored_of(where), "T", np.array([20.0, 40.0])))
    times = [float(t) for t in re.findall(r"lag\([\w.]+, ([\d.]+)\)", said)]
    assert min(times) == pytest.approx(600.0 / 150)
    assert max(times) == pytest.approx(600.0 / 40)
    assert "heater" in said
    assert "lag(T" not in said  # it is read: the heat that warms it follows its own rise whatever is lacking


def valve() -> Recording:
    """A body of 2500 J/K that loses 3 W/K to the room, and 9 W/K more from 45 degC on."""
    rng, time = np.random.default_rng(5), np.arange(0.0, 18000.0, 60.0)
    heater = np.repeat(rng.uniform(0.0, 300.0, 15), 20)
    room = 21.0 + 1.5 * np.sin(time / 4800.0)

    def rate(t: float, x: Array) -> Array:
        k = min(int(t / 60.0), time.size - 1)
        opened = 9.0 / (1.0 + np.exp((45.0 - x) / 0.5))
        return np.asarray((heater[k] - (3.0 + opened) * (x - room[k])) / 2500.0)

    body = solve_ivp(rate, (0.0, time[-1]), [21.0], t_eval=time, max_step=20.0).y[0]
    read = body + rng.normal(0.0, 0.05, time.size)
    return Recording("r1", time, {"heater": heater, "room": room, "T": read})


def test_a_law_that_begins_at_a_temperature_is_described_with_it() -> None:
    """The model misses the body by several kelvin where the valve opens: its readings say where that is."""
    channels = {
        "heater": Channel("heater", "heat load", "W", None, "held"),
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "T": Channel("T", "temperature", "degC", 0.05, "linear"),
    }
    terms = (Term("heater", "T", parse("heater")), Term("air", "T", parse("hA*(room - T)")))
    state = State("T", "degC", 2500.0, parse("room"), 0.3, 1 / 2500.0)
    body = Model("body", {"hA": Parameter(3.0, "W/K", 0.0)}, {"T": state}, terms, {})
    where = context_of(Campaign("valve", channels, {"r1": valve()}), body, outputs=["T"])
    nothing = Force("T", 1.0, {}, {}, {}, np.zeros(0))
    found = describe(where, scored_of(where), nothing)
    assert found is not None
    limits = re.findall(r"max\(T - ([\d.]+), 0\)|\(T > ([\d.]+)\)", found.formula)
    assert any(40.0 < float(a or b) < 50.0 for a, b in limits), found.formula


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
