"""What is known of a parameter before a fit: it stays in the file, and counts in every fit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.errors import UserError
from discovery.fitting import fit_model
from discovery.models import Model, Parameter, read_model, write_model
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import parse

SLOPE = Model("slope", {"a": Parameter(0.0, "um/W", prior=(1.0, 0.1))}, {}, (), {"E": parse("a*u")})


def test_a_file_keeps_it(tmp_path: Path) -> None:
    path = tmp_path / "slope.toml"
    write_model(path, SLOPE)
    assert read_model(path).parameters["a"].prior == (1.0, 0.1)


def test_a_spread_of_zero_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "slope.toml"
    write_model(path, SLOPE)
    path.write_text(path.read_text(encoding="utf-8").replace("0.1]", "0.0]"), encoding="utf-8")
    with pytest.raises(UserError, match="greater than 0"):
        read_model(path)


def test_it_counts_as_one_more_reading() -> None:
    """One reading of 2 um at 1 W with 0.1 um noise, and 1 um/W known to 0.1: halfway."""
    channels = {
        "u": Channel("u", "heat load", "W", None, "held"),
        "E": Channel("E", "error", "um", 0.1, "linear"),
    }
    readings = {"u": np.ones(2), "E": np.array([2.0, np.nan])}
    campaign = Campaign("c", channels, {"r": Recording("r", np.array([0.0, 1.0]), readings)}, Path("c"))
    fit = fit_model(SLOPE, campaign, ["r"], ["E"])
    assert fit.model.parameters["a"].value == pytest.approx(1.5, rel=1e-3)
