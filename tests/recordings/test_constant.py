"""A sensor that shows one value in all recordings is said once, and one that has no readings is looked at."""

from __future__ import annotations

from pathlib import Path

from discovery.recordings.finding import Finding
from discovery.recordings.valuecheck import CONSTANT, said_once

CAMPAIGN = Path("campaign.toml")


def still(file: str, what: str, channel: str = "T_room") -> Finding:
    return Finding("warning", Path(file), 2, what, "check the sensor", CONSTANT, channel)


def test_one_value_in_all_recordings_is_one_finding() -> None:
    alike = [still(f"{k}.csv", f"'T_room' is 26 in all {90 + k} readings") for k in range(5)]
    other = Finding("warning", Path("0.csv"), 7, "'P' stays at 3", "check it")
    [first, second] = said_once([alike[0], other, *alike[1:]], CAMPAIGN, 5)
    assert first == other
    assert (second.file, second.line) == (CAMPAIGN, None)
    assert second.what == "'T_room' is 26 in all readings of all 5 recordings"


def test_what_moves_in_one_recording_or_from_one_to_the_next_is_said_of_each() -> None:
    alike = [still(f"{k}.csv", f"'T_room' is 26 in all {90 + k} readings") for k in range(4)]
    assert said_once(alike, CAMPAIGN, 5) == alike
    changed = [*alike, still("4.csv", "'T_room' is 24 in all 90 readings")]
    assert said_once(changed, CAMPAIGN, 5) == changed
    assert said_once(alike[:1], CAMPAIGN, 1) == alike[:1]
