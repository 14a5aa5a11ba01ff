"""An input that the model does not use comes in by a path of its own; in the running loop, signed."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from benchmarks.month import DAY, TICK, Plan, live, rms, world
from discovery.export.document import Exported, from_document, read_document, render
from discovery.export.seal import open_seal, private_key, public_key, require_trusted
from discovery.recordings import Campaign, Channel
from discovery.runtime.hypotheses import compare
from discovery.runtime.learning import Learner
from discovery.runtime.unused import unused_inputs
from discovery.runtime.update import revision_of
from discovery.virtual.nmv5000.plant import five_axis
from tests.runtime.test_update import days

Array = NDArray[np.float64]
GAINS = {"E_Y0C": 0.3, "E_Z0T": -0.15}  # um per unit of the fan
LAG = 3000.0


def fan(time: Array, seed: int) -> tuple[Array, Array]:
    """A fan that switches every three hours, and what follows it with a lag; time in even steps."""
    speed = np.repeat(np.random.default_rng(seed).choice([0.0, 10.0, 25.0], len(time)), 180)[: len(time)]
    slow, keep = np.full(len(time), speed[0]), float(np.exp(-(time[1] - time[0]) / LAG))
    for k in range(1, len(time)):
        slow[k] = speed[k - 1] + (slow[k - 1] - speed[k - 1]) * keep
    return speed, slow


def with_fan(campaign: Campaign, gain: float) -> Campaign:
    """The recordings of a machine with a fan that moves two errors."""
    recordings = {}
    for seed, (name, recording) in enumerate(campaign.recordings.items()):
        speed, slow = fan(recording.time, seed)
        own = {n: recording.values[n] + gain * g * (slow - 12.0) for n, g in GAINS.items()}
        recordings[name] = replace(recording, values={**recording.values, **own, "fan": speed})
    channels = {**campaign.channels, "fan": Channel("fan", "other input", "1", None, "held")}
    return replace(campaign, recordings=recordings, channels=channels)


@pytest.fixture(scope="module")
def quiet(machine: Campaign) -> Campaign:
    return days(machine, 3, five_axis(), readings=24)


def test_what_the_model_does_not_use_is_offered(exported: Exported, quiet: Campaign) -> None:
    campaign = with_fan(quiet, 0.0)
    still = {n: replace(r, values={**r.values, "flow": 0 * r.time}) for n, r in campaign.recordings.items()}
    assert set(unused_inputs(exported, campaign, list(campaign.recordings))) == {"flow", "P_cool", "fan"}
    stands = replace(campaign, recordings=still)
    assert set(unused_inputs(exported, stands, list(still))) == {"P_cool", "fan"}


def test_an_input_that_acts_comes_in_with_its_gains(exported: Exported, quiet: Campaign) -> None:
    campaign = with_fan(quiet, 1.0)
    found = compare(exported, campaign, list(campaign.recordings), choose=True)
    assert (found.verdict, found.what) == ("unused input", "fan")
    assert found.path is not None
    path, values = found.path
    assert path.lag == 3600.0  # of the ladder, the nearest to 3000 s
    for output, gain in GAINS.items():
        assert values[f"fan_to_{output}"] == pytest.approx(gain, rel=0.15)
    assert abs(values["fan_to_E_R0T"]) < 0.03
    revised = revision_of(exported, campaign, found)
    assert revised is not None
    document, after = revised
    assert after < 0.5 * found.rms
    new = from_document(*open_seal(render(document), "new"), "new")
    assert "fan" in {i.name for i in new.inputs}
    assert new.changelog[-1]["of"] == exported.seal.sha256
    assert "fan is an input now, with a lag of 3600 s" in new.changelog[-1]["text"]
    again = compare(new, campaign, list(campaign.recordings), choose=True)
    assert again.verdict == "nothing"
    assert again.odds["no input fan"] < 0.0
    # the fan is taken off the machine, and its speed is still recorded
    quiet_again = with_fan(quiet, 0.0)
    idle = compare(new, quiet_again, list(quiet_again.recordings), choose=True)
    assert (idle.verdict, idle.what) == ("idle input", "fan")
    left = revision_of(new, quiet_again, idle)
    assert left is not None
    last = from_document(*open_seal(render(left[0]), "last"), "last")
    assert [i.name for i in last.inputs] == [i.name for i in exported.inputs]
    assert last.model.outputs == exported.model.outputs
    assert last.model.states.keys() == exported.model.states.keys()
    assert last.model.parameters.keys() == exported.model.parameters.keys()


def test_an_input_that_does_nothing_stays_out(exported: Exported, quiet: Campaign) -> None:
    campaign = with_fan(quiet, 0.0)
    found = compare(exported, campaign, list(campaign.recordings), choose=True)
    assert found.verdict == "nothing"
    assert found.odds["input fan"] < 0.0
    assert revision_of(exported, campaign, found) is None
    assert "input fan" not in compare(exported, campaign, list(campaign.recordings)).odds


def test_the_running_loop_takes_an_input_in(exported: Exported, tmp_path: Path) -> None:
    """Signed, and only after a shadow run with measured errors."""
    plan = Plan([], [], 72.0)
    happening = world(plan, 4300, faults=False, ageing=False)
    speed, slow = fan(happening.times, 3)
    moved = happening.errors.copy(), happening.probed.copy()
    for errors in moved:
        for k, output in enumerate(("E_Y0C", "E_Z0T")):
            errors[:, k] += GAINS[output] * (slow - slow[0])
    happening = replace(
        happening, inputs={**happening.inputs, "fan": speed}, errors=moved[0], probed=moved[1]
    )
    key = private_key(tmp_path / "key.pem")
    found = live(
        exported, happening, plan, tmp_path, faults=False, learn=lambda: Learner(key), save_every_s=3600.0
    )
    active = read_document(tmp_path / "memory" / "active.json")
    assert "fan" in {i.name for i in active.inputs}
    require_trusted(active.seal, public_key(tmp_path / "key.pem.pub"), "active")
    assert found.counted["shadow run"] >= 1
    assert found.counted["the new model takes over"] >= 1
    alone = tmp_path / "alone"
    alone.mkdir()
    left_alone = live(exported, happening, plan, alone, faults=False, save_every_s=3600.0)
    last = -round(DAY / TICK)
    assert rms(found.left[last:]) < 0.6 * rms(left_alone.left[last:])
