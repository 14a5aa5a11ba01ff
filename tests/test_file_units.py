"""Recordings in mm, models in um: a formula that still gives mm is taken as such, and said so."""

from __future__ import annotations

from pathlib import Path

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.experiment import run
from tests.small import CAMPAIGN, MODEL, results_of, write_small


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The small campaign, errors of E_Y0C in mm, as another logger would write them."""
    write_small(tmp_path)
    for name in "abc":
        path = tmp_path / f"{name}.csv"
        head, *rows = [line.split(",") for line in path.read_text().splitlines()]
        for row in rows:
            row[3] = f"{float(row[3]) / 1000:.6f}" if row[3] else ""
        path.write_text("\n".join(",".join(row) for row in [head, *rows]) + "\n")
    text = CAMPAIGN.replace('"um", noise = 0.3', '"mm", noise = 0.0003', 1)
    (tmp_path / "campaign.toml").write_text(text)
    return tmp_path


def test_a_formula_in_the_unit_of_the_file_is_converted_and_said_so(folder: Path) -> None:
    """It was 1000 times too small, and a diagnosis named a second thermal mass with 98 %."""
    (folder / "model.toml").write_text(MODEL.replace('"-5*', '"-0.005*'))
    text = (folder / "experiment.toml").read_text() + '\n[mismatch]\nmodel = "one_body"\n'
    (folder / "experiment.toml").write_text(text)
    done = CliRunner().invoke(
        app, ["diagnose", str(folder / "experiment.toml"), "--out", str(folder / "out")]
    )
    assert "no mismatch" in done.output
    note = "formula of output 'E_Y0C' is taken in the unit of the file, times 1000 to give um"
    assert f"note, one_body: the {note}" in done.output
    found = results_of(folder / "out")["models"]["one_body"]
    assert "E_Y0C = 1000*(-0.005*(body - 22))" in found["equations"]


@pytest.mark.parametrize("formula", ["-5*", "0.02*"])  # right; and wrong, but no better in mm
def test_a_formula_in_um_is_taken_as_it_stands(folder: Path, formula: str) -> None:
    (folder / "model.toml").write_text(MODEL.replace('"-5*', f'"{formula}'))
    run(folder / "experiment.toml", folder / "out")
    found = results_of(folder / "out")["models"]["one_body"]
    assert not any("unit of the file" in note for note in found["notes"])
    assert (found["recordings"]["c"]["E_Y0C"]["rms"] < 0.5) == (formula == "-5*")


@pytest.mark.parametrize("sister", ["2*", "4.84814*2*"])  # in the unit of the file as well; converted by hand
def test_formulas_of_one_unit_are_judged_together_and_alone(tmp_path: Path, sister: str) -> None:
    """Of two formulas in arcsec one was converted, and the other one was not: a factor of 4.85 passed for
    physics. A fit of the wrong unit explains much, with a loss 4.85 times as large as its author believes.
    """
    write_small(tmp_path)
    text = CAMPAIGN.replace('"um", noise = 0.3', '"arcsec", noise = 0.3')
    (tmp_path / "campaign.toml").write_text(text)
    (tmp_path / "model.toml").write_text(MODEL.replace('"2*', f'"{sister}'))
    run(tmp_path / "experiment.toml", tmp_path / "out")
    found = results_of(tmp_path / "out")["models"]["one_body"]
    said = [note for note in found["notes"] if "unit of the file" in note]
    assert [("E_Y0C" in note, "E_R0T" in note) for note in said] == (
        [(True, False), (False, True)] if sister == "2*" else [(True, False)]
    )
    assert found["values"]["loss"]["value"] == pytest.approx(0.4, rel=0.02)
    noise = 0.3 * 4.84814
    assert all(one["rms"] < 1.2 * noise for one in found["recordings"]["c"].values())
