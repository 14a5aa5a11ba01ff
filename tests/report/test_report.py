"""The report page: complete in itself, says what the results say, and leaves out what is not there."""

from __future__ import annotations

import dataclasses
import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from discovery.challenge import scoring
from discovery.diagnosis.thresholds import RIVAL
from discovery.errors import UserError
from discovery.models import Parameter
from discovery.report import equations, write_comparison, write_figures, write_report
from discovery.report.chart import thinned
from discovery.report.compare import load_runs
from discovery.report.mismatch import NEAR, section, sizes
from discovery.report.page import render
from discovery.report.ranking import ranked, ratio
from discovery.report.run import load_run
from discovery.report.series import autocorrelation
from tests.report import sample


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return Path(sample.write_sample(tmp_path_factory.mktemp("runs") / "cutting fluid"))


@pytest.fixture(scope="module")
def page(folder: Path) -> str:
    return write_report(folder).read_text("utf-8")


class _Page(HTMLParser):
    """Ids, links, labels and what would be loaded from elsewhere."""

    def __init__(self) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.charts: list[str] = []
        self.open: list[str] = []
        self.wrong: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if tag not in ("meta", "link", "input", "br", "wbr", "hr", "img", "rect", "line", "mspace"):
            self.open.append(tag)
        if given.get("id"):
            self.ids.append(str(given["id"]))
        if tag == "a":
            self.links.append(str(given["href"]))
        elif given.get("src") or given.get("href"):
            self.loaded.append(str(given.get("src") or given.get("href")))
        if tag == "figure":
            self.charts.append(str(given["data-chart"]))

    def handle_endtag(self, tag: str) -> None:
        if tag in ("rect", "line", "mspace"):
            return
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)


def _read(page: str) -> _Page:
    reader = _Page()
    reader.feed(page)
    return reader


