"""The rules of scoring by worked examples, and the figures by counting."""

from __future__ import annotations

import math
from typing import Any

import pytest

from discovery.challenge import scoring
from discovery.challenge.document import family_rows
from discovery.challenge.intervals import Share
from discovery.challenge.overlap import overlap
from discovery.challenge.prepare import kind_of
from discovery.challenge.scoring import judge
from discovery.challenge.sizes import covered
from discovery.challenge.tally import by_family, score_all, tally

GAP = {"effect": "flooded_gap", "states": ["c_body_1", "b_corpus"]}
OFFSET = {"effect": "sensor_offset", "states": [], "output": "E_Z0T"}
QUIET: dict[str, Any] = {"effect": None, "states": []}
OWN = {
    "also_true": [
        {"effect": "natural_convection", "states": ["table"], "also": ["radiation"]},
        {"effect": "natural_convection", "states": ["bed"], "also": ["radiation"]},
        {"effect": "flooded_gap", "states": ["side"]},
    ]
}
AIR = {"also_true": [{"effect": "natural_convection", "states": ["top", "legs", "beam", "ram"]}]}
TWO = {
    "effect": "two",
    "states": [],
    "effects": [
        {"effect": "friction_speed", "states": ["c_body_2"]},
        {"effect": "fluid_convection", "states": ["c_body_1"]},
    ],
}


def named(effect: str, *states: str, p: float = 0.9, **more: Any) -> dict[str, Any]:
    return {"effect": effect, "states": list(states), "probability": p, **more}


def said(*found: dict[str, Any], below: dict[str, float] | None = None) -> dict[str, Any]:
    rivals = [{"effect": e, "states": [], "log_evidence_below_best": gap} for e, gap in (below or {}).items()]
    return {"verdict": "missing physics", "physics": list(found), "alternatives": rivals}


NOTHING = {"verdict": "no mismatch", "physics": [], "alternatives": []}
UNKNOWN = {"verdict": "unexplained", "physics": [], "alternatives": []}


