"""What stands between a body and its reading: lags, hysteresis, offsets, one beside the other."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from discovery.diagnosis.context import Context, make_context
from discovery.diagnosis.diagnose import diagnose
from discovery.diagnosis.scan import look
from discovery.diagnosis.scored import assess, refit
from discovery.diagnosis.vetoes import objections
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.recordings import Recording
from discovery.terms import Apply, Expression, names
from tests.mismatch.machine import SEEN, campaign, changed, model, simulated


def context(*words: str) -> Context:
    effects = [catalogue()[word] for word in words]
    return make_context(campaign(simulated(1), simulated(2)), model(), ["r1", "r2"], tuple(SEEN), effects)


def claim(where: Context, word: str) -> Hypothesis:
    """The claim on the second error, in the second recording where it is an event."""
    found = hypotheses(where.model, where.campaign.channels, tuple(SEEN), ("r1", "r2"), where.effects)
    return next(
        h for h in found if h.effect.word == word and h.output == "E_Z" and h.recording in (None, "r2")
    )


def lags(expression: Expression) -> Iterator[Apply]:
    if isinstance(expression, Apply):
        if expression.function == "lag":
            yield expression
        for argument in expression.arguments:
            yield from lags(argument)


def test_what_was_taken_up_beside_another_stands_without_it() -> None:
    """A lag found on a model with a hysteresis: what the output showed before is looked up anew."""
    where = context("joint_hysteresis", "sensor_lag")
    play = claim(where, "joint_hysteresis")
    beside = look(where, assess(where, (play,))).claims
    lag = next(h for h in (c.hypothesis for c in beside) if h.output == "E_Z" and h != play)
    assert lag.effect.word == "sensor_lag"
    assert not set(play.amplitudes) & names(lag.added_to(model()).outputs["E_Z"])
    assert set(play.amplitudes) < names(lag.added_to(play.added_to(model())).outputs["E_Z"])
    assert assess(where, (lag,)).hypotheses == (lag,)


@pytest.mark.parametrize("first", ["sensor_offset", "sensor_lag"])
def test_an_offset_is_not_smoothed_by_a_lag(first: str) -> None:
    """Whatever was taken up first: a jump of the device's zero stays a jump."""
    where = context("sensor_offset", "sensor_lag")
    offset, lag = claim(where, "sensor_offset"), claim(where, "sensor_lag")
    chosen = (offset, lag) if first == "sensor_offset" else (lag, offset)
    start = assess(where, ())
    with_both = refit(where, chosen, where.settings[0], start, dict.fromkeys(offset.amplitudes, 5.0))
    shown = with_both.model.outputs["E_Z"]
    assert set(offset.amplitudes) < names(shown)
    smoothed: list[Expression] = [*lags(shown)] or [
        t.expression for t in with_both.model.terms if "follows" in t.name
    ]
    assert smoothed
    assert all(not set(offset.amplitudes) & names(part) for part in smoothed)


@pytest.mark.parametrize(("over", "said"), [(0.0, False), (20000.0, True)])
def test_a_slope_is_no_jump(over: float, said: bool) -> None:
    """Readings that rise by 12 um at once, or within five hours."""
    other = simulated(2)
    rise = 12.0 * np.clip((other.time - 40000.0) / max(over, 1e-9), 0.0, 1.0)
    runs = campaign(simulated(1), changed(other, E_Z=other.values["E_Z"] + rise))
    where = make_context(runs, model(), ["r1", "r2"], tuple(SEEN), [catalogue()["sensor_offset"]])
    claims = (c.hypothesis for c in look(where, assess(where, ())).claims)
    h = next(h for h in claims if h.output == "E_Z" and h.recording == "r2")
    best = assess(where, (h,))
    assert best.model.parameters[h.amplitudes[0]].values["r2"] > 5.0
    assert any("is a slope" in text for text in objections(best, h, 1000.0)) == said


def test_a_lag_of_any_length_has_no_size() -> None:
    """Nothing lags here: the interval of the time holds nearly none and hours, and the lag is no answer."""
    where = context("sensor_lag")
    lag = claim(where, "sensor_lag")
    best = assess(where, (lag,))
    (name,) = lag.shapes
    p = best.model.parameters[name]
    assert p.low is not None
    assert p.high is not None
    assert p.high - p.low > 2 * p.value
    assert any("do not tell" in text for text in objections(best, lag, 1000.0))


def test_a_drift_in_every_recording_is_a_drift() -> None:
    """Also on a recording that no fit saw; a slow body would show in the other errors, too."""
    runs = [simulated(seed) for seed in (1, 2, 3)]
    drifting = campaign(*(changed(r, E_Z=r.values["E_Z"] + 12.0 * r.time / 86400.0) for r in runs))
    answer = diagnose(model(), drifting, ["r1", "r2"], ["r3"])
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.places) == ("sensor_drift", ("E_Z",))
    assert named.hypothesis.recording is None
    assert answer.after.model.parameters["drift_E_Z"].value == pytest.approx(12.0, abs=0.6)
    assert answer.held_out["r3"].after < 1.1 * answer.held_out["r3"].floor < answer.held_out["r3"].before


def test_clocks_that_are_all_late_may_be_a_dead_time() -> None:
    """Readings that come 40 minutes late in every recording: heat may take as long."""
    late = [_late(simulated(seed), 2400.0) for seed in (1, 2)]
    answer = diagnose(model(), campaign(*late), ["r1", "r2"])
    assert answer.verdict.word == "unexplained"
    assert any("dead time" in reason for reason in answer.verdict.reasons)


def _late(recording: Recording, by: float) -> Recording:
    """The recording with its readings `by` seconds late."""
    steps = round(by / (recording.time[1] - recording.time[0]))
    moved = {name: np.roll(recording.values[name], steps) for name in SEEN}
    for values in moved.values():
        values[:steps] = np.nan
    return changed(recording, **moved)
