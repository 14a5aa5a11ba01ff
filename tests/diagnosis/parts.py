"""Parts of a diagnosis of the machine of `tests/machine.py`."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any

from discovery.diagnosis import Diagnosis
from discovery.diagnosis.context import Context, make_context
from discovery.diagnosis.refit import score
from discovery.diagnosis.scored import Scored
from discovery.effects.catalogue import catalogue
from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model
from discovery.recordings import Campaign
from tests.machine import SEEN, campaign, model, simulated


def context_of(
    seen: Campaign, baseline: Model, words: Sequence[str] = (), outputs: Sequence[str] = tuple(SEEN)
) -> Context:
    """The context of all recordings of a campaign, in their order, with some effects of the catalogue."""
    runs = tuple(seen.recordings)
    after = {run: runs[k:] for k, run in enumerate(runs)}
    return make_context(seen, baseline, runs, outputs, [catalogue()[word] for word in words], after)


def claim_of(context: Context, word: str, place: str, recording: str | None = None) -> Hypothesis:
    """A claim of a context at a place."""
    return next(
        h for h in context.candidates if (h.effect.word, h.places, h.recording) == (word, (place,), recording)
    )


def scored_of(context: Context, *chosen: Hypothesis) -> Scored:
    """The score of a model with some effects, under more noise than usual."""
    found = score(context, chosen, context.settings.at((0, 0, 2, 3, 0, 0, 0)).noise)
    assert found is not None
    return found


@cache
def dry() -> Context:
    """Two recordings of the machine, and a model that leaves the fluid out."""
    words = ("fluid_convection", "friction_speed", "unmeasured_heat", "wear", "sensor_lag")
    return context_of(campaign(simulated(1), simulated(2)), model(wet=False), words)


@cache
def bare() -> Scored:
    """The model of `dry` without any effect."""
    return scored_of(dry())


@cache
def wetted() -> Scored:
    """The model of `dry` with the effect that it lacks."""
    return scored_of(dry(), claim_of(dry(), "fluid_convection", "table"))


def document(answer: Diagnosis) -> dict[str, Any]:
    """A diagnosis as its file holds it."""
    return answer.document().model_dump()
