"""Recordings of small things, as their owners log them: what `discovery new` keeps and how it counts."""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UsageError
from discovery.firsthour.asking import read_statements


def _door(folder: Path, *more: str) -> tuple[str, dict[str, Any]]:
    """What `discovery new` prints where a door opens in the unseen file alone, and the channels."""
    command = ["new", str(folder / "oven"), "--quick", *more]
    for number in range(3):
        rows = [f"{k},{40 * (k // 9 % 2)},{25 + k % 20 / 9},{int(number == 2 and k > 40)}" for k in range(60)]
        (folder / f"run{number}.csv").write_text("\n".join(["time_s,P_W,T1_C,door", *rows]), "utf-8")
        command += ["--from", str(folder / f"run{number}.csv")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    campaign = tomllib.loads((folder / "oven" / "campaign.toml").read_text("utf-8"))
    return result.output, campaign["channels"]


def test_a_column_that_moves_in_the_unseen_file_alone_is_said_not_to_move_elsewhere(tmp_path: Path) -> None:
    out, channels = _door(tmp_path)
    assert "column 'door' never moves in the recordings to fit: left out" in out
    assert '--is "door=other input"' in out
    assert "door" not in channels


def test_a_column_of_which_a_person_says_something_stays(tmp_path: Path) -> None:
    """It was left out before anyone was asked: there was no such column, said the command."""
    _, channels = _door(tmp_path, "--is", "door=other input")
    assert channels["door"]["role"] == "other input"


@pytest.mark.parametrize(("role", "said"), [("heat load,W", True), ("other output,W/m^2", False)])
def test_only_of_a_heat_load_it_is_said_that_it_is_below_zero(tmp_path: Path, role: str, said: bool) -> None:
    rows = [f"{k},{20 + k % 9},{25 + k % 20 / 9},{(k % 30 - 10) / 9}" for k in range(60)]
    (tmp_path / "run.csv").write_text("\n".join(["time_h,T_out_C,T_in_C,q_kW", *rows]), "utf-8")
    command = ["new", str(tmp_path / "wall"), "--quick", "--is", f"q_kW={role}"]
    result = CliRunner().invoke(app, [*command, "--from", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    assert ("is below zero in" in result.output) is said


@pytest.mark.parametrize(("name", "unit"), [("time", "s"), ("t", "min")])
def test_a_column_called_time_is_rather_in_seconds(tmp_path: Path, name: str, unit: str) -> None:
    """A lamp warms a plate for a quarter of an hour. The documents call a column of seconds so."""
    rows = [f"{4 * k},{9 * (k > 9)},{20 + 170 * (1 - math.exp(-max(k - 9, 0) / 15))}" for k in range(240)]
    (tmp_path / "run.csv").write_text("\n".join([f"{name},drive,T_plate", *rows]), "utf-8")
    command = ["new", str(tmp_path / "lamp"), "--quick", "--from", str(tmp_path / "run.csv")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert f"time counted in {unit} (?" in result.output


def test_one_cold_start_says_what_the_room_is_near(tmp_path: Path) -> None:
    """Two heaters on a board, one day cold and one day warm from the run before; nobody measured the room."""
    command = ["new", str(tmp_path / "board"), "--quick"]
    for number, (t1, t2) in enumerate([(28.9, 28.6), (60.0, 39.3), (27.7, 28.7)]):
        rows = [f"{5 * k},{t1 + k % 50 / 5},{t2 + k % 50 / 9},{50 * (k // 25 % 2)}" for k in range(120)]
        (tmp_path / f"run{number}.csv").write_text("\n".join(["time_s,T1,T2,Q1", *rows]), "utf-8")
        command += ["--from", str(tmp_path / f"run{number}.csv")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    assert "the temperatures agree at the start of 1 of 2 recordings, near 29.1 degC" in result.output
    campaign = tomllib.loads((tmp_path / "board" / "campaign.toml").read_text("utf-8"))
    assert 2.0 < campaign["channels"]["T_env"]["spread"] < 5.0
    assert campaign["recordings"]["run1"]["set"]["T_env"] == 29.1


@pytest.mark.parametrize(
    ("said", "unit"),
    [
        ("sun=other input,W/m2", "W/m**2"),
        ("feed=fluid flow,m3/h", "m**3/h"),
        ("feed=fluid flow,kg/s", "kg/s"),
        ("T=degC", "degC"),
    ],
)
def test_a_unit_is_read_as_people_write_it(said: str, unit: str) -> None:
    found, _ = read_statements([said])
    assert [u for _, u in found.values()] == [unit]


def test_a_unit_that_a_role_does_not_have_is_said_so() -> None:
    """The role was right, and the message asked for a role."""
    with pytest.raises(UsageError, match="no unit of a fluid flow; a fluid flow is in 1, l/min"):
        read_statements(["feed=fluid flow,kg/m3"])
    with pytest.raises(UsageError, match="neither a role nor a unit"):
        read_statements(["feed=quux"])
