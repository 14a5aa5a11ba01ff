"""Damages of shop floors: each is found and named, sound recordings are left in peace."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from discovery.recordings.check import check_campaign
from tests.recordings.damages import (
    DAMAGES,
    Damage,
    findings,
    harm,
    is_named,
    others,
    sound,
    write,
    write_campaign,
)
from tests.recordings.simulated import simulated

# what the comparison does not find: too near to what sound recordings differ by, and without harm
NOT_FOUND = {"a clock that runs 20 % fast"}
NMV5000 = Path(__file__).parents[2] / "datasets" / "nmv5000"
CYCLES = ["fit", "validation", "left_nozzle", "height_100", "worn"]  # the flow is at 0 or at 8 l/min
FLOWS = {"pump": ("fluid flow", "1"), "flow": ("fluid flow", "l/min"), "E_Y0C": ("error", "um")}
SEEDS = range(12)  # the thresholds were set on 100 others: benchmarks/damages.md


def test_there_are_sixty_kinds_and_more() -> None:
    assert len({one.name for one in DAMAGES}) >= 60
    assert {one.name for one in DAMAGES} >= NOT_FOUND


def test_what_is_not_found_does_no_harm() -> None:
    for one in (d for d in DAMAGES if d.name in NOT_FOUND):
        assert harm(one) < 1.03  # times the held-out rms with sound recordings


# every sixth here; all of them, with a table, by `python -m tests.recordings.damages` (5 min)
@pytest.mark.parametrize("one", [d for d in DAMAGES if d.name not in NOT_FOUND][::6], ids=lambda d: d.name)
def test_a_damage_is_found_and_named(one: Damage, tmp_path: Path) -> None:
    found = findings(one, tmp_path / "campaign")
    assert is_named(one, found), found
    assert len(others(one, found)) <= 1


@pytest.mark.parametrize("base", ["machine", "heaters"])
def test_sound_recordings_pass(base: str, tmp_path: Path) -> None:
    assert check_campaign(write(tmp_path / base, base, sound(base))) == []


def test_simulated_machines_are_warned_of_once_in_fifty_recordings_at_most(tmp_path: Path) -> None:
    warned = recordings = 0
    for seed in SEEDS:
        made = simulated(seed)
        found = check_campaign(write_campaign(tmp_path / str(seed), "simulated", made.channels, made.frames))
        warned += len({one.file for one in found})
        recordings += len(made.frames)
    assert warned <= np.ceil(0.02 * recordings)


def test_a_poor_prediction_is_no_offset_of_a_sensor() -> None:
    """Of so few recordings, `only_environment` is predicted badly: the room steps there, and nowhere else."""
    some = ["fit", "validation", "left_nozzle", "height_100", "only_environment", "only_fluid", "warm_up"]
    assert check_campaign(NMV5000, only=some) == []


def test_a_pump_that_stays_on_at_new_flows_is_not_frozen() -> None:
    assert check_campaign(NMV5000, only=[*CYCLES, "nozzle_long"]) == []


def test_a_pump_that_stays_on_at_known_flows_is_frozen(tmp_path: Path) -> None:
    frames = {}
    for name in CYCLES:
        frame = pd.read_csv(NMV5000 / f"{name}.csv.gz")
        frames[name] = {column: frame[column].to_numpy(copy=True) for column in ("time", *FLOWS)}
    frames["worn"]["pump"][1500:] = 1.0
    found = check_campaign(write_campaign(tmp_path / "frozen", "machine", FLOWS, frames))
    assert [one.what[:18] for one in found if one.kind == "stuck"] == ["'pump' stays at 1 "]
