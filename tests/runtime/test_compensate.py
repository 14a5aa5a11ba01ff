"""`discovery compensate`: the rows that feed it, and files that cannot be read or written."""

from __future__ import annotations

import math
import time
from pathlib import Path

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.runtime.guards import Reading
from discovery.runtime.rows import csv_rows, ticks


def test_rows_are_read_whatever_stands_in_them() -> None:
    lines = [
        "time,P,T\n",
        "0,1,2\n",
        "x,1,1\n",
        "10,,abc\n",
        "5,9,9\n",
        '20,"3\n',
        "30,4\n",
        "1e300,5,5\n",
        "40,6,7,8\n",
        "\n",
    ]
    rows = list(csv_rows(lines))
    assert [time for time, _ in rows][:2] == [0.0, 10.0]
    assert max(time for time, _ in rows) <= 40.0
    assert math.isnan(rows[1][1]["T"].value)  # type: ignore[arg-type]
    assert "P" not in rows[1][1]
    with pytest.raises(UserError, match="no column 'time'"):
        list(csv_rows(["a,b\n", "1,2\n"]))


def test_ticks_use_what_was_known_by_then() -> None:
    rows = [
        (0.0, {"P": Reading(1.0, 0.0)}),
        (25.0, {"P": Reading(2.0, 25.0)}),
        (30.0, {"P": Reading(3.0, 30.0)}),
    ]
    found = [(now, newest["P"].value) for now, newest in ((n, dict(a)) for n, a in ticks(rows, 10.0))]
    assert found == [(0.0, 1.0), (10.0, 1.0), (20.0, 1.0), (30.0, 3.0)]
    assert [now for now, _ in ticks(rows, 10.0, after=10.0)] == [20.0, 30.0]
    far = [*rows, (1e5, {"P": Reading(4.0, 1e5)})]
    assert [now for now, _ in ticks(far, 10.0)] == [0.0, 10.0, 20.0, 30.0, 1e5]  # the machine was off


@pytest.mark.parametrize("zone", ["UTC", "Europe/Berlin", "America/New_York"])
def test_instants_do_not_depend_on_the_clock_of_the_computer(
    monkeypatch: pytest.MonkeyPatch, zone: str
) -> None:
    """The hours of both changes of summer time, every half hour: none is lost, and naive means UTC."""
    monkeypatch.setenv("TZ", zone)
    time.tzset()
    try:
        for day, first in (("2026-03-29", 1774746000.0), ("2026-10-25", 1792890000.0)):
            stamps = [f"{day}T{h:02d}:{m:02d}:00" for h in range(1, 4) for m in (0, 30)]
            rows = list(csv_rows(["time,P", *(f"{stamp},1" for stamp in stamps)]))
            assert [t for t, _ in rows] == [first + 1800.0 * k for k in range(6)]
        [(zoned, _)] = csv_rows(["time,P", "2026-03-29T03:00:00+02:00,1"])
        assert zoned == 1774746000.0
    finally:
        monkeypatch.undo()
        time.tzset()


def test_the_command_says_what_is_missing(model_file: Path, tmp_path: Path) -> None:
    runner = CliRunner()
    model, inputs = str(model_file), ["--inputs", "-"]
    for words, sentence, status in (
        ([model, *inputs], "no key is trusted", 1),
        ([model, "--allow-unsigned", "--inputs", "none.csv"], "there is no such file", 1),
        ([model, "--allow-unsigned", "--inputs", str(tmp_path)], "this is a folder", 1),
        ([str(tmp_path / "none.json"), *inputs], "there is no such file", 1),
        ([model, "--back", "--state", str(tmp_path)], "--back is not possible", 1),
        ([model, *inputs, "--trust", str(tmp_path / "no.pub")], "there is no such key", 1),
        ([model, "--allow-unsigned"], "give the source of the readings: --inputs FILE", 2),
        ([model, "--back"], "--back needs --state", 2),
        ([model, *inputs, "--opcua-demo"], "--inputs and --opcua-demo: the readings have one source", 2),
        ([model, *inputs, "--seconds", "5"], "--seconds cannot be used with --inputs", 2),
        ([model, *inputs, "--learn", "key.pem"], "--learn needs --state", 2),
        ([model, *inputs, "--shadow-hours", "-1"], "--shadow-hours is -1; give 0 or more", 2),
        ([model, *inputs, "--shadow-um", "nan"], "--shadow-um is nan; give 0 or more", 2),
    ):
        done = runner.invoke(app, ["compensate", *words])
        assert done.exit_code == status
        assert sentence in done.output


def test_a_column_that_is_not_there_is_told(model_file: Path) -> None:
    """A file of something else had been run, with exit status 0 and a table of zeros."""
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", "-"]
    some = CliRunner().invoke(app, command, input="time,T_env,speed\n0,20,0\n")
    assert some.exit_code == 1
    assert (
        "there was no offset: P_drive, T_cool, T_fluid, h_nozzle, pump never had a good reading"
        in some.stderr
    )
    assert "the inputs have no column P_drive, T_cool, T_fluid" in some.stderr
    none = CliRunner().invoke(app, command, input="time,a\n0,20\n")
    assert none.exit_code == 1
    assert "name a file with its inputs" in none.stderr
    assert none.stdout == ""


@pytest.mark.parametrize(
    ("text", "status"), [("t;T_env\n0;20\n", 1), ("time,a\n0,20\n", 1), ("time,T_env\n", 0)]
)
def test_inputs_that_are_refused_leave_no_state(
    model_file: Path, tmp_path: Path, text: str, status: int
) -> None:
    memory = tmp_path / "mem"
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", "-", "--state", str(memory)]
    assert CliRunner().invoke(app, command, input=text).exit_code == status
    assert not memory.exists()
    assert CliRunner().invoke(app, command, input="time,T_env\n0,20\n").exit_code == 1
    assert (memory / "active.json").exists()


def test_the_output_may_not_be_what_is_read(model_file: Path, tmp_path: Path) -> None:
    inputs = tmp_path / "in.csv"
    inputs.write_text("time,T_env\n0,20\n")
    for used in (inputs, model_file):
        before = used.read_bytes()
        command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", str(inputs)]
        done = CliRunner().invoke(app, [*command, "--out", str(used)])
        assert (done.exit_code, "--out names the same file" in done.output) == (1, True)
        assert used.read_bytes() == before


def test_inputs_that_cannot_be_read_leave_an_older_output(model_file: Path, tmp_path: Path) -> None:
    inputs, out = tmp_path / "in.csv", tmp_path / "offsets.csv"
    inputs.write_text("t;T_env\n0;20\n")
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", str(inputs), "--out", str(out)]
    assert CliRunner().invoke(app, command).exit_code == 1
    assert not out.exists()
    out.write_text("what was there")
    assert CliRunner().invoke(app, command).exit_code == 1
    assert out.read_text() == "what was there"
    inputs.write_text("time,T_env\n0,20\n")
    assert CliRunner().invoke(app, command).exit_code == 1  # no offset: the others are missing
    assert out.read_text().startswith("time,state,status")
