"""The sun on several bodies, on most of them, or on one."""

from __future__ import annotations

import numpy as np
import pytest

from discovery.diagnosis import diagnose
from discovery.diagnosis.document import document
from discovery.diagnosis.refit import refit, score
from discovery.diagnosis.scored import MOVED, scored
from discovery.diagnosis.selection import Search
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.diagnosis.parts import context_of

CAPACITY, EXCHANGE, AREA, STEP = 500.0, 2.0, 0.08, 20.0  # J/K, W/K, m**2, s
BODIES = ("first", "second", "third", "fourth")


def recording(name: str, seed: int, lit: int) -> Recording:
    """Bodies in air of 20 degC, of which the first `lit` are in a sun between clouds."""
    rng = np.random.default_rng(seed)
    sun = np.repeat(rng.uniform(0.0, 900.0, 20), 12)
    fade, warm = np.exp(-EXCHANGE * STEP / CAPACITY), np.zeros(len(sun))
    for k in range(1, len(sun)):
        warm[k] = fade * warm[k - 1] + (1 - fade) * AREA * sun[k - 1] / EXCHANGE
    read = {b: 20.0 + (j < lit) * warm + rng.normal(0.0, 0.1, len(sun)) for j, b in enumerate(BODIES)}
    time = STEP * np.arange(float(len(sun)))
    return Recording(name, time, {"sun": sun, "air": np.full(len(sun), 20.0), **read})


def in_the_dark(lit: int) -> tuple[Model, Campaign]:
    """Bodies without a sun, and what they show in it."""
    channels = {
        "sun": Channel("sun", "other input", "W/m**2", None, "held"),
        "air": Channel("air", "ambient temperature", "degC", None, "linear"),
        **{b: Channel(b, "temperature", "degC", None, "linear") for b in BODIES},
    }
    dark = Model(
        "in the dark",
        {"hA": Parameter(EXCHANGE, "W/K", 0.0)},
        {b: State(b, "degC", CAPACITY, parse("air"), scale=1.0 / CAPACITY) for b in BODIES},
        tuple(Term(f"air {b}", b, parse(f"hA*(air - {b})")) for b in BODIES),
        {},
    )
    return dark, Campaign("rows", channels, {name: recording(name, k, lit) for k, name in enumerate("ab", 1)})


@pytest.mark.parametrize("lit", [4, 3, 1])
def test_an_input_heats_several_bodies_alike_most_of_them_or_one(lit: int) -> None:
    """Of four rows of collectors one was heated, and the others by exchanges that follow the sun; if one was
    in the shade, all were heated, and an exchange that follows the sun cooled that one.
    """
    answer = document(diagnose(*in_the_dark(lit), ["a", "b"]))
    assert [(p.effect, tuple(p.states)) for p in answer.physics] == [("input_heat", BODIES[:lit])]


def test_a_model_is_as_likely_as_its_refits_show_and_not_as_a_step_promises() -> None:
    """The best exchange of bodies that lack the sun is at its bound, and their process noise is large: a
    linear look beyond the bound promised 68000 units of log evidence, and refits found none of them.
    """
    dark, rows = in_the_dark(3)
    context = context_of(rows, dark, outputs=BODIES)
    one = score(context, (), context.usual)
    assert one is not None
    again = scored(context, (), refit(context, (), one.noise, one.fit))
    assert one.evidence < again.evidence - again.ahead + MOVED


def test_three_claims_of_one_law_become_one_claim_of_one_size() -> None:
    """One body after the other was found to be heated; that all are, alike, was never tried."""
    dark, rows = in_the_dark(3)
    context = context_of(rows, dark, ["input_heat"], outputs=BODIES)
    search = Search(context).begun()
    each = [h for h in context.candidates if h.places in [(b,) for b in BODIES[:3]]]
    three = score(context, each, context.usual)
    assert three is not None
    together = search._joined(search.keep(three))
    assert [h.states for h in together.hypotheses] == [BODIES[:3]]
    assert together.evidence > three.evidence + 10.0
