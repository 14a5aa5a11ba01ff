"""The page on a small machine: every chapter is there, with the figures that results and recordings give."""

from __future__ import annotations

import json
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.experiment import load_experiment, run
from discovery.experiment.summary import summary
from discovery.models import Parameter
from discovery.paper import influences
from discovery.paper.film import identified
from discovery.paper.recalibration import features
from tests.small import EXPERIMENT, results_of, write_small

PAPER = """
[models.apart]
kind = "superposition"
separate = { T_env = ["a"], P = ["b"] }

[paper]
thermobalance = "one_body"
superposition = "apart"
reduced = "reduced"
dry_load = "superposition"
speeding = ["one_body", "reduced"]
wet = "a"
dry = "b"
compensated = ["c"]
test_piece = ["c"]
symmetric = "E_R0T"
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_small(tmp_path)
    place = tmp_path / "experiment.toml"
    place.write_text(EXPERIMENT.replace("[models]", "cross_validate = false\n[models]") + PAPER)
    return place


def rows_of(chapter: dict[str, Any], title: str) -> list[list[Any]]:
    found: list[list[Any]] = next(t["rows"] for t in chapter["tables"] if title in t["title"])
    return found


def test_the_page_has_a_chapter_for_each_part(path: Path) -> None:
    out = run(path, path.parent / "out")
    results = json.loads((out / "results.json").read_text())
    made = results["paper"]
    assert list(made) == [
        "figure-2",
        "figure-3",
        "equation-6",
        "section-3",
        "symmetry",
        "equation-8",
        "section-4",
        "budgets",
        "test-piece",
    ]
    page = (out / "paper.html").read_text()
    for one in made.values():
        assert one["title"].replace("'", "&#39;") in page
        assert one["shows"]
        assert one["does_not_show"]
    assert "http" not in page.replace("http://www.w3.org", "")  # it loads nothing

    # two days of recordings of their own against two days together
    hours = {row[0]: row[2] for row in rows_of(made["equation-8"], "'apart'")}
    assert hours == pytest.approx({"T_env": 24.0, "P": 24.0})
    # table 3 holds the criteria of results.json
    scores = results["models"]["reduced"]["recordings"]["c"]["E_Y0C"]
    row = next(r for r in rows_of(made["section-4"], "Table 3") if r[:2] == ["E_Y0C", "reduced"])
    assert row[2:8:2] == pytest.approx([scores["peak"], scores["mean"], scores["variance"]])
    # E_R0T of this machine is no error that symmetry keeps small, and the page says so
    assert "moves by more" in made["symmetry"]["shows"][0]
    # the machine is as it was: a few features say so, and the model is kept
    answers = rows_of(made["test-piece"], "What the features say")
    assert [(row[2], row[3], row[5]) for row in answers] == [(12, "nothing", None), (24, "nothing", None)]
    # every recording that was loaded has a budget
    assert len(rows_of(made["budgets"], "Heat into")[0]) == 1 + len("abc")
    # the model of the machine compensates it
    rows = rows_of(made["section-3"], "Measured on the machine")
    left = {r[1]: r[8] for r in rows if r[0] == "E_Y0C"}
    assert left["c, compensated"] < 0.2 * left["c, uncompensated"]


def test_a_chapter_that_cannot_be_made_is_one_sentence_and_the_run_stands(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (path.parent / "left.toml").write_text(EXPERIMENT)  # it has no [mismatch]
    path.write_text(path.read_text() + 'left_nozzle = "left.toml"\n')

    def broken(*_: Any) -> None:
        raise KeyError("c")

    monkeypatch.setattr(influences, "budget", broken)  # an error in the code, not in a file
    out = run(path, path.parent / "out")
    failed = {key: one["failed"] for key, one in results_of(out)["paper"].items() if "failed" in one}
    assert list(failed) == ["left-nozzle-not-made", "budgets-not-made"]
    nozzle, budgets = failed.values()
    assert nozzle.startswith("The chapter “left nozzle” could not be made: ")
    assert nozzle.endswith("left.toml: name the model to diagnose under [mismatch].")
    assert "“budgets” could not be made: internal error KeyError('c') in test_page.py" in budgets
    lines = list(summary(out))
    for page in ((out / "paper.html").read_text(), (out / "report.html").read_text()):
        for one in failed.values():
            assert one in lines
            assert one in unescape(page)
    assert "Figure 2: temperatures" in (out / "paper.html").read_text()
    assert "predicts best" in (out / "report.html").read_text()


def test_a_model_that_the_page_names_must_be_there(path: Path) -> None:
    path.write_text(path.read_text().replace('reduced = "reduced"', 'reduced = "redused"'))
    with pytest.raises(UserError, match="no model 'redused'"):
        load_experiment(path)


def test_a_feature_is_one_reading_of_one_error(path: Path) -> None:
    data = load_experiment(path).campaign.recordings["c"]
    few = features(data, ["E_Y0C", "E_R0T"], 12)
    kept = np.array([np.isfinite(few.values[e]) for e in ("E_Y0C", "E_R0T")])
    assert kept.sum(axis=1).tolist() == [6, 6]
    assert kept.sum(axis=0).max() == 1
    assert few.values["T_env"].tolist() == data.values["T_env"].tolist()
    assert few.values["E_Y0C"][kept[0]].tolist() == data.values["E_Y0C"][kept[0]].tolist()


def test_an_exponent_is_identified_by_its_interval() -> None:
    assert identified(Parameter(0.5, low=0.4, high=0.6))
    assert identified(Parameter(-0.5, low=-0.6, high=-0.4))
    assert not identified(Parameter(0.5, low=-0.1, high=1.1))
    assert not identified(Parameter(0.5))
    assert not identified(Parameter(0.5, low=-np.inf, high=np.inf))
