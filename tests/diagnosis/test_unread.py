"""Outputs and recordings without readings: told in a sentence, or passed over in silence."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from discovery import UserError, diagnose
from discovery.diagnosis.context import Context
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.diagnosis.parts import document
from tests.machine import SEEN, campaign, changed, model, simulated

pytestmark = pytest.mark.filterwarnings("error")


def unread(recording: Recording, *outputs: str) -> Recording:
    nothing = np.full(len(recording.time), np.nan)
    return changed(recording, **dict.fromkeys(outputs, nothing))


def test_an_output_that_was_never_read_leaves_no_rms() -> None:
    runs = [unread(simulated(seed), "E_Z") for seed in (1, 2)]
    found = document(diagnose(model(wet=False), campaign(*runs, simulated(3)), ["r1", "r2"], ["r3"]))
    assert [p["effect"] for p in found["physics"]] == ["fluid_convection"]
    assert found["detection"]["residual_rms"]["E_Z"] is None
    assert found["detection"]["residual_rms"]["E_Y"] > 1.0


def test_recordings_without_readings_are_refused_as_those_of_an_experiment() -> None:
    runs = [unread(simulated(seed), *SEEN) for seed in (1, 2)]
    with pytest.raises(UserError, match=r"no reading of E_Y or E_Z or E_R in r1, r2; name recordings"):
        diagnose(model(), campaign(*runs), ["r1", "r2"])
    with pytest.raises(UserError, match=r"no reading of E_Y or E_Z or E_R in r2; name recordings"):
        diagnose(model(), campaign(simulated(1), runs[1]), ["r1", "r2"])


def test_an_unseen_recording_without_readings_proves_nothing() -> None:
    runs = campaign(simulated(1), simulated(2), unread(simulated(3), *SEEN))
    found = document(diagnose(model(wet=False), runs, ["r1", "r2"], ["r3"]))
    assert found["improvement"]["held_out"] == {}
    assert not any("runs away" in reason for reason in found["reasons"])


def test_a_temperature_that_is_measured_and_no_output_is_found() -> None:
    """Of two bodies only the first is an output: the sensor of the second one takes no part."""
    channels = {n: Channel(n, "temperature", "degC", 0.02, "linear") for n in ("near", "far", "room")}
    states = {n: State(n, "degC", 20_000.0, parse("20")) for n in ("near", "far", "inside")}
    bodies = Model("two bodies", {}, states, (Term("link", "near", parse("far - near"), source="far"),), {})
    values = dict.fromkeys(channels, np.full(3, 20.0))
    seen = Campaign("bench", channels, {"a": Recording("a", np.arange(3.0), values)})
    near = SimpleNamespace(campaign=seen, model=bodies, recordings=("a",), outputs=("near",))
    unused: Any = Context.unused_readings
    assert unused.fget(near) == ["far"]
    near.outputs = ("near", "far")
    assert unused.fget(near) == []
