"""What effects make of terms that somebody wrote down."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from discovery.dynamics.system import predict
from discovery.mismatch.catalogue import catalogue
from discovery.mismatch.hypotheses import hypotheses
from discovery.mismatch.hypothesis import Hypothesis
from discovery.models import Model, read_model, write_model
from discovery.terms import parse, substitute
from tests.mismatch.sample import CHANNELS, RUNS, inside, sample, trajectory

REPLACING = ("fluid terms", "cooling terms", "inputs of a recording")
DELAYS = {"drive": 120.0, "chiller": 90.0, "emulsion": 60.0}  # s, of what its author wrote as late


def late(seconds: Mapping[str, float]) -> Model:
    """The sample machine with channels that reach it late."""
    model, _ = sample()
    swaps = {channel: parse(f"delay({channel}, {by})") for channel, by in seconds.items()}
    return replace(
        model, terms=tuple(replace(t, expression=substitute(t.expression, swaps)) for t in model.terms)
    )


def claims(model: Model, word: str) -> list[Hypothesis]:
    return hypotheses(model, CHANNELS, ("E_Y", "E_Z"), RUNS, [catalogue()[word]])


def test_a_clock_shifts_what_is_late_already() -> None:
    baseline = late(DELAYS)
    shift = next(
        h for h in claims(baseline, "clock_shift") if h.recording == "two" and 900.0 in h.shapes.values()
    )
    shifted = {c: DELAYS.get(c, 0.0) + 900.0 for c in ("drive", "chiller", "emulsion", "pump", "room")}
    found = predict(trajectory(shift.added_to(baseline)))
    assert np.allclose(found, predict(trajectory(late(shifted))), rtol=0, atol=1e-9)


def test_a_fluid_that_is_late_already_is_later() -> None:
    baseline = late(DELAYS)
    later = next(h for h in claims(baseline, "fluid_delay") if 600.0 in h.shapes.values())
    found = predict(trajectory(later.added_to(baseline)))
    expected = predict(trajectory(late({**DELAYS, "emulsion": 660.0})))
    assert np.allclose(found, expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("word", [w for w, e in catalogue().items() if e.place in REPLACING])
def test_what_stands_for_a_late_channel_is_written_read_and_simulated(word: str, tmp_path: Path) -> None:
    baseline = late(DELAYS)
    for h in claims(baseline, word):
        start = dict.fromkeys(h.amplitudes, h.effect.amplitude.fixed or h.effect.amplitude.plausible)
        on = inside(h).added_to(baseline, start)
        write_model(tmp_path / "m.toml", on)
        found = predict(trajectory(read_model(tmp_path / "m.toml")))
        assert np.isfinite(found).all()
        assert np.allclose(found, predict(trajectory(on)), rtol=0, atol=1e-6)