@pytest.mark.parametrize(
    ("key", "answer", "points", "word"),
    [
        (QUIET, NOTHING, 1.0, scoring.RIGHT),
        (QUIET, UNKNOWN, -2.0, scoring.FALSE_ALARM),
        (QUIET, said(named("radiation", "table")), -2.0, scoring.FALSE_ALARM),
        (GAP, NOTHING, 0.0, scoring.MISSED),
        (GAP, UNKNOWN, 0.0, scoring.UNNAMED),
        (GAP, said(), 0.0, scoring.UNNAMED),
        (GAP, None, -2.0, scoring.FAILED),
        (GAP | {"accepts": ["no mismatch"]}, NOTHING, 1.0, scoring.RIGHT),
        (GAP | {"accepts": ["unexplained"]}, UNKNOWN, 1.0, scoring.RIGHT),
        (GAP, said(named("flooded_gap", "c_body_1", "b_corpus")), 1.0, scoring.RIGHT),
        (
            GAP,
            said(named("flooded_gap", "c_body_1", "table", "side")),
            1.0,
            scoring.RIGHT,
        ),  # one state too many
        (GAP, said(named("flooded_gap", "c_body_1", "table", "side", "x")), 0.5, scoring.ELSEWHERE),
        (GAP, said(named("flooded_gap", "table", "side")), 0.5, scoring.ELSEWHERE),
        (GAP | {"also": ["conduction_path"]}, said(named("conduction_path", "b_corpus")), 1.0, scoring.RIGHT),
        (
            GAP,
            said(named("radiation", "table"), below={"flooded_gap": 2.0}),
            0.7 / math.sqrt(2),
            scoring.IN_SET,
        ),
        (
            GAP,
            said(named("radiation", "table"), below={"flooded_gap": 2.0, "wear": 3.0, "windage": 3.1}),
            0.7 / math.sqrt(3),
            scoring.IN_SET,
        ),
        (GAP, said(named("radiation", "table"), below={"flooded_gap": 3.5}), -2.0, scoring.WRONG),
        (GAP, said(named("outlier", "E_Z0T")), -2.0, scoring.WRONG_KIND),
        (OFFSET, said(named("radiation", "table")), -2.0, scoring.WRONG_KIND),
        (OFFSET, said(named("sensor_drift", "E_Z0T")), -2.0, scoring.WRONG),
        (OFFSET, said(named("sensor_offset", "E_Z0T")), 1.0, scoring.RIGHT),
        ({"effect": "clock_shift", "states": []}, said(named("clock_shift")), 1.0, scoring.RIGHT),
        (
            TWO,
            said(named("friction_speed", "c_body_2"), named("fluid_convection", "c_body_1")),
            1.0,
            scoring.RIGHT,
        ),
        (TWO, said(named("friction_speed", "c_body_2")), 0.5, scoring.PARTLY),
        (TWO, said(named("friction_speed", "table")), 0.0, scoring.ELSEWHERE),
        (TWO, said(named("friction_speed", "c_body_2"), named("radiation", "side")), -0.5, scoring.WRONG),
        (QUIET | OWN, said(named("natural_convection", "table")), 1.0, scoring.OF_MACHINE),
        (QUIET | OWN, said(named("radiation", "table")), 1.0, scoring.OF_MACHINE),
        (
            QUIET | OWN,
            said(named("radiation", "table", "bed", "side")),
            1.0,
            scoring.OF_MACHINE,
        ),  # one too many
        (QUIET | OWN, said(named("radiation", "table", "side", "x")), -2.0, scoring.FALSE_ALARM),
        (QUIET | OWN, said(named("natural_convection", "side")), -2.0, scoring.FALSE_ALARM),
        (QUIET | OWN, UNKNOWN, -2.0, scoring.FALSE_ALARM),
        (
            QUIET | OWN,
            said(named("natural_convection", "table"), named("wear", "table")),
            -2.0,
            scoring.FALSE_ALARM,
        ),
        # what shows at four bodies together has to be named at three of them, with one other body at most
        (QUIET | AIR, said(named("natural_convection", "legs", "beam", "ram", "x")), 1.0, scoring.OF_MACHINE),
        (QUIET | AIR, said(named("natural_convection", "legs", "beam")), -2.0, scoring.FALSE_ALARM),
        (GAP | OWN, said(named("natural_convection", "table")), 0.0, scoring.OF_MACHINE),  # the gap is missed
        (GAP | OWN, said(named("flooded_gap", "side")), 0.5, scoring.ELSEWHERE),
        (
            GAP | OWN,
            said(named("radiation", "table"), named("flooded_gap", "b_corpus")),
            1.0,
            scoring.RIGHT,
        ),
        (
            TWO | OWN,
            said(named("friction_speed", "c_body_2"), named("radiation", "table")),
            0.5,
            scoring.PARTLY,
        ),
    ],
)
def test_rules(key: dict[str, Any], answer: dict[str, Any] | None, points: float, word: str) -> None:
    found = judge(key, answer)
    assert found.points == pytest.approx(points)
    assert found.word == word


def test_kind_of_a_key_that_does_not_say() -> None:
    assert [kind_of(k) for k in (QUIET, GAP, OFFSET, TWO)] == ["none", "one", "measuring", "two"]
    assert kind_of(GAP | {"accepts": ["unexplained"]}) == "outside"


def test_exact_intervals_against_their_definition() -> None:
    """Clopper-Pearson: at an end of the interval, what was seen has just 2.5 % probability."""
    from scipy.stats import binom

    low, high = Share(7, 40).interval()
    assert binom.sf(6, 40, low) == pytest.approx(0.025)
    assert binom.cdf(7, 40, high) == pytest.approx(0.025)
    assert Share(0, 50).upper() == pytest.approx(1 - 0.05 ** (1 / 50))  # a "rule of three"
    assert Share(0, 0).value is None
    assert Share(0, 0).interval() == (0.0, 1.0)


def test_overlap_of_windows() -> None:
    key = {"window": ["a", 100.0, 200.0]}

    def windows(*spans: tuple[str, float, float]) -> dict[str, Any]:
        return {"location": {"windows": [{"recording": r, "start_s": a, "end_s": b} for r, a, b in spans]}}

    assert overlap(key, windows(("a", 100.0, 200.0))) == 1.0
    assert overlap(key, windows(("a", 150.0, 250.0))) == pytest.approx(50 / 150)
    assert overlap(key, windows(("a", 140.0, 160.0), ("a", 150.0, 180.0))) == pytest.approx(0.4)
    assert overlap(key, windows(("a", 100.0, 200.0), ("b", 0.0, 100.0))) == pytest.approx(0.5)
    assert overlap(key, {}) == 0.0
    assert overlap({}, windows(("a", 0.0, 1.0))) is None
    edges = {"t_on_x": {"value": 100.0}, "t_off_x": {"value": 150.0}}
    exact = said(named("unmeasured_heat", "side", recording="a", parameters=edges))
    assert overlap(key, exact | windows(("a", 0.0, 900.0))) == pytest.approx(0.5)


