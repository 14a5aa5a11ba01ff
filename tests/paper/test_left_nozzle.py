"""A nozzle that was pointed to the left: named with its size, also where nobody recorded where it points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.experiment import load_experiment
from discovery.paper.chapter import Chapter, Material
from discovery.paper.left_nozzle import HIDDEN, RECORDED, left_nozzle
from tests.small import EXPERIMENT, MODEL

G_JET = 15.0  # W/K, of the fluid on the body while the nozzle points to the left
CAMPAIGN = """
name = "left"

[channels]
T_env   = { role = "ambient temperature", unit = "degC" }
T_fluid = { role = "fluid temperature", unit = "degC" }
pump    = { role = "fluid flow", unit = "1" }
side    = { role = "nozzle side", unit = "1" }
P       = { role = "heat load", unit = "W" }
E_Y0C   = { role = "error", unit = "um", noise = 0.3 }
E_R0T   = { role = "error", unit = "um", noise = 0.3 }

[recordings]
a = { file = "a.csv" }
b = { file = "b.csv", note = "nozzle on the left" }
c = { file = "c.csv" }
"""
LEFT = """
name = "left"
campaign = "campaign.toml"
fit = ["a", "b"]
held_out = ["c"]
cross_validate = false
models = { one_body = { file = "model.toml" } }
mismatch = { model = "one_body" }
"""
PAPER = """
[paper]
thermobalance = "one_body"
superposition = "superposition"
reduced = "reduced"
left_nozzle = "left.toml"
"""


def record(path: Path, seed: int, side: float) -> None:
    """24 h of the body of `tests.small` with a fluid that is pumped in spells; exact steps, noise 0.3 um."""
    rng = np.random.default_rng(seed)
    lines, x, power, pump = ["time,T_env,T_fluid,pump,side,P,E_Y0C,E_R0T"], 22.0, 0.0, 0.0
    for k in range(24 * 12 + 1):
        if k % 12 == 0:
            power, pump = float(rng.choice([0.0, 100.0, 250.0])), float(rng.uniform() < 0.6)
        room, fluid = 22.0 + 0.8 * np.sin(k / 40.0 + seed), 27.0 + np.sin(k / 25.0)
        errors = ["", ""]
        if k % 3 == 0:
            errors = [f"{factor * (x - 22) + 0.3 * rng.standard_normal():.3f}" for factor in (-5.0, 2.0)]
        lines.append(f"{300 * k},{room:.3f},{fluid:.3f},{pump:.0f},{side:g},{power:.0f},{','.join(errors)}")
        jet = G_JET * side * pump
        steady = (12.0 * room + 0.4 * power + jet * fluid) / (12.0 + jet)
        x = steady + (x - steady) * float(np.exp(-300 * (12.0 + jet) / 60e3))
    path.write_text("\n".join(lines) + "\n")


@pytest.fixture
def path(tmp_path: Path) -> Path:
    for seed, (name, side) in enumerate((("a", 0.0), ("b", 1.0), ("c", 1.0))):
        record(tmp_path / f"{name}.csv", seed, side)
    for name, text in (("campaign", CAMPAIGN), ("model", MODEL), ("left", LEFT), ("e", EXPERIMENT + PAPER)):
        (tmp_path / f"{name}.toml").write_text(text)
    return tmp_path / "e.toml"


def chapter_of(path: Path) -> Chapter:
    experiment = load_experiment(path)
    assert experiment.form.paper is not None
    found = left_nozzle(Material(experiment, {}, {}, experiment.form.paper))
    assert found is not None
    return found


def test_the_jet_is_named_with_its_size_and_proved(path: Path) -> None:
    found = chapter_of(path)
    named, rms = found.tables
    assert [row[0] for row in named.rows] == [RECORDED, HIDDEN]
    for _, title, where, _, low, high, unit, _ in named.rows:
        assert "jet" in str(title)
        assert (where, unit) == ("body", "W/K")
        assert float(low or 0) < G_JET < float(high or 0)
    left = {row[1]: float(row[2] or 0) for row in rms.rows if row[0] == "c (unseen)"}
    for label in (RECORDED, HIDDEN):
        assert left[f"repaired, {label}"] < 0.4 < left["one_body"]
    assert "How 'b' was made: nozzle on the left." in found.shows


def test_without_a_channel_there_is_one_case(path: Path) -> None:
    campaign = path.with_name("campaign.toml")
    kept = [line for line in campaign.read_text().splitlines() if not line.startswith("side")]
    campaign.write_text("\n".join(kept))
    assert {row[0] for row in chapter_of(path).tables[0].rows} == {HIDDEN}


def test_an_experiment_that_is_not_there_is_refused(path: Path) -> None:
    path.write_text(path.read_text().replace("left.toml", "right.toml"))
    with pytest.raises(UserError, match=r"no experiment .right\.toml."):
        load_experiment(path)


def test_an_experiment_without_a_question_is_refused(path: Path) -> None:
    left = path.with_name("left.toml")
    left.write_text(left.read_text().replace('mismatch = { model = "one_body" }', ""))
    with pytest.raises(UserError, match=r"\[mismatch\]"):
        chapter_of(path)
