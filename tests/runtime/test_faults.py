"""Injected faults on the virtual machine: what they cost, and that nothing unsafe ever comes out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as some

from discovery.export.document import Exported
from discovery.export.stepper import Stepper
from discovery.runtime.injection import KINDS, Injection, try_faults, violations

TICK = 60.0
CLEAN = {"not finite": 0, "beyond the limit": 0, "steps above the rate limit": 0}


@pytest.fixture(scope="module")
def clean(exported: Exported, minutes: np.ndarray) -> np.ndarray:
    return try_faults(exported, minutes, [], TICK).offsets


def test_without_faults_the_offsets_are_minus_the_model(exported: Exported, minutes: np.ndarray) -> None:
    from discovery.runtime.compensator import Settings

    trial = try_faults(exported, minutes, [], TICK, Settings(tick_s=TICK))
    stepper = Stepper(exported.compiled)
    stepper.start(minutes[0])
    every = round(TICK / exported.compiled.step_s)
    y = stepper.run(np.repeat(minutes, every, axis=0))[::every]
    assert set(trial.states[600:]) == {"ACTIVE"}
    settled = trial.offsets[60:]
    assert np.max(np.abs(settled + y[60:])) < 1e-9


@pytest.mark.parametrize("hour", [3.0, 22.0, 30.0, 46.0, 58.0, 62.0])
def test_a_wrong_ambient_sensor_costs_about_one_um(
    exported: Exported, minutes: np.ndarray, clean: np.ndarray, hour: float
) -> None:
    trial = try_faults(exported, minutes, [Injection("offset", "T_env", hour * 3600, 7200, 15.0)], TICK)
    assert np.max(np.abs(trial.offsets - clean)) <= 1.05  # 1.015 at hour 62
    assert "DEGRADED" in trial.states
    assert trial.states[-1] == "ACTIVE"


@pytest.mark.parametrize("hour", [3.0, 22.0, 30.0, 46.0, 58.0, 62.0])
@pytest.mark.parametrize("kind", ["nan", "quality", "stale"])
def test_a_bad_fluid_sensor_costs_at_most_four_um(
    exported: Exported, minutes: np.ndarray, clean: np.ndarray, hour: float, kind: str
) -> None:
    trial = try_faults(exported, minutes, [Injection(kind, "T_fluid", hour * 3600, 3600)], TICK)
    assert np.max(np.abs(trial.offsets - clean)) <= 4.0


def test_a_lost_link_is_held_and_comes_back(
    exported: Exported, minutes: np.ndarray, clean: np.ndarray
) -> None:
    trial = try_faults(exported, minutes, [Injection("link", "T_env", 30 * 3600, 7200)], TICK)
    assert np.max(np.abs(trial.offsets - clean)) < 64.0
    assert np.max(np.abs(trial.offsets[-1] - clean[-1])) < 0.5


def test_a_fault_that_lasts_ramps_the_offsets_out(exported: Exported, minutes: np.ndarray) -> None:
    trial = try_faults(exported, minutes, [Injection("missing", "T_fluid", 10 * 3600, 1e9)], TICK)
    assert trial.states[-1] == "FAULT"
    assert np.all(trial.offsets[-1] == 0.0)
    assert violations(exported, trial, TICK) == CLEAN


INPUTS = ("P_drive", "T_cool", "T_env", "T_fluid", "h_nozzle", "pump", "speed")
injections = some.lists(
    some.builds(
        Injection,
        some.sampled_from(KINDS),
        some.sampled_from(INPUTS),
        some.floats(0, 12 * 3600),
        some.one_of(some.floats(60, 1200), some.floats(1200, 6 * 3600)),
        some.one_of(some.floats(-30, 30), some.floats(allow_nan=True, allow_infinity=True)),
    ),
    min_size=1,
    max_size=6,
)


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(faults=injections)
def test_nothing_unsafe_comes_out_whatever_comes_in(
    exported: Exported, minutes: np.ndarray, faults: list[Injection]
) -> None:
    trial = try_faults(exported, minutes[:720], faults, TICK)
    assert violations(exported, trial, TICK) == CLEAN
