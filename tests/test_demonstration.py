"""`make demo`: what the README says about it."""

from __future__ import annotations

from pathlib import Path

from discovery.experiment import diagnose, load_experiment
from discovery.report.page import render
from discovery.report.run import load_run

ROOT = Path(__file__).parents[1]
EXPERIMENT = ROOT / "experiments" / "demonstration.toml"


def test_the_cutting_fluid_is_found_by_a_model_of_the_dry_machine(tmp_path: Path) -> None:
    folder = diagnose(EXPERIMENT, tmp_path / "demonstration")
    run = load_run(folder)
    assert run.diagnosis is not None
    assert run.diagnosis["verdict"] == "missing physics"
    found = {(one["effect"], *one["states"]): one for one in run.diagnosis["physics"]}
    assert ("fluid_convection", "table") in found
    assert all(effect == "fluid_convection" for effect, *_ in found)
    sure = found["fluid_convection", "table"]["probability"]
    assert f"at the table ({100 * sure:.0f} % sure)" in (ROOT / "README.md").read_text("utf-8")
    held_out = run.diagnosis["improvement"]["held_out"]
    assert all(held_out[name]["gain_low"] > 0.0 for name in ("validation", "left_nozzle"))
    assert run.diagnosis["improvement"]["contradicted_by"] == []
    page = render(run)
    assert page.index("Physics is missing in") < page.index("predicts best on the held-out")
    assert "Simulated machine · demonstration" in page
    assert page.index('id="mismatch"') < page.index('id="comparison"')


def test_the_demonstration_compares_what_the_readme_lists() -> None:
    form = load_experiment(EXPERIMENT).form
    kinds = {name: entry.kind for name, entry in form.models.items()}
    assert kinds == {
        "dry": "file",
        "reduced": "reduced",
        "superposition": "superposition",
        "regression": "regression",
        "pysindy": "pysindy",
        "discovered": "sindy",
    }
    assert form.mismatch is not None
    assert form.mismatch.model == "dry"
    assert "experiments/demonstration.toml" in (ROOT / "Makefile").read_text("utf-8")
