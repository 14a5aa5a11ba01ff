"""Columns that count in steps of a unit: 2.5 um, 0.1 degC, x10 W; in brackets, in a row of units, by --is."""

from pathlib import Path

import numpy as np
import pytest

from discovery.firsthour.measures import unit_in
from discovery.firsthour.new import new
from discovery.firsthour.table import read_own
from discovery.recordings import load_campaign

ROWS = [(60 * k, -k, 220 + k % 40, (k // 60) % 2 * 20) for k in range(400)]


def write(path: Path, head: str) -> Path:
    body = "\n".join(";".join(map(str, row)) for row in ROWS)
    path.write_text(f"{head}\n{body}\n", "utf-8")
    return path


HEADS = {
    "brackets": "Zeit [s];Weg Z [2,5 µm];Temp 1 [1/10 °C];Leistung [x10 W]",
    "a row of units": "Zeit;Weg Z;Temp 1;Leistung\ns;2,5 µm;0,1 °C;x10 W",
}


@pytest.mark.parametrize("head", HEADS.values(), ids=list(HEADS))
def test_values_are_in_the_unit_itself(tmp_path: Path, head: str) -> None:
    table = read_own(write(tmp_path / "log.csv", head))
    assert [(c.name, c.unit) for c in table.columns] == [("Weg_Z", "µm"), ("Temp_1", "°C"), ("Leistung", "W")]
    for column, factor, k in zip(table.columns, (2.5, 0.1, 10.0), (1, 2, 3), strict=True):
        np.testing.assert_allclose(column.values, [factor * row[k] for row in ROWS])
    assert [note.rpartition(" ")[2] for note in table.notes] == ["2.5", "0.1", "10"]


def test_a_whole_number_may_be_a_range_and_is_asked_about(tmp_path: Path) -> None:
    table = read_own(write(tmp_path / "log.csv", "Zeit [s];Weg Z [10 µm];Temp 1 [°C];AI1 [10 V]"))
    np.testing.assert_allclose(table.columns[0].values, [row[1] for row in ROWS])
    assert [c.unit for c in table.columns] == ["µm", "°C", "V"]
    assert 'say --is "Weg Z [10 µm]=x10 µm"' in table.notes[0]
    assert unit_in("T_air (2 m)") is None  # a height


def test_a_person_says_the_step(tmp_path: Path) -> None:
    log = write(tmp_path / "log.csv", "Zeit [s];mcu_pos;Temp 1 [0.1 °C];Leistung [W]")
    new(tmp_path / "made", [log], statements=["mcu_pos=error,2.5 um"], quick=True)
    campaign = load_campaign(tmp_path / "made" / "campaign.toml")
    assert campaign.channels["mcu_pos"].unit == "um"
    first = next(iter(campaign.recordings.values()))
    np.testing.assert_allclose(np.diff(first.values["mcu_pos"]), -2.5)
