"""The figures of a proof, by closed forms: models that say a constant, bodies that only add up their heat."""

from __future__ import annotations

from dataclasses import replace
from math import exp, inf, sqrt

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import binom

from discovery.diagnosis.proof import Improvement, compare, explained, improvements, noise_floor, unit_of
from discovery.dynamics import Trajectory, make_grid, make_system, simulate
from discovery.fitting import Noise
from discovery.models import Model, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import parse

Array = NDArray[np.float64]
TIME = np.arange(0.0, 240 * 600.0, 600.0)
CHANNELS = {name: Channel(name, "error", "um", sd, "linear") for name, sd in (("E", 1.0), ("F", 3.0))}
WHITE = Noise(("E", "F"), (1.0, 3.0))


def says(readings: dict[str, Array], **formulas: str) -> Trajectory:
    """A free run of a body of 1000 J/K without any loss, and what the outputs make of it."""
    model = Model(
        "m",
        {},
        {"x": State("x", "degC", 1000.0, parse("0"), 0.0, 1e-3)},
        (),
        {n: parse(f) for n, f in formulas.items()},
    )
    grid = make_grid(Campaign("c", CHANNELS, {"r": Recording("r", TIME, readings)}), "r", [], list(formulas))
    return simulate(make_system(model, grid), {})


def test_each_output_counts_in_units_of_its_noise() -> None:
    """Two noises off before the repair and one after it, in every reading: each draw is the same."""
    readings = {"E": np.full(240, 3.0), "F": np.where(np.arange(240) % 3 == 0, 9.0, np.nan)}
    unit = sqrt((1.0**2 + 3.0**2) / 2)
    found = compare(says(readings, E="x + 1", F="x + 3"), says(readings, E="x + 2", F="x + 6"), WHITE, unit)
    assert (found.before, found.after, found.floor) == pytest.approx((2 * unit, unit, unit))
    assert (found.low, found.high) == pytest.approx((unit, unit))


@pytest.mark.parametrize(("unit", "said"), [("um", "um"), ("degC", "times the reading noise")])
def test_outputs_of_several_units_are_told_in_multiples_of_their_noise(unit: str, said: str) -> None:
    """A mean of um and K is neither; the mean noise of outputs of one unit is a size in it."""
    channels = {**CHANNELS, "F": replace(CHANNELS["F"], unit=unit)}
    mixed = Campaign("c", channels, {"r": Recording("r", TIME, {"E": np.full(240, 2.0), "F": np.zeros(240)})})
    formulas = {"E": parse("x"), "F": parse("x")}
    model = Model("m", {}, {"x": State("x", "degC", 1000.0, parse("0"), 0.0, 1e-3)}, (), formulas)
    found = improvements(mixed, ["r"], ["E", "F"], model, model, WHITE)["r"]
    one = sqrt((1.0**2 + 3.0**2) / 2) if unit == "um" else 1.0
    assert unit_of(mixed, ["E", "F"]) == said
    assert (found.before, found.floor) == pytest.approx((sqrt(2.0) * one, one))


def test_the_bounds_are_those_of_a_draw_of_24_blocks() -> None:
    """Better in half of the blocks, worse in the others: how many of each are drawn is binomial."""
    readings = {"E": np.repeat([1.0, -1.0], 120)}
    found = compare(says(readings, E="x"), says(readings, E="x + 0.5"), Noise(("E",), (1.0,)), 1.0)
    better = binom.ppf([0.025, 0.975], 24, 0.5) / 24
    low, high = 1 - np.sqrt(0.25 * better + 2.25 * (1 - better))
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.05)
    assert not found.contradicts


def test_slow_noise_adds_to_the_floor() -> None:
    run = says({"E": np.zeros(240)}, E="x")
    assert noise_floor(run, Noise(("E",), (3.0,), (4.0,))) == pytest.approx(5.0 / 3.0)


def test_everyday_heat_adds_to_the_floor_what_a_body_makes_of_it() -> None:
    """The variance of the integral of first-order noise; heat at a body that is not there adds nothing."""
    sd, tau = 0.05, 3 * 3600.0
    run = says({"E": np.zeros(240)}, E="x")
    found = noise_floor(run, Noise(("E",), (1.0,), (), {"x": sd, "gone": 9.0}, heat_time=tau))
    walk = [2 * (sd / 1000.0) ** 2 * tau * (t - tau * (1 - exp(-t / tau))) for t in TIME]
    assert np.mean(walk) > 1.0
    assert found == pytest.approx(sqrt(1.0 + np.mean(walk)), rel=0.01)


def improved(before: float, after: float, floor: float = 1.0) -> Improvement:
    return Improvement(before, after, floor, 0.0, 0.0)


def test_what_is_explained_is_a_share_of_what_can_be() -> None:
    two = improved(3.0, 2.0)  # 5 of 8
    assert explained({"a": two}) == pytest.approx(5 / 8)
    assert explained({"a": two, "b": improved(5.0, 5.0)}) == pytest.approx(5 / 32)
    assert explained({"a": improved(3.0, 0.5)}) == 1.0  # nothing goes below the noise
    assert explained({"a": improved(3.0, inf)}) == -1.0


def test_where_only_noise_is_nothing_can_be_explained() -> None:
    noisy = improved(1.02, 0.5)
    assert explained({}) is None
    assert explained({"a": noisy}) is None
    assert explained({"a": noisy, "b": improved(3.0, 2.0)}) == pytest.approx(5 / 8)
