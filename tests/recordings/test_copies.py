"""A copy shares the noise of its readings; a program that is run again does not."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.leaks import copied_channels, near_copies
from discovery.recordings.compare.seen import Seen

Array = NDArray[np.float64]
TIME = np.linspace(0.0, 7980.0, 400)
CHANNELS = {
    "heater": Channel("heater", "heat load", "W", None, "held"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}


def heated() -> tuple[Array, Array]:
    """A heater that changes between any two readings, and the temperature of what it heats."""
    watts = np.random.default_rng(1).uniform(0.0, 40.0, TIME.size)
    response = np.zeros(TIME.size)
    for k in range(1, TIME.size):
        response[k] = response[k - 1] + (watts[k - 1] - response[k - 1]) * (1.0 - np.exp(-20.0 / 60.0))
    return watts, 22.0 + response


def seen(name: str, watts: Array, read: Array) -> Seen:
    return Seen(name, Path(f"{name}.csv"), TIME, {"heater": watts, "T": read}, np.arange(TIME.size))


def noisy(values: Array, size: float, seed: int) -> Array:
    return np.asarray(values + np.random.default_rng(seed).normal(0.0, size, values.size))


@pytest.mark.parametrize(("own", "copied"), [(0.2, False), (0.0, True)])
def test_a_program_that_is_run_again_is_no_copy(own: float, copied: bool) -> None:
    watts, warm = heated()
    first = noisy(warm, 0.2, 2)
    second = noisy(warm, own, 3) if own else noisy(first, 0.01, 4)
    pairs = list(near_copies([seen("a", watts, first), seen("b", watts, second)], CHANNELS))
    assert pairs == ([("a", "b", "T")] if copied else [])


@pytest.mark.parametrize(("apart", "copied"), [(True, False), (False, True)])
def test_bodies_that_move_alike_on_one_day_are_no_copies(apart: bool, copied: bool) -> None:
    """Two modules under one sun share each cloud. On another day snow lies on one of them."""
    watts, warm = heated()
    pair = {**CHANNELS, "U": CHANNELS["T"]}
    days = []
    for k, share in enumerate((1.0, 0.3 if apart else 1.0)):
        other = 22.0 + share * (warm - 22.0) + (1 - share) * noisy(np.zeros(TIME.size), 5.0, 10 + k)
        values = {"heater": watts, "T": warm, "U": noisy(other, 0.01, k)}
        days.append(Seen(f"day{k}", Path(f"day{k}.csv"), TIME, values, np.arange(TIME.size)))
    found = [f for f in copied_channels(days, pair) if "same readings" in f.what]
    assert len(found) == (2 if copied else 0)
