"""Effects of the user's own, as lines of an experiment file; what is said when they are wrong."""

from __future__ import annotations

import json
import re
import shutil
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.diagnosis import Diagnosis
from discovery.diagnosis.summary import summary
from discovery.effects.candidates import candidates
from discovery.effects.catalogue import catalogue
from discovery.effects.form import Effect
from discovery.effects.not_offered import not_offered
from discovery.effects.own import EffectForm
from discovery.errors import UserError
from discovery.experiment import diagnose, load_experiment
from discovery.experiment.modelfits import fit_entry
from discovery.experiment.pipeline import diagnosis
from discovery.experiment.summary import comparison
from discovery.models import read_model, write_model
from discovery.progress import silent
from discovery.report.compare import load_runs
from discovery.terms import evaluate, names
from tests import machine
from tests.machine import CHANNELS, Array, Inputs, model, simulated

RUB = """
[[mismatch.effects]]
word = "rub"
title = "Seal that rubs and wears itself free"
place = "driven body"
formula = "k_rub*speed*exp(-time/t_free)"
amplitude = "k_rub"
unit = "W/rpm"
plausible = 0.1
shapes = { t_free = { unit = "s", middle = 17000, factor = 3 } }
source = "maintenance log"
"""


@pytest.mark.parametrize("formula", ["1 + k_rub*speed*exp(-time/t_free)", "k_rub**2*speed*exp(-time/t_free)"])
def test_the_amplitude_has_to_be_a_factor(formula: str) -> None:
    text = RUB.replace("k_rub*speed*exp(-time/t_free)", formula)
    with pytest.raises(UserError, match=r"effect 'rub': its formula has to be zero where k_rub is zero"):
        own(text)


def test_a_formula_may_replace_the_channel_of_its_place() -> None:
    """Air that follows the room sensor late. A formula without the channel and without `term` is refused."""
    enclosure = RUB.replace("driven body", "air terms").replace('"W/rpm"', '"1"')
    late = "ambient + k_rub*(lag(ambient, t_free) - ambient)"
    effect = own(enclosure.replace("k_rub*speed*exp(-time/t_free)", late))
    everywhere, *each = candidates(machine.model(), [effect], machine.scene(machine.model()))
    assert {t.into for t in everywhere.terms} == {"motor", "bed"}
    assert [{t.into for t in h.terms} for h in each] == [{"motor"}, {"bed"}]
    with pytest.raises(UserError, match=r"at the place 'air terms' its formula needs `term`"):
        own(enclosure.replace("exp(-time/t_free)", "exp(-time/t_free) + 0*speed"))


def answered(path: Path) -> Diagnosis:
    """The diagnosis of an experiment file, as a run makes it."""
    found = load_experiment(path)
    fitted = {"baseline": fit_entry(found, "baseline", found.form.models["baseline"])}
    answer = diagnosis(found, silent, fitted)
    assert answer is not None
    return answer


def own(text: str) -> Effect:
    """The effect of an experiment file's lines."""
    (form,) = tomllib.loads(text)["mismatch"]["effects"]
    return EffectForm.model_validate(form).effect()


def rub(t: float, _: Array, u: Inputs) -> tuple[float, float, float]:
    return 0.15 * u["speed"] * np.exp(-t / 20000), 0.0, 0.0


def experiment(folder: Path, effects: str) -> Path:
    """An experiment with files of its own: three recordings of the machine with a rubbing seal."""
    import pandas as pd

    lines = ['name = "three bodies"', "[channels]"]
    for c in CHANNELS.values():
        noise = f", noise = {c.noise}" if c.noise else ""
        lines.append(f'{c.name} = {{ role = "{c.role}", unit = "{c.unit}"{noise} }}')
    lines.append("[recordings]")
    for seed in (1, 2, 3):
        r = simulated(seed, concealed=rub)
        pd.DataFrame({"time": r.time, **r.values}).to_csv(folder / f"{r.name}.csv", index=False)
        lines.append(f'{r.name} = {{ file = "{r.name}.csv" }}')
    (folder / "campaign.toml").write_text("\n".join(lines))
    write_model(folder / "model.toml", model())
    path = folder / "experiment.toml"
    path.write_text(
        'name = "rub"\ncampaign = "campaign.toml"\nfit = ["r1", "r2"]\nheld_out = ["r3"]\n'
        '[models]\nbaseline = { file = "model.toml" }\n[mismatch]\nmodel = "baseline"\n' + effects
    )
    return path


