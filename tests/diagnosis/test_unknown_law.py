"""A law of recorded inputs that a coarse model lacks: a coil whose heat goes with the square of a current."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from discovery.diagnosis import thresholds
from discovery.diagnosis.refit import score
from discovery.diagnosis.unknown_law import _laws, instead
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests.diagnosis.parts import context_of

HEAT, LOSS, CAPACITY = 4.0, 8.0, 4000.0  # W/A^2, W/K, J/K
EVERY = 30.0  # s
CHANNELS = {
    "current": Channel("current", "other input", "A", None, "held"),
    "T_air": Channel("T_air", "ambient temperature", "degC", None, "linear"),
    "T_coil": Channel("T_coil", "temperature", "degC", None, "linear"),
}


def winding(seed: int) -> Recording:
    """A current that changes every 10 min, and a coil that begins at the temperature of the air."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 5 * 3600.0, EVERY)
    current = np.repeat(rng.uniform(0.0, 6.0, len(time) // 20), 20)
    warmer = lsim(([1.0 / LOSS], [CAPACITY / LOSS, 1.0]), HEAT * current**2, time)[1]
    read = 20.0 + warmer + rng.normal(0.0, 0.05, len(time))
    values = {"current": current, "T_air": np.full(len(time), 20.0), "T_coil": read}
    return Recording(f"r{seed}", time, values)


def coil(law: str, unit: str) -> Model:
    return Model(
        "coil",
        {
            "heat": Parameter(10.0, unit, min=0.0),
            "hA": Parameter(6.0, "W/K", min=0.0),
        },
        {"T_coil": State("T_coil", "degC", CAPACITY, scale=1 / CAPACITY)},
        (
            Term("loss", "T_coil", parse(law)),
            Term("air", "T_coil", parse("hA*(T_air - T_coil)")),
        ),
        {},
    )


@pytest.mark.parametrize(
    ("law", "unit", "said"),
    [
        ("heat*current", "W/A", "heat at T_coil that follows the square of current is a law to look for"),
        ("heat*current**2", "W/A**2", None),
    ],
)
def test_a_coarse_model_is_told_the_law_that_it_lacks(law: str, unit: str, said: str | None) -> None:
    seen = Campaign("coil", CHANNELS, {run.name: run for run in (winding(1), winding(2))})
    context = context_of(seen, coil(law, unit), outputs=("T_coil",))
    one = score(context, (), context.usual)
    assert one is not None
    assert (one.off > thresholds.SHARE) is (said is not None)
    found = instead(context, one)
    assert (found is None) if said is None else (found or "").startswith(said)


def test_the_square_of_a_switch_is_the_switch() -> None:
    run = winding(1)
    part = run.values["current"]
    switch = (part > 3.0).astype(float)
    for values, laws in ((part, 1), (switch, 0)):
        seen = Campaign("coil", CHANNELS, {"r1": replace(run, values={**run.values, "current": values})})
        context = context_of(seen, coil("heat*current", "W/A"), outputs=("T_coil",))
        assert len(list(_laws(context))) == laws
