"""Jumps that can be recognised however wrong the flows of a model are."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from discovery.diagnosis import Diagnosis, diagnose
from discovery.diagnosis.abrupt import comes_with
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse

CHANNELS = {
    "P": Channel("P", "heat load", "W", None, "held"),
    "room": Channel("room", "ambient temperature", "degC", None, "linear"),
    "T": Channel("T", "temperature", "degC", None, "linear"),
}


def lamp(seed: int, jump: float = 0.0) -> Recording:
    """A lamp of 80 J/K over a plate that nobody reads, by small steps: heat follows the square of the drive,
    and what the plate stores comes back. Its thermometer jumps at 300 s.
    """
    rng, time = np.random.default_rng(seed), np.arange(0.0, 601.0, 4.0)
    power = np.repeat(rng.uniform(0.0, 40.0, 31), 5)[: time.size]
    warm, plate, read = 21.0, 21.0, []
    for watts in power:
        read.append(warm)
        for _ in range(8):
            flow = 0.25 * (warm - plate)
            warm += 0.5 * (0.03 * watts**2 - flow - 0.1 * (warm - 21.0)) / 80.0
            plate += 0.5 * (flow - 0.05 * (plate - 21.0)) / 400.0
    shown = np.array(read) + rng.normal(0.0, 0.1, time.size) + jump * (time >= 300.0)
    return Recording(f"r{seed}", time, {"P": power, "room": np.full(time.size, 21.0), "T": shown})


def found(*runs: Recording) -> Diagnosis:
    """The diagnosis of a model whose heat follows the drive itself, and that has no plate."""
    terms = (Term("power", "T", parse("k*P")), Term("air", "T", parse("hA*(room - T)")))
    states = {"T": State("T", "degC", 80.0, parse("room"), None, 1 / 80.0)}
    begun = {"hA": Parameter(0.2, "W/K", 0.0), "k": Parameter(1.0, "1", 0.0)}
    seen = Campaign("lamps", CHANNELS, {r.name: r for r in runs})
    return diagnose(Model("lamp", begun, states, terms, {}), seen, [r.name for r in runs], [], ["T"])


def test_a_jump_is_named_where_the_flows_of_the_model_are_wrong() -> None:
    answer = found(lamp(1), lamp(2, jump=12.0))
    jumps = [n for n in answer.verdict.named if not n.hypothesis.effect.is_physics]
    assert [(n.hypothesis.effect.word, n.hypothesis.recording, n.is_abrupt) for n in jumps] == [
        ("sensor_offset", "r2", True)
    ]
    assert answer.after is not None
    assert abs(answer.after.model.parameters["offset_T_r2"].value - 12.0) < 1.0
    assert abs(answer.after.model.parameters["t_step_T_r2"].value - 300.0) <= 4.0


@pytest.mark.parametrize(("later", "named"), [(8.0, False), (200.0, True)])
def test_two_sensors_that_jump_at_once_are_no_faults(later: float, named: bool) -> None:
    """A gas heater that was switched off: the water at its outlet and the wall of its exchanger jumped within
    2 s, and both thermometers were named as faults with 98 %.
    """
    times = {"t_T": 300.0, "t_plate": 300.0 + later}
    jumps = [
        SimpleNamespace(key=name, effect=SimpleNamespace(search="step", is_physics=False), recording="r1")
        for name in ("T", "plate")
    ]
    for h in jumps:
        h.shapes, h.shown = {f"t_{h.key}": times[f"t_{h.key}"]}, {h.key: None}
    grid = SimpleNamespace(recording="r1", time=np.array([0.0, 600.0]))
    run = SimpleNamespace(system=SimpleNamespace(grid=grid))
    parameters = {name: SimpleNamespace(value=value) for name, value in times.items()}
    answer = SimpleNamespace(
        model=SimpleNamespace(parameters=parameters),
        fit=SimpleNamespace(trajectories=(run,)),
        seen=SimpleNamespace(blocks=12),
        hypotheses=tuple(jumps),
    )
    assert [comes_with(cast(Any, answer), cast(Any, h), cast(Any, o)) for h in jumps for o in jumps] == [
        False,
        not named,
        not named,
        False,
    ]


def test_wrong_flows_alone_are_no_jump() -> None:
    answer = found(lamp(1), lamp(2))
    assert all(n.hypothesis.effect.is_physics for n in answer.verdict.named)