def test_an_effect_in_the_experiment_file_is_found(tmp_path: Path) -> None:
    answer = answered(experiment(tmp_path, RUB))
    found = answer.document().model_dump()
    (physics,) = found["physics"]
    assert (physics["effect"], physics["states"], physics["source"]) == ("rub", ["motor"], "maintenance log")
    sizes = {name.split("_")[0]: p for name, p in physics["parameters"].items()}
    assert sizes["k"]["low"] < 0.15 < sizes["k"]["high"]
    assert sizes["k"]["unit"] == "W/rpm"
    assert sizes["t"]["low"] < 20000 < sizes["t"]["high"]
    assert found["improvement"]["explained"] > 0.9
    assert answer.repaired is not None
    assert [t.effect for t in answer.repaired.terms if t.effect] == ["rub"]


def test_the_repaired_model_that_is_written_is_the_one_that_was_proved(tmp_path: Path) -> None:
    """The numbers of diagnosis.json stand in the model file; its free run is the one of the improvement."""
    folder = diagnose(experiment(tmp_path, RUB), tmp_path / "out")
    said = json.loads((folder / "diagnosis.json").read_text())
    model = read_model(folder / "models" / "repaired.toml")
    for name, p in said["physics"][0]["parameters"].items():
        written = model.parameters[name]
        assert written.low is not None
        assert written.high is not None
        assert written.value == pytest.approx(p["value"], rel=1e-3)
        # the diagnosis may allow for the form of its law on top of what the readings leave open
        assert p["low"] <= written.low * 1.001
        assert p["high"] >= written.high * 0.999
    results = json.loads((folder / "results.json").read_text())
    scores = results["models"]["repaired"]["recordings"]["r3"]
    noise = results["models"]["repaired"]["noise"]
    unit = np.mean(np.square(list(noise.values())))
    rms = np.sqrt(np.mean([(s["rms"] / noise[y]) ** 2 for y, s in scores.items()]) * unit)
    assert said["improvement"]["held_out"]["r3"]["rms_after"] == pytest.approx(rms, rel=1e-3)


def test_an_own_effect_that_loses_has_a_line_with_its_log_evidence(tmp_path: Path) -> None:
    """The seal rubs; a second effect of the file, which follows the load, was searched as well."""
    hum = RUB.replace("rub", "hum").replace("speed*exp(-time/t_free)", "load*exp(time/t_free)")
    folder = diagnose(experiment(tmp_path, RUB + hum.replace("W/rpm", "1")), tmp_path / "out")
    found = json.loads((folder / "diagnosis.json").read_text())
    own_effects = {one["effect"]: one for one in found["own_effects"]}
    assert {word: one["named"] for word, one in own_effects.items()} == {"rub": True, "hum": False}
    said = r"um was searched, and not named: at motor it has a log evidence of (\S+); a name needs 16"
    page, text = (folder / "report.html").read_text(), "\n".join(summary(folder))
    for shown in (re.search(f"H{said}", page), re.search(f"h{said}", text)):
        assert shown
        assert float(shown[1]) == pytest.approx(own_effects["hum"]["log_evidence"], rel=0.01)
    other = shutil.copytree(folder, tmp_path / "before")
    (other / "diagnosis.json").write_text(json.dumps(found | {"own_effects": [found["own_effects"][0]]}))
    compared = "\n".join(comparison(load_runs([other, folder]))).replace("\u00a0", " ")
    assert "rub (98 %); hum searched, not named" in compared
    assert "own effects: rub → rub, hum" in compared


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("*exp(", "*height*exp(", "no channel has the role 'nozzle height'"),
        ("driven body", "cooling terms", "no channel has the role 'cooling power'"),
        ("driven body", "link", None),
    ],
)
def test_an_effect_that_has_no_place_is_told(old: str, new: str, why: str | None) -> None:
    text = RUB.replace(old, new)
    if new == "cooling terms":
        text = text.replace('unit = "W/rpm"', 'unit = "1"').replace(
            "k_rub*speed*", "cooling + k_rub*cooling*"
        )
    told = not_offered(model(), machine.scene(model()), [own(text)])
    assert told == ([f"rub was not searched: {why}"] if why else [])


def test_an_input_of_a_role_has_to_be_named() -> None:
    text = RUB.replace("k_rub*speed*", "k_rub*level*")
    with pytest.raises(UserError, match="effect 'rub': say under `roles` which inputs"):
        own(text)
    assert own(text + 'roles = ["heat load"]\n').roles == ("heat load",)


