"""Files of well-known loggers and programs: roles, units and clocks are right with no edit."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.firsthour.clocks import bookkeeping
from discovery.firsthour.header import begin
from discovery.firsthour.stamps import stated_interval
from discovery.firsthour.table import read_own
from discovery.recordings import load_campaign
from tests.first_hour.loggers import LOGGERS
from tests.first_hour.shopfloor import rows


@pytest.mark.parametrize("name", LOGGERS)
def test_roles_units_and_clocks(name: str, tmp_path: Path) -> None:
    floor = LOGGERS[name](tmp_path)
    result = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), *floor.command, "--quick", "--no-ask"])
    assert result.exit_code == 0, result.output
    channels = tomllib.loads((tmp_path / "rig" / "campaign.toml").read_text("utf-8"))["channels"]
    found = {n: (one["role"], one["unit"]) for n, one in channels.items() if n != "T_env"}
    assert found == floor.roles
    first = next(iter(load_campaign(tmp_path / "rig").recordings.values()))
    assert (first.time[-1] - first.time[0]) / 3600 == pytest.approx(floor.hours, rel=0.01)
    sent = rows("tclab", "random_both_01", 3)
    assert len(first.time) == len(sent)
    warm = next(n for n, (role, _) in floor.roles.items() if role == "temperature")
    assert first.values[warm][0] == pytest.approx(sent[0]["T1"], abs=0.06)  # no row is lost above


@pytest.mark.parametrize(
    ("first", "unit", "about"),
    [
        (134_169_000_000_000_000, 1e7, "1601"),  # 2026 in the file time of Windows
        (639_080_000_000_000_000, 1e7, "year 1"),  # in the ticks of .NET
        (740_000.25, 1 / 86400, "year 0"),  # in the date numbers of MATLAB
        (46_083.25, 1 / 86400, "spreadsheets"),
    ],
)
def test_clocks_that_count_since_a_day_of_their_own(
    first: float, unit: float, about: str, tmp_path: Path
) -> None:
    step = 30 * unit
    lines = [
        f"{first + k * step:.12g},{20 + k / 10}" if unit < 1 else f"{first + round(k * step)},{20 + k / 10}"
        for k in range(40)
    ]
    (tmp_path / "run.csv").write_text("time,T1\n" + "\n".join(lines) + "\n", "utf-8")
    table = read_own(tmp_path / "run.csv")
    assert table.time[-1] == pytest.approx(39 * 30, rel=1e-3)
    assert about in table.about_time


def test_settings_that_look_like_readings_are_none() -> None:
    settings = [["101", "bed", "10", "2", "3"], ["102", "column", "10", "2", "3"]]
    header, readings = ["time", "bed", "column", "x", "y"], [["0", "20", "21", "1", "2"]] * 12
    assert begin([["Channel", "Name", "Range", "Low", "High"], *settings, header, *readings], (5, 6)) == 4
    assert begin([header, readings[0], readings[0], header, *readings], (5, 6)) == 1  # a logger started again
    assert begin([header, *readings[:3]], (5, 6)) == 1
    assert begin([header], (5, 6)) is None


def test_an_interval_with_its_unit_in_front() -> None:
    assert stated_interval(["SampleTime[ms]  3000  SampleTime[ms]  3000"]) == 3.0
    assert stated_interval(["Sampling interval,3s"]) == 3.0


def test_a_time_with_dots_stands_next_to_its_date(tmp_path: Path) -> None:
    """An Italian logger; the date alone would be one stamp for all rows."""
    lines = [f"05/03/2026;6.{k:02d}.30;{20 + k / 10:.1f}".replace(".5;", ",5;") for k in range(40)]
    (tmp_path / "run.csv").write_text("Data;Ora;Temp. olio\n" + "\n".join(lines) + "\n", "utf-8")
    table = read_own(tmp_path / "run.csv")
    assert table.time[-1] == 39 * 60.0
    assert table.first == "2026-03-05T06:00:30"


def test_rows_that_are_counted_are_no_input() -> None:
    """Whatever the word for it, and where rows are not evenly spaced; with a unit it is a ramp."""
    rows_, uneven = np.arange(1.0, 60.0), np.cumsum(1.0 + np.arange(59.0) ** 2)
    assert bookkeeping("序号", "", rows_, uneven, "other input")
    assert bookkeeping("序号", "NO.", rows_, uneven, "other input")
    assert not bookkeeping("bed", "degC", rows_, uneven, "other input")
    assert not bookkeeping("序号", "", rows_ + 0.5 * (rows_ > 30), uneven, "other input")
