"""Readings that say the same thing once: intervals and priors of a fit whose residuals are correlated."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from discovery.fitting import Prior, fit_model
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

Array = NDArray[np.float64]

STEP, LOSS, GAIN, CAPACITY = 60.0, 5.0, 0.8, 6000.0
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "T_env": Channel("T_env", "ambient temperature", "degC", None, "linear"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}
PLATE = Model(
    "plate",
    {"G": Parameter(LOSS, "W/K"), "k": Parameter(GAIN, "1")},
    {"plate": State("plate", "degC", CAPACITY, scale=1 / CAPACITY)},
    (Term("drive", "plate", parse("k*P")), Term("loss", "plate", parse("G*(T_env - plate)"))),
    {"T": parse("plate")},
)


def slow(rng: np.random.Generator, count: int, lasts: float) -> Array:
    """First-order noise of unit spread that lasts so many readings."""
    keep = np.exp(-1 / lasts)
    out: Array = lfilter([np.sqrt(1 - keep**2)], [1, -keep], rng.normal(size=count + 500))[500:]
    return out


def warmed(seed: int) -> Campaign:
    """A plate under 15 h of switched load, and 4 W of heat that nobody records and that lasts 20 min."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 15 * 3600.0, STEP)
    load = np.repeat(rng.choice([0.0, 60.0, 100.0], len(time) // 60 + 1), 60)[: len(time)]
    heat = GAIN * load + 4.0 * slow(rng, len(time), 20.0)
    keep = np.exp(-STEP * LOSS / CAPACITY)  # heat that is held over a step, exactly
    plate = 20.0 + lfilter([0.0, (1 - keep) / LOSS], [1.0, -keep], heat)
    values = {"P": load, "T_env": np.full(len(time), 20.0), "T": plate + rng.normal(0.0, 0.02, len(time))}
    return Campaign("plate", CHANNELS, {"a": Recording("a", time, values)})


def test_intervals_hold_the_truth_where_residuals_are_correlated() -> None:
    """Each reading for itself, 95 % intervals held a quarter of the values."""
    inside = []
    for seed in range(40):
        found = fit_model(PLATE, warmed(seed), ["a"], ["T"]).model.parameters
        for name, true in (("G", LOSS), ("k", GAIN)):
            low, high = found[name].low, found[name].high
            assert low is not None
            assert high is not None
            inside.append(low <= true <= high)
    assert np.mean(inside) > 0.85


def test_correlated_readings_do_not_outvote_what_is_known_of_a_law() -> None:
    """A constant that is known to be 0 within 0.1: 1000 readings that are off by one for some 200 in a row
    say of it what five would say.
    """
    rng = np.random.default_rng(3)
    time = np.arange(1000.0)
    read = 1.0 + slow(rng, len(time), 100.0)
    channels = {"T": Channel("T", "temperature", "degC", None, "linear")}
    still = Campaign("still", channels, {"a": Recording("a", time, {"T": read})})
    none = State("hidden", "degC", start=parse("0"))
    model = Model("still", {"x": Parameter(0.0, "degC")}, {"hidden": none}, (), {"T": parse("hidden + x")})
    fit = fit_model(model, still, ["a"], ["T"], priors={"x": Prior(0.0, 0.1)})
    spread = np.std(read)
    expected = np.mean(read) / (1 + spread**2 / 5 / 0.1**2)
    assert abs(fit.model.parameters["x"].value) < 3 * abs(expected) < 0.5
