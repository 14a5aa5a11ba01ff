"""The first sentence: the best model of each output with the interval of its lead; a tie says tie."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

from discovery.report.recommended import recommended
from discovery.report.run import Run
from discovery.report.sections import _costs


def run(found: dict[str, Any], held_out: tuple[str, ...] = ("v",)) -> Run:
    return cast(Run, SimpleNamespace(results={"recommended": found}, held_out=held_out))


def against(rms: float, difference: float, low: float, high: float) -> dict[str, float]:
    return {"rms": rms, "difference": difference, "low": low, "high": high}


def test_a_lead_and_a_tie_are_said_with_their_outputs() -> None:
    found = {
        "E_Y": {
            "model": "masses",
            "ties": [],
            "against": {
                "ridge": against(2.0, -50.0, -62.0, -41.0),
                "worse": against(9.0, -90.0, -95.0, -80.0),
            },
        },
        "E_Z": {"model": "ridge", "ties": ["masses"], "against": {"masses": against(1.1, -5.0, -20.0, 9.0)}},
    }
    said = recommended(run(found), "on the unseen recording “v”")
    assert said == (
        "On the unseen recording “v”, “masses” predicts E_Y (50 % less rms than “ridge”, 95 %: 41 to 62 %) "
        "best; “ridge” and “masses” tie for E_Z."
    )


def test_nothing_is_recommended_without_unseen_recordings() -> None:
    assert recommended(run({"E": {"model": "a", "ties": ["b"], "against": {}}}, ()), "on") == ""
    assert recommended(run({}), "on") == ""


def test_the_cost_of_each_term_is_listed_dearest_first() -> None:
    group = {"outputs": ["E"], "costs": {"T_env": 0.021, "P": 3.4, "1": None, "Q": -0.01}}
    assert _costs(group) == [("E: P", "+340.0 %"), ("E: T_env", "+2.1 %"), ("E: Q", "−1.0 %")]
