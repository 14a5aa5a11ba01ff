"""What an answer holds has to help to predict recordings that were left out of the fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from discovery.diagnosis.context import Context, make_context
from discovery.diagnosis.crossvalidation import least_added, least_taken, left_out
from discovery.diagnosis.question import BLUNT, CLEAR, supported
from discovery.diagnosis.scan import look
from discovery.diagnosis.scored import Assessment, assess, misfits
from discovery.diagnosis.selection import Search, search
from discovery.diagnosis.verdict import decide
from discovery.diagnosis.vetoes import matters, unseen_lag
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import catalogue
from discovery.models import Model, expanded
from discovery.terms import Term, parse
from tests.mismatch.machine import CHANNELS, SEEN, Array, Inputs, campaign, changed, model, simulated


def claimed(baseline: Model, word: str, state: str, runs: tuple[str, ...]) -> tuple[Context, Assessment]:
    """The fit with one effect at one body, whether it is there or not."""
    seen = campaign(*(simulated(int(r[1:]), slow=0.5) for r in runs))
    effect = catalogue()[word]
    context = make_context(seen, baseline, runs, tuple(SEEN), [effect])
    found = hypotheses(context.baseline.problem.model, seen.channels, tuple(SEEN), runs, [effect])
    claim = next(h for h in found if h.states == (state,))
    return context, assess(context, (claim,))


def test_what_acts_stays() -> None:
    context, answer = claimed(model(wet=False), "fluid_convection", "table", ("r1", "r2"))
    assert supported(context, answer)[0] is answer


@pytest.mark.parametrize("state", ["motor", "bed"])
def test_what_predicts_nothing_goes(state: str) -> None:
    """Memory of the bed where there is none follows slow noise, which no other recording repeats."""
    context, answer = claimed(model(), "bed_memory", state, ("r1", "r2"))
    noise = answer.best_view.noise
    assert left_out(context, answer, noise) > left_out(context, assess(context, ()), noise)
    kept, tried, dropped = supported(context, answer)
    assert kept.hypotheses == ()
    assert kept in tried
    assert dropped == list(answer.hypotheses)


def test_every_recording_speaks_for_a_cause_and_none_for_a_ghost() -> None:
    context, answer = claimed(model(wet=False), "fluid_convection", "table", ("r1", "r2"))
    noise, without = answer.best_view.noise, assess(context, ())
    assert least_taken(context, answer, without, noise) > CLEAR
    assert least_added(context, answer, without, noise) > BLUNT
    context, ghost = claimed(model(), "bed_memory", "motor", ("r1", "r2"))
    noise, without = ghost.best_view.noise, assess(context, ())
    assert least_taken(context, ghost, without, noise) < CLEAR
    assert least_added(context, ghost, without, noise) < BLUNT


def test_the_recording_that_is_told_least_counts() -> None:
    """Heat for six hours of r1 alone: what r2 gains by it is the least, however much r1 does."""
    seen = campaign(
        simulated(1, concealed=lambda t, _, __: (0.0, 0.0, 120.0 * (30000 <= t < 52000))), simulated(2)
    )
    runs, effect = ("r1", "r2"), catalogue()["unmeasured_heat"]
    context = make_context(seen, model(), runs, tuple(SEEN), [effect])
    found = hypotheses(context.baseline.problem.model, seen.channels, tuple(SEEN), runs, [effect])
    heat = next(h for h in found if (h.states, h.recording) == (("bed",), "r1"))
    answer = assess(context, (heat.at(dict(zip(heat.shapes, (30000.0, 52000.0), strict=True))),))
    noise, without = answer.best_view.noise, assess(context, ())
    before, after = misfits(without, noise), misfits(answer, noise)
    assert before["r1"] - after["r1"] > before["r2"] - after["r2"] + 20.0
    assert least_taken(context, answer, without, noise) == pytest.approx(before["r2"] - after["r2"])


def test_a_refit_that_is_known_is_not_made_again() -> None:
    context, answer = claimed(model(), "bed_memory", "motor", ("r1", "r2"))
    bare = assess(context, (), answer.best_view.noise)
    assert supported(context, answer, [bare])[0] is bare


def test_a_single_recording_cannot_object() -> None:
    context, answer = claimed(model(), "bed_memory", "motor", ("r1",))
    assert np.isnan(left_out(context, answer, answer.best_view.noise))
    assert supported(context, answer) == (answer, [], [])


def test_what_does_not_carry_over_is_told_and_not_held_against_the_answer() -> None:
    """A left claim beside an answer makes it unexplained, unless it was that one that did not carry over."""
    baseline = model(wet=False)
    context, answer = claimed(baseline, "fluid_convection", "table", ("r1", "r2"))
    _, ghost = claimed(baseline, "bed_memory", "bed", ("r1", "r2"))
    before, (h,) = assess(context, ()), ghost.hypotheses
    before = replace(before, evidence=answer.evidence - 100.0)
    whole = look(context, before)
    claim = replace(whole.claims[0], hypothesis=h, gain=100.0, size=(context.spread(h)[0],))
    found = Search(before, answer, (), whole.board, ((claim,), (claim,)))
    open_ = decide(context, found, (), (), answer)
    assert open_.word == "unexplained"
    assert open_.reasons == ("bed_memory at bed is still significant after the repair",)
    settled = decide(context, replace(found, dropped=(h,)), (), (), answer)
    assert settled.word == "missing physics"
    assert [n.hypothesis.effect.word for n in settled.named] == ["fluid_convection"]
    (told,) = settled.reasons
    assert told.startswith("bed_memory at bed helps the fit and does not carry over")


@pytest.mark.parametrize(("pressed", "word"), [(True, "missing physics"), (False, "unexplained")])
def test_what_is_bent_to_its_limit_objects_less(
    pressed: bool, word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the bar of the search: 28 of a law bent to its limit would not be taken up, and is no objection."""
    context, answer = claimed(model(wet=False), "fluid_convection", "table", ("r1", "r2"))
    _, other = claimed(model(), "friction_speed", "motor", ("r1", "r2"))
    before, (h,) = replace(assess(context, ()), evidence=answer.evidence - 100.0), other.hypotheses
    whole = look(context, before)
    claim = replace(whole.claims[0], hypothesis=h, gain=20.0, size=tuple(context.spread(h)))
    both = replace(assess(context, (*answer.hypotheses, h)), evidence=answer.evidence + 28.0)
    found = Search(before, answer, (both,), whole.board, ((claim,), (claim,)))
    monkeypatch.setattr("discovery.diagnosis.doubts.bent", lambda _, o: pressed and o.key == h.key)
    assert decide(context, found, (), (), answer).word == word


