"""A light machine, read each minute, whose power is logged late: a false alarm where nobody asks for it."""

from __future__ import annotations

import re
from dataclasses import replace
from importlib import import_module
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis.context import make_context
from discovery.diagnosis.selection import Search
from discovery.diagnosis.thresholds import SHORT
from discovery.dynamics import make_grid
from discovery.effects.catalogue import catalogue
from discovery.evidence.late import beyond, perhaps_late, sentences
from discovery.fitting import Noise
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
COIL, FRAME, LINK, AIR = 3000.0, 30000.0, 14.0, 6.0  # J/K, W/K
INTERVAL, FINE = 60.0, 5.0  # s, of the logger and of the machine here
WORDS = ("second_thermal_mass", "unmeasured_heat", "friction_speed", "sensor_lag", "conduction_path")


def light(seed: int, late: float, jitter: float = 0.0) -> Recording:
    """A coil that answers within minutes on a frame; the power switches `late` s before its stamp, and each
    time by up to `jitter` s more or less.
    """
    rng = np.random.default_rng(seed)
    time: Array = INTERVAL * np.arange(480, dtype=float)
    power = np.repeat(rng.choice([0.0, 100.0, 250.0, 400.0], 32), 15)
    fine = FINE * np.arange(int(time[-1] / FINE) + 1)
    early = np.repeat(late + rng.uniform(-jitter, jitter, 32), 15)
    stamps = np.where(np.diff(power, prepend=power[0]) != 0, time - early, time)
    true = power[np.searchsorted(stamps, fine, side="right") - 1]
    x: Array = np.full((len(fine), 2), 22.0)
    for k, heat in enumerate(true[:-1]):
        coil, frame = x[k]
        link = LINK * (frame - coil)
        x[k + 1] = coil + FINE * (heat + link) / COIL, frame + FINE * (AIR * (22 - frame) - link) / FRAME
    read = x[:: int(INTERVAL / FINE)] + 0.1 * rng.standard_normal((len(time), 2))
    values = {"P": power, "room": np.full(len(time), 22.0), "coil": read[:, 0], "frame": read[:, 1]}
    return Recording(f"r{seed}", time, values)


def campaign(*recordings: Recording) -> Campaign:
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "coil": Channel("coil", "temperature", "degC", 0.1, "linear"),
        "frame": Channel("frame", "temperature", "degC", 0.1, "linear"),
    }
    return Campaign("light", channels, {r.name: r for r in recordings})


def model() -> Model:
    terms = (
        Term("power", "coil", parse("share*P")),
        Term("link", "coil", parse("G*(frame - coil)"), "frame"),
        Term("air", "frame", parse("hA*(room - frame)")),
    )
    sizes = {"share": (0.9, "1"), "G": (16.0, "W/K"), "hA": (5.0, "W/K")}
    parameters = {name: Parameter(value, unit, 0.0) for name, (value, unit) in sizes.items()}
    capacity = {"coil": COIL, "frame": FRAME}
    states = {name: State(name, "degC", c, parse("room"), 0.3, 1 / c) for name, c in capacity.items()}
    return Model("light", parameters, states, terms, {})


def after(seen: Campaign) -> dict[str, tuple[str, ...]]:
    """By recording, those that were made then or later."""
    names = tuple(seen.recordings)
    return {run: names[k:] for k, run in enumerate(names)}


def found(seen: Campaign) -> tuple[str, ...]:
    """Effects that a search takes up."""
    effects = [e for e in catalogue().values() if e.word in WORDS]
    context = make_context(seen, model(), list(seen.recordings), ("coil", "frame"), effects, after(seen))
    return tuple(h.effect.word for h in Search(context).run().best.hypotheses)


def test_a_power_that_is_logged_late_is_no_missing_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = campaign(light(1, 40.0), light(2, 35.0))
    assert found(seen) == ()
    monkeypatch.setattr("discovery.diagnosis.context.perhaps_late", lambda _fit, _seen, grids, _enough: grids)
    assert found(seen) != ()


