"""A body that is cut off from all it exchanges with, because the heat that it lacks is not in the model."""

from __future__ import annotations

import numpy as np

from discovery.diagnosis import diagnose
from discovery.diagnosis.document import document
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

RATE, GAIN, STEP = 0.008, 0.3, 360.0  # 1/s, K/s at full sun, s
ROWS = ("first", "second")
CHANNELS = {
    "sun": Channel("sun", "heat load", "W", None, "linear"),
    "inlet": Channel("inlet", "coolant temperature", "degC", None, "linear"),
    **{row: Channel(row, "temperature", "degC", None, "linear") for row in ROWS},
}


def day(name: str, seed: int) -> Recording:
    """Two rows of collectors under clouds, on water that is colder while the sun shines."""
    rng = np.random.default_rng(seed)
    count = 90
    sun = np.clip(np.sin(np.pi * np.arange(count) / count) * rng.uniform(0.3, 1.1, count), 0.0, 1.0)
    inlet = 70.0 - 15.0 * np.convolve(sun, np.ones(5) / 5, "same") + np.cumsum(rng.normal(0.0, 0.2, count))
    fine = 60
    times = np.arange(count * fine) / fine
    suns, inlets = (np.interp(times, np.arange(count), x) for x in (sun, inlet))
    warm, step = np.empty(count * fine), STEP / fine
    warm[0] = inlet[0]
    for k in range(1, len(warm)):
        warm[k] = warm[k - 1] + step * (GAIN * suns[k - 1] - RATE * (warm[k - 1] - inlets[k - 1]))
    read = {row: np.round(warm[::fine] + rng.normal(0.0, 0.1, count), 2) for row in ROWS}
    return Recording(name, STEP * np.arange(float(count)), {"sun": 1000.0 * sun, "inlet": inlet, **read})


def test_a_body_that_lacks_heat_is_cut_off_by_the_fit_and_found_all_the_same() -> None:
    """Its exchange is zero in the fit without the sun; next to that, the sun alone fits no better."""
    parameters = {
        "a": Parameter(0.25, "K/s", 0.0),
        "k_first": Parameter(0.006, "1/s", 0.0),
        "k_second": Parameter(0.006, "1/s", 0.0),
    }
    terms = (
        Term("sun", "first", parse("a*sun/1000")),
        *(Term(f"water {row}", row, parse(f"k_{row}*(inlet - {row})")) for row in ROWS),
    )
    states = {row: State(row, "degC", None, parse("inlet")) for row in ROWS}
    model, runs = Model("rows", parameters, states, terms, {}), {n: day(n, k) for k, n in enumerate("ab")}
    found = diagnose(model, Campaign("rows", CHANNELS, runs), list(runs))
    assert found.before.model.parameters["k_second"].value == 0.0
    answer = document(found)
    assert [(p.effect, p.states) for p in answer.physics] == [("input_heat", ["second"])]
