"""Files of shop floors of several countries: roles, units and clocks are right with no edit."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.firsthour.joining import join_all
from discovery.firsthour.table import read_tables
from discovery.recordings import load_campaign
from tests.first_hour.shopfloor import FLOORS, two_loggers


@pytest.mark.parametrize("name", FLOORS)
def test_roles_units_and_clocks(name: str, tmp_path: Path) -> None:
    floor = FLOORS[name](tmp_path)
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), *floor.command, "--quick", "--no-ask"])
    assert result.exit_code == 0, result.output
    channels = tomllib.loads((tmp_path / "rig" / "campaign.toml").read_text("utf-8"))["channels"]
    found = {n: (one["role"], one["unit"]) for n, one in channels.items() if n in floor.roles}
    assert found == floor.roles
    assert set(channels) - set(floor.roles) <= {"T_env"}
    first = next(iter(load_campaign(tmp_path / "rig").recordings.values()))
    assert (first.time[-1] - first.time[0]) / 3600 == pytest.approx(floor.hours, rel=0.03)
    check = CliRunner().invoke(app, ["check", str(tmp_path / "rig")])
    assert check.exit_code == 0, check.output


def test_a_true_first_answer_in_two_commands(tmp_path: Path) -> None:
    """The heaters in German: a model that predicts the unseen step, and a sentence for each of five lines."""
    floor = FLOORS["german"](tmp_path)
    made = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), *floor.command, "--quick", "--no-ask"])
    assert made.exit_code == 0, made.output
    experiment = tmp_path / "rig" / "experiment.toml"
    text = experiment.read_text("utf-8")
    experiment.write_text(text.split("[mismatch]")[0], "utf-8")  # what is missing is asked elsewhere
    out = ["--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, ["run", str(experiment), *out, "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert found["winner"] in ("first_order", "discovered")
    assert found["held_out"] == ["Versuch_3"]
    assert found["against_none"]["ratio"] < 0.5
    lead = found["against_runner_up"]
    assert lead["low"] <= lead["ratio"] <= lead["high"]


def test_loggers_share_their_shift(tmp_path: Path) -> None:
    command = two_loggers(tmp_path).command
    first, second = (
        [t for word, path in zip(command[::2], command[1::2], strict=True) if word == kind
         for t in read_tables(Path(path))]
        for kind in ("--from", "--join")
    )  # fmt: skip
    notes = [" ".join(table.notes) for table in join_all(first, second)]
    assert all("ahead" in one and "corrected" in one for one in notes)
    shifts = [float(one.split("ahead by ")[1].split(" s")[0]) for one in notes]
    assert shifts == pytest.approx([95.0] * 3, abs=10.0)
    assert len(set(shifts)) == 1  # two clocks have one shift
    assert "as in the other pairs" in notes[2]  # a single step does not show it
