"""The seal, going on where it stopped, and the whole way on tiny cases."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.challenge import pool, seal
from discovery.challenge.methods import METHODS
from discovery.challenge.methods.refit_only import ljung_box
from discovery.challenge.prepare import adopt, draw_orders
from discovery.challenge.run import challenge
from discovery.cli import app
from discovery.errors import UserError
from discovery.sparse.derivative import discrepancy_terms, smoothed_derivative

MODEL = """name = "one body"
[parameters]
G = { start = 10.0, unit = "W/K", min = 0.0 }
[states]
body = { unit = "degC", capacity = 36e3, start = "T_env" }
[[terms]]
name = "air around body"
into = "body"
expression = "G*(T_env - body)"
[[terms]]
name = "drive loss"
into = "body"
expression = "0.3*P_drive"
[outputs]
E = "5*(body - 22)"
"""
CAMPAIGN = """name = "tiny"
[channels]
T_env = { role = "ambient temperature", unit = "degC" }
P_drive = { role = "heat load", unit = "W" }
pump = { role = "fluid flow", unit = "1" }
E = { role = "error", unit = "um", noise = 0.5 }
[recordings]
a = { file = "a.csv" }
b = { file = "b.csv" }
"""
EXPERIMENT = """name = "tiny"
campaign = "campaign.toml"
fit = ["a"]
held_out = ["b"]
[models]
baseline = { file = "baseline.toml" }
[mismatch]
model = "baseline"
"""


def recording(seed: int, pump_heat: float) -> str:
    """A day of one body of 36 kJ/K by explicit steps of a minute, read every 10 minutes."""
    rng = np.random.default_rng(seed)
    air = 22 + np.sin(np.arange(1440) / 200 + seed)
    drive, pump = (np.repeat(rng.integers(0, 2, 24), 60) for _ in range(2))
    body, lines = air[0], ["time,T_env,P_drive,pump,E"]
    for k in range(1440):
        error = f"{5 * (body - 22) + rng.normal(0, 0.5):.3f}" if k % 10 == 0 else ""
        lines.append(f"{60 * k},{air[k]:.4f},{400 * drive[k]},{pump[k]},{error}")
        body += 60 / 36e3 * (10 * (air[k] - body) + 0.3 * 400 * drive[k] + pump_heat * pump[k])
    return "\n".join(lines) + "\n"


@pytest.fixture(scope="module")
def cases(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two tiny cases: nothing hidden; heat while the pump runs."""
    root = tmp_path_factory.mktemp("cases")
    for name, heat in (("case_1", 0.0), ("case_2", -60.0)):
        (root / name).mkdir()
        texts = {"baseline.toml": MODEL, "campaign.toml": CAMPAIGN, "experiment.toml": EXPERIMENT}
        texts |= {
            "a.csv": recording(1, heat),
            "b.csv": recording(2, heat),
            "notes.txt": "the answer is evaporation",
        }
        for file, text in texts.items():
            (root / name / file).write_text(text)
    keys = {
        "case_1": {"effect": None, "states": []},
        "case_2": {"effect": "evaporation_drying", "states": ["body"], "size": 60.0},
    }
    (root / "keys.json").write_text(json.dumps(keys))
    return root


def test_a_solver_is_given_the_files_of_the_contract_alone(cases: Path, tmp_path: Path) -> None:
    adopt(tmp_path / "out", cases)
    there = {p.name for p in (tmp_path / "out" / "cases").rglob("*") if p.is_file()}
    assert there == {"experiment.toml", "campaign.toml", "baseline.toml", "a.csv", "b.csv"}