def test_an_input_counts_with_its_value_and_a_level_as_its_share() -> None:
    """As the manual says: `input` is any recorded input of the roles, not only a temperature."""
    scene = machine.scene(machine.model())
    speed = next(n for n, channel in CHANNELS.items() if channel.role == "rotation speed")
    for variable, share in (("input", 1.0), ("level", scene.largest[speed])):
        text = RUB.replace("k_rub*speed*", f"k_rub*{variable}*") + 'roles = ["rotation speed"]\n'
        h = candidates(machine.model(), [own(text)], scene)[0]
        (size,) = h.amplitudes
        values = {**dict.fromkeys(names(h.terms[0].expression), 0.0), size: 1.0, speed: 600.0}
        values |= dict.fromkeys(h.shapes, 1.0)
        assert evaluate(h.terms[0].expression, values).value == pytest.approx(600.0 / share, rel=1e-2)


@pytest.mark.parametrize(("place", "search"), [("recording", "step"), ("output of a recording", "step")])
def test_an_instant_is_searched_for(place: str, search: str) -> None:
    text = RUB.replace("driven body", place).replace("speed*exp(-time/t_free)", "where(time >= t_free, 1, 0)")
    text = text.replace("middle = 17000, factor = 3", "instant = true")
    found = own(text)
    assert (found.search, found.acts) == (search, "in one recording")
    assert own(text.replace(place, "body")).search == "step"
    with pytest.raises(UserError, match="it cannot act at the place 'pair'"):
        own(text.replace(place, "pair"))


def test_a_time_without_a_middle_is_any_that_the_recordings_show() -> None:
    (shape,) = own(RUB.replace(", middle = 17000, factor = 3", "")).shapes
    assert shape.middle is None


MISTAKES = {
    "k_rub*sped": "effect 'rub': 'sped' is not known in its formula; known are .*speed",
    "0.1*speed": "effect 'rub': the amplitude 'k_rub' is not in the formula",
    "k_rub*speed*(": "effect 'rub'",
    "k_rub*__import__('os')": "effect 'rub'",
    "k_rub*delay(body, t_free)": "effect 'rub': 'delay.body, t_free.' is not of an input",
    "k_rub*delay(speed, speed)": "effect 'rub': the delay in",
}


@pytest.mark.parametrize("formula", MISTAKES)
def test_a_mistake_in_a_formula_is_a_sentence(formula: str, tmp_path: Path) -> None:
    path = experiment(tmp_path, RUB.replace("k_rub*speed*exp(-time/t_free)", formula))
    with pytest.raises(UserError, match=MISTAKES[formula]):
        diagnose(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_usual_size_above_the_most_is_a_mistake(tmp_path: Path) -> None:
    path = experiment(tmp_path, f"{RUB}most = 0.05\n")
    with pytest.raises(UserError, match=r"effect 'rub': its usual size 0\.1 is more than 0\.05"):
        diagnose(path, tmp_path / "out")


@pytest.mark.parametrize(
    ("line", "wrong", "said"),
    [
        ('place = "driven body"', 'place = "somewhere"', "place"),
        ("plausible = 0.1", "plausible = 0", "plausible"),
        ("plausible = 0.1", "plausible = 0.1\nmost = 0", "most"),
        ('word = "rub"', 'word = "Rub it"', "word"),
        ('unit = "W/rpm"', 'colour = "red"', "colour"),
        ('unit = "W/rpm"', 'unit = "W/rpmm"', "unit: the unit 'W/rpmm' is not known"),
        ('unit = "s", middle', 'unit = "sec0nds", middle', "t_free.unit: the unit 'sec0nds' is not known"),
        (", factor = 3", "", "give a middle with a factor or a spread"),
        ("factor = 3", "factor = 3, spread = 2", "give a middle with a factor or a spread"),
        ("middle = 17000", "middle = -1", "a middle with a factor is more than zero, not -1"),
        ("factor = 3", "factor = 0.5", "factor"),
        ("middle = 17000, factor = 3", "grid = [1, 2], low = 1, high = 2", "unknown key"),
    ],
)
def test_a_mistake_in_a_key_names_it(line: str, wrong: str, said: str, tmp_path: Path) -> None:
    path = experiment(tmp_path, RUB.replace(line, wrong))
    with pytest.raises(UserError, match=rf"experiment.toml, line \d+.*{said}"):
        load_experiment(path)


def test_a_drive_may_be_known_by_its_speed_alone() -> None:
    """Where no channel is a heat load but one a speed, it is the model that lacks a law of it."""
    scene = machine.scene(machine.model())
    power = replace(scene.channels["P_drive"], role="other input")
    scene = replace(scene, channels={**scene.channels, "P_drive": power})
    effect = replace(catalogue()["windage"], word="rub")
    why = "the model has no place of the kind 'driven body' where its channels could act"
    assert not_offered(machine.model(), scene, [effect]) == [f"rub was not searched: {why}"]
