"""The sun on several bodies, on most of them, or on one."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.diagnosis import diagnose
from discovery.diagnosis.document import document
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CAPACITY, EXCHANGE, AREA, STEP = 500.0, 2.0, 0.08, 20.0  # J/K, W/K, m**2, s
BODIES = ("first", "second", "third", "fourth")


def recording(name: str, seed: int, lit: int) -> Recording:
    """Bodies in air of 20 degC, of which the first `lit` are in a sun between clouds."""
    rng = np.random.default_rng(seed)
    sun = np.repeat(rng.uniform(0.0, 900.0, 20), 12)
    fade, warm = np.exp(-EXCHANGE * STEP / CAPACITY), np.zeros(len(sun))
    for k in range(1, len(sun)):
        warm[k] = fade * warm[k - 1] + (1 - fade) * AREA * sun[k - 1] / EXCHANGE
    read = {b: 20.0 + (j < lit) * warm + rng.normal(0.0, 0.1, len(sun)) for j, b in enumerate(BODIES)}
    time = STEP * np.arange(float(len(sun)))
    return Recording(name, time, {"sun": sun, "air": np.full(len(sun), 20.0), **read})


@pytest.mark.parametrize("lit", [4, 3, 1])
def test_an_input_heats_several_bodies_alike_most_of_them_or_one(lit: int) -> None:
    """Of four rows of collectors one was heated, and the others by exchanges that follow the sun; if one was
    in the shade, all were heated, and an exchange that follows the sun cooled that one.
    """
    channels = {
        "sun": Channel("sun", "other input", "W/m**2", None, "held"),
        "air": Channel("air", "ambient temperature", "degC", None, "linear"),
        **{b: Channel(b, "temperature", "degC", None, "linear") for b in BODIES},
    }
    dark = Model(
        "in the dark",
        {"hA": Parameter(EXCHANGE, "W/K", 0.0)},
        {b: State(b, "degC", CAPACITY, parse("air"), scale=1.0 / CAPACITY) for b in BODIES},
        tuple(Term(f"air {b}", b, parse(f"hA*(air - {b})")) for b in BODIES),
        {},
    )
    runs = {name: recording(name, seed, lit) for seed, name in enumerate("ab", 1)}
    answer = document(diagnose(dark, Campaign("rows", channels, runs), ["a", "b"]))
    assert [(p.effect, tuple(p.states)) for p in answer.physics] == [("input_heat", BODIES[:lit])]
