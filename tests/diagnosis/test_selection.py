"""What a search may add to the effects that it has."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import pytest

from discovery.diagnosis import selection
from discovery.diagnosis.scored import MOVED, Scored
from discovery.diagnosis.selection import FAR, Search, look_alikes, not_twice
from discovery.effects.catalogue import catalogue
from discovery.evidence.bayes import Score
from tests.diagnosis.parts import dry

ENDED = SimpleNamespace(ended_early=False)  # a fit to the end


def claim(*amplitudes: str) -> SimpleNamespace:
    return SimpleNamespace(hypothesis=SimpleNamespace(amplitudes=amplitudes))


def test_two_effects_never_share_a_size() -> None:
    """A jet that wets less of `a` and more of `b`, and one that wets less of `b` and more of `c`, have the
    size at `b` in common: a model of both has fewer sizes than the two say, and its evidence cannot be
    computed.
    """
    first = SimpleNamespace(amplitudes=("jet_a", "jet_b"))
    pool = [claim("jet_b", "jet_c"), claim("jet_c", "jet_d"), claim("lag")]
    assert not_twice(pool, [first]) == pool[1:]  # type: ignore[arg-type, list-item]
    assert not_twice(pool, []) == pool  # type: ignore[arg-type]


def test_what_looks_the_same_is_refitted_whatever_the_scan_says() -> None:
    """The loss of a solar field to the air had odds of -3.9 in the scan, and in a refit as many as a bed."""

    def candidate(word: str, odds: float) -> SimpleNamespace:
        return SimpleNamespace(hypothesis=SimpleNamespace(effect=catalogue()[word]), odds=odds)

    bed, air, lag = (
        candidate("bed_memory", 3.0),
        candidate("air_convection", -3.9),
        candidate("sensor_lag", 9),
    )
    assert look_alikes(bed.hypothesis, [lag, air]) == [air]  # type: ignore[list-item]


def test_what_grew_is_questioned_under_another_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    """Growing questions nothing. Under another noise the models that matter are scored again, and the search
    goes on from the best of them.
    """
    asked: list[tuple[Search, Scored]] = []

    def questioned(search: Search, current: Scored) -> Scored:
        asked.append((search, current))
        return current

    monkeypatch.setattr(Search, "_questioned", questioned)
    grown = Search(dry()).grow()
    assert asked == []
    assert grown.best.hypotheses[0].effect.word == "fluid_convection"
    settings = dry().settings
    louder = replace(settings.white, white=tuple(1.3 * w for w in settings.white.white))
    other = grown.under(replace(dry(), settings=replace(settings, white=louder)))
    kept = {key for key, one in grown.tried.items() if not key or one.evidence > grown.best.evidence - FAR}
    assert other.tried.keys() == kept
    assert other.best.noise.white == louder.white
    assert other.best.fit.theta is grown.tried[other.best.keys].fit.theta  # not fitted again
    other.run()
    search, current = asked[0]
    assert search is other
    assert "fluid_convection" in {h.effect.word for h in current.hypotheses}


@pytest.mark.parametrize("likely", [("warms", 0.0), ("moves", 0.0), ("moves", 3600.0)])
def test_each_formula_and_each_instant_of_an_effect_is_refitted(
    likely: tuple[str, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hidden mass may warm its body or move an error by itself. The last in the pool took the place of the
    other: on the frame of a printer it had -2153 log evidence, and the other -1826. Under little process
    noise an event may have other instants.
    """

    def refit(*arguments: object) -> Scored:
        h = cast(Score, arguments[3]).hypothesis
        evidence = 100.0 if (h.amplitudes[0], h.shapes["t"]) == likely else 50.0
        one = SimpleNamespace(keys=frozenset({"mass"}), evidence=evidence, hypotheses=(), fit=ENDED)
        return cast(Scored, one)

    monkeypatch.setattr(selection, "attempt", refit)
    monkeypatch.setattr(selection, "light", lambda one: one)
    start = cast(Scored, SimpleNamespace(keys=frozenset(), evidence=0.0))
    offered = [("warms", 0.0), ("moves", 3600.0), ("moves", 0.0)]
    claims = [
        SimpleNamespace(key="mass", amplitudes=(a,), instants=("t",), shapes={"t": t}) for a, t in offered
    ]
    pool = [SimpleNamespace(hypothesis=h) for h in claims]
    found = Search(dry())
    assert found._refitted(start, [], cast(list[Score], pool)).evidence == 100.0
    assert [one.evidence for one in found.tried.values()] == [100.0]


