"""The model of docs/own_model.md: what a reader copies runs, and is the physics that the page says."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from discovery import campaign_from_frames, prediction_frame, read_model
from discovery.models.dimensions import check_dimensions

PAGE = Path(__file__).parents[2] / "docs" / "own_model.md"


def test_its_steady_state_is_the_heat_balance(tmp_path: Path) -> None:
    (text, *_) = re.findall(r"```toml\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    (tmp_path / "mine.toml").write_text(text)
    model = read_model(tmp_path / "mine.toml")
    frame = pd.DataFrame(
        {"speed": 6000.0, "T_hall": 25.0, "E_Z": [0.0] + [np.nan] * 999 + [0.0]},
        index=100.0 * np.arange(1001),
    )
    channels = {
        "speed": {"role": "rotation speed", "unit": "rpm"},
        "T_hall": {"role": "ambient temperature", "unit": "degC"},
        "E_Z": {"role": "error", "unit": "um"},
    }
    campaign = campaign_from_frames({"monday": frame}, channels)
    found = prediction_frame(model, campaign, "monday", ["E_Z"])
    housing = 25.0 + 300.0 / 10.0  # all heat leaves through the housing
    bearing = housing + 300.0 / 20.0
    assert check_dimensions(model, campaign.channels) == []
    wrong = dict(model.parameters) | {"hA": replace(model.parameters["hA"], unit="W")}
    (said,) = check_dimensions(replace(model, parameters=wrong), campaign.channels)
    assert said.partition("': ")[2] in " ".join(PAGE.read_text("utf-8").split())
    assert found["E_Z|model"].iloc[-1] == pytest.approx((bearing - 21.0) + (housing - 21.0), rel=1e-4)
