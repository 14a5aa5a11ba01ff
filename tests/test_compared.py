"""A model file is compared with everything measured that it gives."""

from __future__ import annotations

import json
from pathlib import Path

import pandas as pd
import pytest

from discovery.experiment import load_experiment
from discovery.experiment.experiment import compared_on_all
from discovery.experiment.pipeline import diagnose, run
from tests.small import write_small

ERRORS = ["E_Y0C", "E_R0T"]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The small campaign with a thermometer on its body, which the model gives."""
    write_small(tmp_path)
    for name in "abc":
        table = pd.read_csv(tmp_path / f"{name}.csv")
        table["T_body"] = (22.0 + 0.5 * table["E_R0T"]).round(3)
        table.to_csv(tmp_path / f"{name}.csv", index=False)
    changed(
        tmp_path / "campaign.toml",
        "[recordings]",
        'T_body = { role = "temperature", unit = "degC" }\n\n[recordings]',
    )
    changed(tmp_path / "model.toml", "[outputs]", '[outputs]\nT_body = "body"')
    changed(tmp_path / "experiment.toml", "[models]", 'mismatch = { model = "one_body" }\n\n[models]')
    return tmp_path


def changed(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))


def test_a_model_file_is_compared_with_the_thermometers_that_it_gives(folder: Path) -> None:
    experiment = load_experiment(folder / "experiment.toml")
    assert list(experiment.outputs) == ERRORS
    on_all = compared_on_all(experiment)
    models = on_all.form.models
    assert list(on_all.outputs) == [*ERRORS, "T_body"]
    assert on_all.outputs_of(models["one_body"]) == [*ERRORS, "T_body"]
    assert on_all.outputs_of(models["reduced"]) == ERRORS


def test_a_model_file_may_give_some_of_the_errors_only(folder: Path) -> None:
    changed(folder / "model.toml", 'E_R0T = "2*(body - 22)"', "")
    results = json.loads((run(folder / "experiment.toml", folder / "out") / "results.json").read_text())
    assert list(results["models"]["one_body"]["recordings"]["c"]) == ["E_Y0C", "T_body"]
    assert any("gives no E_R0T" in note for note in results["models"]["one_body"]["notes"])


def test_stated_outputs_stay(folder: Path) -> None:
    changed(folder / "experiment.toml", "fit = [", f"outputs = {ERRORS}\nfit = [")
    experiment = load_experiment(folder / "experiment.toml")
    assert compared_on_all(experiment) is experiment


def test_a_model_with_outputs_of_its_own_keeps_them(folder: Path) -> None:
    changed(folder / "experiment.toml", '"model.toml"', '"model.toml", outputs = ["E_Y0C"]')
    experiment = load_experiment(folder / "experiment.toml")
    assert compared_on_all(experiment) is experiment


def test_a_diagnosis_joins_a_run_without_one(folder: Path) -> None:
    changed(folder / "experiment.toml", 'mismatch = { model = "one_body" }', "")
    out = run(folder / "experiment.toml", folder / "out")
    changed(folder / "experiment.toml", "[models]", 'mismatch = { model = "one_body" }\n\n[models]')
    diagnose(folder / "experiment.toml", out)
    assert {"reduced", "superposition", "one_body"} <= set(
        json.loads((out / "results.json").read_text())["models"]
    )


def test_table_and_diagnosis_show_the_thermometer(folder: Path) -> None:
    alone = diagnose(folder / "experiment.toml", folder / "alone")
    both = run(folder / "experiment.toml", folder / "both")
    found = [json.loads((out / "diagnosis.json").read_text()) for out in (alone, both)]
    assert [d["verdict"] for d in found] == ["no mismatch", "no mismatch"]
    assert found[0]["improvement"]["fit"]["outputs"] == found[1]["improvement"]["fit"]["outputs"]
    assert set(found[0]["improvement"]["fit"]["outputs"]) == {*ERRORS, "T_body"}
    models = json.loads((both / "results.json").read_text())["models"]
    compared = {name: list(one["recordings"]["c"]) for name, one in models.items()}
    assert compared == {"reduced": ERRORS, "superposition": ERRORS, "one_body": [*ERRORS, "T_body"]}
