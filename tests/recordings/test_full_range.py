"""An input that is clipped comes to the end of its range again and again; one that is set, once."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.compare.levels import _full_range
from discovery.recordings.compare.seen import Seen

Array = NDArray[np.float64]
POWER = Channel("P", "heat load", "W", None, "held")


def blocks(seed: int, highest: float) -> Array:
    """Levels that a program sets, each for half an hour in steps of 60 s; one of them stays three hours."""
    levels = np.random.default_rng(seed).uniform(100.0, highest, 80).round()
    levels[7] = highest
    return np.asarray(np.repeat(levels, np.where(np.arange(80) == 7, 180, 30)), dtype=np.float64)


def seen(name: str, power: Array) -> Seen:
    time = np.arange(0.0, 60.0 * len(power), 60.0)
    return Seen(name, Path(f"{name}.csv"), time, {"P": power}, np.arange(len(power)))


@pytest.mark.parametrize(("clipped", "found"), [(False, 0), (True, 1)])
def test_a_level_that_stays_long_is_no_limit(clipped: bool, found: int) -> None:
    power = np.asarray(np.minimum(blocks(3, 800.0), 500.0)) if clipped else blocks(3, 500.0)
    others = [seen("monday", blocks(1, 800.0)), seen("tuesday", blocks(2, 800.0))]
    assert len(list(_full_range([*others, seen("friday", power)], POWER))) == found


def test_rest_before_anything_moves_is_no_limit() -> None:
    """An incubator stands still for 24 s before its heater is switched on."""
    oven = Channel("P", "temperature", "degC", None, "linear")
    warm = np.cumsum(np.random.default_rng(4).uniform(0.01, 0.2, 300))
    rest = seen("monday", np.concatenate([np.zeros(20), warm]) + 25.0)
    others = [seen("tuesday", warm + 20.0), seen("friday", warm + 21.0)]
    assert list(_full_range([rest, *others], oven)) == []


def test_the_smallest_value_of_an_input_may_be_that_at_idle() -> None:
    """A motor that draws 0.44 A as often as it idles, and less on other days."""
    rng = np.random.default_rng(5)
    current = Channel("P", "heat load", "A", None, "held")
    days = [seen(name, rng.uniform(0.1, 5.0, 400)) for name in ("monday", "tuesday")]
    idles = seen("friday", np.maximum(rng.uniform(-1.0, 5.0, 400), 0.44))
    [told] = _full_range([*days, idles], current)
    assert told.do.startswith("its value at idle, or else a full range")
    [other] = _full_range([*days, seen("friday", np.minimum(rng.uniform(0.1, 5.0, 400), 3.5))], current)
    assert other.do == "a full range or a limit: widen it"
