"""Recordings: the same bytes for the same request, envelopes, sentences for mistakes."""

import json
import re
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.virtual.command import effect_list
from discovery.virtual.record import Order, draw_effect, parse_request, recording_file, take


def test_bytes_are_the_same_twice() -> None:
    order = Order("x", seed=3, hours=4.0)
    assert recording_file(order, take(order)) == recording_file(order, take(order))
    assert recording_file(order, take(order)) != recording_file(order, take(replace(order, seed=4)))


def test_command_writes_campaign_and_envelope(tmp_path: Path) -> None:
    out = tmp_path / "radiating"
    command = ["record", "--seed", "3", "--hours", "6", "--recordings", "2", "--out", str(out)]
    result = CliRunner().invoke(app, [*command, "--effect", "radiation=0.3", "--nozzle-height", "100"])
    assert result.exit_code == 0, result.output
    campaign = tomllib.loads((out / "campaign.toml").read_text())
    assert list(campaign["recordings"]) == ["recording_1", "recording_2"]
    assert "radiation" not in (out / "campaign.toml").read_text()
    assert sorted(p.name for p in out.iterdir()) == [
        "campaign.toml",
        "recording_1.csv.gz",
        "recording_2.csv.gz",
    ]
    answers = json.loads((tmp_path / "radiating.answer.json").read_text())
    assert answers[0]["effects"] == [
        {"effect": "radiation", "states": ["c_body_1"], "size": 0.3, "unit": "m2"}
    ]


def test_command_conceals_and_reveals(tmp_path: Path) -> None:
    command = ["record", "--seed", "5", "--hours", "4", "--conceal", "--reveal", "--out", str(tmp_path / "x")]
    result = CliRunner().invoke(app, command)
    assert result.exit_code == 0
    answers = json.loads((tmp_path / "x" / "answer.json").read_text())
    assert answers[0]["effects"][0]["effect"] == draw_effect(5).effect
    assert draw_effect(5).effect not in result.output


@pytest.mark.parametrize(
    ("text", "part"),
    [
        ("radiatio=1", "no effect 'radiatio'"),
        ("radiation", r"needs a size, for example radiation=0\.0294 \(m2\)"),
        ("radiation=much", r"needs a size, for example radiation=0\.0294 \(m2\)"),
        ("radiation=-1e9", "is not possible; give 0 to"),
        ("radiation=1600", "is not possible"),
        ("radiation@leg=1", "cannot act at 'leg'.*choose one of: c_body_1, c_body_2"),
        ("flooded_gap@table=1", "choose one of: c_body_1\\+b_body_1"),
    ],
)
def test_mistakes_in_effects(text: str, part: str) -> None:
    with pytest.raises(UserError, match=part):
        parse_request(text)


def test_mistakes_elsewhere(tmp_path: Path) -> None:
    for option, part in (
        (["--cycle", "wett"], "no test cycle 'wett'"),
        (["--hours", "0"], "not possible"),
        (["--fault", "rezro=1"], "no fault 'rezro'"),
        (["--campaign", "nmv"], "no campaign 'nmv'"),
        (["--conceal", "--effect", "radiation=0.3"], "leave out --effect, or --conceal"),
    ):
        result = CliRunner().invoke(app, ["record", "--out", str(tmp_path / "x"), *option])
        assert result.exit_code == 2
        assert part in result.output
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize("words", [["--effect", "help"], ["--fault", "help"], ["--effect", "radiation=help"]])
def test_help_lists_effects_and_faults(words: list[str]) -> None:
    result = CliRunner().invoke(app, ["record", *words])
    assert result.exit_code == 0
    assert "radiation" in result.stdout
    assert "clock_shift" in result.stdout


def test_the_columns_of_the_help_line_up() -> None:
    rows = [line for line in effect_list().splitlines() if line.startswith("  ")]
    places = [re.search(r" {2}(at|on)", row) for row in rows]
    assert len({place.start() for place in places if place}) == 1
    assert sum(place is None for place in places) == 2  # a clock and a device have no place


def test_a_folder_with_other_recordings_is_left_alone(tmp_path: Path) -> None:
    def record(*words: str) -> tuple[int, str]:
        result = CliRunner().invoke(app, ["record", "--hours", "2", "--out", str(tmp_path / "x"), *words])
        return result.exit_code, result.output

    assert record("--recordings", "2")[0] == 0
    before = {path: path.read_bytes() for path in (tmp_path / "x").iterdir()}
    status, said = record()
    assert (status, "another campaign (with recording_1.csv.gz)" in said) == (1, True)
    assert {path: path.read_bytes() for path in (tmp_path / "x").iterdir()} == before
    assert record("--recordings", "2", "--seed", "2")[0] == 0  # the same names: all is replaced


def test_an_answer_goes_with_its_recordings(tmp_path: Path) -> None:
    command = ["record", "--hours", "2", "--out", str(tmp_path / "x")]
    assert CliRunner().invoke(app, [*command, "--effect", "radiation=0.3", "--reveal"]).exit_code == 0
    answers = [tmp_path / "x.answer.json", tmp_path / "x" / "answer.json"]
    assert all(path.exists() for path in answers)
    assert CliRunner().invoke(app, command).exit_code == 0
    assert not any(path.exists() for path in answers)
