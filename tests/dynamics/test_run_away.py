"""A model that grows without end is told so before its numbers overflow."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.dynamics import make_grid, make_system, simulate
from discovery.errors import RunsAwayError
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse


@pytest.mark.parametrize(("rate", "runs"), [(0.001, True), (0.03, False)])
def test_far_is_away(rate: float, runs: bool) -> None:
    """exp(rate t) after 5000 s: 148, and 1e65, which is finite, but its square over a noise is soon not."""
    time = np.arange(0.0, 5001.0, 100.0)
    channels = {
        "u": Channel("u", "heat load", "W", None, "held"),
        "T": Channel("T", "temperature", "degC", None, "linear"),
    }
    recording = Recording("r", time, {"u": np.zeros(len(time)), "T": np.zeros(len(time))})
    terms = (Term("growth", "T", parse("a*T + 0*u")),)
    model = Model("m", {"a": Parameter(rate, "1/s")}, {"T": State("T", "degC", None, parse("1"))}, terms, {})
    grid = make_grid(Campaign("c", channels, {"r": recording}), "r", ["u"], ["T"])
    if runs:
        x = simulate(make_system(model, grid), model.values()).x
        np.testing.assert_allclose(x[-1, 0], np.exp(5.0), rtol=1e-6)
    else:
        with pytest.raises(RunsAwayError, match="runs away"):
            simulate(make_system(model, grid), model.values())
