"""Before numpy is imported: one thread and one fit at a time in a process, so that the tests can run side by
side.
"""

from __future__ import annotations

import gc
import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import pytest

# These take 13 s or more each. They come first: whoever is done with short ones takes more of them.
LONG = (
    "test_the_tutorial_prints_what_it_says",
    "test_the_cutting_fluid_is_found_by_a_model_of_the_dry_machine",
    "test_a_grammar_of_another_make_reads_the_text",
    "test_another_process_gives_the_same_answer",
    "test_what_is_not_found_does_no_harm",
    "test_what_the_demonstration_discovers_comes_out_of_pysindy[discovered-outputs1-pump*(T_fluid - table)]",
    "test_a_notebook_runs[two_heaters]",
    "test_from_nothing_to_a_diagnosis_in_four_commands",
    "test_two_effects_are_found_together",
    "test_simulated_machines_are_warned_of_once_in_fifty_recordings_at_most",
    "test_an_event_beside_a_law_needs_a_second_recording",
    "test_end_to_end_and_going_on",
    "test_products_of_outputs_make_them_one_system",
    "test_the_model_of_an_exchanger_predicts_to_the_noise",
    "test_a_true_first_answer_in_two_commands",
    "test_killed_at_any_instant_it_returns_to_the_same_offsets[instants0]",
    "test_a_machine_that_has_worn_is_followed_without_new_evidence",
    "test_an_input_that_acts_comes_in_with_its_gains",
    "test_the_lines_for_a_notebook_run",
)

for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")
os.environ.setdefault("DISCOVERY_JOBS", "1")
os.environ.setdefault("MPLBACKEND", "Agg")
gc.disable()  # while tests are collected: all that is imported stays


def pytest_configure(config: pytest.Config) -> None:
    """Workers compile in turn."""
    if hasattr(config, "workerinput"):
        from tests.kernels import compile_in_turn

        compile_in_turn()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Long tests first, all others in their order."""
    items.sort(key=lambda item: LONG.index(item.name) if item.name in LONG else len(LONG))


def pytest_collection_finish() -> None:
    """What was collected is never garbage."""
    gc.freeze()
    gc.enable()
