"""When heat acted or a sensor jumped: against signatures of the very event, and closed forms."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from discovery.dynamics import make_grid
from discovery.effects.candidates import candidates
from discovery.effects.catalogue import catalogue
from discovery.effects.form import Shape
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.scene import Scene
from discovery.evidence.bayes import Slab, project, project_one, scan
from discovery.evidence.events import LEAST, _Search, _span, event_steps, heat_steps, place_events
from discovery.evidence.settings import Setting
from discovery.evidence.signatures import signatures
from discovery.evidence.whitening import Whitened
from discovery.fitting import Noise, fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests import machine
from tests.effects.sample import sample, trajectory
from tests.machine import Array, Inputs

NOISE = Noise(tuple(machine.SEEN), (machine.NOISE,) * 3)
SETTING = Setting(NOISE, 0.0, 1.0, (0, 0, 0, 0))
SLAB = Slab(np.array([60.0]), np.array([3.5]), np.array([0.0]))


def test_a_span_holds_95_percent() -> None:
    """Log evidence of a normal instant, tried each second: one tried instant more on each side."""
    instants = np.arange(0.0, 1001.0)
    low, high = _span(norm.logpdf(instants, 480.0, 40.0), instants)
    assert (low, high) == pytest.approx(norm.interval(0.95, 480.0, 40.0), abs=2.0)


def test_a_span_ends_where_the_recording_does() -> None:
    instants = np.arange(0.0, 11.0)
    assert _span(np.where(instants == 0, 50.0, 0.0), instants) == (0.0, 1.0)
    assert _span(np.where(instants == 10, 50.0, 0.0), instants) == (9.0, 10.0)


def test_steps_of_heat_between_nodes_keep_their_share() -> None:
    """Heat that sets in within an interval keeps its energy, so its late response is that of the instant."""
    steps = heat_steps(trajectory(sample()[0]), "bed", np.array([3000.0, 3150.0, 3300.0]))[-1]
    assert np.allclose(steps[:, 1], 0.5 * (steps[:, 0] + steps[:, 2]), rtol=1e-3)


@pytest.mark.parametrize("word", ["unmeasured_heat", "draught", "input_missed"])
def test_a_window_of_an_effect_is_the_difference_of_two_steps(word: str) -> None:
    """What acts between two instants is what acts from the first on, less what acts from the second on."""
    seen = seen_of(machine.simulated(1), machine.simulated(2))
    on, off = 30000.0, 52200.0
    run = seen.fit.trajectories[1]
    for h in (h for h in machine.claims(machine.model(), word) if h.recording == "r2"):
        steps = event_steps(run, h, np.array([on, off]))
        whole = signatures(run, [h.at(dict(zip(h.shapes, (on, off), strict=True)))])[:, :, 0]
        # a formula is straight within the interval of its edge, a step is not: half an interval apart
        grid = run.system.grid
        far = np.min(np.abs(grid.time[grid.read][:, None] - [on, off]), axis=1) > 7200.0
        found = (steps[:, :, 0] - steps[:, :, 1])[far]
        np.testing.assert_allclose(found, whole[far], rtol=0, atol=0.05 * np.abs(whole).max())
        if word == "unmeasured_heat":
            np.testing.assert_allclose(steps, heat_steps(run, h.states[0], np.array([on, off])), rtol=1e-12)


def sun(t: float, _: Array, __: Inputs) -> tuple[float, float, float]:
    return (0.0, 0.0, 40.0 * (30000 <= t < 52000))


def seen_of(*runs: Recording) -> Whitened:
    seen, outputs = machine.campaign(*runs), list(machine.SEEN)
    grids = {r.name: make_grid(seen, r.name, machine.INPUTS, outputs) for r in runs}
    return Whitened(fit_model(machine.model(), seen, list(grids), outputs, grids=grids), 12)


def test_columns_of_one_recording_are_projected_as_those_of_all() -> None:
    """The others are zero there: same products, without whitening them."""
    seen = seen_of(machine.simulated(1), machine.simulated(2))
    columns = np.random.default_rng(0).standard_normal((*seen.residuals[1].shape, 4))
    whole = project(seen, SETTING, [np.zeros((*seen.residuals[0].shape, 4)), columns])
    alone = project_one(seen, SETTING.noise, seen.absorbed(SETTING.noise), 1, columns)
    np.testing.assert_allclose(alone.dot, whole.dot, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(alone.block(range(4)), whole.block(range(4)), rtol=1e-9, atol=1e-9)


def test_heat_of_some_hours_is_found_where_and_when_it_acted() -> None:
    seen = seen_of(machine.simulated(1), machine.simulated(2, concealed=sun))
    claims = machine.claims(machine.model(), "unmeasured_heat")
    (placed,) = place_events(seen, [SETTING], claims, [SLAB] * len(claims))
    assert len(placed) == len(claims)
    count = sum(len(h.amplitudes) for h in placed)
    scores = scan(seen, [SETTING], placed, SLAB.take(np.zeros(count, dtype=np.intp))).claims
    h = scores[0].hypothesis
    assert (h.states, h.recording) == (("bed",), "r2")
    on, off = h.shapes.values()
    assert (on, off) == pytest.approx((30000, 52000), abs=3000)
    for (low, high), instant in zip(h.spans.values(), (30000, 52000), strict=True):
        assert low - 3600 <= instant <= high + 3600
    assert abs(scores[0].size[0]) == pytest.approx(40.0, rel=0.25)
    assert h.log_weight < 0  # an instant that had to be found among many


def test_an_event_may_have_shapes_next_to_its_instants() -> None:
    """One of a user: a draught that builds up."""
    usual = catalogue()["draught"]
    formula = f"(1 - exp(-time/t_build))*{usual.formula}"
    slow = replace(usual, formula=formula, shapes=(Shape("t_build", "s", 3600.0, factor=2.0), *usual.shapes))
    seen = seen_of(machine.simulated(1), machine.simulated(2, concealed=sun))
    claims = candidates(machine.model(), [slow], machine.scene(machine.model()))
    (placed,) = place_events(seen, [SETTING], claims, [SLAB] * len(claims))
    assert len(placed) == len(claims)
    assert all(h.shapes[h.instants[0]] < h.shapes[h.instants[1]] for h in placed)


def test_a_jump_of_a_sensor_is_found_between_two_readings() -> None:
    other = machine.simulated(2)
    jumped = machine.changed(other, E_Z=other.values["E_Z"] + 3.0 * (other.time >= 50000))
    seen = seen_of(machine.simulated(1), jumped)
    claims = machine.claims(machine.model(), "sensor_offset")
    (placed,) = place_events(seen, [SETTING], claims, [Slab(*(np.array([v]) for v in (3.0, 4.0, 0.0)))] * 6)
    slab = Slab(np.full(6, 3.0), np.full(6, 4.0), np.zeros(6))
    scores = scan(seen, [SETTING], placed, slab).claims
    h = scores[0].hypothesis
    assert (h.outputs, h.recording) == (("E_Z",), "r2")
    ((low, high),) = h.spans.values()
    assert low < 50000 <= high
    assert high - low < 4 * machine.EVERY
    assert scores[0].size[0] == pytest.approx(3.0, abs=0.3)


def plate(seed: int, jump: int) -> Recording:
    """Six hours of a plate with a time constant of 14 min, read every 15 s to 0.1 K. From a reading on, its
    sensor shows 3 K more.
    """
    rng = np.random.default_rng(seed)
    power = np.repeat(rng.choice([0.0, 50.0, 150.0], 18), 80)[:1439]
    warm: Array = np.full(len(power), 21.0)
    for k, heat in enumerate(power[:-1]):
        warm[k + 1] = warm[k] + (heat / 1.4 + 21.0 - warm[k]) * (1 - np.exp(-15.0 * 1.4 / 1200.0))
    read = warm + 0.1 * rng.standard_normal(len(warm)) + 3.0 * (np.arange(len(warm)) >= jump)
    return Recording("r", 15.0 * np.arange(len(warm), dtype=float), {"P": power, "plate": read})


def placed(run: Recording, word: str, noise: Noise) -> Hypothesis:
    """The event of this word at the plate, at the instants that a recording makes most likely."""
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "plate": Channel("plate", "temperature", "degC", 0.1, "linear"),
    }
    terms = Term("power", "plate", parse("P")), Term("air", "plate", parse("hA*(21 - plate)"))
    states = {"plate": State("plate", "degC", 1200.0, parse("21"), 0.1, 1 / 1200.0)}
    model = Model("plate", {"hA": Parameter(1.0, "W/K", 0.0)}, states, terms, {})
    fit = fit_model(model, Campaign("plate", channels, {"r": run}), ["r"], ["plate"])
    scene = Scene(channels, ("plate",), ("r",), {"r": ("r",)}, {"P": 150.0}, frozenset(), 0.02, 0.02)
    effects = [e for name, e in catalogue().items() if name == word]
    claims = [h for h in candidates(model, effects, scene) if h.outputs or h.states]
    (found,) = place_events(Whitened(fit, 12), [replace(SETTING, noise=noise)], claims, [SLAB] * len(claims))
    return found[0]


@pytest.mark.parametrize("jump", [864, 1008])
def test_a_jump_is_found_where_a_filter_forgets_it_after_some_readings(jump: int) -> None:
    """With slow noise and process noise it shows in one innovation, and nothing six readings away."""
    noise = Noise(
        ("plate",), (0.1,), slow=(0.3,), heat={"plate": 2.0}, share=0.02, slow_time=1800.0, heat_time=2700.0
    )
    (instant,) = placed(plate(3, jump), "sensor_offset", noise).shapes.values()
    assert instant == 15.0 * jump


@pytest.mark.parametrize("wrong", [-1, 1])
def test_heat_neither_begins_nor_ends_beside_the_ends_of_a_recording(wrong: int) -> None:
    """One odd reading there is not heat during all the rest of the recording."""
    run = plate(3, 2000)
    few = Recording("r", run.time[:90], {name: v[:90].copy() for name, v in run.values.items()})
    few.values["plate"][wrong] += 3.0
    noise = Noise(("plate",), (0.1,), heat={"plate": 2.0}, share=0.02, heat_time=2700.0)
    for edge in placed(few, "unmeasured_heat", noise).shapes.values():
        beside = int(np.sum(few.time <= edge)), int(np.sum(few.time >= edge))
        assert min(beside) >= LEAST or edge in (few.time[0], few.time[-1])


def test_where_nothing_acts_there_is_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """A print head that stood still: between two instants there, what its heater may have missed does
    nothing, and the difference of two large responses is rounding. The closer look at an event ended there.
    """
    rng, count = np.random.default_rng(0), 12
    rounding = rng.standard_normal((count, count))
    part = SimpleNamespace(
        dot=3e5 + 1e-5 * rng.standard_normal(count),
        block=lambda some: (1e7 + 1e-9 * (rounding + rounding.T))[np.ix_(some, some)],
    )
    seen = seen_of(machine.simulated(1), machine.simulated(2))
    search = _Search(seen, SETTING.noise, seen.absorbed(SETTING.noise), "r1")
    monkeypatch.setattr(search, "projected", lambda _: part)
    gains = search._windows(np.zeros((1, 1, count)), SLAB)
    assert gains[np.triu_indices(count, 1)].max() < 1.0
