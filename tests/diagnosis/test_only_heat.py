"""A model without its only heat: nothing flows in it, and what is recorded still has a name."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.diagnosis import diagnose
from discovery.diagnosis.document import document
from discovery.dynamics import make_grid, make_system, simulate
from discovery.evidence.process_noise import flow_sizes, flows_at_least
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CAPACITY, EXCHANGE, STEP = 500.0, 2.0, 10.0  # J/K, W/K, s


def cell(power: np.ndarray, seed: int, name: str) -> Recording:
    """A body in air of 22 degC that is heated by a recorded power, with 0.05 K of noise."""
    warm = np.zeros(len(power))
    for k in range(1, len(power)):  # exact for a power that is held
        fade = np.exp(-EXCHANGE * STEP / CAPACITY)
        warm[k] = fade * warm[k - 1] + (1 - fade) * power[k - 1] / EXCHANGE
    noise = np.random.default_rng(seed).normal(0.0, 0.05, len(power))
    data = {"P": power, "air": np.full(len(power), 22.0), "body": 22.0 + warm + noise}
    return Recording(name, STEP * np.arange(float(len(power))), data)


@pytest.fixture(scope="module")
def campaign() -> Campaign:
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "air": Channel("air", "ambient temperature", "degC", None, "linear"),
        "body": Channel("body", "temperature", "degC", None, "linear"),
    }
    first = np.repeat([0.0, 40.0, 10.0, 60.0, 0.0], 60)
    other = np.repeat([20.0, 0.0, 50.0, 5.0, 30.0], 60)
    return Campaign("cell", channels, {"a": cell(first, 1, "a"), "b": cell(other, 2, "b")})


@pytest.fixture(scope="module")
def unheated() -> Model:
    terms = (Term("air", "body", parse("hA*(air - body)")),)
    states = {"body": State("body", "degC", CAPACITY, parse("air"), scale=1.0 / CAPACITY)}
    return Model("cell", {"hA": Parameter(EXCHANGE, "W/K", 0.0)}, states, terms, {})


def test_what_is_missed_would_have_to_flow(campaign: Campaign, unheated: Model) -> None:
    """It stays at 22 degC: no flow. It misses the body by its rise; an eighth of 2990 s is the time."""
    system = make_system(unheated, make_grid(campaign, "a", ["air"], ["body"]))
    run = [simulate(system, {"hA": EXCHANGE}, np.array([22.0]))]
    assert flow_sizes(run)["body"] == pytest.approx(0.0, abs=1e-9)
    rise = campaign.recordings["a"].values["body"] - 22.0
    wanted = CAPACITY * np.sqrt(np.mean(rise**2)) / (2990.0 / 8)
    assert flows_at_least(run)["body"] == pytest.approx(wanted)


def test_a_recorded_power_that_is_the_only_heat_has_a_name(campaign: Campaign, unheated: Model) -> None:
    """Before, sizes were a share of no flow, and the air was found to be off by many kelvin."""
    answer = document(diagnose(unheated, campaign, ["a", "b"]))
    named = {(p.effect, tuple(p.states)) for p in answer.physics}
    assert named == {("input_heat", ("body",))}