def test_the_same_readings_count_in_the_fit_and_outside() -> None:
    _, answer = claimed(model(wet=False), "fluid_convection", "table", ("r1", "r2"))
    white = np.array(answer.best_view.noise.white)
    of_r2 = answer.lens.residuals[1] / white
    assert answer.rms({"r1"}) == pytest.approx(float(np.sqrt(np.nanmean(of_r2**2))))
    assert answer.rms() != answer.rms({"r1"})


def test_a_look_after_a_memory_was_found() -> None:
    """The state behind its lag() is no body that the fluid wets."""
    seen = campaign(simulated(1))
    effects = [e for e in catalogue().values() if e.word.startswith("fluid_")]
    context = make_context(seen, model(), ("r1",), tuple(SEEN), effects)
    found = hypotheses(context.baseline.problem.model, seen.channels, tuple(SEEN), ("r1",), effects)
    sump = next(h for h in found if h.effect.word == "fluid_sump")
    claims = look(context, assess(context, (sump,))).claims
    assert claims
    assert not any(place.startswith("lag_") for c in claims for place in c.hypothesis.places)


def test_a_body_may_be_called_after_a_lag() -> None:
    """What is a memory says so itself; a name says nothing."""
    plain = model()
    named = replace(
        plain,
        states={**plain.states, "lag_plate": replace(plain.states["bed"], name="lag_plate")},
        terms=(*plain.terms, Term("air at plate", "lag_plate", parse("hA_b*(T_env - lag_plate)"))),
        outputs={"E_Y": parse("2*lag_plate + 3*lag(T_env, 3600)")},
    )
    found = expanded(named, seen := campaign(simulated(1)).channels)
    (effect,) = (e for e in catalogue().values() if e.word == "radiation")
    placed = {h.places for h in hypotheses(found, seen, ("E_Y",), ("r1",), [effect])}
    assert ("lag_plate",) in placed
    assert ("lag_1",) not in placed