def test_the_process_that_solves_is_not_told_where_the_answers_are(
    cases: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = tmp_path / "out"
    adopt(out, cases)
    seen: list[list[str]] = []

    def look(command: list[str], cwd: Path, **_: Any) -> subprocess.CompletedProcess[str]:
        seen.append([*command, str(cwd), *(str(p) for p in Path(command[4]).parent.rglob("*"))])
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(subprocess, "run", look)
    pool.solve_all(out, ["case_1"], ["diagnosis"], 1, lambda _: None)
    assert seen
    assert not any(str(tmp_path) in word or "answers" in word for word in seen[0])


def test_the_seal_breaks_when_an_answer_or_a_case_is_changed(cases: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    written = adopt(out, cases)
    assert seal.check_seal(out, written) == []
    model = out / "cases" / "case_1" / "baseline.toml"
    before = model.read_text()
    model.write_text(before + "\n")
    with pytest.raises(UserError, match=r"case_1/baseline\.toml: not what was sealed"):
        seal.check_seal(out, written)
    model.write_text(before)
    (out / "cases" / "case_1" / "hint.txt").write_text("x")
    with pytest.raises(UserError, match=r"hint\.txt"):
        seal.check_seal(out, written)
    (out / "cases" / "case_1" / "hint.txt").unlink()
    answers = out / "answers.json"
    answers.write_text(answers.read_text().replace("evaporation_drying", "radiation"))
    with pytest.raises(UserError, match=r"answers\.json: not what was sealed"):
        seal.check_seal(out, written)


def test_the_sum_of_the_answers_is_salted(cases: Path, tmp_path: Path) -> None:
    """The same answers have another sum each time, so that nobody can try answers until the sum fits."""
    sums = {adopt(tmp_path / name, cases)["answers"] for name in ("one", "two")}
    assert len(sums) == 2


def test_changed_code_is_noticed(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("x = 1\n")
    before = seal.source_sums(tmp_path)
    (tmp_path / "a.py").write_text("x = 2\n")
    assert before.keys() == {"a.py"}
    assert seal.source_sums(tmp_path) != before


def test_orders_have_their_shares_and_come_from_the_seed() -> None:
    families = ["portal", "headstock"]
    orders = draw_orders(families, 200, 5)
    for family in families:
        kinds = [o.plan.kind for o in orders if o.family == family]
        shares = {"none": 23, "one": 40, "input": 10, "two": 9, "measuring": 10, "outside": 8}
        assert {k: kinds.count(k) for k in shares} == shares
    assert draw_orders(families, 200, 5) == orders
    assert draw_orders(families, 200, 6) != orders
    assert len({o.seed for o in orders}) == 200
    assert orders[0].family != orders[1].family


def test_end_to_end_and_going_on(cases: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    first = challenge(out, jobs=1, baselines=False, source=cases)
    judged = {row["case"]: row for row in json.loads((out / "results.json").read_text())["judged"]}
    assert judged["case_1"]["word"] == "right"
    assert judged["case_2"]["verdict"] != "no mismatch"
    assert "<svg" in (out / "report.html").read_text()
    assert "false alarms" in (out / "challenge.md").read_text()
    assert "In brackets" not in (out / "challenge.md").read_text()  # no other method to lead
    assert first.lines

    answer = out / "solved" / "case_1" / "diagnosis.json"
    again = out / "solved" / "case_2" / "diagnosis.json"
    stamp = answer.stat().st_mtime_ns
    again.unlink()
    told: list[str] = []
    challenge(out, jobs=1, baselines=False, progress=told.append)
    assert answer.stat().st_mtime_ns == stamp  # not solved a second time
    assert again.exists()
    assert "solving case_2 by 1 method; solved 1 of 2 cases" in told  # before it is solved
    assert any(line.startswith("solved 2 of 2") for line in told)
    with pytest.raises(UserError, match="another challenge"):
        challenge(out, count=3, baselines=False)


def test_a_failure_is_told_and_tried_again(cases: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    broken = tmp_path / "broken"
    broken.mkdir()
    (broken / "case_1").mkdir()
    for path in (cases / "case_1").glob("*.*"):
        (broken / "case_1" / path.name).write_bytes(path.read_bytes())
    (broken / "case_1" / "baseline.toml").write_text("nonsense")
    (broken / "keys.json").write_text(json.dumps({"case_1": {"effect": None, "states": []}}))
    done = challenge(out, jobs=1, baselines=False, source=broken)
    assert done.tallies["diagnosis"].failed == 1
    assert any("case_1: failed" in line and "baseline.toml" in line for line in done.lines)
    assert pool.missing(out, ["case_1"], ["diagnosis"]) == {"case_1": ["diagnosis"]}


def test_every_other_method_answers_in_the_form_that_is_scored(cases: Path) -> None:
    from discovery.challenge.problem import read_problem

    for name, method in METHODS.items():
        if name == "diagnosis":
            continue
        answer = method(read_problem(cases / "case_2"))
        assert answer["verdict"] in ("no mismatch", "missing physics", "measurement fault", "unexplained"), (
            name
        )
        assert all({"effect", "states", "probability"} <= p.keys() for p in answer["physics"]), name
        json.dumps(answer)


def test_ljung_box_against_statsmodels() -> None:
    from statsmodels.stats.diagnostic import acorr_ljungbox

    rng = np.random.default_rng(1)
    x = np.convolve(rng.standard_normal(300), [1, 0.15], "same")
    assert ljung_box(x, 20) == pytest.approx(
        float(acorr_ljungbox(x, lags=[20])["lb_pvalue"].iloc[0]), rel=1e-9
    )


def test_derivative_of_a_parabola() -> None:
    t = np.arange(60.0)
    np.testing.assert_allclose(smoothed_derivative(t, t**2)[10:-10], 2 * t[10:-10], rtol=1e-6)


def test_the_derivative_regression_finds_a_term_in_low_noise() -> None:
    rng = np.random.default_rng(3)
    x = rng.standard_normal((400, 5))
    y = 2 * x[:, 1] - x[:, 4] + 0.1 * rng.standard_normal(400)
    kept = discrepancy_terms([(x[k::4], y[k::4]) for k in range(4)])
    assert [k for k, _ in kept][:2] == [1, 4]
    assert sum(share for _, share in kept) == pytest.approx(1.0)


def test_a_user_is_told_what_is_missing(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["challenge", "--cases-from", str(tmp_path), "--out", str(tmp_path / "out")]
    )
    assert done.exit_code == 1
    assert "neither answers.json nor keys.json there" in done.output
