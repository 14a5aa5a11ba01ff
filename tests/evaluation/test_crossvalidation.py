"""Cross-validation leaves out what it says, and looks at nothing else."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from discovery.evaluation.crossvalidation import LEAD, cross_validate, folds
from discovery.evaluation.paper import parts_of_the_paper
from discovery.models import Model
from discovery.models.reduced import reduced
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import parse

CHANNELS = {
    "u": Channel("u", "heat load", "W", None, "held"),
    "h": Channel("h", "nozzle height", "mm", None, "held"),
    "E": Channel("E", "error", "um", 0.1, "linear"),
}


def recording(name: str, seed: int, tau: float = 2.0, height: float = 50.0) -> Recording:
    """24 h, first order, a reading every 15 min with 0.1 um noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 24 * 3600.0 + 1, 900.0)
    u = rng.choice([0.0, 100.0, 300.0], len(time))
    x = [0.0]
    for k in range(len(time) - 1):
        steady = 0.1 * u[k]
        x.append(steady + (x[-1] - steady) * np.exp(-0.25 / tau))
    values = {"u": u, "h": np.full(len(time), height), "E": np.array(x) + rng.normal(0, 0.1, len(time))}
    return Recording(name, time, values)


def campaign(**taus: float) -> Campaign:
    recordings = {name: recording(name, seed, tau) for seed, (name, tau) in enumerate(taus.items())}
    return Campaign("c", CHANNELS, recordings)


@pytest.fixture
def model() -> Model:
    return reduced(["u"], ["E"], CHANNELS).with_values({"p1_E": -0.4, "p2_E": 0.04})


def test_a_right_model_leaves_the_noise(model: Model) -> None:
    c = campaign(a=2.0, b=2.0)
    found = cross_validate(model, c, ["a", "b"], ["E"])
    assert set(found) == {"recordings", "blocks"}
    for kind in found.values():
        assert kind["E"] == pytest.approx(0.1, rel=0.2)


def test_a_recording_that_is_different_shows_when_it_is_left_out(model: Model) -> None:
    found = cross_validate(model, campaign(a=2.0, b=2.0, c=6.0), ["a", "b", "c"], ["E"])
    assert found["recordings"]["E"] > 0.8


def test_what_the_blocks_leave_is_what_stands_in_them() -> None:
    """Nothing is left to fit: what is left of all readings is what the model leaves of them."""
    nothing = reduced(["u"], ["E"], CHANNELS).with_values({"p1_E": -0.4})
    still = replace(
        nothing,
        parameters={name: replace(p, fixed=True) for name, p in nothing.parameters.items()},
        states={
            name: replace(state, start=parse("0"), start_sd=0.0) for name, state in nothing.states.items()
        },
    )
    readings = np.linspace(0.0, 3.0, 97) ** 2  # most of it at the end
    c = campaign(a=2.0)
    data = replace(c.recordings["a"], values={**c.recordings["a"].values, "E": readings})
    found = cross_validate(still, replace(c, recordings={"a": data}), ["a"], ["E"])
    seen = c.recordings["a"].time >= LEAD / 3 * c.recordings["a"].time[-1]  # of three blocks
    assert found["blocks"]["E"] == pytest.approx(np.sqrt(np.mean(readings[seen] ** 2)))


def test_one_recording_is_left_out_in_blocks_alone(model: Model) -> None:
    assert set(cross_validate(model, campaign(a=2.0), ["a"], ["E"])) == {"blocks"}


def test_recordings_that_are_not_to_fit_are_not_looked_at(model: Model) -> None:
    c = campaign(a=2.0, b=2.0, other=2.0)
    before = cross_validate(model, c, ["a", "b"], ["E"])
    spoiled = replace(
        c.recordings["other"], values={name: v * np.nan for name, v in c.recordings["other"].values.items()}
    )
    after = cross_validate(
        model, replace(c, recordings={**c.recordings, "other": spoiled}), ["a", "b"], ["E"]
    )
    assert before == after


def test_every_recording_and_every_hour_is_left_out_once_save_the_beginning() -> None:
    c = campaign(**{f"r{k}": 2.0 for k in range(7)})
    found = folds(c, list(c.recordings))
    whole = [name for fold in found for name in fold.recordings]
    assert sorted(whole) == sorted(c.recordings)
    windows = [fold.windows["r0"] for fold in found if fold.windows]
    assert windows[0][0] == pytest.approx(LEAD * windows[0][1])
    assert windows[-1][1] == np.inf
    assert all(a[1] == b[0] for a, b in pairwise(windows))


def test_the_parts_of_the_paper_are_recognised() -> None:
    recordings = {
        name: recording(name, 1, height=100.0 if name == "high" else 50.0)
        for name in ("fit", "validation", "left_nozzle", "high")
    }
    parts = parts_of_the_paper(
        Campaign("c", CHANNELS, recordings), ["fit"], ["validation", "left_nozzle", "high"]
    )
    assert parts == {
        "test cycle": "fit",
        "2. test cycle": "validation",
        "left side": "left_nozzle",
        "100 mm": "high",
    }
