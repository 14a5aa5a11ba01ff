"""A single step test: the heater is on from the first reading to the last."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discovery.firsthour.new import new


@pytest.mark.parametrize(("off", "said"), [(1e9, True), (200.0, False)])
def test_a_load_that_never_moves_is_told(off: float, said: bool, tmp_path: Path) -> None:
    clock = np.arange(0.0, 600.0, 5.0)
    body = 22.0 + 40.0 * (1 - np.exp(-np.minimum(clock, off) / 150.0))
    body = 22.0 + (body - 22.0) * np.exp(-np.maximum(clock - off, 0.0) / 150.0)
    rows = [f"{t:g},{50 * (t < off)},{b:.2f}" for t, b in zip(clock, body, strict=True)]
    file = tmp_path / "step.csv"
    file.write_text("\n".join(["time [s],Q1,T1", *rows]) + "\n")
    told = [line for line in new(tmp_path / "step", [file], quick=True) if "never moves" in line]
    assert (
        told
        == [
            "Q1 never moves in the recordings to fit, so they say little of what heats the machine: "
            "record steps and pauses as well"
        ]
        * said
    )
