"""Where masses start in a further recording belongs to the numbers of the fit that says so."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.masses import fit_masses
from discovery.terms import Number, Term, evaluate, parse

TIME = np.arange(0.0, 36_001.0, 600.0)
TAU = 180_000.0


def slow(offset: float) -> Model:
    """A slow mass, and an offset that is given."""
    parameters = {
        "g": Parameter(0.01, "um/W", 0.0, 1.0),
        "tau": Parameter(TAU, "s", fixed=True),
        "c": Parameter(offset, "um", fixed=True),
    }
    states = {"s": State("s", "um", None, parse("0 + 4"), 5.0, 1.0)}
    terms = (Term("settles", "s", parse("-s/tau")), Term("driven", "s", parse("g*P/tau")))
    return Model("slow", parameters, states, terms, {"E": parse("s + c")}, "s")


def cold_starts() -> Campaign:
    """Two recordings in which the mass starts at 0 and the offset is 0."""
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "E": Channel("E", "error", "um", 0.05, "linear"),
    }
    recordings = {}
    for seed, power in enumerate((500.0, 900.0)):
        noise = 0.05 * np.random.default_rng(seed).standard_normal(len(TIME))
        readings = 0.01 * power * (1 - np.exp(-TIME / TAU)) + noise
        recordings[f"r{seed}"] = Recording(f"r{seed}", TIME, {"P": np.full(len(TIME), power), "E": readings})
    return Campaign("c", channels, recordings, Path("c"))


@pytest.mark.parametrize("offset", [0.0, 3.0])
def test_starts_make_up_for_an_offset(offset: float) -> None:
    model = fit_masses(slow(offset), cold_starts(), ["r0", "r1"], ["E"]).model
    start = model.states["s"].start
    assert start is not None
    assert float(evaluate(start, {}).value) == pytest.approx(-offset, abs=0.6)
    assert not isinstance(start, Number)  # what was declared stays a formula
