"""Shares of the terms, on bodies that only add up their heat: every response is a straight line."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.evaluation.shares import term_shares
from discovery.fitting import Noise, fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "Q": Channel("Q", "heat load", "W", None, "held"),
    "E": Channel("E", "error", "um", 1.0, "linear"),
    "F": Channel("F", "error", "um", 10.0, "linear"),
}


def shares(
    terms: tuple[Term, ...], outputs: dict[str, str], runs: dict[str, tuple[float, float]]
) -> dict[str, float]:
    """Two bodies of the same mass; (P, Q) is constant in each recording."""
    time = np.arange(0.0, 3601.0, 60.0)
    recordings = {
        name: Recording(
            name,
            time,
            {
                "P": np.full(len(time), p),
                "Q": np.full(len(time), q),
                "E": np.zeros(len(time)),
                "F": np.zeros(len(time)),
            },
        )
        for name, (p, q) in runs.items()
    }
    states = {n: State(n, "K", 1000.0, parse("0"), 0.0, 1e-3) for n in ("x", "z")}
    model = Model(
        "sums", {"k": Parameter(2.0, fixed=True)}, states, terms, {n: parse(e) for n, e in outputs.items()}
    )
    noise = Noise(tuple(outputs), tuple(CHANNELS[n].noise or 1.0 for n in outputs))
    fit = fit_model(model, Campaign("c", CHANNELS, recordings), list(runs), list(outputs), noise=noise)
    return term_shares(fit)


LOSS, FRICTION = Term("loss", "x", parse("3*P")), Term("friction", "z", parse("Q"))


def test_shares_are_those_of_the_heat_whichever_recording_it_comes_in() -> None:
    joint = Term(
        "joint", "z", parse("k*(x - z)"), "x"
    )  # what one body loses the other gains: E does not see it
    for runs in ({"a": (1.0, 1.0)}, {"a": (1.0, 0.0), "b": (0.0, 1.0)}):
        found = shares((LOSS, FRICTION, joint), {"E": "x + z"}, runs)
        assert found == pytest.approx({"loss": 0.75, "friction": 0.25, "joint": 0.0}, abs=1e-9)


def test_shares_are_weighed_by_the_noise_of_what_shows_them() -> None:
    same = Term("friction", "z", parse("3*Q"))
    found = shares((LOSS, same), {"E": "x", "F": "z"}, {"a": (1.0, 1.0)})
    assert found == pytest.approx({"loss": 10 / 11, "friction": 1 / 11})


def test_terms_of_one_name_share_one_figure() -> None:
    other = Term("loss", "z", parse("Q"))
    assert shares((LOSS, other), {"E": "x + z"}, {"a": (1.0, 1.0)}) == pytest.approx({"loss": 1.0})


def test_where_nothing_acts_nothing_has_a_share() -> None:
    found = shares((LOSS, FRICTION), {"E": "x + z"}, {"a": (0.0, 0.0)})
    assert found == {"loss": 0.0, "friction": 0.0}
