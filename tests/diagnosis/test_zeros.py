"""Every thermometer is off by some tenths of a kelvin: that is no fault, and no missing physics."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis import Diagnosis, diagnose
from discovery.effects.catalogue import catalogue
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
CAPACITY, LOSS, EVERY, READING = 40_000.0, 20.0, 60.0, 0.02  # J/K, W/K, s, K
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "body": Channel("body", "temperature", "degC", READING, "linear"),
}
WORDS = ("sensor_offset", "unmeasured_heat", "bed_memory", "second_thermal_mass", "radiation")


def recorded(seed: int, off: float) -> Recording:
    """Thirty hours of a body under its load; the sensor of the room shows `off` too much."""
    rng = np.random.default_rng(seed)
    time: Array = EVERY * np.arange(1800, dtype=float)
    power = np.repeat(rng.choice([0.0, 50.0, 100.0, 150.0], 60), 30)
    room: Array = 21.0 + 1.5 * np.sin(2 * np.pi * time / 20_000 + seed)
    warm: Array = np.full(1800, room[0])
    for k in range(1799):
        rest = room[k] + power[k] / LOSS
        warm[k + 1] = rest + (warm[k] - rest) * np.exp(-EVERY * LOSS / CAPACITY)
    read = warm + READING * rng.standard_normal(1800)
    return Recording(f"r{seed}", time, {"P": power, "room": room + off, "body": read})


def diagnosed(off: float) -> Diagnosis:
    seen = Campaign("hall", CHANNELS, {f"r{k}": recorded(k, off) for k in (1, 2, 3, 4)})
    terms = Term("power", "body", parse("g*P")), Term("air", "body", parse("hA*(room - body)"))
    parameters = {"g": Parameter(1.1, "1", 0.0), "hA": Parameter(16.0, "W/K", 0.0)}
    states = {"body": State("body", "degC", CAPACITY, parse("body"), READING, 1 / CAPACITY)}
    model = Model("hall", parameters, states, terms, {})
    effects = [e for e in catalogue().values() if e.word in WORDS]
    return diagnose(model, seen, ["r1", "r2", "r3"], ["r4"], effects=effects)


@pytest.mark.parametrize("off", [-0.2, 0.3])
def test_a_usual_zero_has_no_name(off: float) -> None:
    found = diagnosed(off)
    assert found.verdict.word == "no mismatch"
    (proof,) = found.held_out.values()
    assert proof.before < proof.expected


def test_a_large_one_has() -> None:
    named = diagnosed(3.0).verdict.named
    assert {n.hypothesis.effect.word for n in named} <= {"sensor_offset", "unmeasured_heat"}
    assert named
