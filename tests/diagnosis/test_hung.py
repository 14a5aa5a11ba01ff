"""A sensor that hangs, from the recording to diagnosis.json."""

from __future__ import annotations

import numpy as np

from discovery.diagnosis import Diagnosis, diagnose
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}


def plate(seed: int, hangs: bool = False) -> Recording:
    """A plate of 60 J/K over 1500 s, as its model says; its sensor may hang from 300 to 400 s."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 1501.0, 5.0)
    power = np.where((time > 100.0) & (time < 900.0), 30.0 + 10.0 * seed, 0.0)
    warm, lag = np.full(time.size, 21.0), np.exp(-5.0 * 0.3 / 60.0)
    for k in range(time.size - 1):
        end = 21.0 + power[k] / 0.3
        warm[k + 1] = end + (warm[k] - end) * lag
    shown = np.round(warm + rng.normal(0.0, 0.05, time.size), 2)
    if hangs:
        shown[60:81] = shown[60]
    return Recording(f"r{seed}", time, {"P": power, "room": np.full(time.size, 21.0), "T": shown})


def found(*runs: Recording) -> Diagnosis:
    terms = (Term("power", "T", parse("P")), Term("air", "T", parse("hA*(room - T)")))
    states = {"T": State("T", "degC", 60.0, parse("room"), None, 1 / 60.0)}
    seen = Campaign("plates", CHANNELS, {r.name: r for r in runs})
    model = Model("plate", {"hA": Parameter(0.2, "W/K", 0.0)}, states, terms, {})
    return diagnose(model, seen, [r.name for r in runs], [], ["T"])


def test_a_sensor_that_hung_stands_in_the_document() -> None:
    answer = found(plate(1), plate(2, hangs=True)).document()
    assert (answer.verdict, answer.physics) == ("measurement fault", [])
    (one,) = answer.hung
    assert (one.output, one.recording, one.start_s, one.end_s, one.readings) == ("T", "r2", 300.0, 400.0, 21)


def test_nothing_hung_in_the_same_recordings_as_they_are() -> None:
    answer = found(plate(1), plate(2)).document()
    assert (answer.verdict, answer.physics, answer.hung) == ("no mismatch", [], [])
