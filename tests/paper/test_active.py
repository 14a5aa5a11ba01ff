"""Active compensation in the loop, against a machine that the model knows exactly."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.models import read_model
from discovery.paper.active import compensate, exported_of, in_steps, resolution
from discovery.recordings import Campaign, load_campaign
from tests.small import write_small


@pytest.fixture
def campaign(tmp_path: Path) -> Campaign:
    write_small(tmp_path)
    return load_campaign(tmp_path / "campaign.toml")


def test_offsets_come_in_steps_of_the_axis() -> None:
    assert in_steps(0.4, resolution("um")) == 0.0
    assert in_steps(-1.6, resolution("um")) == -2.0
    assert in_steps(5.0, resolution("um/m")) == 4.0  # 1 um at 0.25 m


def test_a_true_model_leaves_noise_and_half_a_step(campaign: Campaign, tmp_path: Path) -> None:
    """Noise 0.3 um and steps of 1 um, uniform within half a step: rms sqrt(0.3^2 + 1/12) = 0.42 um."""
    model = read_model(tmp_path / "model.toml").with_values({"G": 12.0, "loss": 0.4})
    run = compensate(exported_of(model, campaign, ["a", "b"]), campaign, "c")
    for error in ("E_Y0C", "E_R0T"):
        read = np.isfinite(run.measured[error])
        left = run.compensated(error)[read & run.ready]
        before = run.uncompensated(error)[read & run.ready]
        assert len(left) > 20
        assert np.sqrt(np.mean(left**2)) == pytest.approx(0.42, rel=0.35)
        assert np.sqrt(np.mean(before**2)) > 3 * np.sqrt(np.mean(left**2))
        assert np.allclose(run.applied[error], np.round(run.applied[error]))
        # reading plus applied correction is the error of the machine, to the last digit of the log
        assert run.reconstructed[error][read] == pytest.approx(
            campaign.recordings["c"].values[error][read], abs=1e-9
        )


def test_what_the_guards_say_is_a_remark(campaign: Campaign, tmp_path: Path) -> None:
    exported = exported_of(read_model(tmp_path / "model.toml"), campaign, ["a", "b"])
    assert compensate(exported, campaign, "c").remarks == ()
    data = campaign.recordings["c"]
    strong = replace(data, values={**data.values, "P": 4.0 * data.values["P"]})
    (remark,) = compensate(exported, replace(campaign, recordings={"c": strong}), "c").remarks
    assert remark.startswith("gain falls: P far outside of the training")


def test_the_loop_knows_no_reading(campaign: Campaign, tmp_path: Path) -> None:
    """Other readings, same inputs: the same corrections."""
    model = read_model(tmp_path / "model.toml")
    exported = exported_of(model, campaign, ["a", "b"])
    data = campaign.recordings["c"]
    moved = replace(data, values={**data.values, "E_Y0C": data.values["E_Y0C"] + 30.0})
    other = replace(campaign, recordings={**campaign.recordings, "c": moved})
    one, two = (compensate(exported, c, "c") for c in (campaign, other))
    assert one.applied["E_Y0C"].tolist() == two.applied["E_Y0C"].tolist()
