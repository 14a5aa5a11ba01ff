"""Tables in long format: a column is made of each sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.firsthour.table import read_own

SENSORS = ("Outside temp", "Plate temp", "Pump")


def _log(folder: Path, *lines: str) -> Path:
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


@pytest.mark.parametrize("above", [(), ("log of plant 3", "made on a Monday")])
def test_a_long_table_becomes_wide(tmp_path: Path, above: tuple[str, ...]) -> None:
    days = ["28.02", "01.03"]  # a month ends: as words, the stamps would be sorted wrongly
    rows = [
        f"{1000 * k + n};{days[k // 6]}.2026 "
        f"08:{k:02d}:00;{87 + n};{name};{20 * n + k % 4},5;{'C' if n < 2 else '-'}"
        for k in range(12)
        for n, name in enumerate(SENSORS)
    ]
    wide = read_own(_log(tmp_path, *above, "Milliseconds;Date;Parameter;Description;Value;Unit", *rows))
    assert [(column.header, column.unit) for column in wide.columns] == list(
        zip(SENSORS, ("C", "C", "-"), strict=True)
    )
    assert len(wide.time) == 12
    assert wide.columns[1].values.tolist() == [20.5 + k % 4 for k in range(12)]
    assert "the table is long: column 'Description' names 3 sensors" in wide.notes[-1]


def test_sensors_in_turn_without_common_stamps(tmp_path: Path) -> None:
    rows = [f"{k},{1 + k % 4},{20 + k % 4 + k / 100},{40 + k * 7 % 5}" for k in range(40)]
    wide = read_own(_log(tmp_path, "time,Node ID,Temperature [°C],Humidity", *rows))
    names = [f"Temperature_{k}" for k in (1, 2, 3, 4)]
    assert [column.name for column in wide.columns][:4] == names
    assert {column.unit for column in wide.columns if column.name in names} == {"°C"}
    second = wide.values("Temperature_3")
    assert second is not None
    assert np.flatnonzero(np.isfinite(second)).tolist() == list(range(2, 40, 4))
    assert second[2] == pytest.approx(22.02)


def test_sensors_one_after_the_other(tmp_path: Path) -> None:
    rows = [f"{60 * k},{name},{20 + n + k * 3 % 7}" for n, name in enumerate(SENSORS) for k in range(15)]
    wide = read_own(_log(tmp_path, "time,sensor,value", *rows))
    assert [column.header for column in wide.columns] == list(SENSORS)
    assert len(wide.time) == 15
    assert wide.columns[2].values.tolist() == [22 + k * 3 % 7 for k in range(15)]


@pytest.mark.parametrize(
    "row",
    [
        lambda k: f"{k},{'heat' if k % 20 < 10 else 'rest'},{20 + k % 7}",  # a state stays for a while
        lambda k: f"{k},note {k},{20 + k % 7}",
        lambda k: f"{k // 2},{'open' if k * k % 7 < 4 else 'shut'},{20 + k}",  # a coarse clock
        lambda k: f"{k},{k % 2},{20 + k % 7}",  # a switch
    ],
)
def test_a_wide_table_is_not_long(tmp_path: Path, row: object) -> None:
    assert callable(row)
    table = read_own(_log(tmp_path, "time,note,T1", *(row(k) for k in range(60))))
    assert not any("long" in note for note in table.notes)
    assert "T1" in [column.name for column in table.columns]


def test_a_number_of_a_device_that_takes_turns_makes_series(tmp_path: Path) -> None:
    from discovery.firsthour.table import read_tables

    rows = [f"{k},{1 + k % 2},{20 + k % 2 * 5 + k / 9:.3f}" for k in range(60)]
    [table] = read_tables(_log(tmp_path, "time,NodeID,T1", *rows))
    first, second = table.columns
    assert {first.name, second.name} == {"T1_1", "T1_2"}
    assert float(np.nanmin(second.values)) - float(np.nanmin(first.values)) == pytest.approx(5.1, abs=0.2)
