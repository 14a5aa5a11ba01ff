"""Outputs and recordings without readings: told in a sentence, or passed over in silence."""

from __future__ import annotations

import numpy as np
import pytest

from discovery import diagnose
from discovery.recordings import Recording
from tests.mismatch.machine import campaign, changed, model, simulated

pytestmark = pytest.mark.filterwarnings("error")


def unread(recording: Recording, *outputs: str) -> Recording:
    nothing = np.full(len(recording.time), np.nan)
    return changed(recording, **dict.fromkeys(outputs, nothing))


def test_an_output_that_was_never_read_leaves_no_rms() -> None:
    runs = [unread(simulated(seed), "E_Z") for seed in (1, 2)]
    found = diagnose(model(wet=False), campaign(*runs, simulated(3)), ["r1", "r2"], ["r3"]).document()
    assert [p["effect"] for p in found["physics"]] == ["fluid_convection"]
    assert found["detection"]["residual_rms"]["E_Z"] is None
    assert found["detection"]["residual_rms"]["E_Y"] > 1.0
