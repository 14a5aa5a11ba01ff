"""Threads of the linear algebra: one while the workbench computes, afterwards as before."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

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
    from discovery.sparse import discover

    for work in (fit_model, diagnose, discover):
        assert "campaign" in signature(work).parameters
        assert work.__code__.co_name == "pinned"
