"""What columns of an own CSV are taken for, and what is said when a file cannot be read."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from discovery.errors import UserError
from discovery.firsthour.guess import Guess, drives, guess
from discovery.firsthour.table import Column, read_own
from discovery.firsthour.tableguess import guess_all

CASES = [
    ("T_room", "", np.linspace(20, 23, 50), "ambient temperature", "degC"),
    ("Room", "", 24.4 + np.arange(50) // 10 % 2 / 2, "ambient temperature", "degC"),
    ("Ambient", "", np.linspace(70, 74, 50), "ambient temperature", "degF"),
    ("bed temperature", "°F", np.linspace(70, 74, 50), "temperature", "degF"),
    ("T3", "", np.linspace(294, 305, 50), "temperature", "K"),
    ("coolant", "", np.linspace(18, 22, 50), "coolant temperature", "degC"),
    ("cooling power", "W", np.linspace(0, 900, 50), "cooling power", "W"),
    ("emulsion temp", "C", np.linspace(18, 22, 50), "fluid temperature", "degC"),
    ("pump", "", np.arange(50) % 2, "fluid flow", "1"),
    ("coolant_flow", "", np.linspace(6, 12, 50), "fluid flow", "l/min"),
    ("T_coolant_flow", "", np.linspace(18, 22, 50), "coolant temperature", "degC"),
    ("pump flow", "", np.arange(50) % 3 * 6.0, "fluid flow", "l/min"),
    ("spindle speed", "", np.arange(50) * 100.0, "rotation speed", "rpm"),
    ("heater 1", "", np.arange(50) * 2.0, "heat load", "percent"),
    ("P_drive", "kW", np.linspace(0, 2, 50), "heat load", "kW"),
    ("E_Z0T", "", np.linspace(0, 20, 50), "error", "um"),
    ("nozzle height", "mm", np.full(50, 50.0), "nozzle height", "mm"),
    ("Current", "", np.linspace(-130, 0, 50), "other input", "A"),
    ("I_tec", "", np.linspace(4.6, 0.2, 50), "other input", "A"),
    ("current step", "", np.linspace(0, 7, 50), "other input", "A"),
    ("current temperature", "", np.linspace(20, 29, 50), "temperature", "degC"),
    ("Cell Voltage A1", "", np.linspace(3, 4, 50), "other input", "V"),
    ("Aussentemperatur", "", np.linspace(3, 8, 50), "ambient temperature", "degC"),
    ("Umgebungstemperatur", "", np.linspace(3, 8, 50), "ambient temperature", "degC"),
    ("Raumtemperatur-Istwert 2", "", np.linspace(20, 21, 50), "ambient temperature", "degC"),
    ("Vorlauftemperatur Istwert HK2", "", np.linspace(20, 29, 50), "temperature", "degC"),
    ("Aussenluftfeuchte", "", np.linspace(40, 60, 50), "other input", "1"),
    ("pump power", "W", np.linspace(0, 90, 50), "heat load", "W"),
    ("pump speed", "rpm", np.linspace(0, 900, 50), "rotation speed", "rpm"),
    ("pump", "%", np.linspace(0, 90, 50), "fluid flow", "percent"),
    ("gizmo", "", np.linspace(0, 1, 50), "other input", "1"),
    ("T_ext", "", np.linspace(8, 31, 50), "ambient temperature", "degC"),
    ("extruder temp", "", np.linspace(20, 210, 50), "temperature", "degC"),
    ("319A Temp", "ºF", np.linspace(70, 90, 50), "temperature", "degF"),
    ("Torque", "lbf·ft", np.linspace(0, 0.3, 50), "other input", "lbf·ft"),
    ("heat flux", "W/quux", np.linspace(0, 9, 50), "other input", "1"),
    ("Motor Efficiency", "%", np.linspace(0, 90, 50), "other input", "percent"),
    ("DutyCycle", "%", np.linspace(0, 90, 50), "heat load", "percent"),
    ("duty", "", np.linspace(0, 90, 50), "heat load", "percent"),
    ("PWM", "", np.arange(50) * 5.0, "heat load", "1"),
    ("Heating", "", np.arange(50) % 2, "heat load", "1"),
    ("heating_north", "kW", np.linspace(0, 9, 50), "heat load", "kW"),
    ("Output", "%", np.linspace(0, 90, 50), "heat load", "percent"),
    ("Output", "", np.linspace(20, 90, 50), "other input", "1"),
    ("control", "", np.arange(50) * 4.0, "heat load", "1"),
    ("control", "", np.linspace(-3, 3, 50), "other input", "1"),
    ("u", "", np.linspace(0, 1, 50), "heat load", "1"),
    ("valve", "%", np.linspace(0, 90, 50), "heat load", "percent"),
    ("Q1", "", np.linspace(0, 90, 50), "heat load", "percent"),
    ("T_control", "", np.linspace(20, 30, 50), "temperature", "degC"),
    ("T_spindle", "", np.linspace(20, 30, 50), "temperature", "degC"),
    ("motor temp", "", np.linspace(20, 30, 50), "temperature", "degC"),
    ("Prędkość wrzeciona", "obr/min", np.linspace(0, 900, 50), "rotation speed", "rpm"),
    ("Temp. chłodziwa", "°C", np.linspace(20, 30, 50), "coolant temperature", "degC"),
    ("Koelvloeistof temp", "", np.linspace(20, 30, 50), "coolant temperature", "degC"),
    ("Pump", "0/1", np.arange(50.0) % 2, "fluid flow", "1"),
    ("solar", "W/m2", np.linspace(0, 900, 50), "other input", "W/m**2"),
    ("solar", "W/m^2", np.linspace(0, 900, 50), "other input", "W/m^2"),
    ("solar", "W/m²", np.linspace(0, 900, 50), "other input", "W/m²"),
    ("incubator temp", "", np.linspace(59, 61, 50), "temperature", "degC"),
    ("Ta", "", np.linspace(2, 14, 50), "ambient temperature", "degC"),
    ("yTi1", "", np.linspace(19, 24, 50), "temperature", "degC"),
    ("east", "", np.linspace(20, 60, 50), "temperature", "degC"),
    ("HX_ExhOut", "", np.linspace(20, 60, 50), "temperature", "degC"),
    ("Exosun", "", np.linspace(-44, 44, 50), "other input", "1"),
    ("EXX", "", np.linspace(0, 20, 50), "error", "um"),
    ("TT140", "", np.linspace(2, 95, 50), "temperature", "degC"),
    ("te_in", "", np.linspace(280, 322, 50), "temperature", "K"),
    ("Solar_flow_rate", "", np.linspace(15, 25, 50), "fluid flow", "l/min"),
    ("I_sol", "", np.linspace(0, 900, 50), "other input", "1"),
    ("zenith", "", np.linspace(64, 160, 50), "other input", "1"),
    ("Qh", "", np.arange(50) % 2 * 1920.0, "heat load", "W"),
]


@pytest.mark.parametrize(("name", "unit", "values", "role", "expected"), CASES)
def test_roles_and_units(name: str, unit: str, values: np.ndarray, role: str, expected: str) -> None:
    found = guess(Column(name, name.replace(" ", "_"), unit, np.asarray(values, dtype=float)))
    assert (found.role, found.unit) == (role, expected)
    assert found.why


def test_a_correction_is_given_to_the_error_of_its_name() -> None:
    def found(*names: str) -> list[tuple[str, str, str | None]]:
        columns = [Column(n, n, "um/m" if n == "E_A0C" else "", np.linspace(0, 9, 50)) for n in names]
        return [(one.role, one.unit, one.corrects) for one in guess_all(columns).values()]

    assert found("E_A0C", "E_A0C_applied")[1] == ("applied correction", "um/m", "E_A0C")
    assert found("E_Y0C", "offset")[1] == ("applied correction", "um", "E_Y0C")
    assert found("E_Y0C", "E_A0C", "offset")[2] == ("applied correction", "um", None)
    assert found("T_bed", "offset")[1] == ("other input", "um", None)


def test_a_load_that_is_never_on_has_the_unit_of_the_other() -> None:
    columns = [Column("Q1", "Q1", "", np.linspace(0, 80, 9)), Column("Q2", "Q2", "", np.zeros(9))]
    assert [one.unit for one in guess_all(columns).values()] == ["percent", "percent"]


def _guessed(*columns: tuple[str, str, float, float]) -> dict[str, Guess]:
    """Guesses of columns that run from one value to another."""
    return guess_all(
        [Column(n, n.replace(" ", "_"), unit, np.linspace(low, high, 50)) for n, unit, low, high in columns]
    )


def test_a_spring_a_cell_and_a_vessel() -> None:
    """What answers is an output, whatever moves it; nothing is heated by a valve."""
    count = np.arange(200.0)
    ring, pulses = np.sin(count / 5), count // 30 % 3 * 5.0
    spring = guess_all([Column("F_N", "F", "N", ring), Column("x_m", "x", "m", ring / 9)])
    assert [one.role for one in spring.values()] == ["other input", "other output"]
    warm = Column("T_cell", "T_cell", "degC", 20 + count / 50)
    cell = guess_all([Column("I", "I", "A", pulses), Column("U", "U", "V", 3 + ring / 9), warm])
    assert [one.role for one in cell.values()] == ["other input", "other output", "temperature"]
    vessel = guess_all([Column("Valve", "Valve", "%", pulses), Column("p", "p", "bar", 2 + ring)])
    assert [one.role for one in vessel.values()] == ["other input", "other output"]


def test_levels_of_tanks_and_inlets_of_an_exchanger() -> None:
    """A length that a flow alone moves is no thermal error; what flows into an exchanger drives it."""
    tanks = _guessed(("pump", "l/min", 1, 6), ("h1", "cm", 0, 20), ("h2", "cm", 0, 15))
    assert [one.role for one in tanks.values()] == ["fluid flow", "other output", "other output"]
    cooled = _guessed(("pump", "l/min", 1, 6), ("T_coolant", "degC", 20, 24), ("Z", "um", 0, 20))
    assert cooled["Z"].role == "error"
    streams = _guessed(*((f"T_{name}", "degC", 20, 40) for name in ("hot_in", "cold_in", "hot_out", "bed")))
    fluid, body = "fluid temperature", "temperature"
    assert [one.role for one in streams.values()] == [fluid, fluid, body, body]


@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_motor_and_two_masses(noise: float) -> None:
    """A speed that answers to a voltage is no input, a displacement that a force makes no thermal error."""
    rng, count = np.random.default_rng(0), np.arange(300.0)
    steps = count // 60 % 3 * 5.0 + noise * rng.standard_normal(300)
    answer = np.convolve(steps, np.exp(-np.arange(60) / 20))[:300] + 0.01 * rng.standard_normal(300)
    motor = [
        Column("U", "U", "V", steps),
        Column("I", "I", "A", answer),
        Column("n", "n", "rpm", 50 * answer),
    ]
    roles = [one.role for one in guess_all(motor).values()]
    assert roles == ["other input", "other output", "other output"]
    masses = [Column("Force", "Force", "N", steps), *(Column(x, x, "mm", answer) for x in ("x1", "x2"))]
    roles = [one.role for one in guess_all(masses).values()]
    assert roles == ["other input", "other output", "other output"]
    warmed = guess_all([*masses, Column("P", "P", "W", steps)])
    assert [one.role for one in warmed.values()][1:] == ["error", "error", "heat load"]


def test_a_voltage_answers_where_a_current_alone_is_set() -> None:
    count = np.arange(300.0)
    set_current = Column("Current", "Current", "A", count // 60 % 3 * 5.0)
    voltage = Column("Voltage", "Voltage", "V", 3 + np.sin(count / 40))
    warm = Column("Temperature", "Temperature", "degC", 20 + count / 50)
    found = guess_all([set_current, voltage, warm])
    assert [one.role for one in found.values()] == ["other input", "other output", "temperature"]
    assert not found["Voltage"].sure
    heated = guess_all([set_current, voltage, warm, Column("Heater", "Heater", "W", count % 50)])
    assert heated["Voltage"].role == "other input"


def test_sensors_on_the_machine_are_inputs_of_its_errors() -> None:
    found = _guessed(("n", "rpm", 0, 900), ("T nut", "degC", 20, 30), ("X", "um", 0, 9))
    assert [one.role for one in found.values()] == ["rotation speed", "other input", "error"]


def test_columns_named_alike_have_one_role() -> None:
    """A sensor that jumps is known by its sisters; X and Z of one probe are both errors."""
    count = np.arange(50.0)
    calm, jumpy = np.linspace(20, 30, 50), 20 + 10.0 * (count // 9 % 2) + count / 97
    columns = [Column(n, n, "", v) for n, v in (("T1", calm), ("T2", calm), ("T3", jumpy))]
    assert {one.role for one in guess_all(columns).values()} == {"temperature"}
    assert not guess(columns[2]).sure
    assert all(one.sure for one in guess_all(columns).values())
    slow = np.linspace(0, 40, 50) ** 0.5
    axes = [Column(n, n, "", v) for n, v in (("X", slow), ("Z", slow + 3.0), ("S1", count % 2 * 900.0))]
    assert [one.role for one in guess_all(axes).values()][:2] == ["error", "error"]


def test_what_goes_to_a_heater_is_asked_about_and_a_heater_is_not() -> None:
    found = _guessed(("DutyCycle", "%", 0, 90), ("Heater", "%", 0, 90))
    assert [one.sure for one in found.values()] == [False, True]


def test_a_voltage_drives_where_nothing_better_is_recorded() -> None:
    for better in ("power", "Current", "spindle speed"):
        assert drives(_guessed(("voltage", "", 0, 9), (better, "", 0, 9))) == [better.replace(" ", "_")]
    assert drives(_guessed(("voltage", "", 0, 9), ("door", "", 0, 1))) == ["voltage"]


def test_what_answers_drives_nothing() -> None:
    """The level of a tank in volts, and a current that is read as an output."""
    for unit in ("V", "A"):
        both = {n: Guess(f"other {n}", unit, "") for n in ("input", "output")}
        assert drives(both) == ["input"]


def test_a_flow_below_one_that_is_no_switch_is_asked_about() -> None:
    assert not _guessed(("flow", "", 0.1, 0.7))["flow"].sure  # a share, or litres a minute
    assert guess(Column("pump", "pump", "", np.arange(50.0) % 2)).sure


def test_loads_of_one_kind_have_one_unit() -> None:
    watts = _guessed(("Ph1", "", 0, 11), ("Ph2", "", -0.1, 14))
    assert [one.unit for one in watts.values()] == ["W", "W"]
    percent = _guessed(("heater1", "", 0, 80), ("heater2", "", 0, 5))
    assert [one.unit for one in percent.values()] == ["percent", "percent"]


@pytest.mark.parametrize(
    ("names", "roles"),
    [
        (["T_room1", "T_room2", "T_ambient"], ["measured", "measured", "air"]),
        (["yTi1", "Ta"], ["measured", "air"]),
        (["T_room", "Ta"], ["measured", "air"]),
        (["T_air", "T_room"], ["air", "measured"]),
        (["T_air_spindle", "T_hall"], ["measured", "air"]),
        (["T_table", "T_room"], ["measured", "air"]),
        (["T_table", "T_room1", "T_room2"], ["measured", "air", "measured"]),
        (["T_room1", "T_room2"], ["measured", "measured"]),  # nothing else is
        (["T_ambient", "T_outside", "T_bed"], ["air", "air", "measured"]),
    ],
)
def test_of_several_rooms_the_clearest_is_the_air_around(names: list[str], roles: list[str]) -> None:
    words = {"measured": "temperature", "air": "ambient temperature"}
    found = _guessed(*((name, "degC", 18.0, 24.0) for name in names))
    assert [one.role for one in found.values()] == [words[role] for role in roles]
    rooms = [one for name, one in found.items() if "room" in name and one.role == "temperature"]
    assert not any(one.sure for one in rooms)


@pytest.mark.parametrize(
    ("others", "role"),
    [
        (["coolant_flow"], "fluid temperature"),
        (["pump"], "fluid temperature"),
        ([], "coolant temperature"),
        (["coolant_flow", "T_emulsion"], "coolant temperature"),
        (["coolant_flow", "T_chiller"], "coolant temperature"),  # one of two: who knows
    ],
)
def test_the_only_coolant_beside_a_flow_is_its_fluid(others: list[str], role: str) -> None:
    found = _guessed(*((name, "", 18.0, 24.0) for name in ["T_coolant", *others, "T_motor"]))
    assert found["T_coolant"].role == role
    if role == "fluid temperature":
        assert not found["T_coolant"].sure
        assert f"the fluid of {others[0]}" in found["T_coolant"].why


@pytest.mark.parametrize(
    ("columns", "unit", "sure"),
    [
        ([("T1", "", 60.0, 61.0)], "degC", False),  # an incubator as well as a room
        ([("T1", "", 60.0, 61.0), ("T2", "", 70.0, 75.0)], "degF", False),
        ([("T1", "", 60.0, 61.0), ("T2", "", 22.0, 25.0)], "degC", True),
        ([("T1", "", 60.0, 61.0), ("T2", "°F", 70.0, 75.0)], "degF", True),
        ([("T1", "", 60.0, 61.0), ("T3", "", 60.0, 61.0), ("T2", "°C", 60.0, 75.0)], "degC", False),
    ],
)
def test_fahrenheit_needs_more_than_one_witness(
    columns: list[tuple[str, str, float, float]], unit: str, sure: bool
) -> None:
    assert (_guessed(*columns)["T1"].unit, _guessed(*columns)["T1"].sure) == (unit, sure)


def _file(folder: Path, *lines: str) -> Path:
    path = folder / "own.csv"
    path.write_text("\n".join(lines), "utf-8")
    return path


def test_a_row_of_units_is_read(tmp_path: Path) -> None:
    table = read_own(
        _file(tmp_path, "t\tT1\tP", "h\t°F\tkW", *(f"{k / 10}\t{70 + k}\t{k}" for k in range(20)))
    )
    assert table.time[1] == pytest.approx(360.0)
    assert [(c.name, c.unit) for c in table.columns] == [("T1", "°F"), ("P", "kW")]


def test_instants_of_a_logger(tmp_path: Path) -> None:
    rows = [f"01.03.2026 08:{k:02d}:30;{k},5" for k in range(15)]
    table = read_own(_file(tmp_path, "Zeit;T bed", *rows))
    assert table.time[-1] == pytest.approx(14 * 60.0)
    assert table.columns[0].name == "T_bed"
    assert table.columns[0].values[3] == 3.5


CLOCKS = [
    (["Date,Time,T1", *(f"2021-01-15,23:59:{58 - 10 + k:02d},{k}" for k in range(12))], 11.0),
    (["Time,T1", *(f"1/15/2021 11:{48 + k}:00 AM,{k}" for k in range(12))], 660.0),
    (
        ["Time,T1", *(f"{(23 * 60 + 55 + k) // 60 % 24:02d}:{(55 + k) % 60:02d},{k}" for k in range(12))],
        660.0,
    ),
    (["timestamp,T1", *(f"{1685183986928 + 2000 * k},{k}" for k in range(12))], 22.0),
    (["Test Time (min),T1", *(f"{k / 10},{k}" for k in range(12))], 66.0),
    (["T1,elapsed", *(f"{9 - k},{k}" for k in range(12))], 11.0),
    (["time    T1", *(f" {k}   {k / 2}" for k in range(12))], 11.0),
]


@pytest.mark.parametrize(("lines", "last"), CLOCKS)
def test_clocks_of_many_kinds(tmp_path: Path, lines: list[str], last: float) -> None:
    table = read_own(_file(tmp_path, *lines))
    assert table.time[-1] == pytest.approx(last)
    assert [c.name for c in table.columns] == ["T1"]


def test_rows_of_one_stamp_are_spread(tmp_path: Path) -> None:
    table = read_own(_file(tmp_path, "time,T1", *(f"{k // 4},{k}" for k in range(40))))
    np.testing.assert_allclose(np.diff(table.time), 0.25)
    assert "30 rows have the time of the row before" in table.notes[0]


def test_what_a_logger_writes_above_and_between(tmp_path: Path) -> None:
    lines = [
        "# a remark, with commas, many, many",
        "Device;TC-08",
        "Serial;123;4",
        ";time;T1;door;note;spare",
    ]
    rows = [f"{k};{k / 2};{20 + k},5;{'True' if k > 5 else 'False'};ready;" for k in range(12)]
    table = read_own(_file(tmp_path, *lines, *rows))
    assert [c.name for c in table.columns] == ["T1", "door"]
    assert table.time[-1] == 5.5
    assert table.columns[0].values[1] == 21.5
    assert table.columns[1].values.tolist() == [0.0] * 6 + [1.0] * 6
    assert len(table.notes) == 4  # lines above, the count of rows, words, nothing


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (["time,T1", *(f"{k},{k}" for k in range(12)), "12,x"], r"line 14, column 'T1': 'x' is not a number"),
        (
            ["time,T1", *(f"{k},{k}" for k in range(12)), "5,6"],
            r"line 14: the time does not run forward.*line 7 already",
        ),
        (["time,T1", *(f"{k},{k}" for k in range(12)), "12,5,6"], r"line 14: 3 cells where the header has 2"),
        (["T1,T2", *("1,2" for _ in range(12))], "no column of time was found.* or add one"),
        # a motor that warms is no clock, though it never falls
        (
            ["T1,T2", *(f"{k % 3},{28 + 4 * (1 - 0.9**k):.3f}" for k in range(30))],
            "no column of time was found",
        ),
        ([f"{k},0,{299.5 + k}" for k in range(12)], r"line 1: numbers where the names .* line of 3 names"),
        (["T (a)", *(f"{k},{k}" for k in range(12))], "no header above the rows of 2 cells"),
        (["time,T1", "0,1", "1,2"], "only 2 rows"),
        (
            ["lab 3", "time,a,T1", *(f"{k},{k}" for k in range(12))],
            "line 2: the header has 3 names, the rows 2 cells; a name too many",
        ),
        (
            ["time,T1", *(f"{k},{k},{k}" for k in range(12))],
            "line 1: the header has 2 names, the rows 3 cells; add the missing names",
        ),
    ],
)
def test_what_is_wrong_is_said_with_its_line(tmp_path: Path, lines: list[str], said: str) -> None:
    with pytest.raises(UserError, match=said):
        read_own(_file(tmp_path, *lines))


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="there is no such file"):
        read_own(tmp_path / "none.csv")


@pytest.mark.parametrize("nothing", ["NaN", "NAN", "nan", "NA", "null", "-", "", "#N/A", "None"])
def test_a_first_row_that_holds_nothing_is_no_row_of_units(tmp_path: Path, nothing: str) -> None:
    rows = [f"{10 * k},{20 + k * k / 9},{k % 3}" for k in range(1, 15)]
    table = read_own(_file(tmp_path, "time,T1,heater1", f"0,{nothing},{nothing}", *rows))
    assert len(table.time) == 15
    assert [(c.name, c.unit) for c in table.columns] == [("T1", ""), ("heater1", "")]
    assert np.isnan(table.columns[0].values[0])


def test_a_row_of_units_may_say_that_there_is_none(tmp_path: Path) -> None:
    table = read_own(_file(tmp_path, "time,T1,door", "s,-,n/a", *(f"{k},{k * k},{k % 2}" for k in range(15))))
    assert [(c.name, c.unit) for c in table.columns] == [("T1", "-"), ("door", "")]


@pytest.mark.parametrize(("of_names", "of_rows"), [(",", ""), ("", ","), (",", ",")])
def test_a_mark_at_the_end_of_a_line_ends_no_column(tmp_path: Path, of_names: str, of_rows: str) -> None:
    rows = [f"{k},{20 + k * k}{of_rows}" for k in range(15)]
    table = read_own(_file(tmp_path, "logger 7", f"time,T1{of_names}", *rows))
    assert [(c.name, c.values[3]) for c in table.columns] == [("T1", 29.0)]


def _stamped(first: datetime, form: str, minutes: float, count: int = 40) -> list[str]:
    stamps = [first + timedelta(minutes=minutes * k) for k in range(count)]
    return ["Time,T1", *(f"{stamp.strftime(form)},{20 + k * k / 9}" for k, stamp in enumerate(stamps))]


@pytest.mark.parametrize(
    ("form", "read"), [("%m/%d/%Y %H:%M", "month/day/year"), ("%d/%m/%Y %H:%M", "day/month/year")]
)
def test_a_date_that_reads_two_ways_has_even_steps(tmp_path: Path, form: str, read: str) -> None:
    """Not from March to February, nor to the next month; a pause leaves a doubt."""
    table = read_own(_file(tmp_path, *_stamped(datetime(2026, 3, 1, 23), form, 5.0)))
    assert table.time[-1] == pytest.approx(39 * 300.0)
    assert "?" not in table.about_time
    rows = _stamped(datetime(2026, 3, 1, 23), form, 5.0)
    table = read_own(_file(tmp_path, *rows[:5], *rows[9:]))
    assert table.time[-1] == pytest.approx(39 * 300.0)
    assert f"? dates read as {read}" in table.about_time


def test_a_date_that_reads_one_way_is_not_asked_about(tmp_path: Path) -> None:
    for first, minutes in ((datetime(2026, 3, 13, 23), 5.0), (datetime(2026, 3, 1, 8), 5.0)):
        table = read_own(_file(tmp_path, *_stamped(first, "%m/%d/%Y %H:%M", minutes)))
        assert table.time[-1] == pytest.approx(39 * 300.0)
        assert "?" not in table.about_time


@pytest.mark.parametrize(
    ("name", "why"),
    [("T1", "'T' in its name"), ("T_Ambient", "'Ambient'"), ("DutyCycle", "'DutyCycle' in")],
)
def test_a_name_is_quoted_as_it_is_spelled(name: str, why: str) -> None:
    assert why in guess(Column(name, name, "", np.linspace(20, 30, 50))).why


def test_what_never_holds_its_value_is_an_output_where_nothing_thermal_is_measured() -> None:
    set_by_hand = np.repeat([0.0, 2.0, 5.0, 1.0], 50)
    answer = np.convolve(set_by_hand, np.exp(-np.arange(60) / 20))[:200] + np.linspace(0, 1e-3, 200)
    columns = [Column("U [V]", "U", "V", answer), Column("I [A]", "I", "A", set_by_hand)]
    assert [one.role for one in guess_all(columns).values()] == ["other output", "other input"]
    warm = Column("T bearing", "T_bearing", "degC", 20 + answer)
    assert guess_all([*columns, warm, Column("P", "P", "W", set_by_hand)])["U"].role == "other input"


@pytest.mark.parametrize(
    ("header", "role", "unit"),
    [
        ("room_degC", "ambient temperature", "degC"),
        ("T_room_degC", "ambient temperature", "degC"),
        ("hall_C", "ambient temperature", "degC"),
        ("coolant_C", "coolant temperature", "degC"),
        ("spindle_um", "error", "um"),
        ("load_kW", "heat load", "kW"),
    ],
)
def test_a_unit_behind_a_name_is_no_doubt(tmp_path: Path, header: str, role: str, unit: str) -> None:
    """A table of a room, a bed, an error and a load; one of its headers is the one that is asked for."""
    k = np.arange(200)
    slow = np.cumsum(np.sin(k / 15)) / 30
    load = np.repeat(np.tile([0.0, 2.5, 5.0, 1.0], 10), 5)
    columns = {"room_degC": 21 + slow, "bed_degC": 25 + 3 * slow, "dz_um": 9 * slow, "load_kW": load}
    alike = {
        "ambient temperature": "room_degC",
        "coolant temperature": "",
        "error": "dz_um",
        "heat load": "load_kW",
    }
    series = columns.pop(alike[role], 20 + slow)
    columns = {header: series, **columns}
    path = tmp_path / "own.csv"
    pd.DataFrame({"time_s": 60 * k, **columns}).to_csv(path, index=False)
    table = read_own(path)
    one = guess_all(table.columns)[table.columns[0].name]
    assert (one.role, one.unit, one.sure) == (role, unit, True)
