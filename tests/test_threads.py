"""Fits side by side; threads of the linear algebra: one while the workbench computes, then as before."""

from __future__ import annotations

import json
import os
import signal
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


# In a process of its own: that of the tests has threads, and does not fork.
FORKS = """
import os, signal, sys, time
from discovery.threads import side_by_side

parent = os.getpid()

def work(item):
    if item == sys.argv[1]:
        {what}
    return item, os.getpid() == parent, side_by_side(lambda x: os.getpid() == parent, [1, 2])

print(side_by_side(work, ["a", "b", "c"]), flush=True)
"""


def forks(what: str, item: str, **more: Any) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", FORKS.format(what=what), item],
        env=os.environ | {JOBS: "2"},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **more,
    )


def test_a_command_works_in_children_that_do_not_divide_their_work_again() -> None:
    out, err = forks("pass", "none").communicate()
    assert (eval(out), err) == ([(item, False, [False, False]) for item in "abc"], "")


def test_what_a_child_that_was_ended_had_to_do_is_done_by_its_parent() -> None:
    out, _ = forks("if os.getpid() != parent: os.kill(os.getpid(), signal.SIGKILL)", "b").communicate()
    assert [(item, here) for item, here, _ in eval(out)] == [("a", False), ("b", True), ("c", False)]


def test_a_parent_whose_children_were_all_ended_does_the_rest() -> None:
    what = "pass\n    if os.getpid() != parent: os.kill(os.getpid(), signal.SIGKILL)"
    out, _ = forks(what, "none").communicate()
    assert [(item, here) for item, here, _ in eval(out)] == [(item, True) for item in "abc"]


def test_what_goes_wrong_in_a_child_goes_wrong_in_its_parent() -> None:
    out, err = forks("raise ValueError('the second')", "b").communicate()
    assert (out, err.splitlines()[-1]) == ("", "ValueError: the second")


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_child_stays_behind(how: signal.Signals) -> None:
    with forks("print(os.getpid(), flush=True); time.sleep(2)", "a", start_new_session=True) as parent:
        assert parent.stdout is not None
        child = int(parent.stdout.readline())
        parent.send_signal(how)
        parent.wait(10)
        for _ in range(100):  # a child whose parent is killed is done with its item first
            if not is_at_work(child):
                return
            time.sleep(0.1)
        pytest.fail("a child stayed behind")


def is_at_work(process: int) -> bool:
    shown = subprocess.run(["ps", "-o", "stat=", "-p", str(process)], capture_output=True, text=True)
    return shown.stdout.strip() not in ("", "Z", "Zs")
