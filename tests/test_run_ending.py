"""How a run ends, what stops it, and what it clears away."""

from __future__ import annotations

import json
import platform
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.experiment import load_experiment
from discovery.experiment.ending import Ending, constants
from discovery.experiment.modelfits import fit_of
from discovery.report.lead import Lead
from tests.small import write_small

EXPERIMENT = """
name = "small"
campaign = "campaign.toml"
fit = ["a", "b"]
held_out = ["c"]
cross_validate = false

[models]
regression = { kind = "regression" }
one_body   = { file = "model.toml" }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_small(tmp_path)
    (tmp_path / "experiment.toml").write_text(EXPERIMENT)
    return tmp_path


def _run(folder: Path, *options: str, verb: str = "run") -> tuple[int, str, str]:
    out = ["--out", str(folder / "out")]
    result = CliRunner().invoke(app, [verb, str(folder / "experiment.toml"), *out, *options])
    return result.exit_code, result.stdout, result.stderr


def test_a_run_ends_in_five_lines(folder: Path) -> None:
    status, quiet, errors = _run(folder, "--quiet")
    assert (status, errors) == (0, "")
    lines = quiet.splitlines()
    assert [line.partition(":")[0] for line in lines] == ["winner", "how sure", "verdict", "doubts", "next"]
    assert lines[0].startswith("winner: one_body predicts best on 1 held-out recording: rms")
    assert "than that of regression" in lines[1]
    assert lines[3] == "doubts: none; the recordings are sound"


@pytest.mark.parametrize(
    ("verdict", "share", "said"),
    [
        (
            "no mismatch",
            2.17,
            "verdict: no mismatch in the recordings of the fit; but on the held-out ones first_order "
            "has 217% of the rms without a model",
        ),
        ("no mismatch", 0.3, "verdict: no mismatch in first_order"),
        ("unexplained", 2.17, "verdict: unexplained in first_order"),
    ],
)
def test_a_verdict_is_not_said_of_recordings_that_refute_it(verdict: str, share: float, said: str) -> None:
    end = ended(verdict=verdict, diagnosed="first_order", diagnosed_ratio=share)
    assert end.lines()[2] == said


def test_a_verdict_says_of_which_model_it_speaks_if_another_one_wins() -> None:
    for winner, said in (("a", "verdict: unexplained in b"), ("b", "verdict: unexplained")):
        assert ended(verdict="unexplained", diagnosed="b", winner=winner).lines()[2] == said


def ended(**said: Any) -> Ending:
    """The end of a run of one model that helps, with more of what it found."""
    usual: dict[str, Any] = {
        "best": "a", "winner": "a", "against_none": Lead(0.5, 0.4, 0.6, 1.0), "runner_up": None,
        "against_runner_up": None, "rms": {"um": 1.0}, "held_out": ["c"], "verdict": None, "diagnosed": None,
        "diagnosed_ratio": None, "repaired_ratio": None, "effects": [], "findings": [], "constants": [],
        "guesses": {}, "hangs_on_guesses": {}, "next": "", "report": "", "seconds": 1.0,
    }  # fmt: skip
    return Ending(**usual | said)


def test_a_repair_that_makes_held_out_recordings_worse_is_said() -> None:
    said = ended(verdict="missing physics", effects=["wear at a (98%)"], repaired_ratio=1.59).lines()[2]
    assert said.endswith(
        "wear at a (98%); but the repair makes the rms on held-out recordings 1.59 times as large"
    )


def test_a_zero_that_is_not_the_same_is_a_doubt() -> None:
    """The errors of the recording that was held out, with 5 um added to each reading."""
    results = {
        "fit": ["a"], "held_out": ["b"], "roles": {"E": "error", "T": "temperature"}, "units": {"E": "um"},
        "models": {"m": {"recordings": {
            "a": {"E": {"rms": 0.3, "mean": 0.0}, "T": {"rms": 0.1, "mean": 0.0}},
            "b": {"E": {"rms": 5.01, "mean": 5.0}, "T": {"rms": 5.0, "mean": 5.0}},
        }}},
    }  # fmt: skip
    run = SimpleNamespace(results=results, held_out=["b"])
    assert constants(run, "m") == ["E by 5 um in b"]  # type: ignore[arg-type]
    results["models"]["m"]["recordings"]["b"]["E"]["mean"] = 1.0  # type: ignore[index]
    assert constants(run, "m") == []  # type: ignore[arg-type]
    assert "another zero of the probe" in ended(constants=["E by 5 um in b"]).lines()[3]


def test_the_end_as_json_says_the_same(folder: Path) -> None:
    status, printed, _ = _run(folder, "--json")
    found = json.loads(printed)
    assert (status, found["winner"], found["held_out"]) == (0, "one_body", ["c"])
    lead = found["against_runner_up"]
    assert lead["low"] < lead["ratio"] < lead["high"] < 1.0
    assert lead["sure"] == 1.0
    assert 0.2 < next(iter(found["rms"].values())) < 0.5  # the noise is 0.3 um


def test_a_wrong_recording_stops_a_run_unless_forced(folder: Path) -> None:
    text = (folder / "b.csv").read_text().splitlines()
    turned = [text[0]]
    for line in text[1:]:
        cells = line.split(",")
        cells[3] = f"{-float(cells[3]):.3f}" if cells[3] else ""
        turned.append(",".join(cells))
    (folder / "b.csv").write_text("\n".join(turned) + "\n")
    for verb in ("run", "diagnose"):
        status, _, said = _run(folder, verb=verb)
        assert status == 1
        assert "'E_Y0C' has the other sign" in said
        assert "b.csv" in said
        assert "--force" in said
        assert not (folder / "out").exists()
    status, printed, _ = _run(folder, "--force", "--quiet")
    assert status == 0
    assert "has the other sign" in printed


def test_what_a_killed_run_left_is_cleared(folder: Path) -> None:
    gone = subprocess.run(
        [sys.executable, "-c", "import os; print(os.getpid())"], capture_output=True, text=True
    )
    mark = f".out.{platform.node()}."
    dead = folder / f"{mark}{gone.stdout.strip()}.abc"
    alive = folder / f"{mark}1.abc"
    for one in (dead, alive):
        one.mkdir()
        (one / "results.json").write_text("{")
    assert _run(folder, "--quiet")[0] == 0
    assert not dead.exists()
    assert alive.exists()  # somebody's who still runs


def test_a_ridge_regression_is_the_closed_form(folder: Path) -> None:
    experiment = load_experiment(folder / "experiment.toml")
    fit = fit_of(experiment, "regression", experiment.form.models["regression"])[2]
    values = fit.model.values()
    rows = []
    for name in experiment.fit:
        one = experiment.campaign.recordings[name]
        known = np.isfinite(one.values["E_Y0C"])
        rows.append(np.column_stack([one.values[c][known] for c in ("T_env", "P", "E_Y0C")]))
    table = np.concatenate(rows)
    x = np.column_stack([np.ones(len(table)), table[:, :2]])
    plain = np.linalg.lstsq(x, table[:, 2], rcond=None)[0]
    names = [f"b{k}_E_Y0C" for k in range(3)]
    order = [names[0], *sorted(names[1:], key=lambda n: fit.model.parameters[n].unit != "um/K")]
    found = np.array([values[n] for n in order])
    # a ridge shrinks; the mean of the readings stays
    size = table[:, :2].std(axis=0)
    assert np.linalg.norm(found[1:] * size) <= 1.001 * np.linalg.norm(plain[1:] * size)
    assert float(np.mean(x @ found)) == pytest.approx(float(np.mean(table[:, 2])), abs=0.05)


def test_a_single_model_wins_against_none() -> None:
    lines = ended().lines()
    assert lines[0].startswith("winner: a, the only model, on 1 held-out recording: rms 1 um")
    assert lines[1] == "how sure: there is no other model to compare with"
