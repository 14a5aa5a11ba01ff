"""Progress: what is done, and how long the rest takes where the speed was seen."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from discovery.experiment.pipeline import run
from discovery.progress import time_left
from tests.small import write_small


@pytest.mark.parametrize(
    ("done", "count", "passed", "said"),
    [
        (0, 4, 900.0, ""),  # nothing is done: no speed was seen
        (1, 4, 3.0, ""),  # too short to say
        (1, 4, 10.0, ", about 30 s left"),
        (1, 4, 600.0, ", about 30 min left"),  # the same on a busy machine
        (2, 4, 7200.0, ", about 2.0 h left"),
        (4, 4, 900.0, ""),
    ],
)
def test_the_time_left_is_what_the_speed_seen_makes_it(
    done: int, count: int, passed: float, said: str
) -> None:
    assert time_left(done, count, passed) == said


def test_a_run_counts_its_models_and_promises_no_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each look at the clock takes a minute: whatever a step was expected to take, it takes longer."""
    write_small(tmp_path)
    said: list[str] = []
    passed = iter(range(0, 10**9, 60))
    monkeypatch.setattr("time.perf_counter", lambda: float(next(passed)))
    run(tmp_path / "experiment.toml", tmp_path / "out", said.append)
    assert any("0 of 3 models done" in what for what in said), said
    assert any("1 of 3 models done" in what for what in said), said
    assert not [what for what in said if "left" in what]


def test_a_second_run_says_what_is_left_of_the_time_of_the_first(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_small(tmp_path)
    run(tmp_path / "experiment.toml", tmp_path / "out")
    results = tmp_path / "out" / "results.json"
    content = json.loads(results.read_text())
    results.write_text(json.dumps({**content, "seconds": 600.0}))
    said: list[str] = []
    monkeypatch.setattr("time.perf_counter", lambda: 0.0)
    run(tmp_path / "experiment.toml", tmp_path / "out", said.append)
    assert any(what.endswith(", about 10 min left if this takes as long as the last run") for what in said)
    results.write_text(json.dumps({**content, "seconds": 600.0, "fit": ["another"]}))
    said.clear()
    run(tmp_path / "experiment.toml", tmp_path / "out", said.append)
    assert not [what for what in said if "left" in what]
