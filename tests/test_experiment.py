"""The main job end to end on small data: what it writes, and that nothing held out leaks into a fit."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import RunsAwayError, UsageError, UserError
from discovery.experiment import load_experiment, run
from discovery.experiment.fitted import offset_notes, start_notes
from discovery.experiment.summary import comparison, rms_table
from discovery.fitting import Fit, fit_model
from discovery.models import Model, Parameter, State, read_model
from discovery.recordings import Campaign, Channel, Recording
from discovery.report.compare import load_runs
from discovery.report.ranking import ranked
from discovery.report.run import load_run
from discovery.terms import Term, parse
from tests.small import CAMPAIGN, EXPERIMENT, MODEL, results_of, write_recording, write_small


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_small(tmp_path)
    return tmp_path


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


def test_a_room_that_the_fit_moves_far_beyond_its_spread_is_told_so() -> None:
    """A housing 16 K warmer than the guess of the room: the fit put it 67 K off."""
    room = Channel("T_env", "ambient temperature", "degC", None, "linear", spread=5.0)
    far = cast("Fit", SimpleNamespace(offsets={"T_env": {"a": (-67.0, 1.0), "b": (20.0, 1.0)}}))
    near = cast("Fit", SimpleNamespace(offsets={"T_env": {"a": (-8.0, 1.0)}}))
    said = "far beyond it: the model lacks something, or `spread` is too small"
    assert said in offset_notes(far, {"T_env": room})[0]
    assert said not in offset_notes(near, {"T_env": room})[0]


@pytest.mark.parametrize(("begins", "start", "said"), [(41.0, None, 1), (95.0, None, 0), (41.0, "plate", 0)])
def test_a_machine_that_was_just_switched_on_began_in_no_balance(
    begins: float, start: str | None, said: int
) -> None:
    """An element of 95 degC in balance with its power, and a plate that follows it, cold or in balance."""
    time = 2.0 * np.arange(120.0)
    plate = 95.0 + (begins - 95.0) * np.exp(-time / 60.0) + np.sin(time / 40.0)
    channels = {
        "power": Channel("power", "heat load", "W", None, "held"),
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "plate": Channel("plate", "temperature", "degC", None, "linear"),
    }
    inputs = {"power": np.full(120, 750.0), "room": np.full(120, 20.0)}
    model = Model(
        "lamp",
        {"gain": Parameter(0.1, "K/W")},
        {"element": State("element", start=parse(start) if start else None), "plate": State("plate")},
        (
            Term("power", "element", parse("(gain*power + room - element)/10")),
            Term("contact", "plate", parse("(element - plate)/60")),
        ),
        {},
    )
    campaign = Campaign("lamp", channels, {"a": Recording("a", time, {**inputs, "plate": plate})})
    found = start_notes(fit_model(model, campaign, ["a"], ["plate"]))
    assert len(found) == said
    assert all("'a' begins where plate is 5" in one and "element without a start" in one for one in found)


def test_a_fit_whose_balance_is_not_finite_is_judged_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The root of a level that the balance puts below zero: the fit itself stays finite."""

    def runs_away(*_: object) -> None:
        raise RunsAwayError("no finite rate")

    monkeypatch.setattr("discovery.experiment.fitted.at_rest", runs_away)
    states = {"hidden": State("hidden")}
    system = SimpleNamespace(grid=None, model=Model("m", {}, states, (), {}), states=("hidden",))
    fit = cast("Fit", SimpleNamespace(trajectories=(SimpleNamespace(system=system, values={}),)))
    assert start_notes(fit) == []


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


def test_a_limit_that_readings_press_against_can_be_changed_as_the_note_says(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The body has 0.72 1/h and a loss of 0.4; both limits stand in the way."""
    (folder / "model.toml").write_text(
        MODEL.replace('0.5, unit = "1", min = 0.0', '0.1, unit = "1", max = 0.2')
    )
    text = EXPERIMENT[: EXPERIMENT.index("[models]")]
    (folder / "experiment.toml").write_text(
        text + '[models]\nreduced = { kind = "reduced" }\none_body = { file = "model.toml" }\n'
    )
    monkeypatch.setattr("discovery.models.reduced.POLE_MAX", -2.0)
    out = run(folder / "experiment.toml", folder / "out")
    notes = {name: "\n".join(one["notes"]) for name, one in results_of(out)["models"].items()}
    assert "loss is at its upper limit, 0.2: change the limit in model.toml; or" in notes["one_body"]
    said = "copy models/reduced.toml of the results next to the experiment, change it there, and write "
    assert "p1_E_Y0C is at its upper limit, -2 1/h: " in notes["reduced"]
    assert said + '{ file = "reduced.toml" }' in notes["reduced"]
    fitted = (out / "models" / "reduced.toml").read_text()
    (folder / "reduced.toml").write_text(fitted.replace("max = -2.0", "max = -0.01"))
    (folder / "experiment.toml").write_text(text + '[models]\nreduced = { file = "reduced.toml" }\n')
    again = results_of(run(folder / "experiment.toml", folder / "again"))["models"]["reduced"]
    assert again["values"]["p1_E_Y0C"]["value"] == pytest.approx(-0.72, rel=0.1)
    assert not any("limit" in note for note in again["notes"])
