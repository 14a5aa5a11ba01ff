"""The verdict on searches whose evidence is set by hand: each bar from both sides."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from math import exp

import numpy as np
import pytest

from discovery.diagnosis.context import Context, make_context
from discovery.diagnosis.scan import look
from discovery.diagnosis.scored import Assessment, assess
from discovery.diagnosis.selection import Search
from discovery.diagnosis.verdict import Verdict, decide
from discovery.diagnosis.vetoes import objections
from discovery.effects.candidates import hypotheses
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import Score
from discovery.evidence.latent_force import Forcing
from tests.mismatch.machine import SEEN, campaign, model, simulated

RUNS = ("r1", "r2")


@cache
def fitted() -> tuple[Context, Assessment, Search]:
    """The body that the fluid wets, found: 100 of log evidence over the baseline, and nothing left to see."""
    seen = campaign(*(simulated(int(r[1:])) for r in RUNS))
    words = ("fluid_convection", "bed_memory", "friction_speed", "unmeasured_heat")
    effects = [catalogue()[word] for word in words]
    context = make_context(seen, model(wet=False), RUNS, tuple(SEEN), effects)
    answer = assess(context, (claim("fluid_convection", "table", context),))
    before = replace(assess(context, ()), evidence=answer.evidence - 100.0)
    return context, answer, Search(before, answer, (), look(context, before).board, ((), ()))


def claim(word: str, state: str, context: Context | None = None, recording: str | None = None) -> Hypothesis:
    context = context or fitted()[0]
    base = context.baseline.problem.model
    found = hypotheses(base, context.campaign.channels, tuple(SEEN), RUNS, [catalogue()[word]])
    return next(h for h in found if h.states == (state,) and h.recording == recording)


def score(h: Hypothesis, gain: float, size: float) -> Score:
    context, _, found = fitted()
    return replace(look(context, found.baseline).claims[0], hypothesis=h, gain=gain, size=(size,))


def free(gain: float) -> list[Forcing]:
    return [Forcing("motor", gain, {}, {}, {}, np.zeros(1))]


def said(
    found: Search, before: float = 0.0, after: float = 0.0, goes_out: Assessment | None = None
) -> Verdict:
    return decide(fitted()[0], found, free(before), free(after), goes_out or found.best)


@pytest.mark.parametrize(
    ("gain", "before", "after", "reason"),
    [
        (100.0, 199.0, 9.9, None),
        (100.0, 201.0, 0.0, "more than twice"),
        (100.0, 0.0, 10.1, "free heat at motor still explains much"),
        (50.0, 0.0, 8.9, None),
        (50.0, 0.0, 9.1, "free heat at motor still explains much"),
    ],
)
def test_free_heat_may_not_explain_more_than_the_effect(
    gain: float, before: float, after: float, reason: str | None
) -> None:
    _, answer, found = fitted()
    found = replace(found, baseline=replace(found.baseline, evidence=answer.evidence - gain))
    verdict = said(found, before, after)
    assert verdict.word == ("unexplained" if reason else "missing physics")
    assert len(verdict.reasons) == (reason is not None)
    assert all(reason and reason in text for text in verdict.reasons)


@pytest.mark.parametrize(
    ("low", "high", "word"),
    [(-5.0, 60.0, "no mismatch"), (0.5, 60.0, "missing physics"), (-60.0, -0.5, "missing physics")],
)
def test_a_size_that_free_runs_do_not_tell_from_zero_names_nothing(
    low: float, high: float, word: str
) -> None:
    _, answer, found = fitted()
    (size,) = answer.hypotheses[0].amplitudes
    told = replace(answer.model.parameters[size], low=low, high=high)
    goes_out = replace(
        answer, model=replace(answer.model, parameters={**answer.model.parameters, size: told})
    )
    verdict = said(found, goes_out=goes_out)
    assert verdict.word == word
    assert len(verdict.named) == (word == "missing physics")
    assert verdict.reasons == (
        ()
        if verdict.named
        else (
            "fluid_convection at table helps the fit, but free runs do not tell its size from zero: "
            "-5 to 60 W/K",
        )
    )


@pytest.mark.parametrize(
    ("heat", "size", "gain", "word"),
    [
        (8.9, None, 0.0, "no mismatch"),
        (9.1, None, 0.0, "unexplained"),
        (20.0, 0.5, 10.1, "no mismatch"),  # the model is a little wrong in a known way, too small to matter
        (20.0, 0.5, 9.9, "unexplained"),
        (20.0, 2.0, 10.1, "unexplained"),
    ],
)
def test_where_nothing_was_taken_up_heat_alone_speaks(
    heat: float, size: float | None, gain: float, word: str
) -> None:
    """`size` of a claim in units of the least that matters."""
    context, _, found = fitted()
    h = claim("friction_speed", "motor")
    claims = () if size is None else (score(h, gain, size * context.minor(h)[0]),)
    found = replace(found, best=found.baseline, looks=(claims,))
    verdict = said(found, heat)
    assert verdict.word == word
    assert any("heat of unknown cause acts at motor" in text for text in verdict.reasons) == (
        word == "unexplained"
    )


def test_how_sure_a_name_is_follows_from_its_rivals() -> None:
    """98 % of it is shared as exp(0.6 log evidence); what was passed over, or came beside it, is no rival."""
    _, answer, found = fitted()
    h, memory, friction = answer.hypotheses[0], claim("bed_memory", "bed"), claim("friction_speed", "motor")
    tried = [
        replace(answer, hypotheses=chosen, evidence=answer.evidence - below)
        for chosen, below in (
            ((memory,), 7.0),
            ((friction,), 5.0),
            ((memory,), 2.0),
            ((friction,), -1.0),
            ((h, friction), 0.5),
            ((memory, friction), 0.5),
            ((), 0.5),
        )
    ]
    (named,) = said(replace(found, tried=tuple(tried))).named
    assert named.hypothesis is h
    assert [r.hypothesis.effect.word for r in named.rivals] == ["bed_memory", "friction_speed"]
    assert [r.below for r in named.rivals] == pytest.approx([2.0, 5.0])
    assert named.probability == pytest.approx(0.98 / (1 + exp(-1.2) + exp(-3.0)))


def test_what_would_be_missed_most_is_named_first() -> None:
    """By the model that lacks just that effect, where it was tried."""
    _, answer, found = fitted()
    h, memory = answer.hypotheses[0], claim("bed_memory", "bed")
    both = assess(fitted()[0], (h, memory))
    for lost in (30.0, 10.0):  # without the memory; without the fluid it is 20
        tried = (
            replace(both, hypotheses=(h,), evidence=both.evidence - lost),
            replace(both, hypotheses=(memory,), evidence=both.evidence - 20.0),
            replace(both, hypotheses=(), evidence=both.evidence - 1.0),
        )
        verdict = said(replace(found, best=both, tried=tried))
        first = (*verdict.named, *verdict.candidates)[0].hypothesis
        assert first is (memory if lost > 20.0 else h)


@pytest.mark.parametrize(
    ("state", "recording", "gain", "told"),
    [
        ("bed", "r2", 2.1, True),
        ("bed", "r2", 1.9, False),
        ("bed", "r1", 9.0, False),
        ("motor", "r2", 9.0, False),
    ],
)
def test_an_event_that_shows_elsewhere_at_the_same_body_is_none(
    state: str, recording: str, gain: float, told: bool
) -> None:
    context, _, found = fitted()
    best = assess(context, (claim("unmeasured_heat", "bed", recording="r1"),))
    h = claim("unmeasured_heat", state, recording=recording)
    other = score(claim("bed_memory", "bed"), 50.0, 0.0)  # no event
    verdict = said(replace(found, best=best, looks=((), (other, score(h, gain, 0.0)))))
    assert any("shows in another recording" in text for text in verdict.reasons) == told


@pytest.mark.parametrize(("size", "word"), [(0.9, "missing physics"), (1.1, "unexplained")])
def test_what_is_too_small_to_matter_is_not_left_over(size: float, word: str) -> None:
    context, _, found = fitted()
    h = claim("friction_speed", "motor")
    left = score(h, 90.0, size * context.minor(h)[0])
    assert said(replace(found, looks=((), (left,)))).word == word


def test_heat_where_a_law_acts_is_no_second_event() -> None:
    found = fitted()[2]
    heat = score(claim("unmeasured_heat", "table", recording="r2"), 2.5, 0.0)
    assert not any("another recording" in text for text in said(replace(found, looks=((), (heat,)))).reasons)


@pytest.mark.parametrize(("latest", "told"), [(61000.0, True), (41000.0, False)])
def test_a_window_without_edges_is_no_event(latest: float, told: bool) -> None:
    """What may have begun after it may have ended: the heat of a whole recording, not of some hours."""
    context, _, _ = fitted()
    h = claim("unmeasured_heat", "bed", context, "r1")
    edges = dict(zip(h.shapes, (40000.0, 70000.0), strict=True))
    ranges = ((39000.0, latest), (60000.0, 71000.0))
    h = replace(h.at(edges), spans=dict(zip(h.shapes, ranges, strict=True)))
    found = objections(assess(context, (h,)), h, 100.0)
    assert ("unmeasured_heat at bed: these data do not tell when it began and ended" in found) == told
