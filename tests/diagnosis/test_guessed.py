"""Start values that are guesses are where a fit begins; a diagnosis does not hold on to them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from discovery.models import Model, read_model, write_model
from tests.diagnosis.parts import context_of
from tests.machine import campaign, model, simulated


def far_off(guessed: bool) -> Model:
    """The model with the fluid, each start value six times too large."""
    whole = model()
    sizes = {name: replace(p, value=6.0 * p.value) for name, p in whole.parameters.items()}
    return replace(whole, parameters=sizes, guessed=guessed)


def test_guesses_are_not_believed() -> None:
    runs = campaign(simulated(1))
    near, guessed, believed = (
        context_of(runs, one).baseline.model.parameters
        for one in (replace(model(), guessed=True), far_off(True), far_off(False))
    )
    for name, p in near.items():
        assert guessed[name].value == pytest.approx(p.value, rel=1e-6), name
    pulled = [name for name, p in near.items() if believed[name].value != pytest.approx(p.value, rel=1e-4)]
    assert pulled


def test_a_file_says_so(tmp_path: Path) -> None:
    write_model(tmp_path / "m.toml", far_off(True))
    assert "guessed = true" in (tmp_path / "m.toml").read_text("utf-8")
    assert read_model(tmp_path / "m.toml").guessed
    write_model(tmp_path / "m.toml", model())
    assert "guessed" not in (tmp_path / "m.toml").read_text("utf-8")
