"""Answers of any method, scored against the keys of practice cases."""

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from discovery.challenge.answers import score_answers
from discovery.cli import app
from discovery.errors import UserError

KEYS: dict[str, Any] = {
    "case_01": {
        "effect": None,
        "states": [],
        "also_true": [{"effect": "natural_convection", "states": ["left"]}],
    },
    "case_02": {"effect": "wear", "states": ["head"]},
    "case_03": {"effect": None, "states": []},
}


def named(effect: str, state: str) -> dict[str, Any]:
    return {"verdict": "missing physics", "physics": [{"effect": effect, "states": [state]}]}


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    cases, answers = tmp_path / "cases", tmp_path / "answers"
    cases.mkdir()
    (answers / "case_02").mkdir(parents=True)
    (cases / "keys.json").write_text(json.dumps(KEYS))
    (answers / "case_01.json").write_text(json.dumps(named("natural_convection", "left")))
    (answers / "case_02" / "diagnosis.json").write_text(json.dumps(named("wear", "head")))
    return cases, answers


def test_a_line_a_case_and_the_figures(folders: tuple[Path, Path]) -> None:
    cases, answers = folders
    (answers / "case_03.json").write_text(json.dumps(named("wear", "head")))
    run = CliRunner().invoke(app, ["challenge", "--cases-from", str(cases), "--score", str(answers)])
    assert run.exit_code == 0, run.output
    lines = run.output.splitlines()
    assert lines[0] == "case_01  +1.00  true of the machine; truth no effect, said natural_convection@left"
    assert lines[1] == "case_02  +1.00  right; truth wear@head, said wear@head"
    assert lines[2] == "case_03  -2.00  false alarm; truth no effect, said wear@head"
    figures = {line.split("  ")[0]: line.split("  ")[-1].strip() for line in lines[4:]}
    assert figures["points a case, −2 to 1"] == "0.000"  # (1 + 1 - 2)/3
    assert figures["false alarms, of cases without effect"].startswith("50.0 % (1 of 2")
    assert "right body stated first" not in figures  # no answer has a location
    assert "closable gap removed, median of all" not in figures  # no answer states an improvement


def test_a_case_without_an_answer_counts_as_failed(folders: tuple[Path, Path]) -> None:
    assert score_answers(*folders)[2] == "case_03  -2.00  failed; truth no effect, said no answer"


@pytest.mark.parametrize(
    ("content", "what"),
    [
        ('{"verdict": "maybe"}', "verdict: 'maybe' is not known; allowed are: no mismatch, missing physics"),
        (
            '{"verdict": "unexplained", "physics": [{"effect": "wear"}]}',
            "physics.0: the key 'states' is missing",
        ),
        (
            '{"verdict": "missing physics", "physics": [{"effect": "wear", "states": [1]}]}',
            "physics.0.states.0",
        ),
        ("[1]", "the file: "),
        ("{", "not JSON"),
    ],
)
def test_an_answer_of_another_form_is_one_sentence(
    folders: tuple[Path, Path], content: str, what: str
) -> None:
    (folders[1] / "case_03.json").write_text(content)
    with pytest.raises(UserError) as caught:
        score_answers(*folders)
    assert "case_03.json" in str(caught.value)
    assert what in str(caught.value)


def test_no_answers_and_no_cases_are_said(folders: tuple[Path, Path], tmp_path: Path) -> None:
    cases, answers = folders
    with pytest.raises(UserError, match="no answer to any of the 3 cases"):
        score_answers(cases, tmp_path)
    run = CliRunner().invoke(app, ["challenge", "--score", str(answers)])
    assert run.exit_code == 2
