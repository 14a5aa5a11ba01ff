"""A clock that runs fast makes all responses of its recording slow; a poor model makes those of all odd."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from discovery.recordings.campaign import Channel
from discovery.recordings.compare import pace as of_clocks
from discovery.recordings.compare.agreement import disagreements
from discovery.recordings.compare.crossprediction import CrossPrediction
from discovery.recordings.compare.seen import Seen

CHANNELS = {
    "heater": Channel("heater", "heat load", "W", None, "held"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}


def heated(name: str, seed: int, pace: float = 1.0) -> Seen:
    """Steps of a heater, and a body that follows them within ten minutes."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0.0, 14380.0, 720)
    watts = np.repeat(rng.choice([0.0, 10.0, 25.0, 40.0], 36), 20)
    warm = np.zeros(time.size)
    for k in range(1, time.size):
        warm[k] = warm[k - 1] + (watts[k - 1] - warm[k - 1]) * (1.0 - np.exp(-20.0 / 600.0))
    read = 22.0 + warm + rng.normal(0.0, 0.05, time.size)
    values = {"heater": watts, "T": np.asarray(read)}
    return Seen(name, Path(f"{name}.csv"), pace * time, values, np.arange(time.size))


@pytest.mark.parametrize(("pace", "said"), [(1.0, None), (1.2, "% fast"), (0.7, "% slow")])
def test_a_clock_that_runs_at_another_pace(pace: float, said: str | None) -> None:
    found = disagreements([*(heated(f"run{k}", k) for k in range(4)), heated("odd", 9, pace)], CHANNELS)
    if said is None:
        assert found == []
    else:
        [one] = found
        assert (one.recording, one.repair.kind) == ("odd", "pace")
        assert said in one.repair.what


@pytest.mark.parametrize(("silent", "count"), [(("run3",), 1), (("run1", "run2", "run3"), 0)])
def test_a_recording_that_nothing_predicts_is_no_judge(
    silent: tuple[str, ...], count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One that says nothing hides no clock; one judge alone convicts none."""
    gained = of_clocks._gained

    def nothing(
        known: CrossPrediction, name: str, factor: float, without: Sequence[str] = ()
    ) -> tuple[float, float, float, float]:
        return (0.0, 0.0, 0.0, 0.0) if name in silent else gained(known, name, factor, without)

    monkeypatch.setattr(of_clocks, "_gained", nothing)
    found = disagreements([*(heated(f"run{k}", k) for k in range(4)), heated("odd", 9, 1.2)], CHANNELS)
    assert [one.repair.kind for one in found] == ["pace"] * count
