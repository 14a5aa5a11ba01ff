"""Learning in the running loop: action limit, measurements on demand, a signed revision, its shadow run."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.month import Plan, live, rms, world
from discovery.export.document import Exported, read_document
from discovery.export.seal import private_key, public_key, require_trusted
from discovery.runtime.learning import Learner


@pytest.mark.parametrize(("lost", "follows"), [(0.15, True), (0.0, False)], ids=["worn", "unchanged"])
def test_wear_is_followed_in_the_loop_and_an_unchanged_machine_is_left_alone(
    exported: Exported, tmp_path: Path, lost: float, follows: bool
) -> None:
    key = private_key(tmp_path / "key.pem")
    plan = Plan([], [], 60.0)
    happening = world(plan, 4300, faults=False, ageing=False, lost=lost)
    found = live(
        exported, happening, plan, tmp_path, faults=False, learn=lambda: Learner(key), save_every_s=3600.0
    )
    active = read_document(tmp_path / "memory" / "active.json")
    last = rms(found.left[-1440:])
    if not follows:
        assert active.revision == 1
        assert found.counted["action limit"] == 0
        return
    assert found.counted["action limit"] >= 1
    assert found.counted["shadow run"] >= 1
    assert found.counted["the new model takes over"] >= 1
    assert active.revision >= 2
    assert active.trend is not None  # what is lost was lost at once, so nothing goes on by much
    sizes = {n: abs(active.model.parameters[n].value) for n in active.trend.per_day}
    assert all(abs(rate) <= 0.01 * sizes[n] + 1e-9 for n, rate in active.trend.per_day.items())
    require_trusted(active.seal, public_key(tmp_path / "key.pem.pub"), "active")
    alone = tmp_path / "alone"
    alone.mkdir()
    left_alone = live(exported, happening, plan, alone, faults=False, save_every_s=3600.0)
    assert last < 0.6 * rms(left_alone.left[-1440:])