def rarely(run: Recording) -> Recording:
    """The recording with every third reading only; the power is recorded as often as before."""
    kept = np.arange(len(run.time)) % 3 == 0
    read = {n: np.where(kept, v, np.nan) for n, v in run.values.items() if n in ("coil", "frame")}
    return replace(run, values={**run.values, **read})


def test_a_late_power_shows_in_readings_that_are_rarer_than_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Temperatures each 3 min, power each minute. A spindle that was read each 10 min had a wrong name."""
    seen = campaign(rarely(light(1, 40.0)), rarely(light(2, 35.0)))
    assert found(seen) == ()
    monkeypatch.setattr("discovery.diagnosis.context.perhaps_late", lambda _fit, _seen, grids, _enough: grids)
    assert found(seen) != ()


def test_switches_off_the_grid_of_the_logger_are_no_missing_physics(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is logged at the next stamp: 0 to 60 s late."""
    seen = campaign(*(light(k, 30.0, 30.0) for k in (1, 2, 3, 4)))
    assert found(seen) == ()
    monkeypatch.setattr("discovery.evidence.settings.JITTER", 0.0)
    assert found(seen) != ()


@pytest.mark.parametrize(("word", "said"), [("missing physics", ["late"]), ("unexplained", ["unsure"])])
def test_what_may_stand_for_an_unknown_cause_is_said_otherwise(
    word: str, said: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A resin that cures once gave "P_heater is logged 35 s early", which no clock was."""
    module = import_module("discovery.diagnosis.diagnose")
    monkeypatch.setattr(
        module.late, "sentences", lambda _, is_right=True: ["late"] if is_right else ["unsure"]
    )
    monkeypatch.setattr(module.noisy, "sentences", lambda *_: [])
    monkeypatch.setattr(module, "not_offered", lambda *_: [])
    context = SimpleNamespace(unused_readings=[], model=None, scene=None, outliers=(), grids={})
    monkeypatch.setattr(module, "is_usual", lambda setting: setting.level <= 1.0)
    usual, large = (SimpleNamespace(level=level, levels={}) for level in (1.0, 10.0))
    answer = SimpleNamespace(fit=None, noise=Noise(("T",), (0.1,)), setting=usual)
    assert (
        module._reasons(context, SimpleNamespace(word=word, named=(), answer=answer), answer, [], {}, [], [])
        == said
    )
    much = SimpleNamespace(fit=None, noise=answer.noise, setting=large)
    told = module._reasons(context, SimpleNamespace(word=word, named=(), answer=much), much, [], {}, [], [])
    assert told == ["unsure"]


def test_a_shift_by_more_than_a_logger_makes_may_be_a_dead_time() -> None:
    """A gas furnace with a dead time of two intervals, which its model lacks, kept silent about it."""
    prior = (0.0, 9.0)
    late = [SimpleNamespace(name="gas", recording=r, is_late=True, prior=prior) for r in ("a", "b")]
    problem = SimpleNamespace(unknowns=late)
    fit: Any = SimpleNamespace(
        problem=problem, theta=[-18.0, -8.0], standard_errors=[0.1, 0.1], trajectories=[None, None]
    )
    assert sentences(fit, is_right=False) == [
        "in the fit, gas is logged 18 s early in a: a dead time, or what the model leaves out, may look like "
        "this"
    ]
    assert sentences(fit) == [
        "gas is logged 18 s early in a, 8 s early in b; the fit allows for it, and a dead time looks the same"
    ]


@pytest.mark.parametrize(
    ("seconds", "said"),
    [
        (
            (-18.0, -16.0),
            "gas would be logged 18 s early in a, 16 s early in b, more than the interval of its ",
        ),
        ((14.0, 13.0), "gas would be logged 14 s late in a, 13 s late in b, more than the interval of its "),
        ((-18.0, -8.0), None),  # one of them is what a logger makes
        ((-18.0, 16.0), None),
        ((-9.2, -9.2), None),  # within three standard errors of an interval
    ],
)
def test_every_recording_late_by_more_than_an_interval_is_no_logger(
    seconds: tuple[float, float], said: str | None
) -> None:
    late = [SimpleNamespace(name="gas", recording=r, is_late=True, prior=(0.0, 9.0)) for r in ("a", "b")]
    fit: Any = SimpleNamespace(
        problem=SimpleNamespace(unknowns=late),
        theta=seconds,
        standard_errors=[0.1, 0.1],
        trajectories=[None, None],
    )
    found = beyond(fit)
    assert [text.partition("samples")[0] for text in found] == ([said] if said else [])
    assert all(("dead time" in text) == (seconds[0] < 0) for text in found)


def heavy(seed: int) -> Recording:
    """Three hours of a body with a time constant of 9 min, read every 10 s to 0.06 K. Each reading is stamped
    at the end of the interval in which its power acted.
    """
    rng = np.random.default_rng(seed)
    power: Array = np.repeat(rng.choice([0.0, 1000.0, 1800.0, 2600.0], 11), 100)
    warm: Array = np.full(len(power) + 1, 22.0)
    for k, heat in enumerate(power):
        balance = 22.0 + heat / 46.0
        warm[k + 1] = balance + (warm[k] - balance) * np.exp(-10.0 * 46.0 / 25000.0)
    read = warm[1:] + 0.06 * rng.standard_normal(len(power))
    room = np.full(len(power), 22.0)
    time: Array = 10.0 * np.arange(len(power), dtype=float)
    return Recording(f"r{seed}", time, {"P": power, "room": room, "body": read})


def test_precise_readings_of_a_slow_body_show_a_late_stamp(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = campaign(heavy(7), heavy(8))
    body = Channel("body", "temperature", "degC", 0.06, "linear")
    seen = replace(seen, channels={"P": seen.channels["P"], "room": seen.channels["room"], "body": body})
    terms = Term("power", "body", parse("share*P")), Term("air", "body", parse("hA*(room - body)"))
    parameters = {"share": Parameter(0.9, "1", 0.0), "hA": Parameter(40.0, "W/K", 0.0)}
    states = {"body": State("body", "degC", 25000.0, parse("room"), 0.3, 1 / 25000.0)}
    one = Model("compressor", parameters, states, terms, {})
    effects = [e for e in catalogue().values() if e.word in ("sensor_offset", "unmeasured_heat", "rezero")]

    def taken_up() -> list[str]:
        context = make_context(seen, one, ["r7", "r8"], ("body",), effects, after(seen))
        return [h.effect.word for h in Search(context).run().best.hypotheses]

    assert taken_up() == []
    monkeypatch.setattr("discovery.diagnosis.context.perhaps_late", lambda _fit, _seen, grids, _enough: grids)
    assert taken_up() != []


def jacket(seed: int) -> Recording:
    """A day of a body in a water jacket, read every 5 min to 0.03 K. The temperature of the water is the mean
    of the 5 min after its stamp.
    """
    rng = np.random.default_rng(seed)
    water: Array = np.full(8640, 20.0)
    for k in range(1, len(water)):
        water[k] = 20.0 + 0.995 * (water[k - 1] - 20.0) + 0.1 * rng.standard_normal()
    warm: Array = np.full(len(water), 20.0)
    for k, one in enumerate(water[:-1]):
        warm[k + 1] = one + (warm[k] - one) * np.exp(-10.0 * 46.0 / 50000.0)
    read = warm[::30] + 0.03 * rng.standard_normal(288)
    values = {"water": water.reshape(-1, 30).mean(axis=1), "body": read}
    return Recording(f"r{seed}", 300.0 * np.arange(288.0), values)


def test_a_mean_that_is_stamped_at_its_beginning_is_early(monkeypatch: pytest.MonkeyPatch) -> None:
    """By 150 s, and some for what a mean smooths. Without this, a sensor lags, or the water comes late."""
    channels = {
        "water": Channel("water", "fluid temperature", "degC", None, "linear"),
        "body": Channel("body", "temperature", "degC", 0.03, "linear"),
    }
    seen = Campaign("jacket", channels, {r.name: r for r in (jacket(7), jacket(8))})
    states = {"body": State("body", "degC", 50000.0, parse("water"), 0.3, 1 / 50000.0)}
    terms = (Term("water", "body", parse("hF*(water - body)")),)
    one = Model("jacket", {"hF": Parameter(40.0, "W/K", 0.0)}, states, terms, {})
    effects = [e for e in catalogue().values() if e.word in ("fluid_delay", "sensor_lag")]

    def taken_up() -> tuple[list[str], list[str]]:
        context = make_context(seen, one, ["r7", "r8"], ("body",), effects, after(seen))
        best = Search(context).run().best
        return [h.effect.word for h in best.hypotheses], sentences(best.fit)

    words, said = taken_up()
    assert words == []
    assert re.fullmatch(
        r"water is logged 1[4-8]\d s early in r7, 1[4-8]\d s early in r8; .*a dead time looks the same",
        said[0],
    )
    monkeypatch.setattr("discovery.diagnosis.context.perhaps_late", lambda _fit, _seen, grids, _enough: grids)
    assert taken_up()[0] != []


def test_stamps_that_are_exact_stay_so() -> None:
    seen = campaign(light(3, 0.0), light(4, 0.0))
    context = make_context(seen, model(), ["r3", "r4"], ("coil", "frame"), [], after(seen))
    late = [
        v for u, v in zip(context.baseline.problem.unknowns, context.baseline.theta, strict=True) if u.is_late
    ]
    assert late == pytest.approx([0.0, 0.0], abs=3.0)


def test_it_is_asked_only_where_readings_show_a_shift() -> None:
    seen = campaign(light(5, 0.0))
    context = make_context(seen, model(), ["r5"], ("coil", "frame"), [], after(seen))
    assert context.grids["r5"].unsure == {"P": INTERVAL}
    gaps = light(5, 0.0)  # a crusher with irregular stamps and a twentieth of its readings missing
    gaps.values["coil"][::20], gaps.values["frame"][5::20] = np.nan, np.nan
    stamps = gaps.time + np.random.default_rng(5).uniform(0.0, 0.9 * INTERVAL, len(gaps.time))
    holes = make_grid(campaign(replace(gaps, time=stamps)), "r5", ["P", "room"], ["coil", "frame"])
    assert min(holes.logged["coil"], holes.logged["frame"]) > holes.logged["P"]
    assert "P" in perhaps_late(context.baseline, seen, {"r5": holes}, SHORT)["r5"].unsure
    noise = {name: replace(seen.channels[name], noise=30.0) for name in ("coil", "frame")}
    blurred = replace(seen, channels={**seen.channels, **noise})
    assert not perhaps_late(context.baseline, blurred, context.grids, SHORT)["r5"].unsure


def test_readings_that_are_averaged_by_the_program_still_show_a_shift() -> None:
    """What counts is how often a file has them: a long recording is averaged over blocks in the search."""
    seen = campaign(light(5, 40.0))
    context = make_context(seen, model(), ["r5"], ("coil", "frame"), [], after(seen))
    blocks = make_grid(seen, "r5", ["P", "room"], ["coil", "frame"], coarse=160, most=170)
    assert np.median(np.diff(blocks.time[blocks.read])) > 2 * INTERVAL
    assert perhaps_late(context.baseline, seen, {"r5": blocks}, SHORT)["r5"].unsure == {"P": INTERVAL}
