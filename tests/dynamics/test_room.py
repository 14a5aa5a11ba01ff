"""Memory that is kept from one free run to the next."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

FAULTS = """
import resource
import numpy as np
import discovery.dynamics

def work():
    parts = [np.ones(100_000) for _ in range(8)]
    return float(parts[0][0])

for _ in range(3):
    work()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    work()
print(resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="mallopt is glibc's")
def test_freed_arrays_are_used_again_unless_the_user_has_said_otherwise() -> None:
    bare = {name: value for name, value in os.environ.items() if not name.startswith("MALLOC_")}

    def faults(**said: str) -> int:
        ended = subprocess.run(
            [sys.executable, "-c", FAULTS], env=bare | said, capture_output=True, text=True, check=True
        )
        return int(ended.stdout)

    assert faults() < 200
    assert faults(MALLOC_TRIM_THRESHOLD_="100000", MALLOC_MMAP_THRESHOLD_="100000") > 2000
