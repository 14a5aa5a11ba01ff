"""A machine that changes at once: the intervals of what is believed next hold the truth."""

from __future__ import annotations

import numpy as np

from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.runtime.belief import Belief, update_belief
from discovery.terms import Term, parse

CHANNELS = {
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "heater": Channel("heater", "heat load", "W", None, "held"),
    "T": Channel("T", "temperature", "degC", 0.05, "linear"),
}
LOSS, GAIN, KNOWN = 1e-3, 5e-4, 0.001  # 1/s, K/W/s, relative standard deviation of the first fit
NOISE = 0.05  # K


def plate() -> Model:
    return Model(
        "plate",
        {"loss": Parameter(LOSS, "1/s", 0.0), "gain": Parameter(GAIN, "K/W/s", 0.0)},
        {"T": State("T", start=None)},
        (Term("loss", "T", parse("loss*(T_env - T)")), Term("gain", "T", parse("gain*heater"))),
        {},
    )


def recorded(gain: float, seed: int) -> Campaign:
    """Six hours of a plate, exact between the steps of its heater."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 21601.0, 60.0)
    heat = np.repeat(rng.choice([0.0, 20.0, 50.0], 13), 30)[: len(time)]
    values = [20.0]
    for power in heat[:-1]:
        level = 20.0 + gain * power / LOSS
        values.append(level + (values[-1] - level) * np.exp(-LOSS * 60.0))
    seen = np.array(values) + rng.normal(0.0, NOISE, len(time))
    recording = Recording("new", time, {"T_env": np.full(len(time), 20.0), "heater": heat, "T": seen})
    return Campaign("plate", CHANNELS, {"new": recording})


def test_what_the_first_fit_knew_well_may_change() -> None:
    """The heater loses 5 % at once; the first fit knew it within 0.1 %."""
    first = np.array([KNOWN * LOSS, KNOWN * GAIN])
    belief = Belief(plate(), plate(), ("loss", "gain"), np.diag(first**2), first, 0.0)
    truth, held = {"loss": LOSS, "gain": 0.95 * GAIN}, {"loss": 0, "gain": 0}
    for seed in range(20):
        learnt, finding = update_belief(belief, {"T": NOISE}, recorded(truth["gain"], seed), "new")
        assert finding.verdict == "drift"
        for name, value in truth.items():
            p = learnt.model.parameters[name]
            assert p.low is not None
            assert p.high is not None
            held[name] += p.low <= value <= p.high
    assert min(held.values()) >= 17  # of 20 at 95 %: fewer happen once in 60
