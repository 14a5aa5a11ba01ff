"""The folder of a run: what a run replaces in it, what stays, and what a broken file or export says."""

from __future__ import annotations

import csv
import hashlib
import json
import os
from collections.abc import Callable
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.diagnosis.summary import summary as diagnosis_summary
from discovery.errors import UserError
from discovery.experiment import diagnose, load_experiment, run
from discovery.experiment.form import ExportForm
from discovery.experiment.inputfiles import input_files
from discovery.experiment.summary import summary
from discovery.export import export_run, replay
from discovery.report.run import load_run
from discovery.runfolder import default_folder
from discovery.targets import TARGETS
from tests.small import CAMPAIGN, EXPERIMENT, write_small

SHORT = EXPERIMENT.replace('superposition = { kind = "superposition", inputs = ["T_env", "P"] }\n', "")
DRY = '[mismatch]\nmodel = "one_body"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_small(tmp_path)
    (tmp_path / "experiment.toml").write_text(SHORT)
    return tmp_path


@pytest.fixture
def out(folder: Path) -> Path:
    """A finished run with an exported model, a figure and a note of the user's."""
    out = run(folder / "experiment.toml", folder / "out")
    export_run(out, "one_body", "json")
    (out / "figures").mkdir()
    (out / "figures" / "mine.svg").write_text("<svg/>")
    (out / "my_notes.txt").write_text("warm day")
    return out


def content(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


def users(out: Path) -> dict[str, bytes]:
    return {n: data for n, data in content(out).items() if n.startswith(("export/", "figures/", "my_"))}


def results_of(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "results.json").read_text())
    return found


def columns_of(path: Path) -> dict[str, list[str]]:
    rows = list(csv.DictReader(path.read_text().splitlines()))
    return {name: [row[name] for row in rows] for name in rows[0]}


def test_a_run_replaces_what_is_its_own_and_nothing_else(folder: Path, out: Path) -> None:
    before = users(out)
    assert {name.partition("/")[0] for name in before} == {"export", "figures", "my_notes.txt"}
    (folder / "experiment.toml").write_text(SHORT.replace('reduced       = { kind = "reduced" }\n', ""))
    (out / "diagnosis.json").write_text("{}")
    run(folder / "experiment.toml", out)
    assert users(out) == before
    assert {path.name for path in (out / "models").iterdir()} == {"one_body.toml"}
    assert not (out / "diagnosis.json").exists()
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


