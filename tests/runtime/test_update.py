"""Keeping up: noise is left alone, a drift is followed, a new effect is handed on, nothing is lost on the
way.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from discovery.cli import app
from discovery.errors import UserError
from discovery.export.document import Exported, read_document, write_document
from discovery.export.knowledge import stretch
from discovery.recordings import Campaign, Recording
from discovery.runtime import update as module
from discovery.runtime.belief import Finding, belief_of
from discovery.runtime.update import Update, next_name, update_file
from discovery.virtual.effects import Request
from discovery.virtual.machine import Machine
from discovery.virtual.record import Order, take

ERRORS = ("E_Y0C", "E_Z0T", "E_R0T", "E_A0C")


def days(
    machine: Campaign, count: int, plant: Machine, effects: tuple[Request, ...] = (), readings: int = 8
) -> Campaign:
    """Days of 24 h with a few readings each."""
    recordings = {}
    for k in range(count):
        columns = take(Order(f"d{k}", "fit", 300 + k, 24.0, machine=plant, effects=effects)).columns
        values = {name: series for name, series in columns.items() if name != "time"}
        read = np.flatnonzero(np.isfinite(values[ERRORS[0]]))
        chosen = read[np.linspace(0, len(read) - 1, readings).astype(int)]
        for name in ERRORS:
            keep = np.isin(np.arange(len(columns["time"])), chosen)
            values[name] = np.where(keep, values[name], np.nan)
        recordings[f"d{k}"] = Recording(f"d{k}", columns["time"], values)
    return replace(machine, recordings=recordings)


def less_loss(factor: float) -> Machine:
    fresh = Machine()
    return fresh._replace(
        friction_share=tuple(factor * share for share in fresh.friction_share),  # type: ignore[arg-type]
        motor_share=tuple(factor * share for share in fresh.motor_share),  # type: ignore[arg-type]
    )


@pytest.fixture
def at_work(document: bytes, tmp_path: Path) -> Path:
    path = tmp_path / "model.json"
    path.write_bytes(document)
    return path


def test_a_machine_that_has_not_changed_keeps_its_model(machine: Campaign, at_work: Path) -> None:
    campaign = days(machine, 3, Machine())
    found = update_file(at_work, campaign, list(campaign.recordings), at_work.with_name("new.json"))
    assert {f.verdict for f in found.findings} == {"noise"}
    assert (found.path, found.diagnosis) == (None, None)
    assert not at_work.with_name("new.json").exists()


def test_a_drift_is_followed_and_written_with_its_history(machine: Campaign, at_work: Path) -> None:
    campaign = days(machine, 3, less_loss(0.8))
    out = at_work.with_name("new.json")
    found = update_file(at_work, campaign, list(campaign.recordings), out)
    assert found.findings[-1].verdict == "drift"
    assert (found.path, found.diagnosis) == (out, None)
    assert f"{out}: the next revision" in found.lines()[-1]
    old, new = read_document(at_work), read_document(out)
    assert new.revision == 2
    assert new.changelog[-1]["of"] == old.seal.sha256
    assert "drift" in new.changelog[-1]["text"]
    total = {
        which: sum(one.model.parameters[name].value for name in ("loss_table", "loss_c1", "loss_c2"))
        for which, one in (("old", old), ("new", new))
    }
    assert total["new"] / total["old"] == pytest.approx(0.8, abs=0.06)
    for name in belief_of(new).parameters:
        p = new.model.parameters[name]
        assert p.low is not None
        assert p.high is not None
        assert p.min <= p.low <= p.value <= p.high <= p.max
    assert old.document["inputs"] == new.document["inputs"]


def test_what_was_learnt_stands_in_the_residual(machine: Campaign, at_work: Path) -> None:
    """`discovery update` every day, with the days since the last revision."""
    campaign = days(machine, 4, less_loss(0.8))
    path, since, findings = at_work, list[str](), []
    for name in campaign.recordings:
        since.append(name)
        found = update_file(path, campaign, since, next_name(path))
        findings.append(found.findings[-1])
        if found.path is not None:
            path, since = found.path, []
    assert read_document(path).revision >= 2
    assert findings[0].before > 1.5
    assert findings[-1].before < 1.3


def test_a_new_effect_is_handed_to_the_mismatch_method(
    machine: Campaign, at_work: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[list[str]] = []

    def diagnosis(_: object, __: object, recordings: list[str]) -> dict[str, object]:
        asked.append(recordings)
        return {"verdict": "missing physics", "physics": [{"effect": "swarf_heat", "states": ["table"]}]}

    monkeypatch.setattr(module, "_diagnosis", diagnosis)
    campaign = days(machine, 1, Machine(), (Request("swarf_heat", 900.0, ("table",)),), readings=60)
    usual = days(machine, 2, Machine()).recordings["d1"]
    campaign = replace(campaign, recordings={**campaign.recordings, "d1": usual})
    found = update_file(at_work, campaign, ["d0", "d1"], at_work.with_name("new.json"))
    assert [f.verdict for f in found.findings] == ["new effect", "noise"]
    assert asked == [["d0"]]
    assert found.path is None
    assert "swarf_heat at table" in found.lines()[-2]


def test_readings_close_together_count_less() -> None:
    """Against the variance of a mean of correlated noise, by its full covariance matrix."""
    times = np.linspace(0.0, 399 * 900.0, 400)
    rho = 0.4 * np.exp(-np.abs(times[:, None] - times[None, :]) / 7200.0)
    np.fill_diagonal(rho, 1.0)
    assert stretch(0.4, times) == pytest.approx(rho.sum() / len(times), rel=0.05)
    assert stretch(0.0, times) == 1.0


def test_mistakes_are_sentences(machine: Campaign, at_work: Path, exported: Exported, tmp_path: Path) -> None:
    campaign = days(machine, 1, Machine())
    values = {n: s for n, s in campaign.recordings["d0"].values.items() if n not in ERRORS}
    blind = replace(campaign, recordings={"d0": replace(campaign.recordings["d0"], values=values)})
    with pytest.raises(UserError, match="holds no reading"):
        update_file(at_work, blind, ["d0"], tmp_path / "new.json")
    unknown = {**exported.document["knowledge"], "parameters": []}
    write_document(tmp_path / "unknown.json", {**exported.document, "knowledge": unknown})
    with pytest.raises(UserError, match="how well its parameters are known"):
        update_file(tmp_path / "unknown.json", campaign, ["d0"], tmp_path / "new.json")


def test_the_command(at_work: Path) -> None:
    campaign = Path(__file__).parents[2] / "datasets" / "nmv5000" / "campaign.toml"
    done = CliRunner().invoke(app, ["update", str(at_work), str(campaign), "--recording", "validation"])
    assert done.exit_code == 0, done.output
    assert "validation: noise" in done.output
    assert "the model stays as it is" in done.output


def test_a_drift_that_is_dropped_is_told_why() -> None:
    drift = Finding("dry", "drift", 90, 2.1, 1.2, 1e-34, {"hA": (4.0, 5.0)})
    for last, why in (
        (
            Finding("load", "noise", 50, 1.02, 1.0, 1e-34, {}),
            "load is predicted as well as when the model was",
        ),
        (Finding("load", "noise", 50, 1.3, 1.2, 0.3, {}), "load shows none"),
        (Finding("load", "new effect", 50, 3.0, 2.0, 1e-9, {}), "load asks for a new effect"),
    ):
        said = Update((drift, last), None, None).lines()[-1]
        assert said.startswith(f"the model stays as it is: the last recording decides, and {why}")
        assert said.endswith("; the drift in dry is not taken up")


def test_noise_is_not_told_by_a_p_value_that_denies_it() -> None:
    """The p value counts all recordings; this one is predicted as well as ever."""
    said = str(Finding("load", "noise", 50, 1.02, 1.0, 1e-34, {}))
    assert said.startswith("load: noise (residual 1.02 of the fit's, 50 readings: as good as new")
    assert "all recordings so far" in said
    assert str(Finding("load", "noise", 50, 1.3, 1.2, 0.3, {})).startswith(
        "load: noise (p = 0.3, 50 readings"
    )