@pytest.mark.parametrize(("coarse", "begun"), [(True, ["heat", "mass"]), (False, ["heat"])])
def test_a_coarse_answer_is_sought_from_another_beginning_too(
    coarse: bool, begun: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Heat is 5 more likely than a second mass as the first effect, and a lag 50 less than both."""
    found = Search(dry())
    for word, evidence in (("heat", 105.0), ("mass", 100.0), ("lag", 55.0)):
        one = SimpleNamespace(hypotheses=(word,), keys=frozenset({word}), evidence=evidence, setting=coarse)
        found.tried[one.keys] = cast(Scored, one)
    settled: list[str] = []
    monkeypatch.setattr(Search, "grow", lambda self: self)
    monkeypatch.setattr(Search, "_settled", lambda _, current: settled.extend(current.hypotheses))
    monkeypatch.setattr(selection, "is_usual", lambda setting: not setting)
    found.run()
    assert settled == begun


def test_an_effect_of_an_answer_may_be_all_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    """A lag comes third: without any one of the other two, the answer is worse; without both it is better."""
    words = ("mass", "heater", "lag")
    claims = tuple(SimpleNamespace(key=word) for word in words)
    answer = SimpleNamespace(
        hypotheses=claims,
        keys=frozenset(words),
        evidence=340.0,
        setting=False,
        noise=None,
        fit=None,
    )
    alone = {"mass": 300.0, "heater": 10.0, "lag": 420.0}
    found = Search(dry())
    found.tried[answer.keys] = cast(Scored, answer)
    asked: list[str] = []

    def scored(_context: object, own: Any, *_: object, **_limits: object) -> Any:
        asked.append(own[0].key)
        return SimpleNamespace(hypotheses=own, keys=frozenset({own[0].key}), evidence=alone[own[0].key])

    settled: list[str] = []
    monkeypatch.setattr(Search, "grow", lambda self: self)
    monkeypatch.setattr(Search, "_settled", lambda _, one: settled.append("+".join(sorted(one.keys))))
    monkeypatch.setattr(Search, "goal", lambda _, _noise: 0.0)
    monkeypatch.setattr(selection, "is_usual", lambda setting: not setting)
    monkeypatch.setattr(selection, "score", scored)
    monkeypatch.setattr(selection, "light", lambda one: one)
    monkeypatch.setattr(Search, "_for_several", lambda _: [])
    found.run()
    assert asked == [*words]
    assert settled == ["heater+lag+mass", "lag"]


@pytest.mark.parametrize(("ended_early", "asked"), [(False, ["mass"]), (True, [])])
def test_a_fit_that_ended_early_says_nothing_of_what_is_as_likely(
    ended_early: bool, asked: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Heat and a mass were about as likely alone, a thousand below the answer: neither fit was finished, and
    so the mass is not tried next to the lag of the answer.
    """

    def model(evidence: float, *words: str, early: bool = False) -> Any:
        claims = tuple(SimpleNamespace(key=word) for word in words)
        fit = SimpleNamespace(ended_early=early)
        return SimpleNamespace(hypotheses=claims, keys=frozenset(words), evidence=evidence, fit=fit)

    answer = model(1000.0, "heat", "lag")
    found = Search(dry())
    for one in (answer, model(5.0, "heat", early=ended_early), model(3.0, "mass", early=ended_early)):
        found.tried[one.keys] = one
    monkeypatch.setattr(selection, "_of_model", lambda h, _: h)
    assert [cast(Any, h).key for h in found._in_its_place(answer.hypotheses[0], answer)] == asked


@pytest.mark.parametrize(("again", "kept"), [(80.0, 80.0), (40.0, 50.0), (None, 50.0)])
def test_a_model_without_an_effect_is_fitted_from_where_the_other_stands(
    again: float | None, kept: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A processor: with a clock that was shifted by 0.008 s the fit left a bad minimum, 23 units better, and
    the model without it kept the score of that minimum.
    """
    drift = cast(Any, SimpleNamespace(key="drift"))

    def model(evidence: float) -> Any:
        fit = SimpleNamespace(problem=None, theta=None, trajectories=())
        return SimpleNamespace(hypotheses=(drift,), keys=frozenset({"drift"}), evidence=evidence, fit=fit)

    found = Search(dry())
    found.tried[frozenset({cast(Any, "drift")})] = model(50.0)
    goals: list[float] = []

    def refit(*_: object, goal: float) -> Any:
        goals.append(goal)
        return None if again is None else model(again)

    monkeypatch.setattr(selection, "score", refit)
    monkeypatch.setattr(selection, "light", lambda one: one)
    monkeypatch.setattr(selection, "cost_under", lambda *_: 7.0)
    monkeypatch.setattr(Search, "goal", lambda _, _noise: 100.0)
    current = cast(Scored, SimpleNamespace(noise=None, fit=None))
    without = found._from(current, [drift])
    assert without is not None
    assert without.evidence == kept
    assert goals == [7.0 - MOVED]  # it ends where it does not come below what is known


def test_a_fit_that_ended_early_is_finished_where_it_decides(monkeypatch: pytest.MonkeyPatch) -> None:
    """A motor of two masses: 13.8 units for the second one, as the fit without it promised 80 that it did not
    have; a name needs 16. What is far below need not be exact.
    """

    def model(evidence: float, *words: str, early: bool = False) -> Scored:
        chosen = tuple(SimpleNamespace(key=word) for word in words)
        stub = {"hypotheses": chosen, "keys": frozenset(words), "noise": None, "evidence": evidence}
        return cast(Scored, SimpleNamespace(**stub, fit=SimpleNamespace(ended_early=early)))

    near, far = model(-13.8, early=True), model(-90.0, "heat", early=True)
    search = Search(cast(Any, None))
    for one in (model(0.0, "mass"), near, far):
        search.tried[one.keys] = one
    monkeypatch.setattr(selection, "score", lambda _, chosen, *__: model(-21.6, *(h.key for h in chosen)))
    search.finish_near(25.0)
    assert search.gain == 21.6
    assert search.tried[far.keys] is far
