"""The time constant of process noise is unknown: a machine whose laws are off for minutes has no event."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import make_context, process_prior
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from discovery.dynamics import make_grid, make_system, simulate
from discovery.effects.catalogue import catalogue
from discovery.evidence.process_noise import flow_sizes
from discovery.evidence.settings import settings
from discovery.fitting import Noise
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
STEP, CAPACITY, LINK, AIR = 60.0, (8000.0, 40000.0), 30.0, 9.0  # s, J/K, W/K
OFF, MINUTES = 0.04, 20.0  # share by which each flow is off, and for how long
WORDS = ("unmeasured_heat", "friction_speed", "second_thermal_mass", "conduction_path")


def wandering(rng: np.random.Generator, count: int) -> Array:
    """First-order noise of unit variance."""
    kept = np.exp(-STEP / (60.0 * MINUTES))
    out = rng.standard_normal(count)
    for k in range(1, count):
        out[k] = kept * out[k - 1] + np.sqrt(1 - kept**2) * out[k]
    return out


def recorded(seed: int) -> Recording:
    """A day of a coil on a frame, read each minute to 0.01 K."""
    rng = np.random.default_rng(seed)
    count = 1440
    power: Array = np.repeat(rng.choice([0.0, 100.0, 250.0, 400.0], 24), 60)
    heat, link, air = (1.0 + OFF * wandering(rng, count) for _ in range(3))
    x: Array = np.full((count, 2), 22.0)
    for k in range(count - 1):
        coil, frame = x[k]
        between, lost = LINK * (coil - frame) * link[k], AIR * (frame - 22.0) * air[k]
        x[k + 1, 0] = coil + STEP * (power[k] * heat[k] - between) / CAPACITY[0]
        x[k + 1, 1] = frame + STEP * (between - lost) / CAPACITY[1]
    read = x + 0.01 * rng.standard_normal(x.shape)
    values = {"P": power, "room": np.full(count, 22.0), "coil": read[:, 0], "frame": read[:, 1]}
    return Recording(f"r{seed}", STEP * np.arange(count, dtype=float), values)


def best(*seeds: int) -> Scored:
    """The most likely model."""
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "coil": Channel("coil", "temperature", "degC", 0.01, "linear"),
        "frame": Channel("frame", "temperature", "degC", 0.01, "linear"),
    }
    seen = Campaign("coil", channels, {r.name: r for r in map(recorded, seeds)})
    terms = (
        Term("power", "coil", parse("share*P")),
        Term("link", "coil", parse("G*(frame - coil)"), "frame"),
        Term("air", "frame", parse("hA*(room - frame)")),
    )
    sizes = {"share": (0.9, "1"), "G": (25.0, "W/K"), "hA": (8.0, "W/K")}
    parameters = {name: Parameter(value, unit, 0.0) for name, (value, unit) in sizes.items()}
    capacity = dict(zip(("coil", "frame"), CAPACITY, strict=True))
    states = {name: State(name, "degC", c, parse("room"), 0.3, 1 / c) for name, c in capacity.items()}
    model = Model("coil", parameters, states, terms, {})
    names = list(seen.recordings)
    after = {run: tuple(names[k:]) for k, run in enumerate(names)}
    effects = [e for e in catalogue().values() if e.word in WORDS]
    return Search(make_context(seen, model, names, ("coil", "frame"), effects, after)).run().best


@pytest.mark.parametrize("g", [1e3, 1e5, 1e7])
def test_a_joint_as_good_as_rigid_is_no_larger_flow(g: float) -> None:
    """Two halves of a coil that begin 1 K apart are as warm within seconds. What flows between them then is
    what heats the second half, half of the heat; `g` times 1 K at first would be the largest flow by far.
    """
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "coil": Channel("coil", "temperature", "degC", 0.01, "linear"),
    }
    time, power = STEP * np.arange(600.0), np.repeat([0.0, 400.0, 100.0], 200)
    read = Recording("r", time, {"P": power, "coil": np.full(600, 22.0)})
    campaign = Campaign("halves", channels, {"r": read})
    terms = (Term("power", "coil", parse("P")), Term("joint", "coil", parse("G*(core - coil)"), "core"))
    states = {n: State(n, "degC", 4000.0, parse("22"), 0.3, 1 / 4000.0) for n in ("coil", "core")}
    model = Model("halves", {"G": Parameter(g, "W/K")}, states, terms, {})
    system = make_system(model, make_grid(campaign, "r", ["P"], ["coil"]))
    found = flow_sizes([simulate(system, {"G": g}, np.array([23.0, 22.0]))])
    heat = np.sqrt(np.mean(power**2))
    assert found["core"] == pytest.approx(heat / 2, rel=0.02)
    assert found["coil"] == pytest.approx(np.hypot(heat, heat / 2), rel=0.02)


def test_laws_that_are_off_for_minutes_are_no_event(monkeypatch: pytest.MonkeyPatch) -> None:
    """With one time constant of 3 h they are."""
    found = best(1, 2)
    assert found.hypotheses == ()
    assert 0.5 * 60 * MINUTES < found.noise.heat_time < 3 * 60 * MINUTES
    monkeypatch.setattr(thresholds, "TIMES", {1.0: 1.0})
    assert best(1, 2).hypotheses != ()


def test_a_coarse_body_has_steps_of_its_own() -> None:
    """Next to a place lie those where the others lose a step of what the coarse body keeps."""
    white = Noise(("T",), (0.1,))
    grid = settings(white, {"coil": 1.0, "frame": 2.0}, process_prior(), False, False, ("coil",))
    levels, shares = list(thresholds.LEVELS), list(thresholds.SHARES)
    place = (0, 0, 0, 2, 2, 0, 0, 0)
    assert grid.at(place).noise.force is None
    near = [grid.at(one).noise for one in grid.near(place)]
    assert {"coil": (levels[3], shares[2])} in [n.force for n in near if n.share == shares[1]]
    above = grid.at((0, 0, 0, 1, 1, 0, 0, 2)).noise
    assert (above.heat, above.share) == ({"coil": levels[1], "frame": 2.0 * levels[1]}, shares[1])
    assert above.force == {"coil": (levels[3], shares[3])}
    weights = [grid.at((*place[:-1], k)).log_weight for k in range(2)]
    usual = max(thresholds.SHARES, key=lambda share: thresholds.SHARES[share])
    odds = [weight for share, weight in thresholds.SHARES.items() if share >= usual]
    assert np.exp(weights[1] - weights[0]) == pytest.approx(odds[1] / odds[0] / 2)  # two bodies


def test_one_sensor_may_be_slower_than_the_others() -> None:
    """It keeps its slow noise where the others lose a step."""
    white = Noise(("T", "E", "Z"), (0.1, 2.0, 5.0))
    grid = settings(white, {"coil": 1.0}, process_prior(), False, False, slower=("E",))
    sizes = list(thresholds.SLOW)
    place = (0, 0, 1, 0, 0, 0, 0, 2)
    assert grid.at(place).noise.slow == pytest.approx((sizes[1] * 0.1, sizes[3] * 2.0, sizes[1] * 5.0))
    near = [grid.at(one).noise.slow for one in grid.near(place)]
    assert any(slow == pytest.approx((0.0, sizes[3] * 2.0, 0.0)) for slow in near)
    assert grid.closest(grid.at(place).noise, lambda _: True) == place
    weights = [grid.at((*place[:-1], k)).log_weight for k in (0, 2)]
    assert np.exp(weights[1] - weights[0]) == pytest.approx(thresholds.SLOW[1.0] / thresholds.SLOW[0.0] / 3)


def test_slow_noise_may_be_as_fast_as_process_noise() -> None:
    """A sensor that is updated every few seconds shows stairs: noise of seconds, not of a whole test."""
    white = Noise(("T",), (0.1,), slow_time=7200.0, heat_time=10800.0)
    grid = settings(white, {"coil": 1.0}, process_prior(), unsure=False, noisy=False)
    found = {(s.noise.slow_time / 7200.0, s.noise.heat_time / 10800.0) for s in grid}
    assert found == {(part, part) for part in thresholds.TIMES}
