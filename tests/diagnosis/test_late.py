"""What comes late or is off throughout: heat of an element with a mass, the clock and zero of a sensor.

An oven of two bodies, an element in front of them, written down as matrices: a closed form for power that is
held between instants.
"""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import expm

from discovery.diagnosis import Diagnosis, diagnose
from discovery.effects.catalogue import catalogue
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CHAMBER, SHELL = 600.0, 900.0  # J/K
LINK, LOSSES = 6.0, (3.0, 2.0)  # W/K
STEP, EVERY = 10.0, 20.0  # s
CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "T_in": Channel("T_in", "temperature", "degC", 0.05, "linear"),
    "T_out": Channel("T_out", "temperature", "degC", 0.05, "linear"),
}


def oven(seed: int, element: float = 0.0, late: float = 0.0, off: float = 0.0) -> Recording:
    """An hour and a half, the power of the element another one every 5 min.

    Args:
        element: time constant of the element [s]; without one, the chamber gets the power at once.
        late: by which the clock of T_out is slow [s].
        off: what T_out shows too much [K].
    """
    rng = np.random.default_rng(seed)
    power = np.repeat(np.r_[0.0, rng.uniform(0.0, 300.0, 17)], int(300.0 / STEP))
    rates = np.zeros((4, 4))  # of element [W], chamber, shell [K over the room]; then of the power
    rates[0, [0, 3]] = np.array([-1.0, 1.0]) / max(element, 1.0)
    rates[1, [0, 1, 2]] = np.array([1.0, -LINK - LOSSES[0], LINK]) / CHAMBER
    rates[2, [1, 2]] = np.array([LINK, -LINK - LOSSES[1]]) / SHELL
    step = expm(rates * STEP)
    states = [np.zeros(3)]
    for watts in power[:-1]:
        states.append(step[:3] @ np.r_[states[-1], watts])
    time = np.arange(0.0, STEP * power.size, STEP)
    true = 22.0 + np.array(states)
    shown = {"T_in": true[:, 1], "T_out": np.interp(time - late, time, true[:, 2]) + off}
    every = int(EVERY / STEP)

    def read(values: NDArray[np.float64]) -> NDArray[np.float64]:
        noisy = np.full(power.size, np.nan)
        noisy[::every] = values[::every] + rng.normal(0.0, 0.05, values[::every].size)
        return noisy

    values = {"P": power, "room": np.full(power.size, 22.0), **{n: read(v) for n, v in shown.items()}}
    return Recording(f"r{seed}", time, values)


def model() -> Model:
    """Two bodies, and the power goes into the first one at once; sizes a little off."""
    sizes = {"k": 1.1, "G": 0.8 * LINK, "hA_in": 1.2 * LOSSES[0], "hA_out": 0.9 * LOSSES[1]}
    terms = (
        Term("element", "T_in", parse("k*P")),
        Term("wall", "T_out", parse("G*(T_in - T_out)"), "T_in"),
        Term("loss inside", "T_in", parse("hA_in*(room - T_in)")),
        Term("loss outside", "T_out", parse("hA_out*(room - T_out)")),
    )
    parameters = {name: Parameter(size, "1" if name == "k" else "W/K", 0.0) for name, size in sizes.items()}
    capacities = {"T_in": CHAMBER, "T_out": SHELL}
    states = {name: State(name, "degC", c, parse("room"), None, 1 / c) for name, c in capacities.items()}
    return Model("oven", parameters, states, terms, {})


def answered(*runs: Recording) -> Diagnosis:
    """The diagnosis of the first two recordings, the third held out."""
    seen = Campaign("oven", CHANNELS, {r.name: r for r in runs})
    return diagnose(model(), seen, ["r1", "r2"], ["r3"])


def test_an_element_has_a_mass_of_its_own() -> None:
    """Not the sensor is late, nor is the chamber two bodies: the shell, too, gets its heat late."""
    answer = answered(*(oven(seed, element=90.0) for seed in (1, 2, 3)))
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.places) == ("heater_mass", ("T_in",))
    assert answer.after is not None
    assert answer.after.model.parameters["t_h_T_in"].value == pytest.approx(90.0, rel=0.05)
    assert answer.held_out["r3"].after < 1.2 * answer.held_out["r3"].floor < answer.held_out["r3"].before


def test_the_clock_of_one_logger_is_late() -> None:
    """Neither heat that nobody records, nor a lag that other recordings do not have."""
    answer = answered(oven(1), oven(2, late=60.0), oven(3))
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.places) == ("clock_shift", ("T_out",))
    assert named.hypothesis.recording == "r2"
    assert answer.after is not None
    assert answer.after.model.parameters["t_late_T_out_r2"].value == pytest.approx(60.0, rel=0.05)


def test_a_sensor_is_off_from_the_first_reading_on() -> None:
    """It was replaced before the recording, so nothing jumps in it."""
    answer = answered(oven(1), oven(2, off=1.5), oven(3))
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, named.hypothesis.places) == ("sensor_offset", ("T_out",))
    assert named.hypothesis.recording == "r2"
    assert answer.after is not None
    assert answer.after.model.parameters["bias_T_out_r2"].value == pytest.approx(1.5, abs=0.1)


def test_what_lacks_nothing_lacks_nothing_late() -> None:
    assert answered(*(oven(seed) for seed in (1, 2, 3))).verdict.word == "no mismatch"


def test_a_lag_is_asked_whether_the_heat_is_late() -> None:
    """Each stands for the other where one sensor alone shows them, so both are refitted."""
    lag, heat = catalogue()["sensor_lag"], catalogue()["heater_mass"]
    assert heat.word in lag.confused_with
    assert lag.word in heat.confused_with


def test_the_clock_of_the_only_output_is_that_of_the_recording() -> None:
    """Then the inputs are early, which has a name already."""
    from discovery.effects.places import spots

    effect = catalogue()["clock_shift_output"]
    assert [s.outputs for s in spots(effect, model(), ("T_in", "T_out"), CHANNELS)] == [("T_in",), ("T_out",)]
    assert not [*spots(effect, model(), ("T_in",), CHANNELS)]
