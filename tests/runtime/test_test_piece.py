"""A test piece as sparse readings: a few features cut in a day and measured later suffice for an update."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.dynamics.system import predict
from discovery.export.document import Exported, from_document, render
from discovery.export.makedocument import make_document
from discovery.export.seal import open_seal
from discovery.fitting import fit_model, predict_recording
from discovery.models import Model, read_model
from discovery.recordings import Campaign, load_campaign
from discovery.runtime.hypotheses import compare
from tests.small import write_small

HOURS = (2.0, 5.0, 8.0, 11.0, 14.0, 17.0, 20.0, 23.0)  # when a feature is cut
ERRORS = ("E_Y0C", "E_R0T")


@pytest.fixture
def fitted(tmp_path: Path) -> tuple[Campaign, Model, Exported]:
    write_small(tmp_path)
    campaign = load_campaign(tmp_path / "campaign.toml")
    fit = fit_model(read_model(tmp_path / "model.toml"), campaign, ["a", "b"], list(ERRORS))
    document, seal = open_seal(render(make_document(fit.model, campaign, ["a", "b"])), "piece")
    return campaign, fit.model, from_document(document, seal, "piece")


def piece(campaign: Campaign, model: Model, loss: float, seed: int) -> Campaign:
    """Recording c of a machine with another loss: eight features, 1 um of measuring and cutting scatter."""
    rng = np.random.default_rng(seed)
    data = campaign.recordings["c"]
    machine = model.with_values({"G": 12.0, "loss": loss})
    run = predict_recording(machine, campaign, "c", list(ERRORS))
    time = run.system.grid.time[run.system.grid.read]
    cut = [int(np.argmin(np.abs(time - 3600.0 * h))) for h in HOURS]
    values = dict(data.values)
    for y, name in enumerate(ERRORS):
        column = np.full(len(data.time), np.nan)
        for k in cut:
            column[np.searchsorted(data.time, time[k])] = predict(run)[k, y] + rng.normal(0.0, 1.0)
        values[name] = column
    return replace(campaign, recordings={"c": replace(data, values=values)})


def test_a_test_piece_shows_wear(fitted: tuple[Campaign, Model, Exported]) -> None:
    """Loss from 0.4 to 0.6: found within a fifth from eight features; an unchanged machine stays."""
    campaign, model, exported = fitted
    found = compare(exported, piece(campaign, model, 0.6, 1), ["c"])
    assert found.verdict == "wear"
    assert found.change["loss"] == pytest.approx(0.6, rel=0.2)
    same = compare(exported, piece(campaign, model, 0.4, 2), ["c"])
    assert same.verdict == "nothing"
