"""Files as other shops bring them: lathes, hot ends, spindles, cells; what was guessed wrongly once."""

from __future__ import annotations

import re
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from openpyxl import Workbook
from typer.testing import CliRunner

from discovery.cli import app
from discovery.firsthour.filenames import constants
from discovery.firsthour.guess import Guess
from discovery.firsthour.joining import join_all
from discovery.firsthour.recorded import recorded
from discovery.firsthour.table import Column, read_own
from discovery.firsthour.tableguess import guess_all
from discovery.firsthour.zeros import perhaps_own_zeros
from discovery.recordings.units import conversion
from tests.first_hour.shopfloor import DATASETS

Array = NDArray[np.float64]
ROWS = 400
SLOW = 22.0 + 9.0 * (1 - np.exp(-np.arange(ROWS) / 90.0))
STEPS = np.repeat([0.0, 1.0, 0.4, 0.0, 0.8], ROWS // 5)


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def roles(*columns: tuple[str, str, Array]) -> dict[str, Guess]:
    return guess_all([Column(name, name, unit, values) for name, unit, values in columns])


def test_a_setting_above_a_table_is_no_row_of_units(tmp_path: Path) -> None:
    """`Prova n. | 1`: the number is no unit of the second column."""
    book = Workbook()
    sheet = book.active
    assert sheet is not None
    sheet.append(["Prova n.", 1])
    sheet.append([])
    sheet.append(["Data/ora", "Mandrino", "", "Temperature", ""])
    sheet.append(["", "Velocità (giri/min)", "Refrigerante ON/OFF", "Mandrino (°C)", "Ambiente (°C)"])
    for k in range(60):
        at = datetime(2026, 3, 2, 8) + timedelta(seconds=30 * k)
        sheet.append([at, 1000 * (k // 20), "ON" if k % 30 > 9 else "OFF", 20 + 0.1 * k, 20.0 + k % 3])
    book.save(tmp_path / "prova.xlsx")
    table = read_own(tmp_path / "prova.xlsx")
    assert [c.unit for c in table.columns] == ["giri/min", "ON/OFF", "°C", "°C"]
    found = guess_all(table.columns)
    assert [one.role for one in found.values()] == [
        "rotation speed",
        "fluid flow",  # a coolant that is on or off
        "temperature",
        "ambient temperature",
    ]


def test_a_set_point_is_that_of_the_reading_with_its_name() -> None:
    """As printers log: the target of an extruder is no speed."""
    extruder = 24.0 + 20.0 * (SLOW - 22.0)
    found = roles(("extruder", "", extruder), ("extruder_target", "", np.round(240.0 * STEPS)),
                  ("extruder_power", "", STEPS), ("fan", "", STEPS[::-1]))  # fmt: skip
    assert found["extruder_target"].role == "temperature"
    assert (found["extruder_power"].role, found["extruder_power"].unit) == ("heat load", "1")


def test_the_current_of_a_load_is_a_current() -> None:
    found = roles(("Current_load", "", STEPS), ("Temperature_measured", "", SLOW))
    assert (found["Current_load"].role, found["Current_load"].unit) == ("other input", "A")


def test_the_clearest_word_counts_where_two_say_the_same() -> None:
    assert roles(("X Displacement (mm)", "mm", 1e-3 * (SLOW - 22.0)))["X Displacement (mm)"].sure


def test_dates_next_to_a_clock_are_no_readings(tmp_path: Path) -> None:
    """As testers of cells write them; `data` is also a date in Italian, and here counts the rows."""
    rows = [f"{k + 1},{10.0 * k},{datetime(2026, 3, 2, 8) + timedelta(seconds=10 * k)},{10.0 * (k % 40)},"
            f"{(k // 40) % 3 - 1},{3.6 + 0.001 * (k % 40)}" for k in range(200)]  # fmt: skip
    head = "Data_Point,Test_Time(s),Date_Time,Step_Time(s),Current(A),Voltage(V)"
    found = recorded([read_own(write(tmp_path / "cell.csv", head, *rows))])
    assert [c.name for c in found.seen] == ["Current", "Voltage"]
    run = next(iter(found.recordings.values()))
    assert np.median(np.diff(run.time)) == 10.0


def test_what_loggers_write_for_nothing_is_emptied(tmp_path: Path) -> None:
    rows = [f"{30 * k};{'-9999,00' if k % 9 == 0 else f'{20 + 0.01 * k:.2f}'};{k % 5}".replace(".", ",")
            for k in range(100)]  # fmt: skip
    table = read_own(write(tmp_path / "essai.csv", "temps [s];Palier [°C];P [W]", *rows))
    assert np.isnan(table.columns[0].values).sum() == 12
    assert "12 cells hold a logger's code for a missing value (-9999): emptied" in table.notes


def test_a_mil_is_a_thousandth_of_an_inch() -> None:
    assert conversion("mil", "error") == conversion("thou", "error")


@pytest.mark.parametrize("stamp", ["%m/%d/%Y,%I:%M:%S %p", "%d/%m/%Y,%H:%M:%S"], ids=["a.m.", "day first"])
def test_dates_of_two_loggers_are_read_so_that_they_meet(tmp_path: Path, stamp: str) -> None:
    """3 November in one file: nothing in it says which number is the month."""
    begin = datetime(2026, 11, 3, 7, 15)
    at = [begin + timedelta(seconds=20 * k) for k in range(ROWS)]
    temps = [f"{t:{stamp}},{v:.2f}" for t, v in zip(at, SLOW, strict=True)]
    drives = [f"{t:%Y-%m-%dT%H:%M:%S.000Z};{1000 * v:.0f}" for t, v in zip(at, STEPS, strict=True)]
    one = read_own(write(tmp_path / "temps.csv", "Date,Time,Bearing (C)", *temps))
    other = read_own(write(tmp_path / "cnc.csv", "Timestamp;Speed_RPM", *drives))
    [joined] = join_all([one], [other])
    assert joined.time[-1] < 1.3 * 20 * ROWS


def test_numbers_of_tests_in_the_names_of_files() -> None:
    stems = [f"test{k + 1}_{speed}rpm" for k, speed in enumerate((0, 20, 500))]
    assert constants(stems, [])["speed"][1] == dict(zip(stems, (0.0, 20.0, 500.0), strict=True))


def test_whether_a_spring_counts_seconds_is_asked(tmp_path: Path) -> None:
    """Nothing but its shape says that `y` is an error: whether the clock is that of a machine is open."""
    time = np.arange(2000) * 0.02
    u = np.sin(3.0 * time) + np.sin(0.7 * time)
    y = np.convolve(u, np.exp(-np.arange(200) * 0.01) * np.sin(np.arange(200) * 0.13))[:2000]
    rows = [f"{t:.3f},{a:.5f},{b:.6f}" for t, a, b in zip(time, u, 1e-3 * y, strict=True)]
    found = recorded([read_own(write(tmp_path / "spring.csv", "time,u,y", *rows))])
    assert found.clock["s"] > 0.1  # hours in silence once


def test_of_two_voltages_the_one_that_follows_is_the_output() -> None:
    """Pump and level of two real tanks: no word says which drives which."""
    u, y = np.loadtxt(DATASETS / "tanks" / "estimation.csv", delimiter=",", skiprows=1, usecols=(1, 2)).T
    found = roles(("泵电压(V)", "V", u), ("液位(V)", "V", y))
    assert [one.role for one in found.values()] == ["other input", "other output"]
    assert not found["液位(V)"].sure


@pytest.mark.parametrize("name", ["motor_A", "Load", "S-load"])
def test_what_a_motor_takes_is_asked(name: str) -> None:
    """Percent, amperes or a temperature: nothing but jumps from 0 to 40."""
    assert not roles((name, "", 40.0 * STEPS), ("T1", "degC", SLOW))[name].sure


@pytest.mark.parametrize("zero", [0.0, 0.012, -0.2, 152.3], ids=["at zero", "near", "below", "of a probe"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_displacements_of_a_lathe_without_units(zero: float, sign: float) -> None:
    """`X1-1, Z1` in mm, next to temperatures without units."""
    moved = zero + sign * 0.03 * (1 - np.exp(-np.arange(ROWS) / 120.0))
    found = roles(("T1", "", SLOW), ("T2", "", SLOW + 3.0), ("X1-1", "", moved), ("Z1", "", 0.5 * moved))
    assert [(found[n].role, found[n].unit) for n in ("X1-1", "Z1")] == [("error", "mm")] * 2


def lathe(tmp_path: Path, *, zero: bool, warm: bool) -> dict[str, float]:
    """Errors that may have own zeros, of three runs of a lathe that start at other rooms."""
    for k in range(3):
        room = 20.0 + 2.0 * k * warm
        head, error = room + SLOW - 22.0, 2.0 * (SLOW - 22.0) + (0.0 if zero else 40.0 * k)
        rows = [f"{60 * i},{a:.2f},{b:.2f}" for i, (a, b) in enumerate(zip(head, error, strict=True))]
        write(tmp_path / f"run{k}.csv", "time [s],T_head [°C],E_z [um]", *rows)
    found = recorded([read_own(tmp_path / f"run{k}.csv") for k in range(3)])
    return perhaps_own_zeros(found, found.guesses, {})


@pytest.mark.parametrize(
    ("zero", "warm", "own"), [(True, True, True), (True, False, False), (False, False, True)]
)
def test_probes_that_are_set_to_zero_before_each_run(
    tmp_path: Path, zero: bool, warm: bool, own: bool
) -> None:
    """A warmer machine at zero again, or the same machine elsewhere: the zero may be another one."""
    assert bool(lathe(tmp_path, zero=zero, warm=warm)) is own


@pytest.mark.parametrize("errors", [False, True], ids=["temperatures", "with errors"])
def test_a_cool_down_under_a_speed_of_the_name_is_said(tmp_path: Path, *, errors: bool) -> None:
    """Three runs of 10 h. The fastest stops after 6 h; the room of the slowest falls by 6 K at night."""
    hours = np.arange(0.0, 10.0, 0.05)
    rng = np.random.default_rng(3)
    for speed, stop, night in ((1000, 10.0, 6.0), (2000, 10.0, 0.0), (3000, 6.0, 0.0)):
        warm = np.where(hours < stop, 1 - np.exp(-hours), (1 - np.exp(-stop)) * np.exp(stop - hours))
        room = 22.0 - night * hours / 10.0 + rng.normal(0, 0.05, len(hours))
        front = room + 0.004 * speed * warm + rng.normal(0, 0.1, len(hours))
        rows = [
            f"{3600 * t:.0f},{r:.2f},{f:.2f}" + (f",{2 * (f - 22):.2f}" if errors else "")
            for t, r, f in zip(hours, room, front, strict=True)
        ]
        head = "time [s],T_room [degC],T_front [degC]" + (",E_Z [um]" if errors else "")
        write(tmp_path / f"spindle_{speed}rpm.csv", head, *rows)
    files = [f"spindle_{speed}rpm.csv" for speed in (1000, 3000, 2000)]
    command = ["new", str(tmp_path / "machine"), "--quick"]
    done = CliRunner().invoke(
        app, [*command, *(x for name in files for x in ("--from", str(tmp_path / name)))]
    )
    assert done.exit_code == 0, done.output
    assert (
        "speed in rpm from the names of the files, held for the whole recording: 1000, 3000, 2000"
        in done.output
    )
    [said] = [line for line in done.output.splitlines() if line.startswith("warning:")]
    found = re.match(
        r"warning: spindle_3000rpm: T_front .*cools down from (\S+) h on \(by (\d+)% of its rise\), but ",
        said,
    )
    assert found, said
    assert float(found[1]) == pytest.approx(6.0, abs=0.2)
    assert int(found[2]) > 80
    assert "speed = 3000 rpm of the file's name is held until the end" in said
