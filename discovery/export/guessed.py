"""Starts that an export guesses, since a controller reads nothing, at their readings where there are some."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discovery.models import Model
from discovery.models.model import shown_states
from discovery.recordings import Campaign

START_SD = 2.0  # um or K: of a start value that was a reading and is a guess now


def at_readings(model: Model, campaign: Campaign, recordings: Sequence[str]) -> Model:
    """An exported model on recordings, with the start of each state at its first reading, as in its fit,
    where it is known no better than an export guesses it, and every recording reads the state.

    A guess is off in all recordings alike if the machine never begins at the temperature of its room. Taken
    as knowledge, it looks like an offset of the sensor that the guess follows.
    """
    states = dict(model.states)
    for name, output in shown_states(model, model.outputs).items():
        spread = states[name].start_sd or 0.0
        if spread >= START_SD and all(_read(campaign, r, output) for r in recordings):
            states[name] = replace(states[name], start=None, start_sd=None)
    return replace(model, states=states)


def _read(campaign: Campaign, recording: str, output: str) -> bool:
    values = campaign.recordings[recording].values
    return output in values and bool(np.isfinite(values[output]).any())
