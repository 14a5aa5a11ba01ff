"""Models without capacities, as `discovery new` writes them: states are the readings, terms are rates."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from discovery.diagnosis import diagnose, thresholds
from discovery.evidence.process_noise import flow_sizes
from discovery.models import Model, Parameter, State
from discovery.recordings import Campaign, Channel, Recording
from discovery.terms import Term, parse
from tests import machine
from tests.diagnosis.parts import context_of, document

EVERY = 300.0  # s
INTO_MOTOR, INTO_COLUMN = 6e-4, 1.2e-4  # 1/s: the column has five times the capacity of the motor


def recording(seed: int) -> Recording:
    """Motor and column, heat from one to the other, read with 0.05 K of noise."""
    rng = np.random.default_rng(seed)
    time = np.arange(0.0, 40 * 3600.0, EVERY)
    power = np.repeat(rng.choice([0.0, 200.0, 500.0, 900.0], len(time) // 12 + 1), 12)[: len(time)]

    def rates(t: float, x: np.ndarray) -> list[float]:
        heat = power[min(int(t // EVERY), len(time) - 1)]
        return [
            4e-6 * heat - 2e-4 * (x[0] - 20) + INTO_MOTOR * (x[1] - x[0]),
            -1e-4 * (x[1] - 20) + INTO_COLUMN * (x[0] - x[1]),
        ]

    x = solve_ivp(rates, (0.0, time[-1]), [20.0, 20.0], t_eval=time, max_step=EVERY / 2, rtol=1e-8).y
    read = {name: row + 0.05 * rng.standard_normal(len(time)) for name, row in zip("mc", x, strict=True)}
    return Recording(
        f"r{seed}", time, {"T_motor": read["m"], "T_column": read["c"], "T_room": 0 * time + 20, "P": power}
    )


def test_a_path_between_two_readings_has_a_rate_for_each() -> None:
    channels = {
        "T_motor": Channel("T_motor", "temperature", "degC", 0.05, "linear"),
        "T_column": Channel("T_column", "temperature", "degC", 0.05, "linear"),
        "T_room": Channel("T_room", "ambient temperature", "degC", None, "linear"),
        "P": Channel("P", "heat load", "W", None, "held"),
    }
    apart = Model(
        "two readings",
        states={"T_motor": State("T_motor"), "T_column": State("T_column")},
        parameters={
            "gain": Parameter(3e-6, "K/s/W", 0.0),
            "k_m": Parameter(3e-4, "1/s", 0.0),
            "k_c": Parameter(2e-4, "1/s", 0.0),
        },
        terms=(
            Term("drive", "T_motor", parse("gain*P")),
            Term("motor to air", "T_motor", parse("k_m*(T_room - T_motor)")),
            Term("column to air", "T_column", parse("k_c*(T_room - T_column)")),
        ),
        outputs={},
    )
    runs = Campaign("two readings", channels, {f"r{k}": recording(k) for k in (1, 2, 3)})
    answer = diagnose(apart, runs, ["r1", "r2"], ["r3"])
    (named,) = answer.verdict.named
    assert (named.hypothesis.effect.word, set(named.hypothesis.states)) == (
        "conduction_path",
        {"T_motor", "T_column"},
    )
    assert answer.after is not None
    into = {t.into: answer.after.model.parameters[n] for t, n in _ways(answer.repaired)}
    assert into["T_motor"].value == pytest.approx(INTO_MOTOR, rel=0.1)
    assert into["T_column"].value == pytest.approx(INTO_COLUMN, rel=0.1)
    (told,) = document(answer)["physics"]
    assert len(told["parameters"]) == len(told["expressions"]) == 2
    assert document(answer)["location"]["heat_units"] == {"T_motor": "K/s", "T_column": "K/s"}
    assert answer.held_out["r3"].after < 1.1 * answer.held_out["r3"].floor


def _ways(model: Model | None) -> list[tuple[Term, str]]:
    """The terms of the path, each with the name of its size."""
    assert model is not None
    paths = [t for t in model.terms if t.effect == "conduction_path"]
    return [(t, next(n for n in model.parameters if n.startswith(f"G_path_into_{t.into}"))) for t in paths]


def test_process_noise_of_rates_has_nothing_to_do_with_the_heat_of_the_bodies_beside_them() -> None:
    """A foundation that follows the room within hours moves by 1e-4 K/s at most; heat flows are of 300 W."""
    plain = machine.model()
    followed = replace(
        plain,
        parameters={**plain.parameters, "tau": Parameter(2e4, "s", 5e3)},
        states={**plain.states, "foundation": State("foundation", "degC", None, parse("T_env"), 0.5)},
        terms=(
            *plain.terms,
            Term("foundation follows the room", "foundation", parse("(T_env - foundation)/tau")),
            Term("bed to foundation", "bed", parse("4*(foundation - bed)")),
        ),
    )
    runs = machine.campaign(machine.simulated(1))
    context = context_of(runs, followed)
    found, sizes = context.baseline.model.values(), flow_sizes(context.baseline.trajectories)
    air = thresholds.AIR / found["tau"]  # K/s, where the air is so much warmer
    assert context.floor["foundation"] == pytest.approx(np.hypot(thresholds.FLOOR * sizes["foundation"], air))
    assert sizes["foundation"] < 1.5 / 13751.0  # K/s, of the room: a follower is slower
    heat = max(size for name, size in sizes.items() if name != "foundation")
    air = thresholds.AIR * found["hA_b"]  # W
    usual = np.sqrt(heat * sizes["bed"])  # of the busiest body and its own
    assert context.floor["bed"] == pytest.approx(np.hypot(thresholds.FLOOR * usual, air))
    assert heat > 100.0