def test_sizes_are_compared_in_one_unit() -> None:
    """100 W at a top speed of 600 rpm with an exponent of 2 are 277.8 W at 1000 rpm."""
    key = {"effect": "friction_speed", "size": 100.0, "unit": "W", "top_speed": 600.0}

    def found(low: float, high: float) -> dict[str, Any]:
        size = {"value": (low + high) / 2, "low": low, "high": high, "unit": "W"}
        return {"effect": "friction_speed", "parameters": {"P_f_body": size, "m_body": {"value": 2.0}}}

    assert covered(key, found(270.0, 285.0)) is True
    assert covered(key, found(90.0, 110.0)) is False
    assert covered({**key, "top_speed": 6000.0}, found(2.5, 3.0)) is True
    assert covered({"effect": "friction_speed", "size": 100.0}, found(270.0, 285.0)) is None
    assert covered({"effect": "radiation", "size": 1.0}, {"effect": "radiation"}) is None
    assert covered(key, {"effect": "friction_speed"}) is None


def test_figures_by_counting() -> None:
    place = {"states": ["table"]}
    keys = {
        "q1": QUIET | {"kind": "none"},
        "q2": QUIET | {"kind": "none"},
        "big": {"effect": "film_drag", **place, "kind": "one", "rms_over_noise": 2.1},
        "small": {"effect": "film_drag", **place, "kind": "one", "rms_over_noise": 0.6},
        "odd": {"effect": "out of catalogue", **place, "kind": "outside", "accepts": ["unexplained"]},
        "two": TWO | {"kind": "two"},
    }
    half = {"improvement": {"explained": 0.8}, "seconds": 3.0}
    answers = {
        "q1": NOTHING,
        "q2": UNKNOWN,
        "big": said(named("film_drag", "table", p=0.95), named("wear", "side", p=0.55)) | half,
        "small": NOTHING,
        "odd": said(named("radiation", "table", p=0.6)),
        "two": said(named("fluid_convection", "c_body_1", p=0.99)) | {"improvement": {"explained": 0.4}},
    }
    t = tally(score_all(keys, answers))
    assert (t.false_alarms, t.outside_named) == (Share(1, 2), Share(1, 1))
    assert (t.large_named, t.large_right) == (Share(1, 1), Share(1, 1))
    assert (t.stated, t.two_found, t.extra) == (Share(2, 3), Share(1, 2), Share(1, 2))
    assert [(b.size, b.count, b.detected, b.named, b.right) for b in t.power] == [
        (0.5, 1, 0, 0, 0),
        (1.0, 0, 0, 0, 0),
        (2.0, 1, 1, 1, 1),
        (4.0, 0, 0, 0, 0),
    ]
    # said 0.95, 0.99 and true; 0.55, 0.6 and false
    assert t.calibration_points == pytest.approx(100 * (0.05 + 0.01 + 0.55 + 0.6) / 4)
    assert t.explained == pytest.approx(0.6)
    assert t.explained_all == pytest.approx(0.4)  # 0.8, 0.4 and nothing
    assert t.points == pytest.approx((1 - 2 + 1 + 0 - 2 + 0.5) / 6)
    assert t.confusion["film_drag"] == {"film_drag": 1, "no mismatch": 1}
    assert t.confusion["friction_speed"] == {"not named": 1}
    assert t.confusion["no effect"] == {"no mismatch": 1, "unexplained": 1}
    assert t.seconds == 3.0


def test_families_have_figures_of_their_own_and_say_which_chose_settings() -> None:
    keys = {
        "a": QUIET | {"kind": "none", "family": "portal"},
        "b": QUIET | {"kind": "none", "family": "headstock"},
        "c": QUIET | {"kind": "none", "family": "headstock"},
    }
    t = tally(score_all(keys, {"a": UNKNOWN, "b": NOTHING, "c": NOTHING}))
    assert {name: one.false_alarms for name, one in by_family(t).items()} == {
        "portal": Share(1, 1),
        "headstock": Share(0, 2),
    }
    head, portal, headstock = family_rows(t)
    assert head[:3] == ["family", "settings", "cases"]
    assert portal[:3] == ["portal", "confirms", "1"]
    assert headstock[:3] == ["headstock", "chosen on it", "2"]
    nameless = tally(score_all({"a": QUIET | {"kind": "none"}}, {"a": NOTHING}))
    assert family_rows(nameless) == []
