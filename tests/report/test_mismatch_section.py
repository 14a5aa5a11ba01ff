"""What the report says of a diagnosis: the answer, its proof, and what came close."""

from __future__ import annotations

import dataclasses
import json
import re
from pathlib import Path

import pytest

from discovery.challenge import scoring
from discovery.diagnosis.thresholds import RIVAL
from discovery.experiment.ending import ending
from discovery.models import Parameter
from discovery.report import equations, write_report
from discovery.report.mismatch import NEAR, section, sizes
from discovery.report.run import load_run
from tests.report import sample


def test_the_missing_physics_is_named_with_size_and_certainty(page: str) -> None:
    assert "flooded gap at c_body_1 and b_corpus (98 % sure)" in page
    assert "G_gap = 38.3 W/K (95 %: 35.1 to 41.6)" in page
    assert "less than 1 in 1000" in page
    assert "pump &gt; 0.5 and speed &gt; 750 rpm." in page
    shades = [chart["shades"] for chart in sample.data_of(page)["charts"] if chart["key"] == "fit-E_Y0C"]
    assert shades == [[[4, 10, "mismatch at b_corpus, 81 W"]]]


def test_a_span_at_a_state_without_heat_capacity_has_the_unit_of_its_rate(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run")
    path = folder / "diagnosis.json"
    diagnosis = json.loads(path.read_text())
    diagnosis["location"]["heat_units"] = {"b_corpus": "K/s"}
    path.write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    shades = [chart["shades"] for chart in sample.data_of(page)["charts"] if chart["key"] == "fit-E_Y0C"]
    assert shades == [[[4, 10, "mismatch at b_corpus, 81 K/s"]]]


def test_a_repair_that_unseen_recordings_contradict_is_said_first(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run")
    path = folder / "diagnosis.json"
    diagnosis = json.loads(path.read_text())
    diagnosis["physics"].append(
        {**diagnosis["physics"][0], "effect": "clock_shift", "states": [], "recording": "fit"}
    )
    held = {"rms_before": 1.6, "rms_after": 25.0, "noise_floor": 0.4, "gain_low": -27.0, "gain_high": -19.0}
    diagnosis["improvement"] = {
        "fit": {},
        "held_out": {"left": held},
        "explained": -1.0,
        "contradicted_by": ["left"],
    }
    path.write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    assert "clock shift in fit (98 % sure); but the held-out “left” contradicts the repair." in page
    assert "Before you use it, check whether the machine was the same there" in page
    held |= {"rms_after": 1.59, "gain_low": -0.1, "gain_high": 0.2}
    diagnosis["improvement"] = {"fit": {}, "held_out": {"left": held}, "explained": -0.002}
    path.write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    assert "contradict" not in page
    assert "(improvement, 95 %: −0.1 to 0.2; may be chance)" in page


def test_two_effects_of_one_place_are_told_apart_by_their_inputs(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run")
    path = folder / "diagnosis.json"
    diagnosis = json.loads(path.read_text())
    [found] = diagnosis["physics"]
    diagnosis["physics"] = [
        {**found, "effect": "input_path", "states": ["T0"], "channels": [name]} for name in ("Q1", "Q2")
    ]
    path.write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    for name in ("Q1", "Q2"):
        assert f"input path at T0 from {name} (98 % sure)" in page
        assert f"Size of input path at T0 from {name}: " in page
        assert f"T0 from {name}</td>" in page
    assert f"input_path at T0 from Q1 ({found['probability']:.0%})" in ending(folder).effects


@pytest.mark.parametrize("after", [1.9, 2.4, None])
def test_the_answer_gives_one_before_and_after(tmp_path: Path, after: float | None) -> None:
    folder = sample.write_sample(tmp_path / "run")
    path = folder / "diagnosis.json"
    diagnosis = json.loads(path.read_text())
    held = {"rms_before": 13.7, "rms_after": 1.26, "noise_floor": 0.4, "from_known_starts": [2.1, after]}
    diagnosis["improvement"] = {
        "unit": "K",
        "fit": {"rms_before": 5.0, "rms_after": 1.0},
        "held_out": {"validation": held},
        "explained": 0.25,  # of the rms from known starts: another measure
    }
    path.write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    answer = page[page.index('<header class="answer"') : page.index("</header>")]
    assert "(rms): 13.7 → 1.26 K on validation." in answer
    assert "<dd>13.7 → 1.26</dd>" in answer
    assert "25 %" not in answer
    assert ("the rms is larger after the repair: 2.1 → 2.4 K on validation." in answer) == (after == 2.4)


def test_an_output_that_the_repair_makes_worse_is_named(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run")
    results = json.loads((folder / "results.json").read_text())
    before = results["models"]["thermobalance"]["recordings"]
    after = json.loads(json.dumps(before))
    after["validation"]["E_Y0C"]["rms"] = 2 * before["validation"]["E_Y0C"]["rms"]
    results["models"]["repaired"] = {"kind": "repaired", "recordings": after}
    (folder / "results.json").write_text(json.dumps(results))
    page = write_report(folder).read_text("utf-8")
    assert re.search(r"After the repair, the rms is larger for E_Y0C on validation \(\S+ → \S+ µm\)\.", page)


@pytest.mark.parametrize(("unit", "said"), [("um", "µm"), ("times the reading noise",) * 2])
def test_the_proof_says_what_its_figures_are(tmp_path: Path, unit: str, said: str) -> None:
    folder = sample.write_sample(tmp_path / "run")
    diagnosis = json.loads((folder / "diagnosis.json").read_text())
    diagnosis["improvement"]["unit"] = unit
    (folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    assert f"0.6 → 0.5 {said} on validation" in page
    assert f"each weighted by its noise [{said}]" in page


def test_the_mismatch_by_output_has_the_rms_of_the_table_above_it(tmp_path: Path) -> None:
    """Free runs of the fitted recordings; the residual of the fit itself has another rms."""
    sample.write_sample(tmp_path / "run")
    found = section(load_run(tmp_path / "run"))
    assert found
    above = next(t for t in found["tables"] if t.title.startswith("Free runs before and after"))
    table = next(
        t for t in found["tables"] if t.title.startswith("Mismatch by output: free runs of the fitted")
    )
    assert table.header[2] == "rms before"
    rms = {row.cells[0].split()[0]: float(row.cells[2]) for row in table.rows}
    assert rms == {"E_Y0C": 0.8, "E_R0T": 0.3}
    whole = next(row.cells[1] for row in above.rows if row.cells[0] == "fitted")
    assert float(whole) == pytest.approx(((0.8**2 + 0.3**2) / 2) ** 0.5, abs=0.01)


def test_what_came_closest_has_its_recording_and_hours_and_stands_once(tmp_path: Path) -> None:
    heat = {"effect": "unmeasured_heat", "states": ["head"], "share_that_a_refit_leaves": 0.6}
    considered = [
        {**heat, "recording": "mon", "instants_s": [36000, 50400], "log_evidence": 60.0},
        {**heat, "recording": "fri", "instants_s": [600, 1800], "log_evidence": 50.0},
        {"effect": "film_drag", "states": ["head"], "log_evidence": 20.0, "share_that_a_refit_leaves": 0.02},
        {"effect": "film_drag", "states": ["head"], "log_evidence": 10.0, "share_that_a_refit_leaves": 0.02},
    ]
    document = {**sample.diagnosed(24.0), "verdict": "unexplained", "physics": [], "considered": considered}
    (tmp_path / "diagnosis.json").write_text(json.dumps(document))
    found = section(load_run(tmp_path))
    assert found
    (table,) = (t for t in found["tables"] if t.title == "Closest effects of the catalogue")
    assert [row.cells for row in table.rows] == [
        ("unmeasured heat", "head in mon (10 to 14 h)", "60", "60 %"),
        ("unmeasured heat", "head in fri (10 to 30 min)", "50", "60 %"),
        ("film drag", "head", "20", "2 %"),
    ]


def test_a_jump_that_may_be_none_is_not_told() -> None:
    known = {
        "zero_T": {"value": -0.01, "low": -0.03, "high": 0.01, "unit": "K", "output": "T"},
        "zero_dZ": {"value": 2.1, "low": 2.0, "high": 2.2, "unit": "um", "output": "dZ"},
        "t_zero": {"value": 60.0, "low": 50.0, "high": 70.0, "unit": "s"},
    }
    told = sizes({"states": ["T", "dZ"], "moved": ["dZ"], "parameters": known})
    assert told == ["zero_dZ = 2.1 µm (95 %: 2 to 2.2)", "t_zero = 60 s (95 %: 50 to 70)"]


def test_a_size_says_at_which_speed_it_is_one() -> None:
    size = {"value": 0.686, "low": 0.487, "high": 0.905, "unit": "W", "at": "1000 rpm"}
    assert sizes({"parameters": {"P_f": size}}) == ["P_f = 0.686 W at 1000 rpm (95 %: 0.487 to 0.905)"]


def test_a_given_number_of_each_recording_is_printed_for_each() -> None:
    window = Parameter(0.0, "s", fixed=True, per_recording=True, values={"monday": 8.7})
    assert (
        equations.value("t_on", window).value,
        equations.value("k", Parameter(2.0, fixed=True)).value,
    ) == (
        "monday: 8.7",
        "2",
    )
    found = dataclasses.replace(window, fixed=False, intervals={"monday": (8.1, 9.3)})
    assert equations.value("t_on", found).value == "monday: 8.7 (8.1 to 9.3)"


def test_a_diagnosis_alone_makes_a_report(tmp_path: Path) -> None:
    (tmp_path / "diagnosis.json").write_text(json.dumps(sample.diagnosed(24.0)))
    page = write_report(tmp_path).read_text("utf-8")
    assert (
        "<h1>Physics is missing in “thermobalance”: flooded gap at c_body_1 and b_corpus (98 % sure).</h1>"
        in page
    )


def test_report_and_engine_mean_the_same_by_a_rival_that_cannot_be_excluded() -> None:
    assert {NEAR, scoring.NEAR} == {RIVAL}
