"""A light machine whose power is read with noise: heat of unknown cause where nobody knows of the noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis import diagnose
from discovery.diagnosis.context import make_context
from discovery.diagnosis.selection import Search
from discovery.dynamics import Trajectory
from discovery.dynamics.samples import Samples
from discovery.effects.catalogue import catalogue
from discovery.evidence.noisy import smooth, spectral, with_noise
from discovery.fitting import Noise
from discovery.fitting.kalman import innovations, make_filter
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
CAPACITY, LOSS, EVERY, READING = 5000.0, 9.0, 10.0, 0.05  # J/K, W/K, s, K
SHARE = 0.2  # by which each sample of the power is off
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "body": Channel("body", "temperature", "degC", READING, "linear"),
}


def recorded(seed: int, share: float, acts: bool = True) -> Recording:
    """Four hours of a body with a time constant of 9 min. Its power is off by a share of its value in each
    sample; it `acts` as it is drawn, and is recorded without what the noise adds, or the reverse.
    """
    rng = np.random.default_rng(seed)
    level: Array = np.repeat(rng.choice([0.0, 60.0, 120.0, 240.0], 24), 60)
    off = level * (1.0 + share * rng.standard_normal(len(level)))
    warm: Array = np.full(len(level), 22.0)
    decay = np.exp(-EVERY * LOSS / CAPACITY)
    for k, heat in enumerate((level if acts else off)[:-1]):
        rest = 22.0 + heat / LOSS
        warm[k + 1] = rest + (warm[k] - rest) * decay
    read = warm + READING * rng.standard_normal(len(level))
    room, time = np.full(len(level), 22.0), EVERY * np.arange(len(level), dtype=float)
    return Recording(f"r{seed}", time, {"P": off, "room": room, "body": read})


def campaign(*recordings: Recording) -> Campaign:
    return Campaign("light", CHANNELS, {r.name: r for r in recordings})


def model() -> Model:
    terms = Term("power", "body", parse("share*P")), Term("air", "body", parse("hA*(room - body)"))
    parameters = {"share": Parameter(0.9, "1", 0.0), "hA": Parameter(8.0, "W/K", 0.0)}
    states = {"body": State("body", "degC", CAPACITY, parse("room"), 0.3, 1 / CAPACITY)}
    return Model("light", parameters, states, terms, {})


def noise(rough: float) -> Noise:
    return Noise(("body",), (READING,), rough=rough)


def runs(seen: Campaign) -> list[Trajectory]:
    """Free runs of the model with the right numbers, which know how rough the inputs are."""
    context = make_context(seen, model(), list(seen.recordings), ("body",), [], {})
    return [with_noise(seen, run) for run in context.baseline.trajectories]


def test_noise_is_found_near_each_sample_at_any_level() -> None:
    rng = np.random.default_rng(3)
    level: Array = np.repeat([0.0, 100.0, 400.0], 400)
    read: Array = level * (1 + 0.1 * rng.standard_normal(1200))
    found = spectral(Samples(np.linspace(0.0, 2398.0, 1200), read, False))
    parts = [float(np.median(found.value[k + 20 : k + 380])) / np.sqrt(2.0) for k in (0, 400, 800)]
    assert parts == pytest.approx([0.0, 10.0, 40.0], rel=0.15)
    stated = spectral(Samples(np.arange(50.0), np.zeros(50), True), 0.3)
    assert stated.value == pytest.approx(0.3)


def test_one_switch_at_either_end_is_no_noise() -> None:
    for first, last in ((0.0, 60.0), (60.0, 0.0)):
        quiet = recorded(1, 0.0)
        power = np.full(len(quiet.time), 60.0)
        power[0], power[-1] = first, last
        seen = campaign(replace(quiet, values={**quiet.values, "P": power}))
        assert "P" not in runs(seen)[0].system.grid.noisy


def test_the_variance_of_free_runs_is_that_of_many_simulated_ones() -> None:
    """Of a body under a steady load: sd^2 D / (2 tau) (1 - exp(-2 t / tau)) / hA^2 for t far above D."""
    seen = campaign(recorded(1, SHARE))
    run = runs(seen)[0]
    free = make_filter(run).spread(noise(1.0))[:, 0]
    rng = np.random.default_rng(4)
    level = np.abs(recorded(1, 0.0).values["P"])
    moved, decay, many = np.zeros(2000), np.exp(-EVERY * LOSS / CAPACITY), []
    for heat in level:
        many.append(float(moved.var()))
        moved = moved * decay + SHARE * heat * rng.standard_normal(2000) * (1 - decay) / LOSS
    assert float(free.mean()) == pytest.approx(float(np.mean(many)), rel=0.2)
    assert np.corrcoef(free, many)[0, 1] > 0.85


def test_edges_stay_where_an_input_is_smoothed() -> None:
    rng = np.random.default_rng(6)
    level: Array = np.repeat([0.0, 100.0, 40.0, 0.0, 300.0], [100, 100, 3, 97, 200])
    read: Array = level * (1 + 0.05 * rng.standard_normal(500))
    seen = Samples(np.linspace(0.0, 2495.0, 500), read, False)
    left = smooth(seen, spectral(seen)).value - level
    assert float(np.std(left[300:])) < 0.35 * 0.05 * 300
    assert np.abs(left[[99, 100, 200, 201, 202, 203, 299, 300]]).max() < 30.0  # the short level stays, too
    assert np.abs(left[:80]).max() == 0.0


def test_innovations_are_white_once_the_noise_is_known() -> None:
    seen = campaign(recorded(5, SHARE, acts=True))
    run = runs(seen)[0]
    residual = run.system.grid.readings - run.x[run.system.grid.read]
    for rough, low, high in ((0.0, 2.0, np.inf), (1.0, 0.85, 1.2)):
        z = innovations(run, noise(rough), residual)
        assert low < float(np.sqrt(np.nanmean(z**2))) < high


def test_a_noisy_power_is_no_missing_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = campaign(recorded(1, SHARE), recorded(2, SHARE))
    words = ("unmeasured_heat", "second_thermal_mass", "sensor_lag", "free_convection", "rezero")
    effects = [e for e in catalogue().values() if e.word in words]
    found = diagnose(model(), seen, ["r1", "r2"], effects=effects)
    assert found.verdict.word == "no mismatch"
    assert any(one.startswith("P jumps from sample to sample") for one in found.verdict.reasons)
    assert found.search.baseline.noise.share < 0.02
    # without it, all flows are off by as much as usual models are at most, and hide what is as small
    monkeypatch.setattr("discovery.diagnosis.context.perhaps_noisy", lambda _f, _c, grids, *_: grids)
    context = make_context(seen, model(), ["r1", "r2"], ("body",), effects, {})
    assert Search(context).run().baseline.noise.share >= 0.08


def test_a_power_that_moves_as_recorded_is_not_noise() -> None:
    """A rough input that the body follows: the readings decide, not the roughness."""
    seen = campaign(recorded(1, SHARE, acts=False), recorded(2, SHARE, acts=False))
    context = make_context(seen, model(), ["r1", "r2"], ("body",), [], {})
    assert any(s.noise.rough for s in context.settings)
    assert Search(context).run().best.noise.rough == 0.0


def test_it_is_asked_only_where_the_readings_show_it() -> None:
    smooth = campaign(recorded(1, 0.0))
    assert not any(s.noise.rough for s in make_context(smooth, model(), ["r1"], ("body",), [], {}).settings)
    coarse = replace(CHANNELS["body"], noise=5.0)
    seen = replace(campaign(recorded(1, SHARE)), channels={**CHANNELS, "body": coarse})
    assert not any(s.noise.rough for s in make_context(seen, model(), ["r1"], ("body",), [], {}).settings)
