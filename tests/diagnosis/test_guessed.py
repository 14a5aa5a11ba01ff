"""Start values that are guesses: a diagnosis hardly holds on to them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.diagnosis.refit import refit
from discovery.models import Model, Parameter, read_model, write_model
from tests.diagnosis.parts import context_of
from tests.machine import campaign, claims, model, simulated


def far_off(guessed: bool) -> Model:
    """The model with the fluid, each start value six times too large."""
    whole = model()
    sizes = {name: replace(p, value=6.0 * p.value) for name, p in whole.parameters.items()}
    return replace(whole, parameters=sizes, guessed=guessed)


def test_guesses_are_hardly_believed() -> None:
    runs = campaign(simulated(1))
    near, guessed, believed = (
        context_of(runs, one).baseline.model.parameters
        for one in (replace(model(), guessed=True), far_off(True), far_off(False))
    )
    for name, p in near.items():
        assert guessed[name].value == pytest.approx(p.value, rel=1e-3), name

    def pulled(one: Mapping[str, Parameter]) -> float:
        return sum(abs(float(np.log(one[name].value / p.value))) for name, p in near.items())

    assert pulled(believed) > 4 * pulled(guessed)


def test_a_guess_keeps_what_the_readings_leave_open() -> None:
    """A processor: nothing spoke against a sink of 1e8 J/K, guessed as 100, but for the start value."""
    believed = context_of(campaign(simulated(1)), replace(model(), guessed=True)).belief
    assert {name: np.exp(width) for name, width in believed.items()} == pytest.approx(
        dict.fromkeys(model().free, 9.0)
    )


def test_the_size_of_an_effect_is_not_believed_to_be_where_a_search_begins() -> None:
    """A tenth of usual: friction, which is never negative, was held near it by a second prior."""
    context = context_of(campaign(simulated(1)), model())
    (h,) = (one for one in claims(model(), "friction_speed") if one.states == ("motor",))
    fit = refit(context, [h], context.usual)
    believed = {u.name: u.belief for u in fit.problem.unknowns if not u.is_nuisance}
    assert {name: believed[name] for name in model().free} == context.belief
    assert [believed[name] for name in h.amplitudes] == [None]


def test_a_file_says_so(tmp_path: Path) -> None:
    write_model(tmp_path / "m.toml", far_off(True))
    assert "guessed = true" in (tmp_path / "m.toml").read_text("utf-8")
    assert read_model(tmp_path / "m.toml").guessed
    write_model(tmp_path / "m.toml", model())
    assert "guessed" not in (tmp_path / "m.toml").read_text("utf-8")
