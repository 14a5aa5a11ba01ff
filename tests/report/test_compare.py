"""Several runs on one page and in the terminal: a list with differences, models side by side."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import pytest

from discovery.experiment.summary import comparison
from discovery.report import write_comparison, write_report
from discovery.report.compare import groups, load_runs, shared_recordings
from discovery.report.lead import lead_over
from discovery.report.printed import behind
from discovery.report.run import load_run
from discovery.report.runlist import run_list
from tests.report import sample


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(sample.write_sample(tmp_path_factory.mktemp("runs") / "cutting fluid"))


def test_a_comparison_counts_as_unseen_only_what_no_run_has_fitted(folder: Path, tmp_path: Path) -> None:
    other = sample.write_sample(tmp_path / "second")
    results = json.loads((other / "results.json").read_text()) | {"experiment": "second"}
    (other / "results.json").write_text(json.dumps(results))
    page = write_comparison(load_runs([folder, other]), tmp_path).read_text("utf-8")
    assert "discovered, second" in page
    assert "compared on “validation”" in page


def test_a_recording_that_only_some_models_are_fitted_to_is_not_compared(
    folder: Path, tmp_path: Path
) -> None:
    """As `also` does: it is neither of the fit nor held out."""
    other = sample.write_sample(tmp_path / "second")
    for run in (folder, other):
        results = json.loads((run / "results.json").read_text())
        next(iter(results["models"].values()))["recordings"]["warm_up"] = {}
        (run / "results.json").write_text(json.dumps(results))
    assert shared_recordings(load_runs([folder, other])) == ["fit", "validation"]


def test_runs_of_two_machines_are_listed_but_their_models_are_not_mixed(folder: Path, tmp_path: Path) -> None:
    """Recordings of the same name with other readings are not the same recordings."""
    other = sample.write_sample(tmp_path / "machine", hours=20.0)
    runs = load_runs([folder, tmp_path])
    assert shared_recordings(runs) == []
    page = write_comparison(runs, tmp_path).read_text("utf-8")
    assert "These runs share no recording" in page
    assert 'href="machine/report.html"' not in page  # it has none
    write_report(other)
    page = write_comparison(runs, tmp_path).read_text("utf-8")
    assert 'href="machine/report.html"' in page


def test_many_recordings_are_one_table_in_the_terminal(tmp_path: Path) -> None:
    both = [tmp_path / name for name in ("first", "second")]
    for run in both:
        path = sample.write_sample(run) / "results.json"
        path.write_text(json.dumps(json.loads(path.read_text()) | {"experiment": run.name}))
    few = "\n".join(comparison(load_runs(both)))
    assert "Recording 'validation' (held out)" in few
    copies = [f"validation {k}" for k in range(8)]
    for run in both:
        path = run / "results.json"
        results = json.loads(path.read_text())
        for model in results["models"].values():
            model["recordings"] |= dict.fromkeys(copies, model["recordings"]["validation"])
        path.write_text(json.dumps(results | {"held_out": ["validation", *copies]}))
        for name in copies:
            shutil.copy(run / "predictions" / "validation.csv", run / "predictions" / f"{name}.csv")
    many = "\n".join(comparison(load_runs(both)))
    assert "Recording 'validation" not in many
    assert "Removed rms [%], held-out recordings, geometric mean over all errors" in many
    assert re.search(r"discovered, second .* 0 %", many)


def test_runs_of_several_machines_are_compared_machine_by_machine(tmp_path: Path) -> None:
    for name, hours in (("first", 24.0), ("again", 24.0), ("other", 20.0), ("twin", 20.0)):
        path = sample.write_sample(tmp_path / name, hours) / "results.json"
        results = json.loads(path.read_text())
        path.write_text(json.dumps(results | {"experiment": name, "campaign": f"machine of {hours:g} h"}))
    runs = load_runs([tmp_path])
    assert groups(runs) == [[0, 1], [2, 3]]
    page = write_comparison(runs, tmp_path).read_text("utf-8")
    assert "Runs are compared on the recordings that they share" in page
    for number, hours, label in ((1, 24, "again"), (2, 20, "twin")):
        part = page.partition(f'<section id="group-{number}"><h2>machine of {hours} h</h2>')[2]
        assert f"discovered, {label}" in part.partition("</section>")[0]
    said = "\n".join(comparison(runs))
    assert "again: discovered" in said
    assert "twin: discovered" in said
    assert "machine: machine of 24 h → machine of 20 h" in said


def test_the_list_says_how_a_run_differs_from_any_other(folder: Path, tmp_path: Path) -> None:
    """The lead of one best model over another is that of the same two models in one run."""
    other = sample.write_sample(tmp_path / "plain")
    results = json.loads((other / "results.json").read_text())
    models = {name: one for name, one in results["models"].items() if name in ("reduced", "superposition")}
    values = {"G": {"value": 9.0, "low": 8.5, "high": 9.5, "unit": "W/K"}}
    models["reduced"]["values"] = values
    changed = results | {"models": models, "inputs": {"campaign.toml": "1" * 64}}
    (other / "results.json").write_text(json.dumps(changed))
    results["models"]["reduced"]["values"] = {"G": values["G"] | {"value": 4.0, "low": 3.0, "high": 5.0}}
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "results.json").write_text(json.dumps(results))
    shutil.copytree(other / "predictions", tmp_path / "full" / "predictions")
    runs = load_runs([tmp_path / "full", other])
    table = run_list(runs, ["full", "plain"], tmp_path)
    assert table.against is not None
    assert table.against.cells[0][1][0] == behind(lead_over(load_run(folder), "discovered", "reduced"))
    assert table.against.cells[1][0][0].startswith("−")
    assert table.against.cells[1][1] == ("reference", "")
    told = table.against.cells[0][1][1]
    assert "without discovered" in told
    assert "campaign.toml changed" in told
    assert "reduced, G: 4 → 9 W/K" in told
