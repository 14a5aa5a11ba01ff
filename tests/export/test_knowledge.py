"""What an exported model says of its fit, by textbook regression: the model is a straight line."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.export.knowledge import Knowledge, knowledge, stretch
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import parse

Array = NDArray[np.float64]
CHANNELS = {
    "u": Channel("u", "heat load", "W", None, "held"),
    "E": Channel("E", "error", "um", 1.0, "linear"),
    "F": Channel("F", "error", "um", 1.0, "linear"),
}
COUNT = 400
TIMES = np.linspace(0.0, 900.0 * (COUNT - 1), COUNT)
U = np.random.default_rng(5).uniform(1.0, 3.0, COUNT)
SIGNS = np.tile([1.0, -1.0], COUNT // 2)


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
    found = known({"E": 0.5 * SIGNS}, {"E": "k*u"})
    assert found.residual == {"E": pytest.approx(0.5)}
    assert (found.slow_share, found.parameters) == (0.0, ("k",))
    assert found.covariance == pytest.approx(np.array([[0.25 / np.sum(U**2)]]))


def test_a_start_that_nobody_knows_is_found_first_and_costs_certainty() -> None:
    """3 um beside the line are where the body began: with a free intercept the spread of u alone tells."""
    found = known({"E": 3.0 + 0.5 * SIGNS}, {"E": "k*u + zero"}, start_sd=100.0)
    assert found.residual["E"] == pytest.approx(0.5, rel=1e-3)
    assert found.parameters == ("k",)
    assert found.covariance[0, 0] == pytest.approx(0.25 / np.sum((U - U.mean()) ** 2), rel=0.02)


def test_each_error_is_weighed_by_what_it_leaves() -> None:
    found = known({"E": 0.5 * SIGNS, "F": 2.0 * SIGNS}, {"E": "k*u", "F": "k*u"})
    assert found.residual == {"E": pytest.approx(0.5), "F": pytest.approx(2.0)}
    assert found.covariance[0, 0] == pytest.approx(1 / (np.sum(U**2) * (1 / 0.25 + 1 / 4.0)))


@pytest.mark.parametrize(("keep", "share"), [(0.5, 0.5), (1.0, 0.9)])
def test_what_stays_alike_from_reading_to_reading_widens_it(keep: float, share: float) -> None:
    """First-order noise by its lag-1 correlation, at most 0.9."""
    rng, slow = np.random.default_rng(2), np.zeros(COUNT)
    for k in range(1, COUNT):
        slow[k] = keep * slow[k - 1] + rng.normal(0, 1)
    found = known({"E": slow}, {"E": "k*u"})
    assert found.slow_share == pytest.approx(share, abs=0.1 if share < 0.9 else 1e-12)
    wider = stretch(found.slow_share, TIMES)
    assert wider > 3.0
    assert found.covariance[0, 0] == pytest.approx(np.mean(slow**2) * wider / np.sum(U**2))


def test_the_slowest_error_counts() -> None:
    slow = np.cumsum(np.random.default_rng(2).normal(0, 1, COUNT))
    for outputs in (("E", "F"), ("F", "E")):
        assert known({"E": slow, "F": SIGNS}, dict.fromkeys(outputs, "k*u")).slow_share == 0.9


def test_what_was_not_read_is_not_known() -> None:
    found = known({"E": 0.5 * SIGNS}, {"E": "k*u", "F": "k*u"})
    assert found.residual == {"E": pytest.approx(0.5), "F": None}
    nothing = known({}, {"E": "k*u"})
    assert (nothing.residual, nothing.parameters, nothing.covariance.shape) == ({"E": None}, (), (0, 0))


def test_what_belongs_to_one_recording_is_left_out() -> None:
    assert known({"E": 0.5 * SIGNS}, {"E": "k*u"}, r=2.0).parameters == ()
