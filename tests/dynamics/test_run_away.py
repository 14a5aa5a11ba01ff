"""A model that grows without end is told so before its numbers overflow."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.dynamics import make_grid, make_system, predict, simulate
from discovery.errors import RunsAwayError
from discovery.fitting import fit_model
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
    model = Model(
        "m", {"a": Parameter(rate, "1/s")}, {"T": State("T", "degC", None, parse("1"), 0.0)}, terms, {}
    )
    grid = make_grid(Campaign("c", channels, {"r": recording}), "r", ["u"], ["T"])
    if runs:
        x = simulate(make_system(model, grid), model.values()).x
        np.testing.assert_allclose(x[-1, 0], np.exp(5.0), rtol=1e-6)
    else:
        with pytest.raises(RunsAwayError, match="diverges"):
            simulate(make_system(model, grid), model.values())


@pytest.mark.parametrize("formula", ["T + log(u - 300)", "T + 0*(1/(u - 400))", "T + 0*sqrt(100 - u)"])
def test_an_output_that_is_no_number_is_told(formula: str) -> None:
    """u is the time in s: the formulas are numbers before 200 s, or after 300 s, but not at every reading."""
    time = np.arange(0.0, 1001.0, 100.0)
    channels = {
        "u": Channel("u", "heat load", "W", None, "held"),
        "E": Channel("E", "error", "um", None, "linear"),
    }
    recording = Recording("r", time, {"u": time, "E": np.where(time < 350, np.nan, 0.0)})
    state = State("T", "degC", None, parse("20"))
    campaign = Campaign("c", channels, {"r": recording})

    def of(output: str) -> np.ndarray:
        model = Model("m", {}, {"T": state}, (), {"E": parse(output)})
        return predict(simulate(make_system(model, make_grid(campaign, "r", ["u"], ["E"])), {}))

    if "log" in formula:  # NaN where nothing was read is nobody's business
        np.testing.assert_allclose(of(formula)[:, 0], 20 + np.log(time[time > 350] - 300))
        formula = formula.replace("300", "500")
    with pytest.raises(
        RunsAwayError, match=r"the output 'E' is not a finite number 400 s after the start of"
    ):
        of(formula)
    with pytest.raises(RunsAwayError, match="'E' is not a finite number"):  # not scipy's words
        fit_model(
            Model("m", {"k": Parameter(1.0)}, {"T": state}, (), {"E": parse(f"{formula} + k")}),
            campaign,
            ["r"],
        )
