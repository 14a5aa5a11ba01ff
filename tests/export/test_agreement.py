"""How far the fixed step is from the model that was fitted, on an integral that one can work out."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.export.agreement import agreement
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CHANNELS = {
    "T": Channel("T", "ambient temperature", "degC", None, "linear"),
    "E": Channel("E", "error", "um", None, "linear"),
}
RATE = 1e-3  # K/s of the room


def found(hours: float, step_s: float) -> dict[str, dict[str, float]]:
    """y' = T/1000 while the room warms up all the time."""
    time = np.array([0.0, hours * 3600.0])
    values = {"T": RATE * time, "E": np.zeros(2)}
    states = {"y": State("y", "um", None, parse("0"), 0.0, 1.0)}
    model = Model("sum", {}, states, (Term("t", "y", parse("T/1000")),), {"E": parse("y")})
    return agreement(model, Campaign("c", CHANNELS, {"r": Recording("r", time, values)}), "r", step_s)


@pytest.mark.parametrize(("step_s", "last"), [(10.0, 3600.0), (400.0, 3200.0), (1200.0, 3600.0)])
def test_inputs_that_are_held_lag_by_half_a_step(step_s: float, last: float) -> None:
    """What half a step of the slope adds up to by the last of the instants, about 10 min apart."""
    deviation = found(3601.0 / 3600.0, step_s)
    assert deviation["integrator"]["um"] == pytest.approx(0.0, abs=1e-9)
    assert deviation["held_inputs"]["um"] == pytest.approx(RATE * step_s / 2 * last / 1000.0, rel=1e-6)


def test_where_there_is_nothing_to_compare_nothing_deviates() -> None:
    assert found(0.1, 10.0) == {"integrator": {"um": 0.0}, "held_inputs": {"um": 0.0}}
