"""Rows of CSV as shop floors have them: clocks that jump, rows that come twice, units that are wrong."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.runtime.firsttick import refuse_wrong_units
from discovery.runtime.guards import Reading
from discovery.runtime.rows import Dropped, csv_rows


def read(stamps: list[float]) -> tuple[list[float], Dropped, list[str]]:
    """Times of rows with these stamps; each row has a value of its own."""
    dropped, said = Dropped(), list[str]()
    lines = ["time,T\n", *(f"{stamp:.3f},{20 + 0.001 * k:.3f}\n" for k, stamp in enumerate(stamps))]
    return [time for time, _ in csv_rows(lines, (), said.append, dropped)], dropped, said


MINUTES = [60.0 * k for k in range(1400)]


def test_one_stamp_two_days_ahead_costs_one_row() -> None:
    """It had cost 1000 of 1400 rows without a word."""
    stamps = list(MINUTES)
    stamps[400] += 172_800.0
    times, dropped, said = read(stamps)
    assert times == [*MINUTES[:400], *MINUTES[401:]]
    assert str(dropped) == "1 row was left out: 1 with a time far ahead (the first in line 402)"
    assert said == []


def test_a_clock_that_is_set_back_is_followed() -> None:
    stamps = [t if k < 700 else t - 86_400.0 for k, t in enumerate(MINUTES)]
    times, dropped, said = read(stamps)
    assert times == MINUTES
    assert not dropped.counts
    assert said == ["the clock of the inputs went back by 86400 s in line 702; the new time is used"]


def test_rows_out_of_order_and_twice_are_left_out_and_counted() -> None:
    lines = ["time,T\n", *(f"{t:g},{t:g}\n" for t in (0, 60, 120, 90, 180, 60, 120, 240, 240))]
    dropped = Dropped()
    assert [t for t, _ in csv_rows(lines, (), dropped=dropped)] == [0, 60, 120, 180, 240]
    assert dropped.counts == {"out of order": 1, "doubled": 3}


def test_a_gap_is_a_gap() -> None:
    stamps = [*MINUTES[:100], *(t + 200_000.0 for t in MINUTES[100:200])]
    times, dropped, said = read(stamps)
    assert (times, dict(dropped.counts), said) == (stamps, {}, [])


@pytest.mark.parametrize("separator", [";", "\t"])
def test_semicolons_and_decimal_commas_are_read(separator: str) -> None:
    lines = [f"time{separator}T\n", f"0{separator}20,5\n", f"60{separator}20.75\n", f"120,5{separator}21\n"]
    assert [(time, row["T"].value) for time, row in csv_rows(lines)] == [(0, 20.5), (60, 20.75), (120.5, 21)]


@pytest.mark.parametrize(
    ("lines", "sentence"),
    [
        (["time,T,P\n", "0,20,5,800,0\n"], "decimal commas"),
        (["time,T\n", "1700000000000,20\n"], "not milliseconds"),
        (["time,T\n", *(f"{k * 60_000},2{k}\n" for k in range(9))], "are the times in milliseconds"),
        (["time,T\n", *(f"{k * 1_000},2{k}\n" for k in range(9))], "are the times in milliseconds"),
        (["t,T\n", "0,20\n"], "no column 'time'"),
    ],
)
def test_what_cannot_be_right_is_refused(lines: list[str], sentence: str) -> None:
    with pytest.raises(UserError, match=sentence):
        list(csv_rows(lines, oldest_s=300.0))


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [
        ("T_env", 295.2, "kelvin"),
        ("T_env", 72.0, "Fahrenheit"),
        ("T_fluid", 2780.0, "hundredths of a degree"),
        ("T_fluid", 278.0, "tenths of a degree"),
        ("pump", 100.0, "percent"),
        ("h_nozzle", 50_000.0, "micrometres"),
    ],
)
def test_a_wrong_unit_is_refused_at_the_first_tick(
    exported: Exported, name: str, value: float, unit: str
) -> None:
    with pytest.raises(UserError, match=rf"{name} is .*looks like .*{unit}.* give it in"):
        refuse_wrong_units(exported.inputs, {name: Reading(value, 0.0)}, set())


def test_an_input_that_comes_later_is_asked_at_its_first_value(exported: Exported) -> None:
    """Two loggers of different rates: the slower one has no cell in the first row."""
    middle = {i.name: Reading(0.5 * (i.range.low + i.range.high), 0.0) for i in exported.inputs}
    known: set[str] = set()
    refuse_wrong_units(exported.inputs, middle | {"T_env": Reading(float("nan"), 0.0)}, known)
    with pytest.raises(UserError, match="T_env is 72 at first, which looks like degrees Fahrenheit"):
        refuse_wrong_units(exported.inputs, middle | {"T_env": Reading(72.0, 60.0)}, known)
    refuse_wrong_units(exported.inputs, {"T_env": Reading(72.0, 120.0)}, known)  # a spike is for the guards


def test_values_of_the_training_are_no_wrong_unit(exported: Exported) -> None:
    refused = []
    for share in (-0.3, 0.0, 0.5, 1.0, 1.3):
        found = {i.name: i.range.low + share * (i.range.high - i.range.low) for i in exported.inputs}
        try:
            refuse_wrong_units(exported.inputs, {n: Reading(value, 0.0) for n, value in found.items()}, set())
        except UserError as error:
            refused.append((share, str(error)))
    assert refused == []


def test_a_run_tells_what_it_did(model_file: object, exported: Exported) -> None:
    """Kelvin in a file: a sentence and exit status 1, where it had been a table of zeros and status 0."""
    middle = {i.name: 0.5 * (i.range.low + i.range.high) for i in exported.inputs}
    command = ["compensate", str(model_file), "--allow-unsigned", "--inputs", "-"]

    def rows(values: dict[str, float], stamps: list[float]) -> str:
        lines = [",".join([f"{t:g}", *(f"{v + 1e-4 * t:g}" for v in values.values())]) for t in stamps]
        return "\n".join([",".join(["time", *values]), *lines, ""])

    kelvin = middle | {"T_env": middle["T_env"] + 273.15}
    done = CliRunner().invoke(app, command, input=rows(kelvin, [0.0, 60.0]))
    assert done.exit_code == 1
    assert "looks like kelvin" in done.stderr
    assert done.stdout == ""
    done = CliRunner().invoke(app, command, input=rows(middle, [0.0, 60.0, 120.0, 30.0, 180.0]))
    assert done.exit_code == 0, done.stderr
    assert "1 row was left out: 1 out of order (the first in line 5)" in done.stderr
    assert done.stderr.count("a cold start settles after about 17 h") == 1
    assert "in a tick of 10 s an offset moves by at most " in done.stderr
    refused = CliRunner().invoke(app, command, input=rows(middle, [0.0]).replace("\n0,", "\nnoon,"))
    assert refused.exit_code == 1
    assert "no row of the inputs can be used: 1 row was left out: 1 without a time (the first in line 2)" in (
        refused.stderr
    )
    assert "19 ticks: COLD 100.0 %; 1 event; ended COLD" in done.stderr
