"""After a gap, measured errors say where the states are; a probe that is wrong says nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from discovery.export.document import Exported
from discovery.runtime.compensator import Compensator, Settings
from discovery.runtime.guards import Reading
from discovery.runtime.persistence import restore, save
from tests.runtime.small import small

GAP_S = 3600.0


@pytest.fixture
def slow() -> Exported:
    """An error that follows a power within hours, and is known to 0.3 um."""
    return replace(small("P/1000 - y/20000"), document={"knowledge": {"residual": {"E": 0.3}}})


def warm(exported: Exported, observe: bool = True) -> Compensator:
    """At work for a night, then alone for an hour, and read again once."""
    found = Compensator(exported, Settings(tick_s=60.0, observe=observe))
    for k in range(1000):
        found.tick({"P": Reading(3.0, 60.0 * k)}, 60.0 * k)
    again = 60.0 * 999 + GAP_S
    found.tick({"P": Reading(3.0, again)}, again)
    return found


def measured(found: Compensator, error: float, minutes: int = 1) -> float:
    """What is predicted after an error was measured once."""
    assert found.last is not None
    for k in range(1, minutes + 2):
        now = found.last + 60.0
        more = {"E": Reading(error, now)} if k == 1 else {}
        found.tick({"P": Reading(3.0, now), **more}, now)
    assert found.predicted is not None
    return float(found.predicted[0])


def test_a_machine_that_was_not_off_is_found_where_it_is(slow: Exported) -> None:
    """The model took it to be at rest for an hour; it went on."""
    found = warm(slow)
    assert found.predicted is not None
    true = 57.0
    assert abs(found.predicted[0] - true) > 5.0
    assert found.uncertain > 5.0
    assert measured(found, true) == pytest.approx(true, abs=0.5)
    assert found.uncertain < 1.1
    assert abs(measured(warm(slow, observe=False), true) - true) > 5.0


def test_the_same_reading_counts_once_and_a_wrong_probe_never(slow: Exported) -> None:
    found = warm(slow)
    before = measured(found, 90.0)  # more than any state could explain
    assert before < 50.0
    assert found.uncertain > 5.0


def test_it_ends_and_without_a_gap_it_never_begins(slow: Exported) -> None:
    found = warm(slow)
    for _ in range(120):
        measured(found, float(found.predicted[0]))  # type: ignore[index]
    assert found.observer is None
    assert found.uncertain == 0.0
    quiet = Compensator(slow, Settings(tick_s=60.0))
    for k in range(10):
        quiet.tick({"P": Reading(3.0, 60.0 * k), "E": Reading(9.0, 60.0 * k)}, 60.0 * k)
    assert quiet.observer is None


def test_a_restart_goes_on_with_it(slow: Exported, tmp_path: Path) -> None:
    found = warm(slow)
    measured(found, 57.0)
    save(found, tmp_path).result()
    other = Compensator(slow, Settings(tick_s=60.0))
    assert restore(other, tmp_path) is not None
    assert measured(other, 58.0, 5) == measured(found, 58.0, 5)
    assert json.loads(json.loads((tmp_path / "state.json").read_text())["body"])["observer"]["counted"]
