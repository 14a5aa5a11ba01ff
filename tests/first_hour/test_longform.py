"""Tables in long format: told as such, with a line of Python that makes them wide."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from discovery.errors import UserError
from discovery.firsthour.table import OwnTable, read_own

SENSORS = ("Outside temp", "Plate temp", "Pump")


def _log(folder: Path, *lines: str) -> Path:
    path = folder / "log.csv"
    path.write_text("\n".join(lines) + "\n", "utf-8")
    return path


def _wide(folder: Path, said: str) -> OwnTable:
    """The table that the line of Python in a message makes."""
    found = re.search(r"import pandas.*$", said)
    assert found
    environment = {**os.environ, "PYTHONUTF8": "1"}
    subprocess.run([sys.executable, "-c", found[0]], cwd=folder, check=True, env=environment)
    return read_own(folder / "wide.csv")


@pytest.mark.parametrize("above", [(), ("log of plant 3", "made on a Monday")])
def test_a_long_table_is_told_and_the_line_of_python_makes_it_wide(
    tmp_path: Path, above: tuple[str, ...]
) -> None:
    days = ["28.02", "01.03"]  # a month ends: as words, the stamps would be sorted wrongly
    rows = [
        f"{1000 * k + n};{days[k // 6]}.2026 08:{k:02d}:00;{87 + n};{name};{20 * n + k % 4},5;C"
        for k in range(12)
        for n, name in enumerate(SENSORS)
    ]
    path = _log(tmp_path, *above, "Milliseconds;Date;Parameter;Description;Value;Unit", *rows)
    with pytest.raises(
        UserError, match="the table is long: column 'Description' names 3 quantities"
    ) as error:
        read_own(path)
    assert "stand in 'Value'" in str(error.value)
    wide = _wide(tmp_path, str(error.value))
    assert [column.header for column in wide.columns] == list(SENSORS)
    assert len(wide.time) == 12
    assert wide.columns[1].values.tolist() == [20.5 + k % 4 for k in range(12)]


def test_sensors_in_turn_without_common_stamps_are_told(tmp_path: Path) -> None:
    rows = [f"{k},{1 + k % 4},{20 + k % 4 + k / 100},{40 + k % 3}" for k in range(40)]
    path = _log(tmp_path, "time,Node ID,Temperature [°C],Humidity", *rows)
    [note] = [one for one in read_own(path).notes if "in turn" in one]
    assert "column 'Node ID' takes 4 values in turn: if so many sensors share the column 'Temperature" in note
    wide = _wide(tmp_path, note)
    assert [column.name for column in wide.columns] == [f"Temperature_{k}" for k in (1, 2, 3, 4)]
    assert wide.columns[2].values[2] == pytest.approx(22.02)


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
    assert not any("in turn" in note for note in table.notes)
