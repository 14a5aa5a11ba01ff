"""Cross-validation over roles: a fold sees its own recordings only; the matrix is that of a run."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.evaluation.rolematrix import left_out, matrix, steadiness
from discovery.experiment import load_experiment, run
from discovery.experiment.roles import Fold, fold_of, leave_roles_out, summary, without_role
from discovery.report.run import load_run
from tests.small import EXPERIMENT, write_recording, write_small

ROLES = """
[roles]
fitting = ["a"]
validation = ["b"]
"100 mm" = ["c"]
"""
SEPARATE = """
[models.apart]
kind = "superposition"
separate = { T_env = ["a"], P = ["a", "b"] }
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_small(tmp_path)
    place = tmp_path / "experiment.toml"
    place.write_text(EXPERIMENT.replace("superposition = ", "# ") + SEPARATE + ROLES)
    return place


def test_a_fold_is_fitted_to_all_other_roles(path: Path) -> None:
    experiment = load_experiment(path)
    fold = without_role(experiment, "fitting")
    assert fold.fit == ("b", "c")
    assert fold.held_out == ("a",)
    assert set(fold.fitting.recordings) == {"b", "c"}
    entry = fold.form.models["apart"]
    assert entry.separate == {"T_env": ["b", "c"], "P": ["b", "c"]}  # type: ignore[union-attr]
    assert experiment.fit == ("a", "b")  # the experiment itself stays


def test_one_influence_at_a_time_is_identified_again_in_each_fold(path: Path) -> None:
    """Its own recordings stay, cycles that play a role are those of the fold; without a role it sees none."""
    text = path.read_text().replace('"100 mm" = ["c"]', "").replace('held_out = ["c"]', "held_out = []")
    path.write_text(
        text.replace('P = ["a", "b"]', 'P = ["c", "a"]').replace('T_env = ["a"]', 'T_env = ["c"]')
    )
    experiment = load_experiment(path)
    fold = without_role(experiment, "fitting").form.models["apart"]
    assert fold.separate == {"T_env": ["c"], "P": ["c", "b"]}  # type: ignore[union-attr]
    folds = [fold_of(experiment, "apart", role) for role in ("fitting", "validation")]
    assert [fold.unseen for fold in folds] == [("fitting",), ("validation",)]
    found = summary(folds, ["fitting", "validation"])
    spreads = {n: p["sd"] for term in found["terms"].values() for n, p in term["parameters"].items()}
    assert spreads["p1_E_Y0C"] == 0.0  # of T_env, from "c" alone
    assert spreads["p5_E_Y0C"] > 0.0  # of P, from "c" and the other role
    path.write_text(path.read_text().replace('P = ["c", "a"]', 'P = ["c"]'))
    alone = fold_of(load_experiment(path), "apart", "fitting")
    assert alone.unseen == ("fitting", "validation")


def test_a_fold_does_not_see_what_is_left_out(path: Path) -> None:
    before = {
        name: fold_of(load_experiment(path), name, "validation") for name in ("reduced", "apart", "one_body")
    }
    write_recording(path.parent / "b.csv", 77)  # another day in the role that is left out
    after = {name: fold_of(load_experiment(path), name, "validation") for name in before}
    for name, fold in before.items():
        assert after[name].terms == fold.terms
        for error, judged in fold.rms.items():
            assert after[name].rms[error]["fitting"] == judged["fitting"]
            assert after[name].rms[error]["validation"] != judged["validation"]


def test_the_matrix_is_what_a_run_without_the_role_finds(path: Path) -> None:
    roles = leave_roles_out(load_experiment(path))
    alone = path.parent / "alone.toml"
    text = EXPERIMENT.replace('fit = ["a", "b"]', 'fit = ["a", "c"]').replace(
        'held_out = ["c"]', 'held_out = ["b"]'
    )
    alone.write_text(text.replace('name = "small"', 'name = "alone"\ncross_validate = false'))
    results = json.loads((run(alone, path.parent / "alone") / "results.json").read_text())
    for model in ("reduced", "one_body"):
        for error in ("E_Y0C", "E_R0T"):
            row = roles["models"][model]["rms"][error]["validation"]
            found = results["models"][model]["recordings"]
            assert [row[r] for r in ("fitting", "validation", "100 mm")] == pytest.approx(
                [found[r][error]["rms"] for r in "abc"], rel=1e-4
            )
    # the truth of the small machine is G = 12 W/K and loss = 0.4
    terms = roles["models"]["one_body"]["terms"]
    values = {name: one for term in terms.values() for name, one in term["parameters"].items()}
    assert values["G"]["mean"] == pytest.approx(12.0, rel=0.05)
    assert values["loss"]["mean"] == pytest.approx(0.4, rel=0.05)
    assert set(values["G"]["without"]) == {"fitting", "validation", "100 mm"}
    assert values["G"]["sd"] == pytest.approx(np.std(list(values["G"]["without"].values()), ddof=1))


def test_terms_and_parameters_over_the_folds() -> None:
    folds = [
        Fold("m", "a", {"E": {"a": 3.0, "b": 1.0}}, {"loss": {"k": 1.0}, "gap": {"g": 9.0}}, ("a",)),
        Fold("m", "b", {"E": {"a": 1.0, "b": 5.0}}, {"loss": {"k": 3.0}}, ("b",)),
        Fold("m", "c", {}, {}, lost=("diverges",)),
    ]
    found = summary(folds, ["a", "b"])
    assert found["terms"]["loss"]["share"] == 1.0
    assert found["terms"]["gap"]["share"] == 0.5
    assert found["terms"]["loss"]["parameters"]["k"]["mean"] == 2.0
    assert found["terms"]["loss"]["parameters"]["k"]["sd"] == pytest.approx(math.sqrt(2.0))
    assert found["lost"] == ["without c: diverges"]
    roles = {"recordings": {"a": ["x"], "b": ["y"]}, "models": {"m": found}}
    assert matrix(roles, "E").rows == (("m", "without a", "(3)", "1"), ("m", "without b", "1", "(5)"))
    assert left_out(roles, {"E": "um"}).rows == (("m", "E [um]", 3.0, 5.0, 1.0),)
    assert steadiness(roles, "m").rows[0][:3] == ("loss", "100 %", "k")


def test_a_run_writes_the_matrix_into_results_and_report(path: Path) -> None:
    out = run(path, path.parent / "out")
    results = load_run(out).results
    assert set(results["role_matrix"]["models"]) == {"reduced", "one_body", "apart"}
    page = (out / "report.html").read_text()
    assert "Cross-validation over roles" in page
    assert "Heat and fluid of each recording" in page
    budget = results["models"]["one_body"]["budgets"]["a"]
    assert abs(budget["gap"]) < 1e-3 * sum(abs(v) for v in budget["entering"].values())


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (('"100 mm" = ["c"]', '"100 mm" = ["a"]'), "one role"),
        (('"100 mm" = ["c"]', '"100 mm" = ["d"]'), "no recording 'd'"),
    ],
)
def test_what_roles_must_not_be(path: Path, change: tuple[str, str], said: str) -> None:
    path.write_text(path.read_text().replace(*change))
    with pytest.raises(UserError, match=said):
        load_experiment(path)


def test_a_copy_of_a_recording_cannot_play_another_role(path: Path) -> None:
    (path.parent / "c.csv").write_text((path.parent / "a.csv").read_text())
    path.write_text(path.read_text().replace('held_out = ["c"]', "held_out = []"))
    with pytest.raises(UserError, match="same readings"):
        load_experiment(path)
