"""What an exported model says of its fit, by textbook regression: the model is a straight line."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.knowledge import Knowledge, knowledge, read_knowledge
from discovery.export.makedocument import exportable
from discovery.fitting import fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]
CHANNELS = {
    "u": Channel("u", "heat load", "W", None, "held"),
    "E": Channel("E", "error", "um", 1.0, "linear"),
    "F": Channel("F", "error", "um", 1.0, "linear"),
}
COUNT = 400
TIMES = np.linspace(0.0, 900.0 * (COUNT - 1), COUNT)
U = np.random.default_rng(5).uniform(1.0, 3.0, COUNT)
NOISE = np.random.default_rng(9).normal(0.0, 1.0, COUNT)


def known(left: dict[str, Array], outputs: dict[str, str], start_sd: float = 0.0, **own: float) -> Knowledge:
    """Of a model whose errors are `k u` but for what is `left`; `own`: k in one recording alone."""
    model = Model(
        "line",
        {"k": Parameter(2.0, per_recording=bool(own), values=own)},
        {"zero": State("zero", "um", None, parse("0"), start_sd, 1.0)},
        (),
        {name: parse(formula) for name, formula in outputs.items()},
    )
    values = {"u": U, **{name: 2.0 * U + series for name, series in left.items()}}
    recordings = {"r": Recording("r", TIMES, values)}
    return knowledge(model, Campaign("c", CHANNELS, recordings), ["r"])


def test_a_slope_is_known_as_well_as_regression_says() -> None:
    found = known({"E": NOISE}, {"E": "k*u"})
    assert found.residual == {"E": pytest.approx(np.sqrt(np.mean(NOISE**2)))}
    assert found.parameters == ("k",)
    assert found.noise is not None
    assert (found.noise.white, found.noise.slow, found.noise.form) == ((1.0,), (0.0,), 0.0)
    assert found.rows[:, 1] @ found.rows[:, 1] == pytest.approx(np.sum(U**2))
    # what the rows say is what the readings say: the same pull on the slope
    assert found.rows[:, 0] @ found.rows[:, 1] == pytest.approx(NOISE @ U, rel=1e-4)


def test_a_start_that_nobody_knows_costs_certainty() -> None:
    """An offset of 3 um is where the body began. With a free intercept, only the spread of u informs."""
    found = known({"E": 3.0 + NOISE}, {"E": "k*u + zero"}, start_sd=100.0)
    assert found.residual["E"] == pytest.approx(np.std(NOISE), rel=1e-3)
    about = found.rows[:, 1] @ found.rows[:, 1]
    assert about == pytest.approx(np.sum((U - U.mean()) ** 2), rel=0.02)


def test_slow_noise_is_found_and_costs_certainty() -> None:
    rng, slow = np.random.default_rng(2), np.zeros(COUNT)
    for k in range(1, COUNT):
        slow[k] = np.exp(-900.0 / 7200.0) * slow[k - 1] + rng.normal(0, 1)
    found = known({"E": slow + NOISE}, {"E": "k*u"})
    assert found.noise is not None
    assert 1.0 < found.noise.slow[0] < 4.5
    assert np.linalg.norm(found.rows[:, 1]) < np.linalg.norm(U)


def test_what_is_written_is_what_is_read() -> None:
    found = known({"E": NOISE}, {"E": "k*u"})
    again = read_knowledge("line", json.loads(json.dumps(found.document())))
    assert again.noise == found.noise
    assert again.rows == pytest.approx(found.rows, rel=1e-5)
    with pytest.raises(UserError, match="export it again from its run"):
        read_knowledge("line", {**found.document(), "noise": None})


def test_what_was_not_read_is_not_known() -> None:
    found = known({"E": NOISE}, {"E": "k*u", "F": "k*u"})
    assert found.residual["F"] is None
    nothing = known({}, {"E": "k*u"})
    assert (nothing.residual, nothing.parameters, nothing.noise) == ({"E": None}, (), None)


def test_what_belongs_to_one_recording_is_left_out() -> None:
    assert known({"E": NOISE}, {"E": "k*u"}, r=2.0).parameters == ()


def test_the_residual_is_that_of_the_fit() -> None:
    """A body that begins 30 K above the room, where a controller would start it, and an error with it: what
    is left is what the fit left, and the reading noise that it found.
    """
    rng, hours = np.random.default_rng(3), np.linspace(0.0, 12.0, 60)
    body = 22.0 + 25.0 * (1.0 - np.exp(-hours / 2.0)) + 30.0 * np.exp(-hours / 2.0)
    values = {
        "u": np.full(60, 200.0),
        "room": np.full(60, 22.0),
        "T": body + rng.normal(0.0, 0.02, 60),
        "E": body - 22.0 + rng.normal(0.0, 0.1, 60),
    }
    channels = {
        "u": CHANNELS["u"],
        "room": Channel("room", "ambient temperature", "degC", None, "linear"),
        "T": Channel("T", "temperature", "degC", None, "linear"),
        "E": Channel("E", "error", "um", None, "linear"),
    }
    campaign = Campaign("c", channels, {"r": Recording("r", 3600.0 * hours, values)})
    model = Model(
        "warm",
        {"hA": Parameter(8.0, min=0.0), "k": Parameter(1.1)},
        {"T": State("T", "degC", 5.76e4, None, None, 1 / 5.76e4)},
        (Term("heat", "T", parse("u")), Term("air", "T", parse("hA*(room - T)"))),
        {"E": parse("k*(T - 22)")},
    )
    fit = fit_model(model, campaign, ["r"])
    left = dict(zip(fit.problem.outputs, np.sqrt(np.mean(fit.residuals()["r"] ** 2, axis=0)), strict=True))
    found = knowledge(exportable(fit.model, campaign), campaign, ["r"])
    assert found.residual == {name: pytest.approx(left[name], rel=0.02) for name in found.residual}
    assert found.noise is not None
    said = dict(zip(found.noise.outputs, found.noise.white, strict=True))
    assert said == pytest.approx(dict(zip(fit.noise.outputs, fit.noise.white, strict=True)), rel=0.02)
