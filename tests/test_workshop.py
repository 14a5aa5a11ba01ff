"""`python -m benchmarks.workshop` writes a case with its key, and the same bytes each time."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pandas as pd
import pytest
from typer.testing import CliRunner

from benchmarks.workshop.__main__ import main
from benchmarks.workshop.machines import CASES
from discovery.cli import app
from discovery.effects.catalogue import catalogue


def _files(folder: Path, monkeypatch: pytest.MonkeyPatch, case: str = "laser_a") -> dict[str, bytes]:
    monkeypatch.setattr(sys, "argv", ["workshop", str(folder), case])
    main()
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_a_case_is_written_with_its_key_and_with_the_same_bytes_twice(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four recordings from 0 s, the last one held out; the key names what the model lacks."""
    files = _files(tmp_path / "one", monkeypatch)
    texts = {"campaign.toml", "model.toml", "experiment.toml", *(f"{run}.csv" for run in "abcd")}
    assert set(files) == {"keys.json", *(f"laser_a/{name}" for name in texts)}
    (key,) = json.loads(files["keys.json"]).values()
    assert (key["effect"], key["output"]) == ("input_path", "E_focus")
    assert key["changes_noises"]["E_focus"] > 5
    assert key["changes_noises"]["T_head"] == 0
    assert b'held_out = ["d"]' in files["laser_a/experiment.toml"]
    for run, hours in zip("abcd", (4, 4, 5, 4), strict=True):
        table = pd.read_csv(tmp_path / "one" / "laser_a" / f"{run}.csv")
        assert [*table] == ["time", "T_amb", "T_cool", "P", "T_head", "T_mount", "E_focus"]
        assert table["time"].iloc[0] == 0
        assert set(table["time"].diff().dropna()) == {10}
        assert table["time"].iloc[-1] == pytest.approx(hours * 3600, abs=30)
        assert table.notna().all(axis=None)
    assert _files(tmp_path / "two", monkeypatch) == files


def test_keys_name_effects_of_the_catalogue_at_states_of_the_model() -> None:
    """A key with a wrong word would never be scored as right."""
    for name, case in CASES.items():
        assert (case.key["effect"] is None) == (not case.lacks), name
        for part in case.key.get("effects", [case.key]):
            assert part["effect"] in {None, "out of catalogue", *catalogue()}, name
            assert set(part["states"]) <= set(case.machine.states), name


@pytest.mark.parametrize("case", ["gearbox_a", "robot_d"])
def test_the_clock_of_a_machine_that_is_not_linear_is_not_blamed(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Recordings that predict each other to 20 % like any factor, and say nothing about a clock."""
    _files(tmp_path, monkeypatch, case)
    done = CliRunner().invoke(app, ["check", str(tmp_path / case / "campaign.toml")])
    assert done.exit_code == 0
    assert "clock" not in done.output
