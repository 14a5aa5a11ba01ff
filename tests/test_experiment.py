"""The main job end to end on small data: what it writes, what it refuses, and that nothing held out leaks
into a fit.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import RunsAwayError, UsageError, UserError
from discovery.experiment import load_experiment, run
from discovery.experiment.fitted import offset_notes
from discovery.experiment.summary import comparison, rms_table
from discovery.fitting import Fit
from discovery.models import read_model
from discovery.recordings import Channel, load_campaign
from discovery.recordings.check import check_campaign
from discovery.report.compare import load_runs
from discovery.report.ranking import ranked
from discovery.report.run import load_run
from tests.small import CAMPAIGN, EXPERIMENT, MODEL, write_recording, write_small


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_small(tmp_path)
    return tmp_path


def results_of(out: Path) -> dict[str, Any]:
    content: dict[str, Any] = json.loads((out / "results.json").read_text())
    return content


def test_the_inputs_of_equation_9_are_all_that_heats(folder: Path) -> None:
    """Two heaters: both. A spindle without a recorded power: its speed. The first of a role is not enough."""

    def inputs(*lines: str) -> list[str]:
        head = 'name = "x"\n[channels]\nT_env = { role = "ambient temperature", unit = "degC" }\n'
        tail = 'E_Y0C = { role = "error", unit = "um" }\n[recordings]\na = { file = "d.csv" }\n'
        (folder / "campaign.toml").write_text(head + "\n".join(lines) + "\n" + tail)
        rows = [f"{60 * k},21,{k % 2},{k % 3},0,{k / 9}" for k in range(30)]
        (folder / "d.csv").write_text("\n".join(["time,T_env,one,two,off,E_Y0C", *rows]))
        text = 'name = "x"\ncampaign = "campaign.toml"\nfit = ["a"]\n[models]\nr = { kind = "reduced" }\n'
        (folder / "experiment.toml").write_text(text)
        experiment = load_experiment(folder / "experiment.toml")
        return experiment.inputs(experiment.form.models["r"])

    load, speed = '{ role = "heat load", unit = "W" }', '{ role = "rotation speed", unit = "rpm" }'
    assert inputs(f"one = {load}", f"two = {load}", f"off = {load}") == ["T_env", "one", "two"]
    assert inputs(f"one = {speed}") == ["T_env", "one"]
    assert inputs(f"one = {speed}", f"two = {load}") == ["T_env", "two"]


def test_the_note_on_an_uncertain_room_names_each_recording_once() -> None:
    room = Channel("T_env", "ambient temperature", "degC", None, "linear", spread=1.0)
    one = cast("Fit", SimpleNamespace(offsets={"T_env": {"a": (0.5, 0.1)}}))
    two = cast("Fit", SimpleNamespace(offsets={"T_env": {"a": (0.5, 0.1), "b": (-0.2, 0.1)}}))
    assert offset_notes(one, {"T_env": room})[0].count("'a'") == 1
    assert "-0.2 K in 'b' to +0.5 K in 'a'" in offset_notes(two, {"T_env": room})[0]


def test_a_room_that_the_fit_leaves_where_it_was_is_no_note() -> None:
    room = Channel("T_env", "ambient temperature", "degC", None, "linear", spread=1.0)
    none = cast("Fit", SimpleNamespace(offsets={"T_env": {"a": (2.4e-12, 0.1), "b": (-3e-4, 0.1)}}))
    one = cast("Fit", SimpleNamespace(offsets={"T_env": {"a": (2.4e-12, 0.1), "b": (-0.1, 0.1)}}))
    assert offset_notes(none, {"T_env": room}) == []
    assert "-0.1 K in 'b'" in offset_notes(one, {"T_env": room})[0]


def test_a_run_writes_what_the_contract_says(folder: Path) -> None:
    out = run(folder / "experiment.toml", folder / "out")
    names = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    models = ("reduced", "superposition", "one_body")
    assert names >= {
        "results.json",
        "inputs.json",
        "report.html",
        *(f"models/{m}.toml" for m in models),
        *(f"predictions/{r}.csv" for r in "abc"),
    }
    results = results_of(out)
    assert (results["experiment"], results["fit"], results["held_out"]) == ("small", ["a", "b"], ["c"])
    assert list(results["models"]) == list(models)
    entry = results["models"]["reduced"]
    assert (entry["terms"], entry["parameters"]) == (8, 8)
    assert entry["equations"][0].startswith("d/dt E_Y0C = ")
    assert set(entry["recordings"]) == {"a", "b", "c"}
    score = entry["recordings"]["c"]["E_Y0C"]
    assert set(score) == {"rms", "peak", "mean", "variance", "r2", "uncompensated", "improvement"}
    assert set(score["uncompensated"]) == set(score["improvement"]) == {"rms", "peak", "mean", "variance"}
    assert len(results["inputs"]["c.csv"]) == 64
    assert results["versions"]["numpy"] == np.__version__


def test_the_right_model_is_right_on_the_held_out_recording(folder: Path) -> None:
    results = results_of(run(folder / "experiment.toml", folder / "out"))
    entry = results["models"]["one_body"]
    for error in ("E_Y0C", "E_R0T"):
        assert entry["recordings"]["c"][error]["rms"] == pytest.approx(0.3, rel=0.15)
        assert entry["cross_validation"]["recordings"][error] == pytest.approx(0.3, rel=0.15)
    values = entry["values"]
    assert values["G"]["low"] < 12.0 < values["G"]["high"]
    assert values["loss"]["value"] == pytest.approx(0.4, rel=0.02)


def test_a_model_that_runs_away_on_an_unseen_recording_is_told_and_last(folder: Path) -> None:
    """Its feedback is off in the recordings to fit, where it is the same model as the other."""
    campaign = CAMPAIGN.replace("[recordings]", 'mode = { role = "other input", unit = "1" }\n[recordings]')
    for name in "abc":
        campaign = campaign.replace(
            f'"{name}.csv" }}', f'"{name}.csv", set = {{ mode = {int(name == "c")} }} }}'
        )
    (folder / "campaign.toml").write_text(campaign)
    feedback = '[[terms]]\ninto = "body"\nexpression = "k*mode*(body - T_env)"\n[outputs]'
    wild = MODEL.replace("[outputs]", feedback)
    wild = wild.replace("[states]", 'k = { start = 500.0, unit = "W/K", fixed = true }\n[states]')
    (folder / "wild.toml").write_text(wild)
    models = (
        'wild = { file = "wild.toml" }\nreduced = { kind = "reduced" }\none_body = { file = "model.toml" }\n'
    )
    text = EXPERIMENT[: EXPERIMENT.index("reduced ")] + models
    (folder / "experiment.toml").write_text(text)
    out = run(folder / "experiment.toml", folder / "out")
    entries = results_of(out)["models"]
    assert set(entries["wild"]["recordings"]) == {"a", "b"}
    assert "diverges on recording 'c'" in " ".join(entries["wild"]["notes"])
    assert set(entries["one_body"]["recordings"]) == {"a", "b", "c"}
    assert (out / "predictions" / "c.csv").read_text().splitlines()[0].count("|") == 4
    loaded = load_run(out)
    assert ranked(loaded) == ["one_body", "reduced", "wild"]
    assert (
        "The free run of “wild” diverges on the held-out recording “c”." in (out / "report.html").read_text()
    )


def test_predictions_are_readings_and_models_side_by_side(folder: Path) -> None:
    out = run(folder / "experiment.toml", folder / "out")
    table = np.genfromtxt(out / "predictions" / "c.csv", delimiter=",", names=True, deletechars="")
    assert table.dtype.names is not None
    assert set(table.dtype.names) == {
        "time", "E_Y0C", "E_R0T",
        *(f"{e}|{m}" for e in ("E_Y0C", "E_R0T") for m in ("reduced", "superposition", "one_body")),
    }  # fmt: skip
    rms = np.sqrt(np.mean((table["E_Y0C"] - table["E_Y0C|one_body"]) ** 2))
    assert rms == pytest.approx(
        results_of(out)["models"]["one_body"]["recordings"]["c"]["E_Y0C"]["rms"], rel=1e-3
    )


def test_a_fitted_model_can_be_fitted_again(folder: Path) -> None:
    """What a run writes is a model file like any other: run again from it, the numbers stay."""
    out = run(folder / "experiment.toml", folder / "out")
    again = EXPERIMENT.replace(
        'one_body      = { file = "model.toml" }', 'one_body = { file = "out/models/one_body.toml" }'
    )
    (folder / "again.toml").write_text(
        again.replace('{ kind = "reduced" }', '{ file = "out/models/reduced.toml" }')
    )
    second = run(folder / "again.toml", folder / "out2")
    for name in ("one_body", "reduced", "superposition"):
        before, after = (read_model(o / "models" / f"{name}.toml") for o in (out, second))
        for parameter in before.free:
            assert after.parameters[parameter].value == pytest.approx(
                before.parameters[parameter].value, rel=2e-3
            )


def test_nothing_held_out_touches_a_fit(folder: Path) -> None:
    """Another held-out recording: every number found stays the same to the last digit, the scores on it
    change.
    """
    (folder / "experiment.toml").write_text(EXPERIMENT + 'discovered = { kind = "sindy", bootstraps = 4 }\n')
    before = run(folder / "experiment.toml", folder / "out1")
    write_recording(folder / "c.csv", seed=99)
    after = run(folder / "experiment.toml", folder / "out2")
    for name in ("reduced", "superposition", "one_body", "discovered"):
        file = f"models/{name}.toml"
        assert (before / file).read_bytes() == (after / file).read_bytes()
        one, two = (results_of(out)["models"][name] for out in (before, after))
        for key in ("equations", "values", "cross_validation", "noise", "notes", "terms"):
            assert one[key] == two[key], key
        assert one["recordings"]["a"] == two["recordings"]["a"]
        assert one["recordings"]["c"] != two["recordings"]["c"]


def test_fits_are_not_even_handed_what_is_held_out(folder: Path) -> None:
    experiment = load_experiment(folder / "experiment.toml")
    assert set(experiment.fitting.recordings) == {"a", "b"}
    assert set(experiment.campaign.recordings) == {"a", "b", "c"}


def test_one_influence_after_the_other(folder: Path) -> None:
    entry = 'superposition = { kind = "superposition", separate = { T_env = ["a"], P = ["b"] } }'
    text = EXPERIMENT.replace('superposition = { kind = "superposition", inputs = ["T_env", "P"] }', entry)
    (folder / "experiment.toml").write_text(text)
    found = results_of(run(folder / "experiment.toml", folder / "out"))["models"]["superposition"]
    assert found["parameters"] == 0
    assert found["values"]["p4_E_Y0C"]["low"] < found["values"]["p4_E_Y0C"]["value"]


def test_a_model_may_be_fitted_to_more_than_the_others(folder: Path) -> None:
    """As if the experiment named those recordings for it; the other models do not see them."""
    text = EXPERIMENT.replace('fit = ["a", "b"]', 'fit = ["a"]')
    more = text.replace('"model.toml" }', '"model.toml", also = ["b"] }')
    found = {}
    for name, content in (("both", EXPERIMENT), ("one", text), ("more", more)):
        (folder / "experiment.toml").write_text(content)
        found[name] = results_of(run(folder / "experiment.toml", folder / name))
    both, one, got = (found[name]["models"] for name in ("both", "one", "more"))
    for key in ("values", "cross_validation", "recordings"):
        assert got["one_body"][key] == both["one_body"][key] != one["one_body"][key]
        assert got["reduced"][key] == one["reduced"][key] != both["reduced"][key]
    assert found["more"]["fit"] == ["a"]
    assert got["one_body"]["notes"][0] == "also fitted to b"
    assert set(got["reduced"]["recordings"]) == {"a", "c"}


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
        ('name = "small"', 'name = "../small"', ["line 2", "name of a file"]),
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
    done = CliRunner().invoke(
        app, ["diagnose", str(folder / "experiment.toml"), "--out", str(folder / "two")]
    )
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


def test_an_interrupted_run_leaves_what_was_there(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = run(folder / "experiment.toml", folder / "out")
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("discovery.experiment.pipeline.write_run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run(folder / "experiment.toml", out)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


def test_a_folder_that_holds_something_else_is_left_alone(folder: Path) -> None:
    (folder / "mine").mkdir()
    (folder / "mine" / "thesis.tex").write_text("...")
    with pytest.raises(UserError, match="something else than results"):
        run(folder / "experiment.toml", folder / "mine")
    assert (folder / "mine" / "thesis.tex").exists()


def test_a_run_replaces_an_older_one_as_a_whole(folder: Path) -> None:
    out = run(folder / "experiment.toml", folder / "out")
    shorter = EXPERIMENT.replace('superposition = { kind = "superposition", inputs = ["T_env", "P"] }\n', "")
    (folder / "experiment.toml").write_text(shorter)
    run(folder / "experiment.toml", out)
    assert not (out / "models" / "superposition.toml").exists()


def test_runs_side_by_side(folder: Path) -> None:
    first = run(folder / "experiment.toml", folder / "one")
    (folder / "experiment.toml").write_text(EXPERIMENT.replace('fit = ["a", "b"]', 'fit = ["a"]'))
    second = run(folder / "experiment.toml", folder / "two")
    text = "\n".join(comparison(load_runs([first, second])))
    assert "Recording 'c' (held out)" in text
    for out in (first, second):
        assert f"{out.name}: one_body" in text
    assert "two differs from one: fit: a, b → a" in text
    assert [one.folder for one in load_runs([folder], against=second)] == [second, first]
    (folder / "empty").mkdir()
    with pytest.raises(UsageError, match="two or more runs"):
        load_runs([first])
    with pytest.raises(UserError, match="empty: there is no run"):
        load_runs([first, folder / "empty"])


def test_a_run_without_a_recording_has_no_say_in_what_it_was() -> None:
    here = {"fit": ["a"], "held_out": ["b"], "models": {}}
    elsewhere = {"fit": ["x"], "held_out": [], "models": {}}
    assert rms_table({"one": here, "two": elsewhere}, "b").title == "Recording 'b' (held out)"
    assert rms_table({"one": here, "two": {**elsewhere, "fit": ["b"]}}, "b").title.endswith(
        "(fitted / held out)"
    )


def test_nothing_is_fitted_to_recordings_without_a_reading(folder: Path) -> None:
    """A run had ended with 0 and a diagnosis with a traceback."""
    import pandas as pd

    for name in ("a", "b"):
        frame = pd.read_csv(folder / f"{name}.csv")
        frame[["E_Y0C", "E_R0T"]] = np.nan
        frame.to_csv(folder / f"{name}.csv", index=False)
    with pytest.raises(UserError, match=r"line \d+: fit: no reading of E_.* in a, b; name recordings"):
        load_experiment(folder / "experiment.toml")


def test_a_run_says_where_its_campaign_is(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """An export may start in another folder than the run did."""
    monkeypatch.chdir(folder)
    out = run(Path("experiment.toml"), Path("out"))
    named = json.loads((out / "results.json").read_text())["campaign_file"]
    monkeypatch.chdir(folder.parent)
    assert Path(named).samefile(folder / "campaign.toml")


def test_the_command_line(folder: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(app, ["run", str(folder / "experiment.toml"), "--out", str(folder / "out")])
    assert done.exit_code == 0, done.output
    assert "report.html" in done.output
    shutil.copytree(folder / "out", folder / "copy")
    compared = runner.invoke(app, ["compare", str(folder / "out"), str(folder / "copy")])
    assert compared.exit_code == 0
    assert "copy differs from out: none" in compared.output
    failed = runner.invoke(app, ["run", str(folder / "nothing.toml")])
    assert failed.exit_code == 1
    assert "no such file" in failed.output
    assert runner.invoke(app, ["run"]).exit_code == 2


@pytest.mark.parametrize("name", ["nmv5000", "tclab"])
def test_the_experiments_of_the_repository_load(name: str) -> None:
    experiment = load_experiment(Path(__file__).parents[1] / "experiments" / f"{name}.toml")
    assert not set(experiment.fit) & set(experiment.held_out)
    for model, entry in experiment.form.models.items():
        if entry.kind == "file":
            assert experiment.model_file(model).outputs or experiment.model_file(model).states


def test_a_model_that_runs_away_in_cross_validation_is_told_and_kept(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def explode(*_: object) -> None:
        raise RunsAwayError("model 'x' diverges on recording 'a'")

    monkeypatch.setattr("discovery.experiment.fitted.cross_validate", explode)
    out = run(folder / "experiment.toml", folder / "out")
    for name, entry in results_of(out)["models"].items():
        assert entry["cross_validation"] == {}
        assert f"the fit of {name} diverges" in entry["notes"][0]
        assert set(entry["recordings"]) == {"a", "b", "c"}