def test_a_folder_that_cannot_change_places_is_left_as_it_was(
    folder: Path, out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    before = content(out)
    really = Path.replace

    def interrupted(source: Path, target: Path) -> Path:
        if target == out and not source.name.endswith(".old"):
            raise KeyboardInterrupt
        return really(source, target)

    monkeypatch.setattr(Path, "replace", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(folder / "experiment.toml", out)
    assert content(out) == before
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


def test_a_diagnosis_leaves_the_other_models_of_a_run(folder: Path, out: Path) -> None:
    before, mine = content(out), users(out)
    predicted = {r: columns_of(out / "predictions" / f"{r}.csv") for r in "abc"}
    entries = results_of(out)["models"]
    (folder / "experiment.toml").write_text(SHORT.replace("[models]", DRY + "[models]"))
    for _ in range(2):
        diagnose(folder / "experiment.toml", out)
        results = results_of(out)
        assert results["models"]["reduced"] == entries["reduced"]
        assert list(results["models"])[:2] == ["reduced", "one_body"]
        assert results["command"] == " && ".join(
            f"discovery {verb} {folder / 'experiment.toml'}" for verb in ("run", "diagnose")
        )
        assert content(out)["models/reduced.toml"] == before["models/reduced.toml"]
        for recording, old in predicted.items():
            new = columns_of(out / "predictions" / f"{recording}.csv")
            for name in ("time", "E_Y0C", "E_R0T", "E_Y0C|reduced", "E_R0T|reduced"):
                assert new[name] == old[name]
            assert "E_Y0C|one_body" in new
        assert users(out) == mine
    assert set(load_run(out).models) == set(results_of(out)["models"])
    assert "diagnose" in (out / "report.html").read_text()


def test_a_repaired_model_goes_with_its_diagnosis(folder: Path, out: Path) -> None:
    results = results_of(out)
    results["models"]["repaired"] = {**results["models"]["one_body"], "kind": "repaired"}
    (out / "results.json").write_text(json.dumps(results))
    (folder / "experiment.toml").write_text(SHORT.replace("[models]", DRY + "[models]"))
    diagnose(folder / "experiment.toml", out)
    found = json.loads((out / "diagnosis.json").read_text())
    assert found["verdict"] == "no mismatch"
    assert set(results_of(out)["models"]) == {"reduced", "one_body"}


@pytest.mark.parametrize("change", ["a.csv", "campaign.toml", "fit"])
def test_a_diagnosis_of_other_recordings_wants_a_folder_of_its_own(
    folder: Path, out: Path, change: str
) -> None:
    before, asked = content(out), SHORT.replace("[models]", DRY + "[models]")
    (folder / "experiment.toml").write_text(asked)
    if change == "a.csv":
        (folder / "a.csv").write_text((folder / "a.csv").read_text().rsplit("\n", 3)[0] + "\n")
    elif change == "campaign.toml":
        (folder / "campaign.toml").write_text(CAMPAIGN.replace("noise = 0.3", "noise = 0.4"))
    else:
        (folder / "experiment.toml").write_text(asked.replace('fit = ["a", "b"]', 'fit = ["a"]'))
    with pytest.raises(UserError, match=rf"other models \(reduced.*{change} has changed"):
        diagnose(folder / "experiment.toml", out)
    assert content(out) == before


def test_a_diagnosis_alone_says_how_it_was_made(folder: Path) -> None:
    (folder / "experiment.toml").write_text(SHORT.replace("[models]", DRY + "[models]"))
    alone = diagnose(folder / "experiment.toml", folder / "alone")
    assert results_of(alone)["command"] == f"discovery diagnose {folder / 'experiment.toml'}"
    assert f"discovery diagnose {folder / 'experiment.toml'}" in (alone / "report.html").read_text()
    assert "reduced" not in results_of(alone)["models"]


def test_an_export_that_fails_leaves_the_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(replay.LIMITS, "double", -1.0)
    wanted = '[export]\nmodel = "one_body"\nto = ["st"]\n'
    (folder / "experiment.toml").write_text(SHORT.replace("[models]", wanted + "[models]"))
    done = CliRunner().invoke(app, ["run", str(folder / "experiment.toml"), "--out", str(folder / "out")])
    assert done.exit_code == 1
    [sentence] = [line for line in done.output.splitlines() if line.startswith("error: ")]
    assert f"the run is done and kept in {folder / 'out'}" in sentence
    assert "deviates" in sentence
    assert set(load_run(folder / "out").models) == {"reduced", "one_body"}
    assert (folder / "out" / "report.html").exists()
    assert not (folder / "out" / "export").exists()


def test_a_missing_compiler_is_told_before_anything_is_fitted(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("discovery.targets.shutil.which", lambda _: None)
    monkeypatch.setattr("discovery.experiment.pipeline.fit_entry", lambda *_: pytest.fail("fitted"))
    for target in ("c", "fmu", "fmu3"):
        wanted = f'[export]\nmodel = "one_body"\nto = ["json", "{target}"]\n'
        (folder / "experiment.toml").write_text(SHORT.replace("[models]", wanted + "[models]"))
        with pytest.raises(UserError, match=f"'{target}'.*gcc.*install"):
            run(folder / "experiment.toml", folder / "out")
    assert not (folder / "out").exists()


def test_a_run_exports_out_of_its_folder(folder: Path) -> None:
    wanted = '[export]\nmodel = "one_body"\n'
    (folder / "experiment.toml").write_text(SHORT.replace("[models]", wanted + "[models]"))
    out = run(folder / "experiment.toml", folder / "out")
    assert (out / "export" / "one_body" / "one_body.json").exists()


def test_every_target_may_stand_in_an_experiment() -> None:
    assert set(TARGETS) == {"json", "c", "fmu", "fmu3", "st", "plcopen", "scl"}
    assert ExportForm(model="m", to=list(TARGETS)).to == list(TARGETS)
    printed = CliRunner().invoke(app, ["schema", "experiment"]).output
    assert json.loads(printed)["$defs"]["ExportForm"]["properties"]["to"]["items"]["enum"] == list(TARGETS)


def test_a_baseline_file_is_hashed_like_any_other_input(folder: Path) -> None:
    root = Path(__file__).parents[1]
    files = input_files(load_experiment(root / "experiments" / "nmv5000.toml"))
    dry = root / "datasets" / "nmv5000" / "dry_thermobalance.toml"
    assert files["../datasets/nmv5000/dry_thermobalance.toml"].resolve() == dry
    listed = results_of(run(folder / "experiment.toml", folder / "out"))["inputs"]
    names = ("experiment.toml", "campaign.toml", "model.toml", "a.csv", "b.csv", "c.csv")
    assert listed == {name: hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names}


def test_a_model_is_discovered_once_and_then_diagnosed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import discovery.diagnosis
    import discovery.sparse.discover

    really, searches, diagnosed = discovery.sparse.discover.discover, [], []

    def counted(*given: Any) -> Any:
        searches.append(given)
        return really(*given)

    def noted(model: Any, *_: Any, **__: Any) -> Any:
        diagnosed.append(model)
        document = {"model": "found", "verdict": "no mismatch", "physics": []}
        written = SimpleNamespace(model_dump=lambda **_: document)
        return SimpleNamespace(repaired=None, document=lambda: written)

    monkeypatch.setattr(discovery.sparse.discover, "discover", counted)
    monkeypatch.setattr(discovery.diagnosis, "diagnose", noted)
    text = EXPERIMENT[: EXPERIMENT.index("[models]")]
    text += '[models]\nfound = { kind = "sindy", bootstraps = 4 }\n[mismatch]\nmodel = "found"\n'
    (folder / "experiment.toml").write_text(text)
    out = run(folder / "experiment.toml", folder / "out")
    assert len(searches) == 1
    assert [model.name for model in diagnosed] == ["found"]
    assert len(diagnosed[0].terms) == results_of(out)["models"]["found"]["terms"]


READERS: dict[str, list[Callable[[Path], object]]] = {
    "results.json": [
        lambda folder: list(summary(folder)),
        load_run,
        lambda folder: export_run(folder, "m", "json"),
    ],
    "diagnosis.json": [diagnosis_summary, load_run],
}


@pytest.mark.parametrize("name", list(READERS))
@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{\n"fit": [', "line 2: not valid JSON"),
        ("[]", "is missing"),
        ('{"fit": [], "physics": []}', "is missing"),
        ('{"experiment": "x", "fit": 3, "held_out": [], "models": {}, "model": 3}', "is missing or wrong"),
        ("[" * 100_000, "not valid JSON"),
    ],
)
def test_a_broken_file_is_one_sentence_whoever_reads_it(
    tmp_path: Path, name: str, text: str, words: str
) -> None:
    (tmp_path / name).write_text(text)
    sentences = set()
    for read in READERS[name]:
        with pytest.raises(UserError, match=words) as caught:
            read(tmp_path)
        sentences.add(str(caught.value))
    [sentence] = sentences
    assert str(tmp_path / name) in sentence
    assert "make the run again" in sentence


@pytest.mark.parametrize(
    "name", ["../small", "/etc/x", "mill, X axis: 3/4", "  .hidden", "Fräse #3", "a" * 300]
)
def test_the_folder_of_any_name_stands_in_runs(name: str) -> None:
    folder = default_folder(name)
    assert folder.parent == Path("runs")
    assert folder.name
    assert not folder.name.startswith(".")
    assert len(folder.name) <= 100


def test_a_second_run_says_which_run_it_replaces_and_how_to_keep_both(folder: Path) -> None:
    (folder / "experiment.toml").write_text(SHORT.replace("[models]", DRY + "[models]"))
    out = folder / "out"

    def said(verb: str) -> list[str]:
        done = CliRunner().invoke(app, [verb, str(folder / "experiment.toml"), "--out", str(out)])
        assert done.exit_code == 0, done.output
        return [line for line in done.stderr.splitlines() if "replaces" in line]

    assert said("run") == []
    os.utime(out / "results.json", (stamp := datetime(2026, 3, 9, 14, 5).timestamp(), stamp))
    os.utime(out / "diagnosis.json", (stamp := datetime(2026, 3, 10, 8, 0).timestamp(), stamp))
    assert said("diagnose") == [
        f"this replaces the diagnosis of 2026-03-10 08:00 in {out} (keep both with --out)"
    ]
    os.utime(out / "results.json", (stamp := datetime(2026, 3, 9, 14, 5).timestamp(), stamp))
    assert said("run") == [f"this replaces the run of 2026-03-09 14:05 in {out} (keep both with --out)"]
