"""What an experiment refuses, each in one sentence with its place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.experiment import load_experiment, run
from discovery.models import read_model
from discovery.recordings import load_campaign
from discovery.recordings.check import check_campaign
from tests.small import EXPERIMENT, MODEL, results_of, write_small


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_small(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("reads", "name", "kinds", "say"),
    [
        (load_experiment, "campaign.toml", "a campaign, and an experiment", "check {}"),
        (load_experiment, "model.toml", "a model, and an experiment", "check CAMPAIGN --model {}"),
        (load_experiment, "a.csv", "a recording, and a TOML file", "new DIR --from {}"),
        (read_model, "campaign.toml", "a campaign, and a model", "check {}"),
        (check_campaign, "experiment.toml", "an experiment, and a campaign", "run {}"),
        (check_campaign, "a.csv", "a recording, and a TOML file", "new DIR --from {}"),
        (load_campaign, "model.toml", "a model, and a campaign", "check CAMPAIGN --model {}"),
    ],
)
def test_files_mixed_up_are_called_by_their_kind(
    folder: Path, reads: Callable[[Path], object], name: str, kinds: str, say: str
) -> None:
    with pytest.raises(UserError) as caught:
        reads(folder / name)
    assert f"{folder / name}: this is {kinds} is needed; " in str(caught.value)
    assert f"`discovery {say.format(folder / name)}`" in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('fit = ["a", "b"]', 'fit = ["a", "bb"]', ["line 4", "fit", "no recording 'bb'", "did you mean 'b'"]),
        ('held_out = ["c"]', 'held_out = ["b"]', ["line 5", "'b' is also in fit"]),
        ('held_out = ["c"]', 'held_out = ["d"]', ["line 5", "no recording 'd'"]),
        ('fit = ["a", "b"]', "fit = []", ["line 4", "at least 1"]),
        ('fit = ["a", "b"]', 'fit = "a"', ["line 4", "fit: should be a list", "not 'a'"]),
        ('{ kind = "reduced" }', '"model.toml"', ["line 8", "should be a table", "not 'model.toml'"]),
        ('kind = "reduced"', 'kind = "sindy", inputs = "P"', ["line 8", "inputs: should be a list"]),
        ('kind = "reduced"', 'kind = "sindy", seed = "1"', ["line 8", "seed: should be a valid integer"]),
        ('fit = ["a", "b"]\n', "", ["the key 'fit' is missing"]),
        ('fit = ["a", "b"]', 'fits = ["a", "b"]', ["line 4", "unknown key", "did you mean 'fit'"]),
        ('kind = "reduced"', 'kind = "redced"', ["line 8", "is not known", "mean 'reduced'"]),
        ('kind = "reduced"', "", ["line 8", 'say file = "my_model.toml", or kind = one of reduced, superp']),
        ('kind = "reduced"', 'kind = "x"', ["line 8", "are: reduced, superposition, ", "or file = "]),
        ('kind = "reduced"', 'fiel = "x"', ["line 8", "did you mean 'file'"]),
        ('kind = "reduced"', 'kind = "reduced", file = "x"', ["line 8", "unknown key"]),
        ('kind = "reduced"', 'kind = "sindy", file = "x"', ["line 8", "kind, inputs, baseline"]),
        ('kind = "reduced"', 'kind = "reduced", input = ["P"]', ["line 8", "did you mean 'inputs'"]),
        ('inputs = ["T_env", "P"]', 'inputs = ["T_env", "Q"]', ["line 9", "no channel 'Q'"]),
        ('inputs = ["T_env", "P"]', 'separate = { P = ["c"] }', ["line 9", "'c' is held out"]),
        ('"model.toml"', '"model.toml", also = ["c"]', ["line 10", "also: 'c' is held out"]),
        ('kind = "reduced"', 'kind = "sindy", also = ["z"]', ["line 8", "no recording 'z'"]),
        ('inputs = ["T_env", "P"]', 'separate = { P = ["z"] }', ["line 9", "no recording 'z'"]),
        ('inputs = ["T_env", "P"]', 'inputs = ["T_env", "E_R0T"]', ["line 9", "is an output of this"]),
        ('file = "model.toml"', 'file = "modell.toml"', ["modell.toml", "no such file"]),
        ('campaign = "campaign.toml"', 'campaign = "c.toml"', ["c.toml", "no such file"]),
        ('name = "small"', 'name = "..."', ["line 2", "with letters or digits"]),
        ('name = "small"', 'name = "a\\nb"', ["line 2", "one line"]),
        ('name = "small"', 'name = "small"\noutputs = ["P"]', ["line 3", "'P' is no measured channel"]),
        ("one_body      =", '"one/body"    =', ["line 10", "name of a file"]),
        ("[models]", "[mismatch]\nmodel = \"x\"\n[models]", ["no model 'x'"]),
        ("[models]", "[export]\nmodel = \"one_body\"\nto = [\"exe\"]\n[models]", ["'exe' is not known"]),
        ("[models]", "[models", ["line 7", "not valid TOML"]),
    ],
)  # fmt: skip
def test_a_mistake_is_one_sentence_with_its_place(folder: Path, old: str, new: str, words: list[str]) -> None:
    assert old in EXPERIMENT
    (folder / "experiment.toml").write_text(EXPERIMENT.replace(old, new))
    with pytest.raises(UserError) as caught:
        run(folder / "experiment.toml", folder / "out")
    sentence = str(caught.value)
    assert "\n" not in sentence
    for word in words:
        assert word in sentence
    assert not (folder / "out").exists()


def test_a_model_without_the_outputs_is_refused(folder: Path) -> None:
    (folder / "model.toml").write_text(MODEL.split("[outputs]")[0])
    with pytest.raises(UserError, match=r"'one_body' gives none of the outputs E_Y0C, E_R0T"):
        run(folder / "experiment.toml", folder / "out")


def test_an_output_that_a_model_lacks_is_told_with_the_nearest_name(folder: Path) -> None:
    (folder / "model.toml").write_text(MODEL.replace("E_R0T", "E_R0TT"))
    done = CliRunner().invoke(app, ["run", str(folder / "experiment.toml"), "--out", str(folder / "out")])
    assert "note, one_body: gives no E_R0T, which the experiment asks for" in done.output
    assert "is its output 'E_R0TT' meant to be 'E_R0T'?" in done.output
    assert results_of(folder / "out")["models"]["reduced"]["notes"] == []
    (folder / "model.toml").write_text("\n".join(line for line in MODEL.splitlines() if "E_R0T" not in line))
    done = CliRunner().invoke(app, ["diagnose", str(folder), "--out", str(folder / "two")])
    assert done.exit_code == 0, done.output
    assert "gives no" not in done.output  # the first model is diagnosed, and gives them all


def test_an_output_that_is_demanded_of_a_model_has_to_be_there(folder: Path) -> None:
    (folder / "model.toml").write_text(MODEL.replace("E_R0T", "E_R1T"))
    text = EXPERIMENT.replace('"model.toml"', '"model.toml", outputs = ["E_R0T"]')
    (folder / "experiment.toml").write_text(text)
    with pytest.raises(UserError, match=r"line 10: .* model\.toml gives no 'E_R0T'; did you mean 'E_R1T'"):
        run(folder / "experiment.toml", folder / "out")


def test_an_output_that_is_an_input_is_refused(folder: Path) -> None:
    (folder / "model.toml").write_text(MODEL + 'P = "G"\n')
    with pytest.raises(UserError, match=r"model\.toml, line 22: outputs\.P: 'P' is an input of the campaign"):
        run(folder / "experiment.toml", folder / "out")


@pytest.mark.parametrize("shift", [0, 1000])
def test_what_is_fitted_cannot_be_held_out_under_another_name(folder: Path, shift: int) -> None:
    """The same readings in another file, on another clock, and with another constant for an input."""
    lines = [line.split(",") for line in (folder / "a.csv").read_text().splitlines()]
    moved = [[str(int(line[0]) + shift), line[1], "9", *line[3:]] for line in lines[1:]]
    (folder / "c.csv").write_text("\n".join(",".join(line) for line in [lines[0], *moved]))
    with pytest.raises(
        UserError, match=r"line 5: held_out: 'c' holds the same readings as 'a', which is fitted"
    ):
        run(folder / "experiment.toml", folder / "out")


def test_what_is_wrong_with_the_recordings_is_said_at_the_end(folder: Path) -> None:
    clean = CliRunner().invoke(app, ["run", str(folder / "experiment.toml"), "--out", str(folder / "one")])
    assert "discovery check" not in clean.output
    text = (folder / "b.csv").read_text().splitlines()
    (folder / "b.csv").write_text("\n".join([*text, "9999999,22,0,,"]))
    for verb in ("run", "diagnose"):
        command = [verb, str(folder / "experiment.toml"), "--out", str(folder / verb)]
        told = [line for line in CliRunner().invoke(app, command).output.splitlines() if "check" in line]
        assert len(told) == 1
        assert "b.csv, line 291: time jumps by" in told[0]
        assert f"`discovery check {folder / 'campaign.toml'}`" in told[0]


def test_nothing_is_fitted_to_recordings_without_a_reading(folder: Path) -> None:
    """A run had ended with 0 and a diagnosis with a traceback."""
    import pandas as pd

    for name in ("a", "b"):
        frame = pd.read_csv(folder / f"{name}.csv")
        frame[["E_Y0C", "E_R0T"]] = np.nan
        frame.to_csv(folder / f"{name}.csv", index=False)
    with pytest.raises(UserError, match=r"line \d+: fit: no reading of E_.* in a, b; name recordings"):
        load_experiment(folder / "experiment.toml")
