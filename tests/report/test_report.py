"""The report page: complete in itself, says what the results say, and leaves out what is not there."""

from __future__ import annotations

import dataclasses
import json
import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.report import write_comparison, write_figures, write_report
from discovery.report.chart import thinned
from discovery.report.compare import load_runs
from discovery.report.page import render
from discovery.report.ranking import ranked, ratio
from discovery.report.run import load_run
from discovery.report.series import autocorrelation
from tests.report import sample


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
    keys = {chart["key"] for chart in sample.data_of(page)["charts"]}
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
    (chart,) = (one for one in sample.data_of(page)["charts"] if one["key"] == "validation-inputs")
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
    drawn = {one["name"] for one in sample.data_of(render(more))["charts"][0]["panels"][0]["series"]}
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


def test_a_narrow_screen_lists_the_network(page: str) -> None:
    listed = re.search(r'<dl class="bodies listed">(.*?)</dl>', page, re.S)
    assert listed
    bodies = re.findall(r"<dt>(\w+).*?</dt><dd>(.*?)</dd>", listed[1])
    assert [name for name, _ in bodies] == ["table", "c_body_1", "b_corpus"]
    assert '<span class="added">b_corpus</span>' in dict(bodies)["c_body_1"]
    assert "<span>T_fluid</span>" in dict(bodies)["table"]


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
