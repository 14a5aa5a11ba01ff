"""Fits side by side; threads of the linear algebra: one while the workbench computes, then as before."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.threads import JOBS, side_by_side
from tests.small import EXPERIMENT, write_small

SCRIPT = """
import numpy
from threadpoolctl import threadpool_info, threadpool_limits
from discovery.threads import one_thread

def count():
    return max(library["num_threads"] for library in threadpool_info())

with threadpool_limits(2):
    print(one_thread(count)(), count())
"""


@pytest.mark.parametrize(("said", "seen"), [({}, ["1", "2"]), ({"OMP_NUM_THREADS": "2"}, ["2", "2"])])
def test_a_script_is_pinned_while_it_computes_unless_the_user_says_otherwise(
    said: dict[str, str], seen: list[str]
) -> None:
    environment = {key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], env=environment | said, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == seen


def test_what_computes_for_long_is_pinned_and_keeps_its_signature() -> None:
    from inspect import signature

    from discovery.diagnosis import diagnose
    from discovery.fitting import fit_model
    from discovery.sparse.discover import discover

    for work in (fit_model, diagnose, discover):
        assert "campaign" in signature(work).parameters
        assert work.__code__.co_name == "pinned"


def test_a_run_is_the_same_on_one_two_and_four_jobs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Bit for bit: models, predictions, diagnosis and folds of the roles; only the seconds differ."""
    monkeypatch.setenv(JOBS, "1")  # put back at the end
    write_small(tmp_path)
    text = EXPERIMENT.replace(
        'held_out = ["c"]', 'held_out = []\nroles = { warm = ["a"], cold = ["b", "c"] }'
    )
    (tmp_path / "experiment.toml").write_text(text + '\n[mismatch]\nmodel = "one_body"\n')
    written = {}
    for jobs in ("1", "2", "4"):
        out = tmp_path / f"out{jobs}"
        command = ["run", str(tmp_path / "experiment.toml"), "--out", str(out), "--jobs", jobs, "--quiet"]
        result = CliRunner().invoke(app, command)
        assert result.exit_code == 0, result.output
        files = {p.relative_to(out): p for p in out.rglob("*") if p.suffix in (".toml", ".csv", ".json")}
        written[jobs] = {
            name: without_seconds(json.loads(p.read_text())) if p.suffix == ".json" else p.read_bytes()
            for name, p in files.items()
        }
        assert len(written[jobs]) > 5
    assert written["1"] == written["2"] == written["4"]


def without_seconds(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: without_seconds(item) for key, item in value.items() if key != "seconds"}
    return [without_seconds(item) for item in value] if isinstance(value, list) else value


def test_the_first_failure_in_the_order_of_the_items_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(JOBS, "3")
    begun = []

    def work(item: int) -> int:
        begun.append(item)
        time.sleep(0.01)
        raise ValueError(item)

    with pytest.raises(ValueError, match="0"):
        side_by_side(work, range(1000))
    assert len(begun) < 1000
