"""Where masses start in a further recording belongs to the numbers of the fit that says so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.signal import lfilter

from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.sparse.library import Feature
from discovery.sparse.masses import Response, Rules, fit_masses, mass_model
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
    for power in (500.0, 900.0):
        assert float(evaluate(start, {"P": power}).value) == pytest.approx(-offset, abs=0.6)


def test_starts_follow_what_is_recorded_at_that_moment() -> None:
    """A mass that the load warms, and a cooler whose power says how warm it is when the load stands still."""
    rng, tau = np.random.default_rng(3), 7200.0
    time = np.arange(0.0, 200_000.0, 300.0)
    recordings = {}
    for k in range(3):
        load = np.repeat(rng.choice([0.0, 400.0, 900.0], 70), 10)[: len(time) + 30]
        mass = lfilter([1 - np.exp(-300.0 / tau)], [1.0, -np.exp(-300.0 / tau)], 0.02 * load)[30:]
        load = load[30:]
        cooler = 10.0 * mass + 0.2 * rng.standard_normal(len(time))
        load[0] = 0.0  # it stands still for the first reading
        readings = mass + 0.05 * rng.standard_normal(len(time))
        recordings[f"r{k}"] = Recording(f"r{k}", time, {"P": load, "Q": cooler, "E": readings})
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "Q": Channel("Q", "cooling power", "W", None, "held"),
        "E": Channel("E", "error", "um", 0.05, "linear"),
    }
    parameters = {"g": Parameter(0.02, "um/W"), "tau": Parameter(tau, "s"), "h": Parameter(0.0, "um/W")}
    terms = (Term("settles", "s", parse("-s/tau")), Term("driven", "s", parse("g*P/tau + h*Q/tau")))
    states = {"s": State("s", "um", None, Number(0.0), 5.0, 1.0)}
    model = Model("m", parameters, states, terms, {"E": parse("s")}, "s")
    campaign = Campaign("c", channels, recordings, Path("c"))
    start = fit_masses(model, campaign, ["r0", "r1"], ["E"]).model.states["s"].start
    assert start is not None
    for recording in recordings.values():
        now = {name: float(recording.values[name][0]) for name in ("P", "Q")}
        assert float(evaluate(start, now).value) == pytest.approx(now["Q"] / 10.0, abs=1.5)


@pytest.mark.parametrize("tau", [600.0, 3600.0, 20_000.0])
def test_a_mass_begins_as_its_drive_has_lasted(tau: float) -> None:
    """Against a long run: a load that is on or off for T on average, and the mass that it drives."""
    rng, lasts, gain, step = np.random.default_rng(1), 3600.0, 0.02, 10.0
    load = 500.0 * np.cumprod(np.where(rng.random(4_000_000) < step / lasts / 2, -1.0, 1.0))
    kept = np.exp(-step / tau)
    mass = lfilter([gain * (1 - kept)], [1.0, -kept], load)[100_000:]
    now = load[100_000:]
    slope = float(now @ mass / (now @ now))
    rules = Rules("E", {"E": "um", "P": "W"}, (), {"P": lasts}, {}, (10.0, 1e6), 4.0)
    feature = Feature("P", tau)
    model = mass_model(rules, [Response(feature, gain, 0, feature)])
    start = model.states["E_1"]
    assert start.start is not None
    assert start.start_sd is not None
    declared = float(evaluate(start.start, {"P": 500.0, **model.values()}).value)
    assert declared == pytest.approx(500.0 * slope, abs=0.4)
    left = float(np.std(mass - slope * now) / np.std(mass))
    assert start.start_sd == pytest.approx(4.0 * left, rel=0.1)
    settled = mass_model(replace(rules, settled=("P",), lasting={}), [Response(feature, gain, 0, feature)])
    assert settled.states["E_1"].start_sd == 4.0
