"""What stands between a body and its reading: lags, hysteresis, offsets, one beside the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
import pytest

from discovery.diagnosis import diagnose
from discovery.diagnosis.refit import with_effects
from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Apply, Expression, Term, names, parse
from tests import machine
from tests.machine import NOISE, SEEN, campaign, changed, claims, model, simulated


def claim(word: str) -> Hypothesis:
    """The claim on the second error, in the second recording where it is an event."""
    found = claims(model(), word)
    return next(h for h in found if h.outputs == ("E_Z",) and h.recording in (None, "r2"))


def lags(expression: Expression) -> Iterator[Apply]:
    if isinstance(expression, Apply):
        if expression.function == "lag":
            yield expression
        for argument in expression.arguments:
            yield from lags(argument)


def test_what_was_taken_up_beside_another_stands_without_it() -> None:
    """A lag beside a hysteresis: what the output showed before is looked up anew."""
    play, lag = claim("joint_hysteresis"), claim("sensor_lag")
    assert not set(play.amplitudes) & names(lag.added_to(model()).outputs["E_Z"])
    assert set(play.amplitudes) < names(lag.added_to(play.added_to(model())).outputs["E_Z"])


@pytest.mark.parametrize("first", ["sensor_offset", "sensor_lag"])
def test_an_offset_is_not_smoothed_by_a_lag(first: str) -> None:
    """Whatever was taken up first: a jump of the device's zero stays a jump."""
    offset, lag = claim("sensor_offset"), claim("sensor_lag")
    both = with_effects(model(), (offset, lag) if first == "sensor_offset" else (lag, offset))
    shown = both.outputs["E_Z"]
    assert set(offset.amplitudes) < names(shown)
    smoothed = [*lags(shown)]
    assert smoothed
    assert all(not set(offset.amplitudes) & names(part) for part in smoothed)


def test_a_drift_in_every_recording_is_a_drift() -> None:
    """Also on a recording that no fit saw; a slow body would show in the other errors, too."""
    runs = [simulated(seed) for seed in (1, 2, 3)]
    drifting = campaign(*(changed(r, E_Z=r.values["E_Z"] + 12.0 * r.time / 86400.0) for r in runs))
    answer = diagnose(model(), drifting, ["r1", "r2"], ["r3"])
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.places) == ("sensor_drift", ("E_Z",))
    assert named.hypothesis.recording is None
    assert answer.after is not None
    assert answer.after.model.parameters["drift_E_Z"].value == pytest.approx(12.0, abs=0.6)
    assert answer.held_out["r3"].after < 1.1 * answer.held_out["r3"].floor < answer.held_out["r3"].before


def test_the_play_of_long_sliding_parts_is_no_lag(monkeypatch: pytest.MonkeyPatch) -> None:
    """25 um, ten times the play of a machine tool: four fifths of the error pass through it."""
    monkeypatch.setattr(machine, "EVERY", machine.STEP)  # a joint also moves between two readings
    runs = [_with_play(simulated(seed, noise=0.0), 0.8, 25.0, seed) for seed in (1, 2, 3)]
    answer = diagnose(model(), campaign(*runs), ["r1", "r2"], ["r3"])
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.places) == ("joint_hysteresis", ("E_Z",))
    assert answer.after is not None
    found = answer.after.model.parameters
    assert found["slip_E_Z"].value == pytest.approx(0.8, abs=0.05)
    assert found["width_E_Z"].value == pytest.approx(25.0, rel=0.05)
    assert answer.held_out["r3"].after < 1.1 * answer.held_out["r3"].floor < answer.held_out["r3"].before


def _with_play(recording: Recording, slip: float, width: float, seed: int) -> Recording:
    """A share of E_Z moves only where the error is `width` ahead of it; then noise on all errors."""
    true = recording.values["E_Z"]
    held, shown = true[0], true.copy()
    for k, y in enumerate(true):
        held = min(max(held, y - width), y + width)
        shown[k] = y + slip * (held - y)
    rng = np.random.default_rng(seed)
    without = {name: recording.values[name] for name in SEEN} | {"E_Z": shown}
    return changed(recording, **{name: e + rng.normal(0.0, NOISE, len(true)) for name, e in without.items()})


def lamp(seed: int) -> Recording:
    """A lamp of 8 J/K that loses 0.3 W/K, with another power every 20 s, read every 4 s: closed form."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 481.0, 4.0)
    power = np.repeat(rng.uniform(0.0, 40.0, 25), 5)[: time.size]
    warm = [21.0]
    for watts in power[:-1]:
        level = 21.0 + watts / 0.3
        warm.append(level + (warm[-1] - level) * np.exp(-4.0 * 0.3 / 8.0))
    read = np.array(warm) + rng.normal(0.0, 0.3, time.size)
    return Recording(f"r{seed}", time, {"P": power, "room": np.full(time.size, 21.0), "T": read})


def test_a_clock_may_be_late_by_more_than_a_fast_body_needs() -> None:
    """40 s, where the power changes every 20 s: this is no heat of unknown cause."""
    channels = {
        "P": Channel("P", "heat load", "W", None, "held"),
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "T": Channel("T", "temperature", "degC", None, "linear"),
    }
    terms = (Term("power", "T", parse("k*P")), Term("air", "T", parse("hA*(room - T)")))
    states = {"T": State("T", "degC", 8.0, parse("room"), None, 1 / 8.0)}
    begun = {"hA": Parameter(0.2, "W/K", 0.0), "k": Parameter(1.3, "1", 0.0)}
    shifted = _late(lamp(2), 40.0, ["T"])
    runs = {r.name: r for r in (lamp(1), shifted, lamp(3))}
    answer = diagnose(
        Model("lamp", begun, states, terms, {}),
        Campaign("lamps", channels, runs),
        ["r1", "r2"],
        ["r3"],
        ["T"],
    )
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.recording) == ("clock_shift", "r2")
    assert answer.after is not None
    assert answer.after.model.parameters["t_shift_r2"].value == pytest.approx(40.0, abs=2.0)
    assert answer.held_out["r3"].after < 0.1 * answer.held_out["r3"].before


def test_clocks_that_are_all_late_may_be_a_dead_time() -> None:
    """Readings that come ten minutes late in every recording: heat may take as long."""
    late = [_late(simulated(seed), 600.0) for seed in (1, 2)]
    answer = diagnose(model(), campaign(*late), ["r1", "r2"])
    assert answer.verdict.word == "unexplained"
    assert any("dead time" in reason for reason in answer.verdict.reasons)


def _late(recording: Recording, by: float, seen: Iterable[str] = SEEN) -> Recording:
    """The recording with its readings `by` seconds late."""
    steps = round(by / (recording.time[1] - recording.time[0]))
    moved = {name: np.roll(recording.values[name], steps) for name in seen}
    for values in moved.values():
        values[:steps] = np.nan
    return changed(recording, **moved)