def test_what_has_an_event_of_its_own_is_not_run() -> None:
    context, answer = claimed(model(), "bed_memory", "motor", ("r1", "r2"))
    (claim,) = answer.hypotheses
    noise = answer.best_view.noise
    one, both = (
        replace(answer, hypotheses=tuple(replace(claim, recording=r) for r in runs))
        for runs in (("r1",), ("r1", "r2"))
    )
    assert np.isfinite(left_out(context, one, noise))  # of r2
    assert np.isnan(left_out(context, both, noise))


@pytest.mark.parametrize(("lag", "unseen"), [(300.0, True), (1800.0, False)])
def test_a_lag_shorter_than_the_time_between_readings_is_not_seen(lag: float, unseen: bool) -> None:
    """EVERY is 900 s: a shorter delay may as well be the way of heat through a body."""
    seen = campaign(simulated(1))
    effect = catalogue()["sensor_lag"]
    context = make_context(seen, model(), ("r1",), tuple(SEEN), [effect])
    found = hypotheses(context.baseline.problem.model, seen.channels, tuple(SEEN), ("r1",), [effect])
    claim = next(h for h in found if h.output == "E_Z")
    assert unseen_lag(context, claim.at(dict.fromkeys(claim.shapes, lag))) is unseen


@pytest.mark.parametrize(("share", "word"), [(0.1, "missing physics"), (0.5, "no mismatch")])
def test_what_is_little_beside_a_link_has_to_add_more(
    share: float, word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A gap of 8 W/K adds 10 to 30: enough if it counts for itself, too little for the link's coarseness."""

    def gap(_: float, bodies: Array, inputs: Inputs) -> tuple[float, float, float]:
        heat = 8.0 * inputs["pump"] * (bodies[2] - bodies[1])
        return 0.0, heat, -heat

    noisy = {name: replace(c, noise=1.3) if c.role == "error" else c for name, c in CHANNELS.items()}
    seen = campaign(*(simulated(seed, concealed=gap, noise=1.3) for seed in (1, 2)))
    seen = replace(seen, channels=noisy)
    context = make_context(seen, model(), ("r1", "r2"), tuple(SEEN), [catalogue()["flooded_gap"]])
    monkeypatch.setattr("discovery.diagnosis.context.COARSE_LINK", share)
    found = search(context)
    assert 0.0 < found.tried[0].evidence - found.baseline.evidence < BLUNT
    assert decide(context, found, (), (), found.best).word == word


@pytest.mark.parametrize(
    ("word", "size", "large"),
    [("sensor_drift", 0.2, False), ("sensor_drift", 0.4, True), ("sensor_offset", 0.2, True)],
)
def test_a_slow_body_drifts_a_little_and_never_jumps(word: str, size: float, large: bool) -> None:
    """Of the usual 2 um a day a seventh is the coarseness of a model; a jump of any size is none of that."""
    first = simulated(1, noise=0.05)
    late = first.time / 86400.0 if word == "sensor_drift" else first.time > first.time[-1] / 2
    seen = campaign(changed(first, E_Y=first.values["E_Y"] - size * late), simulated(2, noise=0.05))
    effect, runs = catalogue()[word], ("r1", "r2")
    context = make_context(seen, model(), runs, tuple(SEEN), [effect])
    found = hypotheses(context.baseline.problem.model, seen.channels, tuple(SEEN), runs, [effect])
    h = next(h for h in found if (h.output, h.recording) == ("E_Y", "r1"))
    h = h.at(dict.fromkeys(h.shapes, first.time[-1] / 2))
    assert matters(context, assess(context, (h,)), h) == large
