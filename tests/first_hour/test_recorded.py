"""What `discovery new` takes, what it leaves out, and that nothing of it comes from the unseen recording."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.firsthour.recorded import recorded
from discovery.firsthour.table import read_tables

Row = Callable[[int], str]


def _made(folder: Path, header: str, *files: Row, rows: int = 60) -> tuple[str, Path]:
    """What `discovery new` prints on files of such rows, and the folder that it made."""
    command = ["new", str(folder / "rig"), "--quick"]
    for number, row in enumerate(files):
        lines = [header, *(row(k) for k in range(rows))]
        (folder / f"run{number}.csv").write_text("\n".join(lines), "utf-8")
        command += ["--from", str(folder / f"run{number}.csv")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    return result.output, folder / "rig"


def _campaign(rig: Path) -> dict[str, Any]:
    return tomllib.loads((rig / "campaign.toml").read_text("utf-8"))


SEEN: Row = lambda k: f"{k},{40 * (k // 9 % 2)},{25 + k % 20 / 9},{k % 7 // 6},21"  # noqa: E731
UNSEEN: tuple[Row, ...] = (
    lambda k: f"{k},{40 * (k // 9 % 2)},{24 + k % 20 / 9},0,21",
    lambda k: f"{k},{900 * (k // 9 % 2)},{5 + k % 30 / 9},7,{k}",
    lambda k: f"{k},-3,{320 + k % 20 / 9},{'' if k % 50 else 3},{80 - k % 5}",
)


def test_nothing_is_guessed_from_the_unseen_recording(tmp_path: Path) -> None:
    made = []
    for number, unseen in enumerate(UNSEEN):
        (tmp_path / str(number)).mkdir()
        _, rig = _made(tmp_path / str(number), "time,P,T1,fault,T2", SEEN, unseen)
        made.append(
            [(rig / f"{name}.toml").read_text("utf-8") for name in ("campaign", "model", "experiment")]
        )
    assert made[0] == made[1] == made[2]


def test_nothing_is_guessed_from_the_unseen_last_third(tmp_path: Path) -> None:
    made = []
    for number, unseen in enumerate(UNSEEN):
        (tmp_path / str(number)).mkdir()
        row = lambda k, unseen=unseen: SEEN(k) if k < 40 else unseen(k)  # noqa: E731
        _, rig = _made(tmp_path / str(number), "time,P,T1,fault,T2", row)
        made.append(
            [(rig / f"{name}.toml").read_text("utf-8") for name in ("campaign", "model", "experiment")]
        )
    assert made[0] == made[1] == made[2]


@pytest.mark.parametrize("name", ["t", "hour", "T9", "whatever"])
def test_a_column_in_proportion_to_the_time_is_a_clock(tmp_path: Path, name: str) -> None:
    said, rig = _made(
        tmp_path,
        f"date,{name},T1",
        lambda k: f"2026-03-{1 + k // 24:02d} {k % 24:02d}:00,{1233 + k},{20 + k % 7}",
    )
    assert f"column '{name}' is a clock, in exact proportion to the time: left out" in said
    assert set(_campaign(rig)["channels"]) == {"T1", "T_env"}


@pytest.mark.parametrize(
    ("name", "row", "said"),
    [
        ("Relative timestamp [s]", lambda k: k * 9 // 10, "rises steadily with the time, as a second clock"),
        ("Step time", lambda k: k % 20, "is a clock that starts anew"),
        ("ticks", lambda k: 3 * k + k % 2, "rises steadily with the time, as a second clock"),
        ("Entry ID", lambda k: 7 + k + k % 2, "numbers rows or devices"),
        ("NodeID", lambda k: 1 + k // 9 % 4 // 3, "numbers rows or devices"),
        ("Cycle Index", lambda k: k // 9, "numbers rows or devices"),
        ("Loop Counter #1", lambda k: k // 9, "numbers rows or devices"),
        ("Amp-Hours", lambda k: -(k // 9) / 7, "is a counter that only runs on"),
        ("Heating energy [kWh]", lambda k: k * k / 7, "is a counter that only runs on"),
    ],
)
def test_what_keeps_the_books_is_no_input(
    tmp_path: Path, name: str, row: Callable[[int], float], said: str
) -> None:
    out, rig = _made(tmp_path, f"time,{name},T1", lambda k: f"{k},{row(k)},{20 + k % 7}")
    assert f"column '{name}' {said}: left out" in out
    assert set(_campaign(rig)["channels"]) == {"T1", "T_env"}


@pytest.mark.parametrize(
    ("name", "row"),
    [
        ("T2", lambda k: 20 + k / 9 + k * k / 1e4),
        ("Temperature ID 7", lambda k: 20 + k + k % 2),
        ("T_row_number [°C]", lambda k: 20 + k),
        ("voltage", lambda k: k / 9 + k % 2 / 20),
        ("heater", lambda k: k + k % 2 / 9),
        ("motor id", lambda k: k % 3),  # a current
        ("Number of occupants", lambda k: k // 9 % 4),
        ("valve [mm]", lambda k: k + k % 2 / 9),
        ("charging energy [kWh]", lambda k: k % 9),  # falls: no counter
        ("running time", lambda k: k % 2),
    ],
)
def test_what_is_measured_or_acts_keeps_no_books(
    tmp_path: Path, name: str, row: Callable[[int], float]
) -> None:
    out, _ = _made(tmp_path, f"time,{name},T1", lambda k: f"{k},{row(k)},{20 + k % 7}")
    assert ": left out" not in out


def test_a_ramp_is_no_clock(tmp_path: Path) -> None:
    row: Row = lambda k: f"{k},{k},{k / 9},{20 + k % 7}"  # noqa: E731
    _, rig = _made(tmp_path, "time,P [W],heater,T1", row)
    assert {"P", "heater"} <= set(_campaign(rig)["channels"])


def test_a_ramp_in_one_recording_of_several_is_no_clock(tmp_path: Path) -> None:
    ramp: Row = lambda k: f"{k},{k},{20 + k % 7}"  # noqa: E731
    steps: Row = lambda k: f"{k},{k // 9 % 2},{20 + k % 7}"  # noqa: E731
    _, rig = _made(tmp_path, "time,heater,T1", ramp, steps, steps)
    assert "heater" in _campaign(rig)["channels"]


@pytest.mark.parametrize(
    "name",
    ["Setpoint [C]", "Target", "SP", "T_set", "Sollwert", "T_room_set", "temp setpoint", "T_soll [°C]"],
)
def test_a_set_point_is_neither_room_nor_output(tmp_path: Path, name: str) -> None:
    said, rig = _made(
        tmp_path, f"time,heater,T1,{name}", lambda k: f"{k},{k % 3},{20 + k % 7},{50 + k // 30}"
    )
    assert f"column '{name}' is a set point, no measurement: left out" in said
    assert set(_campaign(rig)["channels"]) == {"heater", "T1", "T_env"}


@pytest.mark.parametrize("name", ["speed_set", "Setpoint [%]", "P_target [W]", "offset", "T_settled"])
def test_other_set_points_stay(tmp_path: Path, name: str) -> None:
    said, _ = _made(tmp_path, f"time,{name},T1", lambda k: f"{k},{k % 3},{20 + k % 7}")
    assert "left out" not in said


@pytest.mark.parametrize(
    ("first", "second", "room", "spread"),
    [
        (25.0, 25.4, 25.2, 2.0),  # a machine that stood overnight
        (25.0, 31.0, 22.0, 5.0),  # one that did not
        (69.8, 70.0, 22.0, 5.0),
        (-4.0, -4.2, 22.0, 5.0),
    ],
)
def test_a_room_that_nobody_measured_is_an_unknown(
    tmp_path: Path, first: float, second: float, room: float, spread: float
) -> None:
    said, rig = _made(
        tmp_path, "time,P,T1 [C],T2 [C]", lambda k: f"{k},{k % 3},{first + k // 5},{second + k // 5}"
    )
    made = _campaign(rig)
    assert made["recordings"]["first_part"]["set"] == {"T_env": room}
    assert made["recordings"]["last_part"]["set"] == {"T_env": room}
    assert made["channels"]["T_env"]["spread"] == spread
    first_line = next(line for line in said.splitlines() if "room" in line)
    assert first_line.startswith("no room temperature was recorded: T_env is an unknown of each recording")
    assert first_line in (rig / "campaign.toml").read_text("utf-8")


def test_a_single_sensor_shows_no_room(tmp_path: Path) -> None:
    _, rig = _made(tmp_path, "time,P,T1 [C]", lambda k: f"{k},{k % 3},{25 + k // 5}")
    assert _campaign(rig)["channels"]["T_env"]["spread"] == 5.0


def test_nothing_stands_for_a_room_that_would_drive_errors(tmp_path: Path) -> None:
    said, rig = _made(tmp_path, "time,P [W],E_Z [um]", lambda k: f"{k},{k % 3},{k * k / 90:.2f}")
    assert "none is assumed" in said
    assert "T_env" not in _campaign(rig)["channels"]


def test_a_column_may_stand_for_the_room(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(
        "\n".join(
            [
                "time,P [W],T1 [C],roof [C]",
                *(f"{k},{k % 3},{25 + k // 5},{12 + k / 30:.1f}" for k in range(60)),
            ]
        )
    )
    result = CliRunner().invoke(
        app, ["new", str(tmp_path / "rig"), "--quick", "--room", "roof", "--from", str(tmp_path / "run.csv")]
    )
    assert result.exit_code == 0, result.output
    channels = _campaign(tmp_path / "rig")["channels"]
    assert channels["roof"]["role"] == "ambient temperature"
    assert "T_env" not in channels


def test_rooms_beside_the_air_outside_are_outputs(tmp_path: Path) -> None:
    _, rig = _made(
        tmp_path,
        "time,T_room1 [degC],T_room2 [degC],T_ambient [degC],heating [kW]",
        lambda k: f"{k},{20 + k % 7},{21 + k % 5},{5 + k % 3},{k % 4}",
    )
    assert tomllib.loads((rig / "experiment.toml").read_text("utf-8"))["outputs"] == ["T_room1", "T_room2"]
    assert "T_ambient - T_room1" in (rig / "model.toml").read_text("utf-8")


def test_a_column_that_is_empty_where_models_are_fitted_stays_out(tmp_path: Path) -> None:
    said, rig = _made(tmp_path, "time,P,T1,T2", lambda k: f"{k},{k % 3},{20 + k % 7},{'' if k < 40 else 20}")
    assert "column 'T2' has no values in the recordings to fit: left out" in said
    assert "T2" not in _campaign(rig)["channels"]


def test_a_room_in_japanese_and_empty_cells_behind_the_last_tab(tmp_path: Path) -> None:
    rows = [f"{k}\t{21 + k % 5 / 9}\t{100 * (k // 9 % 2)}\t{'' if k % 9 else k / 7}" for k in range(90)]
    text = "\n".join(["経過時間[分]\t室温[℃]\t主軸電力[W]\t変位X[μm]", *rows])
    (tmp_path / "run.txt").write_bytes(text.encode("shift_jis"))
    command = ["new", str(tmp_path / "rig"), "--quick", "--from", str(tmp_path / "run.txt")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0, result.output
    channels = _campaign(tmp_path / "rig")["channels"]
    assert channels["room"] == {"role": "ambient temperature", "unit": "degC"}
    assert channels["disp_X"]["role"] == "error"


POLISH = "Płyta lewa [°C],Moc grzałki [mW]"


@pytest.mark.parametrize(
    ("header", "encoding", "names"),
    [
        (POLISH, "cp1250", {"Plyta_lewa", "Moc_grzalki"}),
        ("Strömung [m³/h],Temp. Gehäuse [°C]", "cp1252", {"Stroemung", "Temp_Gehaeuse"}),
        ("主轴功率(W),X轴温度(℃)", "gbk", {"spindle_power", "X_temp"}),
    ],
)
def test_names_in_code_pages(header: str, encoding: str, names: set[str], tmp_path: Path) -> None:
    rows = [f"{k},{100 * (k // 20 % 2)},{20 + k % 9 / 7}" for k in range(120)]
    (tmp_path / "Körning 1.csv").write_bytes("\n".join([f"time,{header}", *rows]).encode(encoding))
    [table] = read_tables(tmp_path / "Körning 1.csv")
    assert {column.name for column in table.columns} == names


def test_recordings_have_the_names_of_their_files_in_ascii(tmp_path: Path) -> None:
    rows = [f"{k},{k % 3},{20 + k % 7}" for k in range(90)]
    paths = [tmp_path / f"Körning {k}.csv" for k in (1, 2)]
    for path in paths:
        path.write_text("\n".join(["time,P [W],T [°C]", *rows]), "utf-8")
    assert list(recorded([table for path in paths for table in read_tables(path)], None).recordings) == [
        "Koerning_1",
        "Koerning_2",
    ]


def test_kelvin_of_a_machine_with_errors_becomes_celsius(tmp_path: Path) -> None:
    """Models count degC from the room; kelvin would count from absolute zero."""
    header = "time [min],T body [K],T rise [K],Disp. Z [um]"
    row: Row = lambda k: f"{k},{295 + k / 9:.2f},{k / 9:.2f},{k / 3:.2f}"  # noqa: E731
    said, rig = _made(tmp_path, header, row, row, row)
    assert "'T_body': converted from kelvin to degC" in said
    channels = _campaign(rig)["channels"]
    assert (channels["T_body"]["unit"], channels["T_rise"]["unit"]) == ("degC", "K")
    assert _read(rig, "run0", "T_body")[0] == pytest.approx(21.85)


def _probe(zero: float, further: float = 0.0) -> Row:
    """A bed that is heated, a probe with an arbitrary zero that follows it, and the number of the sample."""
    return lambda k: f"{k},{k // 3},{21 + k % 5 / 9},{25 + k * k / 90},{zero + further * (k == 59) - k / 2}"


def _read(rig: Path, recording: str, column: str) -> list[float]:
    header, *rows = (line.split(",") for line in (rig / f"{recording}.csv").read_text("utf-8").splitlines())
    return [float(row[header.index(column)]) for row in rows]


def test_an_error_far_from_zero_is_counted_from_its_first_reading(tmp_path: Path) -> None:
    out, rig = _made(tmp_path, "time,sample,T_room,T_bed,dZ_um", _probe(-80532), _probe(-3051))
    assert "'dZ' starts at -80532 in run0, far from zero" in out
    assert "column 'sample' numbers rows or devices: left out" in out
    for recording in ("run0", "run1"):
        assert _read(rig, recording, "dZ") == [-k / 2 for k in range(60)]
    rms = float(f"{np.sqrt(np.mean((np.arange(60) / 2) ** 2)):.2g}")
    assert _campaign(rig)["channels"]["dZ"] == {"role": "error", "unit": "um", "spread": rms}


def test_errors_that_start_far_from_each_other_have_zeros_of_their_own(tmp_path: Path) -> None:
    """Neither starts three times as far from zero as it then moves."""
    _, rig = _made(tmp_path, "time,sample,T_room,T_bed,dZ_um", _probe(70), _probe(-5), _probe(20))
    assert _campaign(rig)["channels"]["dZ"]["spread"] > 0
    for recording in ("run0", "run1", "run2"):
        assert _read(rig, recording, "dZ") == [-k / 2 for k in range(60)]
    (tmp_path / "near").mkdir()
    _, rig = _made(tmp_path / "near", "time,sample,T_room,T_bed,dZ_um", _probe(10), _probe(-5), _probe(20))
    assert "spread" not in _campaign(rig)["channels"]["dZ"]
    assert _read(rig, "run0", "dZ")[0] == 10


def test_a_wrong_first_reading_is_no_zero(tmp_path: Path) -> None:
    wrong: Row = lambda k: _probe(-80532 + 4300 * (k < 2))(k)  # noqa: E731
    _, rig = _made(tmp_path, "time,sample,T_room,T_bed,dZ_um", wrong, _probe(-3051))
    assert _read(rig, "run0", "dZ")[2:] == [-k / 2 for k in range(58)]


def test_an_error_that_a_person_names_later_is_counted_from_its_first_reading(tmp_path: Path) -> None:
    """In the campaign file, with --again: as --is says it at once."""
    probes = _probe(-80532), _probe(-3051), _probe(12)
    out, rig = _made(tmp_path, "time,sample,T_room,T_bed,mcu_pos_z", *probes)
    assert "predicted: T_bed; no column was recognised as an error: if one is, say so, as in" in out
    assert '--is "mcu_pos_z=error,um"' in out
    text = (rig / "campaign.toml").read_text("utf-8")
    text = re.sub(r"mcu_pos_z *= .*", 'mcu_pos_z = { role = "error", unit = "um" }', text)
    (rig / "campaign.toml").write_text(text, "utf-8")
    before = _read(rig, "run1", "T_bed")
    for said in (
        "write spread = 17 into the line of 'mcu_pos_z' in campaign.toml",
        "",
    ):  # once, and not again
        again = CliRunner().invoke(app, ["new", str(rig), "--again", "--quick"])
        assert again.exit_code == 0, again.output
        assert said in again.output
    assert "far from zero" not in again.output
    for recording in ("run0", "run1", "run2"):
        assert _read(rig, recording, "mcu_pos_z") == [-k / 2 for k in range(60)]
    assert _read(rig, "run1", "T_bed") == before


def test_what_a_person_says_needs_the_files(tmp_path: Path) -> None:
    _, rig = _made(tmp_path, "time,sample,T_room,T_bed,dZ_um", _probe(7), _probe(9))
    again = CliRunner().invoke(app, ["new", str(rig), "--again", "--is", "dZ=error,mm"])
    assert again.exit_code == 2
    assert "--is and --room need --from" in again.output


def test_parts_of_one_file_keep_its_zero(tmp_path: Path) -> None:
    _, rig = _made(tmp_path, "time,sample,T_room,T_bed,dZ_um", _probe(500))
    both = _read(rig, "first_part", "dZ") + _read(rig, "last_part", "dZ")
    assert both == [-k / 2 for k in range(60)]


def test_an_error_that_starts_near_zero_keeps_it(tmp_path: Path) -> None:
    out, rig = _made(tmp_path, "time,sample,T_room,T_bed,dZ_um", _probe(7), _probe(9))
    assert "counted from its first reading" not in out
    assert _read(rig, "run0", "dZ")[0] == 7


def test_a_position_that_never_jumps_is_asked_about(tmp_path: Path) -> None:
    """With a zero of its own in each file, its span is that of a file."""
    out, _ = _made(tmp_path, "time,sample,T_room,T_bed,mcu_pos_z", _probe(-80532), _probe(-3051), _probe(12))
    [line] = [one for one in out.splitlines() if one.startswith("  mcu_pos_z")]
    assert " ? " in line


def test_sensors_are_inputs_of_an_error_that_a_person_names(tmp_path: Path) -> None:
    header, row = "time,T_room,T_bed,CH1", _probe(0)
    lines = [header, *(row(k).replace(f",{k // 3},", ",", 1) for k in range(60))]
    (tmp_path / "run.csv").write_text("\n".join(lines), "utf-8")
    command = ["new", str(tmp_path / "rig"), "--quick", "--is", "CH1=error,um"]
    result = CliRunner().invoke(app, [*command, "--from", str(tmp_path / "run.csv")])
    assert result.exit_code == 0, result.output
    assert _campaign(tmp_path / "rig")["channels"]["T_bed"]["role"] == "other input"


def test_a_battery_is_told_how_to_get_thermal_masses(tmp_path: Path) -> None:
    """Its voltage answers to the current as its temperature does, but no thermal mass explains a voltage."""
    step = np.arange(200)
    current = 2.0 * (step % 40 < 20)
    rows = zip(step * 10, current, 3.7 - 0.05 * current - step / 900, 20 + 5 * np.sin(step / 60), strict=True)
    lines = [",".join(f"{value:.4f}" for value in row) for row in rows]
    cell = tmp_path / "cell.csv"
    cell.write_text("\n".join(["time [s],current [A],voltage [V],T_cell [degC]", *lines]), "utf-8")
    said = CliRunner().invoke(app, ["new", str(tmp_path / "rig"), "--from", str(cell), "--quick"])
    assert 'thermal masses leave out what is none: --is "voltage [V]=other input"' in said.output


def test_a_run_that_alone_warms_the_machine_is_fitted(tmp_path: Path) -> None:
    """An idle run before it says nothing of a load. Nor is the load judged from the idle run."""
    idle: Row = lambda k: f"{k},{0.1 - k % 3 / 100},{40 + k % 5 / 9},1500016128,{99 - k // 50}"  # noqa: E731
    stress: Row = lambda k: f"{k},{min(4, k / 9)},{40 + min(k, 30)},{1.5e9 + k % 9 * 1e8},{99 - k // 9}"  # noqa: E731
    header = "t_s,load1,temp_c,arm_hz,batt_pct"
    output, rig = _made(tmp_path, header, idle, stress)
    assert "recordings: fit run1; held out run0" in output
    assert "0 to 4 taken" in output
    channels = _campaign(rig)["channels"]
    assert (channels["arm"]["role"], channels["arm"]["unit"]) == ("other input", "Hz")  # a clock, no spindle
    (tmp_path / "again").mkdir()
    output, _ = _made(tmp_path / "again", header, stress, idle)
    assert "recordings: fit run0; held out run1" in output


def test_a_guess_is_no_advice(tmp_path: Path) -> None:
    """A percentage that never moves is kept as what nobody knows, not as a load that a guess makes of it."""
    row: Row = lambda k: f"{k},{40 * (k // 9 % 2)},{25 + k % 20 / 9},99"  # noqa: E731
    output, _ = _made(tmp_path, "time,P,T1,batt_pct", row, row)
    assert 'to keep it: --is "batt_pct=other input"' in output