def _data(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def test_it_is_whole_and_loads_nothing(page: str) -> None:
    reader = _read(page)
    assert reader.wrong == []
    assert reader.open == []
    assert [one for one in reader.loaded if one != "data:,"] == []
    assert "@import" not in page
    assert "url(http" not in page
    assert len(reader.ids) == len(set(reader.ids))
    assert {link.removeprefix("#") for link in reader.links} <= set(reader.ids)
    assert len(page.encode()) < 3_000_000


def test_every_error_of_every_recording_is_drawn(page: str) -> None:
    keys = {chart["key"] for chart in _data(page)["charts"]}
    wanted = {f"{recording}-{output}" for recording in ("fit", "validation") for output in sample.OUTPUTS}
    assert wanted <= keys
    assert set(_read(page).charts) == keys


def test_the_answer_agrees_with_an_independent_count(folder: Path, page: str) -> None:
    results = json.loads((folder / "results.json").read_text())
    scores = {name: entry["recordings"]["validation"] for name, entry in results["models"].items()}
    logs = [np.log(scores["discovered"][o]["rms"] / scores["reduced"][o]["rms"]) for o in sample.OUTPUTS]
    less = 100 * (1 - np.exp(np.mean(logs)))
    assert "The discovered model predicts best on the held-out recording “validation”" in page
    more = 100 * (np.exp(-np.log(1 - less / 100)) - 1)
    assert f"+{more:.0f} % (" in page
    left = [1 - scores["discovered"][o]["improvement"]["rms"] / 100 for o in sample.OUTPUTS]
    removed = 100 * (1 - np.exp(np.mean(np.log(left))))
    assert f"It removes {float(f'{removed:.2g}'):.0f} % of the thermal error" in page


@pytest.mark.parametrize("together", [False, True])
def test_kelvins_and_micrometres_are_not_mixed(tmp_path: Path, together: bool) -> None:
    """Temperatures beside a displacement: each figure with its own unit, in a comparison of runs, too."""
    rms = {"T_head": 0.2, "dZ": 0.64, "T_brg": 0.4}
    units = {"T_head": "degC", "dZ": "um", "T_brg": "degC"}
    folders = []
    for name, times in (("one", 1.0), ("two", 2.0)):
        scores = {output: {"rms": times * value} for output, value in rms.items()}
        entry = {"terms": 1, "parameters": 1, "seconds": 1.0, "recordings": {"sun": scores}, "notes": []}
        content = {
            "experiment": name,
            "fit": [],
            "held_out": ["sun"],
            "units": units,
            "models": {name: entry},
        }
        folders.append(tmp_path / name)
        folders[-1].mkdir()
        (folders[-1] / "results.json").write_text(json.dumps(content))
    written = write_comparison(load_runs(folders), tmp_path) if together else write_report(folders[0])
    page = written.read_text("utf-8")
    assert (
        "Its rms is 0.3 K and 0.64 µm (median rms over 3 outputs and 1 recording; largest: 0.4 K and" in page
    )
    assert "rms [K, µm], held-out recordings, over all outputs of a unit" in page
    assert f"{float(np.sqrt((0.2**2 + 0.4**2) / 2)):.3f}, 0.64<" in page
    assert "T_head [K]" in page
    assert "dZ [µm]" in page


def test_every_model_can_be_the_reference(folder: Path, page: str) -> None:
    run = load_run(folder)
    (text,) = re.findall(r'data-against="([^"]+)"', page)
    given = json.loads(unescape(text))
    order = ranked(run)
    for i, chosen in enumerate(order):
        for j, model in enumerate(order):
            said = given["texts"][given["cells"][i][j][0]]
            more = 100 * (ratio(run, model, chosen) - 1)
            assert said == "reference" if i == j else said.startswith(f"{more:+.0f} %".replace("-", "−"))


def test_models_are_ranked_on_what_all_of_them_predict(folder: Path) -> None:
    """A model of the easy outputs alone does not win by leaving out the hard one."""
    run = load_run(folder)
    models = json.loads(json.dumps(run.results["models"]))
    for model in models.values():
        for scores in model["recordings"].values():
            scores["E_A0C"]["rms"] = 50.0
    models["superposition"]["recordings"] = {
        recording: {"E_Y0C": scores["E_Y0C"]}
        for recording, scores in models["superposition"]["recordings"].items()
    }
    models["discovered"]["recordings"]["validation"]["E_A0C"]["rms"] = 5000.0
    one = dataclasses.replace(run, results={**run.results, "models": models})
    rms = {name: models[name]["recordings"]["validation"]["E_Y0C"]["rms"] for name in models}
    assert ranked(one) == sorted(rms, key=lambda name: rms[name])


def test_a_simulated_machine_is_said_first_and_inputs_are_drawn(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run")
    results = json.loads((folder / "results.json").read_text())
    (folder / "results.json").write_text(
        json.dumps(results | {"simulated": True, "input_units": {"pump": "1"}})
    )
    inputs = {"validation": {"pump": {"time": [0, 1800, 3600], "value": [0, 1, 1], "held": True}}}
    (folder / "inputs.json").write_text(json.dumps(inputs))
    page = write_report(folder).read_text("utf-8")
    assert re.search(r'class="eyebrow">Simulated machine · ', page)
    (chart,) = (one for one in _data(page)["charts"] if one["key"] == "validation-inputs")
    assert chart["panels"][0]["label"] == "pump [-]"
    assert chart["panels"][0]["series"][0]["y"] == [0, 0, 1, 1, 1]  # a step, not a ramp
    (folder / "inputs.json").write_text('{"validation": {"pump": [1]}}')
    with pytest.raises(UserError, match=r"inputs\.json: cannot be read"):
        write_report(folder)


def test_models_that_are_not_drawn_are_named(folder: Path, page: str) -> None:
    assert "Not drawn" not in page
    run = load_run(folder)
    models = run.results["models"]
    copies = {f"copy {k}": {**models["superposition"], "kind": "superposition"} for k in range(3)}
    predictions = {
        name: dataclasses.replace(
            data, models={**data.models, **dict.fromkeys(copies, data.models["superposition"])}
        )
        for name, data in run.predictions.items()
    }
    more = dataclasses.replace(
        run, results={**run.results, "models": {**models, **copies}}, predictions=predictions
    )
    drawn = {one["name"] for one in _data(render(more))["charts"][0]["panels"][0]["series"]}
    (named,) = re.findall(r"Not drawn, since [^:]*: ([^.]*)\.", render(more))
    assert len(set(copies) - drawn) == 1
    assert {named} == set(copies) - drawn


def test_the_tables_beside_the_papers_name_units(page: str) -> None:
    tables = page[page.index("Comparison of the models") :]
    assert re.search(r"E_Y0C \[µm\]\s*</t[hd]>", tables)
    assert re.search(r"E_A0C \[µm/m\]\s*</t[hd]>", tables)
    assert "mean square about the mean (in the square of the unit)" in tables


def test_a_recording_that_was_fitted_decides_nothing(folder: Path) -> None:
    run = load_run(folder)
    before = ratio(run, "discovered", "reduced")
    for entry in run.results["models"].values():
        for score in entry["recordings"]["fit"].values():
            score["rms"] = 1e-6
    assert ratio(run, "discovered", "reduced") == before


def test_the_missing_physics_is_named_with_size_and_certainty(page: str) -> None:
    assert "flooded gap at c_body_1 and b_corpus (98 % sure)" in page
    assert "G_gap = 38.3 W/K (95 %: 35.1 to 41.6)" in page
    assert "less than 1 in 1000" in page
    assert "pump &gt; 0.5 and speed &gt; 750 rpm." in page
    shades = [chart["shades"] for chart in _data(page)["charts"] if chart["key"] == "fit-E_Y0C"]
    assert shades == [[[4, 10, "mismatch at b_corpus, 81 W"]]]


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
    assert "Do not use the repaired model" in page
    assert "The repair removes" not in page
    held |= {"rms_after": 1.59, "gain_low": -0.1, "gain_high": 0.2}
    diagnosis["improvement"] = {"fit": {}, "held_out": {"left": held}, "explained": -0.002}
    path.write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    assert "contradict" not in page
    assert "The repair removes none of this mismatch" in page
    assert "(improvement, 95 %: −0.1 to 0.2; may be chance)" in page


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


def test_a_narrow_screen_lists_the_network(page: str) -> None:
    listed = re.search(r'<dl class="bodies listed">(.*?)</dl>', page, re.S)
    assert listed
    bodies = re.findall(r"<dt>(\w+).*?</dt><dd>(.*?)</dd>", listed[1])
    assert [name for name, _ in bodies] == ["table", "c_body_1", "b_corpus"]
    assert '<span class="added">b_corpus</span>' in dict(bodies)["c_body_1"]
    assert "<span>T_fluid</span>" in dict(bodies)["table"]


@pytest.mark.parametrize(("unit", "said"), [("um", "µm"), ("times the reading noise",) * 2])
def test_the_proof_says_what_its_figures_are(tmp_path: Path, unit: str, said: str) -> None:
    folder = sample.write_sample(tmp_path / "run")
    diagnosis = json.loads((folder / "diagnosis.json").read_text())
    diagnosis["improvement"]["unit"] = unit
    (folder / "diagnosis.json").write_text(json.dumps(diagnosis))
    page = write_report(folder).read_text("utf-8")
    assert f"0.6 → 0.5 {said} on validation" in page
    assert f"each weighted by its noise [{said}]" in page


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


def test_names_of_a_user_stay_text(page: str) -> None:
    assert "cutting <fluid>" not in page
    assert "cutting &lt;fluid&gt;" in page


def test_without_diagnosis_and_discovered_model_those_parts_do_not_show(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run", diagnosis=False)
    results = json.loads((folder / "results.json").read_text())
    del results["models"]["discovered"]
    (folder / "results.json").write_text(json.dumps(results))
    (folder / "models" / "discovered.toml").unlink()
    page = write_report(folder).read_text("utf-8")
    ids = _read(page).ids
    assert "mismatch" not in ids
    assert "discovery" not in ids
    assert {"answer", "predictions", "comparison", "network", "reproduce"} <= set(ids)
    assert "The given model “thermobalance” predicts best" in page


def test_a_diagnosis_alone_makes_a_report(tmp_path: Path) -> None:
    (tmp_path / "diagnosis.json").write_text(json.dumps(sample.diagnosed(24.0)))
    page = write_report(tmp_path).read_text("utf-8")
    assert (
        "<h1>Physics is missing in “thermobalance”: flooded gap at c_body_1 and b_corpus (98 % sure).</h1>"
        in page
    )


def test_a_folder_without_results_is_told(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"neither results\.json nor diagnosis\.json is there"):
        write_report(tmp_path)


def test_broken_files_are_told_with_their_line(tmp_path: Path) -> None:
    folder = sample.write_sample(tmp_path / "run")
    file = folder / "predictions" / "fit.csv"
    file.write_text(file.read_text().replace("\n600,", "\n600,x", 1))
    with pytest.raises(UserError, match=r"fit\.csv, line 3: 'x.*' is not a number"):
        write_report(folder)
    (folder / "results.json").write_text('{\n"models": ]')
    with pytest.raises(UserError, match=r"results\.json, line 2: not valid JSON"):
        write_report(folder)


def test_figures_name_their_units(folder: Path) -> None:
    written = write_figures(folder)
    assert {path.suffix for path in written} == {".svg", ".pdf"}
    text = (folder / "figures" / "validation-E_Y0C.svg").read_text("utf-8")
    assert "E_Y0C [µm]" in text
    assert "time [h]" in text
    assert (folder / "figures" / "validation-E_Y0C.pdf").read_bytes().startswith(b"%PDF")


def test_thinning_keeps_peaks() -> None:
    x = np.arange(5000.0)
    y = np.sin(x / 300)
    y[1234], y[3456] = 7.0, -7.0
    a, b = thinned(x, y, 200)
    assert len(a) <= 200
    assert (b.max(), b.min()) == (7.0, -7.0)
    assert (np.diff(a) > 0).all()


def test_a_held_value_stays_flat_when_its_curve_is_thinned() -> None:
    """Long at 50, then a new value every half minute; no line may lead from 50 to a value after the step."""
    at = np.r_[0.0, 700.0 + 30.0 * np.arange(400)]
    values = np.r_[50.0, np.random.default_rng(0).uniform(0, 100, 400)]
    a, b = thinned(np.repeat(at, 2)[1:], np.repeat(values, 2)[:-1], 200)
    assert len(a) <= 200
    assert (a[1], b[1]) == (700.0, 50.0)
    assert (b.min(), b.max()) == (values[:-1].min(), values[:-1].max())


def test_autocorrelation_is_that_of_statsmodels() -> None:
    from statsmodels.tsa.stattools import acf

    values = np.cumsum(np.random.default_rng(1).standard_normal(300))
    np.testing.assert_allclose(autocorrelation(values, 12), acf(values, nlags=12, fft=False)[1:], rtol=1e-10)


def test_report_and_engine_mean_the_same_by_a_rival_that_cannot_be_excluded() -> None:
    assert {NEAR, scoring.NEAR} == {RIVAL}
