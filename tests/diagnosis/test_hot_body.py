"""A hot body that radiates, and a model with a loss in proportion: its process noise swallows all of it."""

from __future__ import annotations

import json
from pathlib import Path

from typer.testing import CliRunner

from benchmarks.laboratory import write_case
from discovery.cli import app
from discovery.effects.catalogue import catalogue


def test_what_large_process_noise_swallows_is_searched_for_without_it(tmp_path: Path) -> None:
    """The free runs are 58 K off, the flows by 25 %: to first order no candidate is worth a refit."""
    write_case(tmp_path, "kiln", "effect", 3)
    done = CliRunner().invoke(
        app, ["diagnose", str(tmp_path / "experiment.toml"), "--out", str(tmp_path / "o")]
    )
    assert done.exit_code == 0, done.output
    found = json.loads((tmp_path / "o" / "diagnosis.json").read_text("utf-8"))
    assert [p["effect"] for p in found["physics"]] == ["radiation"]
    size = found["physics"][0]["parameters"]["A_rad_T_b"]
    assert size["low"] < 0.064 < size["high"]
    unseen = found["improvement"]["held_out"]["c"]
    assert unseen["rms_before"] > 30
    assert unseen["rms_after"] < 1


def test_a_law_keeps_the_range_of_its_exponent() -> None:
    """Free convection: 1/4 to 1/3. With an exponent of 1.9 it would pass for radiation."""
    (exponent,) = catalogue()["natural_convection"].shapes
    low, high = exponent.ends
    assert low < 0.25 < 0.33 < high < 0.6
