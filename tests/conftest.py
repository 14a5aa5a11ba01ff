"""Before numpy is imported: one thread a process, so that the tests can run side by side."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

# These take half a minute or more each. They come first: whoever is done with short ones takes more of them.
LONG = (
    "test_the_tutorial_prints_what_it_says",
    "test_a_case_is_a_case_folder_with_a_key[two]",
    "test_a_notebook_runs[two_heaters]",
    "test_the_cutting_fluid_is_found_by_a_model_of_the_dry_machine",
    "test_from_nothing_to_a_diagnosis_in_four_commands",
    "test_killed_at_any_instant_it_returns_to_the_same_offsets[instants0]",
    "test_simulated_machines_are_warned_of_once_in_fifty_recordings_at_most",
    "test_end_to_end_and_going_on",
)

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long tests first, all others in their order."""
    items.sort(key=lambda item: LONG.index(item.name) if item.name in LONG else len(LONG))
