"""Files as outsiders bring them: what was read wrongly once."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.firsthour.guess import guess
from discovery.firsthour.new import new
from discovery.firsthour.recorded import recorded
from discovery.firsthour.stamps import spread_evenly
from discovery.firsthour.table import Column, read_own
from discovery.firsthour.tableguess import guess_all
from discovery.recordings import load_campaign
from discovery.recordings.check import check_campaign


def write(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def test_a_logger_that_writes_tag_and_value_on_change(tmp_path: Path) -> None:
    """A blank in the stamp is no mark between cells, and the last rows are readings."""
    lines = ["Time;Tag;Value;Quality"]
    for k in range(120):
        at = f"2026-03-27 06:{k // 60:02d}:{k % 60:02d}.000"
        lines += [f"{at};Spindle.Speed;{1000 + 7 * (k % 9)};Good", f"{at};Head.Temp;{20 + 0.01 * k:.2f};Good"]
    table = read_own(write(tmp_path / "change.csv", *lines))
    assert [c.name for c in table.columns] == ["Spindle_Speed", "Head_Temp"]
    assert len(table.time) == 120
    assert table.columns[1].values[-1] == pytest.approx(21.19)
    assert not any("left out" in note for note in table.notes)


def test_a_column_of_states_is_left_out_though_one_of_them_is_a_switch(tmp_path: Path) -> None:
    rows = [f"{k};{('AUTO', 'JOG', 'STOP')[k // 5 % 3]};{k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "plc.csv", "t/s;Mode;T1 [°C]", *rows))
    assert [c.name for c in table.columns] == ["T1"]
    assert "column 'Mode' holds words: left out (AUTO, JOG, STOP)" in table.notes[0]


SPRING, OTHER = datetime(2026, 3, 28, 22, 0), datetime(2026, 3, 27, 22, 0)


@pytest.mark.parametrize(
    ("begin", "zone", "hours"),
    [(SPRING, "", 8.0), (SPRING, "+01:00", 9.0), (OTHER, "", 9.0)],
    ids=["summer time begins", "with a time zone", "a pause in another night"],
)
def test_the_hour_that_clocks_skip_in_spring(
    tmp_path: Path, begin: datetime, zone: str, hours: float
) -> None:
    """From 2 to 3 at night no row: on the night of the change no time passed, else the logger paused."""
    lines = ["Zeitstempel;T1 [°C]"]
    for k in range(481):
        at = begin + timedelta(minutes=k)
        at += timedelta(hours=at.hour in range(2, 12))
        lines.append(f"{at:%Y-%m-%dT%H:%M:%S}{zone};{20 + k % 7}")
    table = read_own(write(tmp_path / "night.csv", *lines))
    assert table.time[-1] == hours * 3600.0
    assert any("start of summer time" in note for note in table.notes) is (hours == 8.0)


@pytest.mark.parametrize("hours", [6, 24])
def test_stamps_that_are_hours_apart_show_no_clock_that_was_moved(tmp_path: Path, hours: int) -> None:
    """A gauge of a river, read once a day: an hour was taken out at the first of all dates of a change."""
    begin = datetime(2026, 3, 1)
    lines = ["date;T1 [°C]"]
    lines += [f"{begin + timedelta(hours=hours * k):%Y-%m-%dT%H:%M:%S};{20 + k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "days.csv", *lines))
    assert set(np.diff(table.time)) == {3600.0 * hours}
    assert not any("clock was put" in note for note in table.notes)


def test_rows_of_one_stamp_are_not_spread_over_a_pause() -> None:
    """Two rows in each minute, then a pause of an hour."""
    stamps = np.array([0.0, 0.0, 60.0, 60.0, 3660.0, 3660.0, 3720.0, 3720.0])
    assert spread_evenly(stamps).tolist() == [0.0, 30.0, 60.0, 90.0, 3660.0, 3690.0, 3720.0, 3750.0]


def test_a_merged_cell_over_two_lines_names_its_column(tmp_path: Path) -> None:
    rows = [f"2026-03-02 08:00:{k:02d};{k % 3};{20 + k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "merged.csv", "Zeit;Antrieb;Lager", ";Drehzahl;T1", ";1/min;°C", *rows))
    assert table.clock == "Zeit"
    assert "none is called time" not in table.about_time


def test_stamps_are_the_time_and_not_the_numbers_of_the_rows(tmp_path: Path) -> None:
    rows = [f"{k},2026-03-27T06:{k:02d}:00.000000000,{20 + k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "pandas.csv", ",ts,t_head", *rows))
    assert table.time[-1] == 59 * 60.0
    assert [c.name for c in table.columns] == ["t_head"]


def test_a_torque_is_no_length_and_a_symbol_before_a_word_is_read() -> None:
    torque, room = (Column(h, n, u, np.linspace(20.0, 22.0, 50)) for h, n, u in
                    (("M [Nm]", "M", "Nm"), ("Troom [C]", "Troom", "C")))  # fmt: skip
    assert (guess(torque).role, guess(torque).unit) == ("other input", "N*m")
    assert guess(room).role == "ambient temperature"


def test_each_channel_may_bring_its_own_clock(tmp_path: Path) -> None:
    """As oscilloscopes of controllers write them: the second clock is no input, whatever stands over it."""
    rows = [f"{50 * k};{20 + k % 7};{50 * k};{k % 3}" for k in range(60)]
    scope = write(tmp_path / "scope.csv", "Name;T1;Name;E_z", "Unit;°C;Unit;µm", *rows)
    found = recorded([read_own(scope)])
    assert [c.name for c in found.seen] == ["T1", "E_z"]


@pytest.mark.parametrize(
    ("room", "head", "unit"),
    [
        ((2158, 2237), (2200, 3454), "0.01 degC"),
        ((215, 224), (220, 345), "0.1 degC"),
        ((294, 297), (295, 330), "K"),
        ((20, 24), (22, 61), "degC"),
        ((70, 75), (72, 110), "degF"),
    ],
)
def test_whole_numbers_may_be_parts_of_a_degree(
    room: tuple[int, int], head: tuple[int, int], unit: str
) -> None:
    columns = [
        Column(name, name, "", np.round(np.linspace(*ends, 400)))
        for name, ends in (("temp_amb", room), ("temp_head", head))
    ]
    assert {one.unit for one in guess_all(columns).values()} == {unit}


def test_a_list_above_the_table_says_which_channel_is_the_room() -> None:
    """CH1 to CH3 are alike in their names alone."""
    slow = np.linspace(21.0, 30.0, 400)
    places = {"CH1": "Spindle front", "CH2": "Room", "CH3": "Column"}
    found = guess_all([Column(name, name, "degC", slow, about) for name, about in places.items()])
    assert {name: one.role for name, one in found.items()} == {
        "CH1": "temperature",
        "CH2": "ambient temperature",
        "CH3": "temperature",
    }


def test_a_target_is_held_between_its_stamps_and_is_no_sensor_that_fell(tmp_path: Path) -> None:
    target, slow = np.repeat([105.0, 105.0, 0.0], 100), np.linspace(22.0, 28.0, 300).round(1)
    rows = [
        f"{20 * k},{a:g},{b:g},{3 * b - 60 + k % 2:g}"
        for k, (a, b) in enumerate(zip(target, slow, strict=True))
    ]
    files = [write(tmp_path / f"run{n}.csv", "time,bed_target,T_frame,dZ_um", *rows) for n in range(3)]
    for run in files[1:]:  # on to the end
        run.write_text(run.read_text("utf-8").replace(",0,", ",105,"), "utf-8")
    new(tmp_path / "rig", files, statements=["bed_target=other input,degC"], quick=True)
    assert load_campaign(tmp_path / "rig" / "campaign.toml").channels["bed_target"].between == "held"
    assert not [f for f in check_campaign(tmp_path / "rig") if f.channel == "bed_target"]


START = datetime(2026, 3, 27, 20, 0)
STAMPS = {
    "%Y%m%dT%H%M%S": "compact",
    "%a %b %d %H:%M:%S %Y": "as C writes them",
    "%d.%m.%Y %H.%M.%S": "dots",
    "%Y-%m-%d %H:%M:%S,250": "a comma before the milliseconds",
}


@pytest.mark.parametrize("form", STAMPS, ids=list(STAMPS.values()))
def test_dates_of_many_forms(tmp_path: Path, form: str) -> None:
    rows = [f"{START + timedelta(seconds=30 * k):{form}};{20 + k % 7}" for k in range(700)]
    table = read_own(write(tmp_path / "log.csv", "Zeit;T1 [°C]", *rows))
    assert (np.diff(table.time) == 30.0).all()


@pytest.mark.parametrize(
    ("head", "step", "form", "seconds"),
    [
        ("Time", 30, "{m}:{s:02d}", 30.0),  # 350 h would be the other
        ("Time [mm:ss]", 30, "{m}:{s:02d}", 30.0),
        ("Time [h:mm]", 30, "{m}:{s:02d}", 1800.0),
        ("Time", 30, "{days} days {h:02d}:{min:02d}:{s:02d}", 30.0),
        ("Time", 30, "{days}d {h:02d}:{min:02d}:{s:02d}", 30.0),
        ("Time", 30, "{h:02d}h{min:02d}m{s:02d}s", 30.0),
        ("Time", 30, "{m}m{s}s", 30.0),
        ("Time", 30, "PT{m}M{s}S", 30.0),
        ("Time", 30, "P{days}DT{h}H{min}M{s}.0S", 30.0),
    ],
)
def test_times_since_the_start(tmp_path: Path, head: str, step: int, form: str, seconds: float) -> None:
    rows = []
    for k in range(700):
        at = step * k
        parts = {
            "m": at // 60,
            "s": at % 60,
            "min": at % 3600 // 60,
            "h": at % 86400 // 3600,
            "days": at // 86400,
        }
        rows.append(f"{form.format(**parts)},{20 + k % 7}")
    table = read_own(write(tmp_path / "log.csv", f"{head},T1 [°C]", *rows))
    assert (np.diff(table.time) == seconds).all()
    assert ("?" in table.about_time) is (head == "Time" and form == "{m}:{s:02d}")


def test_a_length_of_time_in_a_column_of_readings_is_no_number(tmp_path: Path) -> None:
    """1m30s is neither 1 nor 90."""
    rows = [f"{30 * k},{20 + k % 7},{k}m30s" for k in range(40)]
    with pytest.raises(UserError, match="column 'lap': '0m30s' is not a number"):
        read_own(write(tmp_path / "log.csv", "time,T1 [°C],lap", *rows))


def test_dates_in_which_a_logger_never_pauses_are_not_asked_about(tmp_path: Path) -> None:
    rows = [
        f"{datetime(2026, 2, 4) + timedelta(minutes=5 * k):%Y-%m-%d %H:%M},{20 + k % 7}" for k in range(700)
    ]
    assert "?" not in read_own(write(tmp_path / "log.csv", "time,T1 [°C]", *rows)).about_time
    days = [f"0{1 + k // 9}/01/2026 {8 + k % 9}:00,{20 + k % 7}" for k in range(27)]
    assert "?" in read_own(write(tmp_path / "days.csv", "time,T1 [°C]", *days)).about_time


def test_rows_that_stand_twice_are_read_once(tmp_path: Path) -> None:
    """An export that repeats rows here and there; a fast logger with a coarse clock repeats stamps alone."""
    rows = [f"{30 * k},{20 + k % 7},{k % 5}" for k in range(100)]
    twice = [row for k, row in enumerate(rows) for _ in range(1 + (k % 9 == 4))]
    table = read_own(write(tmp_path / "twice.csv", "time,T1 [°C],P [W]", *twice))
    assert table.time.tolist() == [30.0 * k for k in range(100)]
    assert "11 rows repeat the row before: left out" in table.notes
    fast = read_own(
        write(
            tmp_path / "fast.csv", "time [s],T1 [°C],P [W]", *(f"{k // 4},20,{k // 40}" for k in range(400))
        )
    )
    assert len(fast.time) == 400


def test_a_block_of_rows_that_a_logger_sends_again_is_read_once(tmp_path: Path) -> None:
    rows = [f"{30 * k},{20 + k % 7},{k % 5}" for k in range(100)]
    for name, again in (("block", rows[:60] + rows[20:40] + rows[60:]), ("end", rows + rows[50:70])):
        table = read_own(write(tmp_path / f"{name}.csv", "time,T1 [°C],P [W]", *again))
        assert table.time.tolist() == [30.0 * k for k in range(100)]
        assert table.columns[0].values.tolist() == [20.0 + k % 7 for k in range(100)]
        assert "20 rows repeat an earlier row: left out" in table.notes
    other = [*rows[:60], *rows[20:25], "750,99,0", *rows[60:]]
    said = (
        r"line 67: the time does not run forward in column 'time'; its stamp stands in line 27 already, with"
    )
    with pytest.raises(UserError, match=said):
        read_own(write(tmp_path / "other.csv", "time,T1 [°C],P [W]", *other))


@pytest.mark.parametrize(
    "header", ["Temp. nave (°C)", "Rumstemperatur (°C)", "Verkstadstemp [°C]", "Temp. taller"]
)
def test_rooms_in_spanish_and_swedish(header: str) -> None:
    slow = np.linspace(20.0, 23.0, 300)
    head = Column("T1", "T1", "degC", slow + 5.0)
    assert guess_all([Column(header, "room", "degC", slow), head])["room"].role == "ambient temperature"


@pytest.mark.parametrize("cell", ["OFF44:09", "7.0%", "Target:"])
def test_a_garbled_cell_of_a_switch_is_an_error_with_its_line(tmp_path: Path, cell: str) -> None:
    """One cell of a serial line that lost letters: neither the switch is left out, nor the cell a number."""
    rows = [
        f"{10 * k};{20 + 0.1 * k:.1f};{cell if k == 100 else ('ON', 'OFF')[k // 30 % 2]}" for k in range(200)
    ]
    with pytest.raises(UserError, match=f"line 102, column 'Heater': '{cell}' is not a number; empty it"):
        read_own(write(tmp_path / "mat.csv", "t/s;T1 [°C];Heater", *rows))


def test_a_column_of_states_with_on_and_off_is_left_out(tmp_path: Path) -> None:
    rows = [f"{k};{('ON', 'OFF', 'STANDBY')[k // 5 % 3]};{k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "plc.csv", "t/s;Mode;T1 [°C]", *rows))
    assert "column 'Mode' holds words: left out (ON, OFF, STANDBY)" in table.notes[0]


def test_a_power_that_is_off_at_times_is_read(tmp_path: Path) -> None:
    rows = [f"{k};{'OFF' if k % 3 else 45.5};{k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "power.csv", "t/s;P [W];T1 [°C]", *rows))
    assert table.columns[0].values[:3].tolist() == [45.5, 0.0, 0.0]


def test_names_behind_empty_cells(tmp_path: Path) -> None:
    """A program wrote marks for columns that it had hidden, in front of the names alone."""
    rows = [f"{k}\t{20 + 0.1 * k:.1f}\t{k % 7}" for k in range(60)]
    table = read_own(write(tmp_path / "hidden.csv", "\t\t\ttime [s]\tT1 [°C]\tpower [W]", *rows))
    assert [(c.name, c.unit) for c in table.columns] == [("T1", "°C"), ("power", "W")]


def test_a_counter_that_starts_again_is_not_to_be_sorted(tmp_path: Path) -> None:
    rows = [f"{(4000 + 1000 * k) % 10000};{20 + 0.1 * k:.1f};{k % 7}" for k in range(60)]
    with pytest.raises(UserError, match=r"line 8: .*'time'; it falls 6 times: sort .*starts again there"):
        read_own(write(tmp_path / "counter.csv", "time;T1 [°C];power [W]", *rows))
