"""The next experiment is one that the machine at hand can do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.mismatch.ask import next_experiment
from discovery.mismatch.context import make_context
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.mismatch.machine import NOISE, SEEN, campaign, model, simulated

PLATE = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "heater": Channel("heater", "heat load", "W", None, "held"),
    "T": Channel("T", "temperature", "degC", 0.1, "linear"),
}


def plate(gain: float) -> Model:
    """A heated plate that starts where it was first read."""
    return Model(
        "plate",
        {"loss": Parameter(0.01, "1/s", 0.0), "gain": Parameter(gain, "K/W/s", 0.0)},
        {"T": State("T", start=None)},
        (Term("loss", "T", parse("loss*(T_env - T)")), Term("gain", "T", parse("gain*heater"))),
        {},
    )


def ten_minutes() -> Campaign:
    """Steps of a heater on a plate: closed form between the steps."""
    time = np.arange(0.0, 601.0, 5.0)
    heat, rate = np.where((time // 150) % 2 == 0, 0.0, 10.0), 0.01
    values = [60.0]
    for power in heat[:-1]:
        level = 20.0 + 0.05 * power / rate
        values.append(level + (values[-1] - level) * np.exp(-rate * 5.0))
    rng = np.random.default_rng(0)
    recording = Recording(
        "a",
        time,
        {
            "T_env": np.full(len(time), 20.0),
            "heater": heat,
            "T": np.array(values) + rng.normal(0, 0.1, len(time)),
        },
    )
    return Campaign("plate", PLATE, {"a": recording})


def test_a_heated_plate_is_not_sent_to_pump_for_hours() -> None:
    where = make_context(ten_minutes(), plate(0.04), ["a"], ["T"], [])
    fitted = where.baseline.model
    other = fitted.with_values({"gain": 1.3 * fitted.parameters["gain"].value})
    said = next_experiment(where, other, None, np.array([0.1]))
    for word in ("dry", "pump", "speed", "fluid", " h "):
        assert word not in said
    assert "load" in said
    assert "would confirm the answer within about" in said


def test_a_pattern_starts_where_the_machine_was_read() -> None:
    """Two answers that differ in how they cool down are told apart by standing still, from 60 degC on."""
    where = make_context(ten_minutes(), plate(0.04), ["a"], ["T"], [])
    fitted = where.baseline.model
    still = replace(fitted, parameters={**fitted.parameters, "gain": Parameter(0.0, "K/W/s", fixed=True)})
    faster = still.with_values({"loss": 2 * still.parameters["loss"].value})
    said = next_experiment(where, faster, still, np.array([0.1]))
    assert "tells the rivals apart within about" in said


@pytest.mark.parametrize("wet", [True, False])
def test_a_machine_with_a_pump_is_asked_to_run_it_or_to_stay_dry(wet: bool) -> None:
    where = make_context(campaign(simulated(1)), model(), ["r1"], tuple(SEEN), [])
    fitted = where.baseline.model
    name = "hF" if wet else "loss"
    other = fitted.with_values({name: 1.5 * fitted.parameters[name].value})
    said = next_experiment(where, other, None, np.full(3, NOISE))
    assert ("pump" in said) == wet
    assert ("dry" in said) != wet
