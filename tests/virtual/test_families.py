"""What every family promises, and what every effect does to every machine that can have it."""

import tomllib
from dataclasses import replace
from functools import reduce
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.models import read_model, write_model
from discovery.virtual.casefiles import case_files
from discovery.virtual.effects import EFFECTS, OUTSIDE, Effect, Shapes
from discovery.virtual.families import FAMILIES
from discovery.virtual.log import observe, reading_instants
from discovery.virtual.machine import Machine
from discovery.virtual.network import Form, Inputs
from discovery.virtual.nmv5000.plant import five_axis
from discovery.virtual.refit import refit
from discovery.virtual.simulate import Run, simulate
from discovery.virtual.world import draw_inputs, first_step, sigma_of

Array = NDArray[np.float64]
STEPS = 1500  # of a recording, enough to see an effect act


def machine_of(family: str, seed: int = 3) -> Machine:
    """A machine of a family whose recordings are short."""
    m = FAMILIES[family](np.random.default_rng(seed))
    hours = max(2.5, STEPS * m.pace.step_s / 3600.0)
    return replace(m, pace=replace(m.pace, hours=hours, before_h=0.2 * hours))


def inputs_of(m: Machine, seed: int = 5) -> Inputs:
    return draw_inputs(np.random.default_rng(seed), m, 1, 1.0)


def run(m: Machine, u: Inputs) -> Run:
    return simulate(m.network, u, m.pace.step_s, float(u["T_env"][0]))


@pytest.mark.parametrize("family", FAMILIES)
def test_a_baseline_is_a_model_file(family: str, tmp_path: Path) -> None:
    m = machine_of(family)
    write_model(tmp_path / "baseline.toml", m.baseline)
    read = read_model(tmp_path / "baseline.toml")
    assert list(read.states) == list(m.bodies)
    assert tuple(read.outputs) == m.outputs
    channels = {c.name for c in m.channels}
    assert set(read.inputs) <= channels
    assert {s.channel for s in m.spare} <= channels - set(read.inputs)  # recorded, and not used
    for body, bar in m.bodies.items():
        assert read.states[body].capacity == pytest.approx(bar.capacity, rel=1e-3)
        assert sum(m.network.nodes[node] for node in bar.nodes) == pytest.approx(bar.capacity)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_case_asks_for_all_readings_that_its_key_counts(family: str) -> None:
    """A fault of a thermometer, or an effect that shows in one, is in a case that reads it."""
    world: Any = SimpleNamespace(machine=machine_of(family), origins=None, noise=1.0)
    experiment = tomllib.loads(case_files("a case", world, {}, stated=True)["experiment.toml"].decode())
    assert tuple(experiment["outputs"]) == world.machine.outputs


@pytest.mark.parametrize("family", FAMILIES)
def test_unrecorded_heat_is_in_proportion_to_what_the_machine_makes(family: str) -> None:
    """About one percent of it, rms, at each body: small machines are not noisier than large ones."""
    m = machine_of(family)
    assert 0.005 <= m.pace.heat_w / m.heat <= 0.015


@pytest.mark.parametrize("family", FAMILIES)
def test_a_plant_is_finer_than_its_baseline_and_moves(family: str) -> None:
    m = machine_of(family)
    assert len(m.network.nodes) >= 2 * len(m.baseline.states)
    y = m.read(run(m, inputs_of(m)))[first_step(m) :]
    assert np.isfinite(y).all()
    assert (np.ptp(y, axis=0) > 3.0 * sigma_of(m, m.pace.noise[0])).sum() >= 2


@pytest.mark.parametrize("family", FAMILIES)
def test_twice_as_many_cells_change_little(family: str) -> None:
    u = inputs_of(machine_of(family))
    shown = []
    for refine in (1, 2):
        m = FAMILIES[family](np.random.default_rng(3), refine=refine)  # type: ignore[call-arg]
        m = replace(m, pace=machine_of(family).pace)
        shown.append(m.read(run(m, u)))
    change = np.abs(shown[1] - shown[0]).max(axis=0)
    assert (change < 0.1 * np.ptp(shown[0], axis=0) + 0.05).all(), change


@pytest.mark.parametrize("family", FAMILIES)
def test_the_same_seed_gives_the_same_machine(family: str) -> None:
    one, other, another = (FAMILIES[family](np.random.default_rng(s)) for s in (1, 1, 2))
    assert one.network.nodes == other.network.nodes
    assert one.nominal == other.nominal
    assert one.baseline.values() == other.baseline.values()
    assert one.network.nodes != another.network.nodes


def machines() -> dict[str, Machine]:
    return {family: machine_of(family) for family in FAMILIES}


CASES = [
    pytest.param(family, k, id=f"{family}-{word}")
    for family, m in machines().items()
    for k, (word, effect) in enumerate(
        [*EFFECTS.items(), *((f"outside{i}", e) for i, e in enumerate(OUTSIDE))]
    )
    if effect.places(m)
]


@pytest.mark.parametrize(("family", "number"), CASES)
def test_an_effect_acts_and_nothing_else_changes(family: str, number: int) -> None:
    effect: Effect = [*EFFECTS.values(), *OUTSIDE][number]
    m, u = machine_of(family), inputs_of(machine_of(family))
    if effect.word == "bed_memory":
        u = {**u, "T_env": u["T_env"] + 2.0 * (u["clock"] > 0)}  # a bed shows in a room that changes
    plain = m.read(run(m, u))
    for at in effect.places(m)[:2]:
        size = effect.reach(m, at)
        assert size > 0
        acting = effect.conceal(m, at, size, Shapes(np.random.default_rng(1)))
        again = effect.conceal(m, at, size, Shapes(np.random.default_rng(1)))
        y = acting.read(run(acting, u))
        assert np.isfinite(y).all()
        np.testing.assert_array_equal(y, again.read(run(again, u)))
        if effect.unit != "J" and effect.word not in (
            "unmeasured_heat",
            "draught",
        ):  # may melt or be on at another time
            assert np.abs(y - plain).max() > 1e-3, at
        weak = effect.conceal(m, at, 1e-6 * size, Shapes(np.random.default_rng(1)))
        if effect.word not in ("fluid_delay", "fluid_sump", "joint_hysteresis", "cooling_hysteresis"):
            assert np.abs(weak.read(run(weak, u)) - plain).max() < 0.02, at
        assert m.baseline is acting.baseline


@pytest.mark.parametrize("family", FAMILIES)
def test_the_key_knows_all_that_a_baseline_lacks(family: str) -> None:
    """With all laws as the baseline believes them, a refit leaves next to nothing."""
    m = FAMILIES[family](np.random.default_rng(3))
    m = replace(
        m,
        pace=replace(m.pace, hours=m.pace.hours / 3, before_h=2.0),
        channels=tuple(replace(c, sd=0.0) if c.series else c for c in m.channels),
    )
    believed = reduce(lambda machine, lack: machine.as_believed(lack), m.lacks, m)
    u = draw_inputs(np.random.default_rng(8), m, 0, 0.0)
    at = reading_instants(np.random.default_rng(0), m.pace, (m.pace.read_s[0], m.pace.read_s[0]))
    left = []
    for plant in (m, believed):
        log = observe(plant, run(plant, u), first_step(m), at, np.random.default_rng(0), None)
        left.append(refit(plant, {"a": log}, sigma_of(m, m.pace.noise[0])).rms)
    assert left[1] < 0.1 < left[0]  # of the least noise
    assert {s for lack in m.lacks for s in lack.states} <= set(m.bodies)
    assert {lack.effect for lack in m.lacks} <= set(EFFECTS)


def test_every_effect_has_a_machine() -> None:
    possible = {word for m in machines().values() for word, e in EFFECTS.items() if e.places(m)}
    assert possible == set(EFFECTS)


def test_a_refit_finds_the_numbers_of_a_lumped_machine() -> None:
    """With one cell a body and laws that the baseline has, nothing is left and the truth comes out."""
    m = machine_of("headstock")
    lumped = FAMILIES["headstock"](np.random.default_rng(3))
    bodies = {name: replace(bar, cells=1) for name, bar in lumped.bodies.items()}
    m = replace(m, **_one_cell_each(lumped, bodies), pace=replace(lumped.pace, hours=30.0, before_h=5.0))
    u = draw_inputs(np.random.default_rng(8), m, 0, 0.0)
    at = reading_instants(np.random.default_rng(0), m.pace, (600.0, 600.0))
    silent = replace(m, channels=tuple(replace(c, sd=0.0) if c.series else c for c in m.channels))
    log = observe(silent, run(m, u), first_step(m), at, np.random.default_rng(0), None)
    found = refit(m, {"a": log}, np.full(3, 0.5))
    assert found.rms < 0.06  # of the noise of a reading
    values = {name: x * m.nominal[name] for name, x in zip(found.model.free, found.theta, strict=False)}
    coolant = next(law.size for law in m.network.laws if law.name == "coolant")  # in series with the jacket
    series = 1.0 / (1.0 / m.nominal["cool_housing_rear"] + 1.0 / coolant)
    assert values["cool_housing_rear"] == pytest.approx(series, rel=0.03)
    assert values["loss_spindle"] == pytest.approx(0.35, rel=0.02)


def _one_cell_each(m: Machine, bodies: dict) -> dict:  # type: ignore[type-arg]
    """Fields of a machine whose cells are merged: their laws add up, conduction inside falls away."""
    home = {node: name for name, bar in m.bodies.items() for node in bar.nodes}

    def merged(law):  # type: ignore[no-untyped-def]
        ends = [home.get(x, x) for x in (law.into, law.source, law.leaves)]
        if ends[0] == ends[1]:
            return None
        linear = (
            {"form": Form.LINK, "size": law.size * 3.0**0.25, "shape": ()} if law.name[:3] == "air" else {}
        )
        return replace(law, into=ends[0], source=ends[1], leaves=ends[2], film=None, **linear)

    network = m.network.changed(merged)
    capacity = {name: bar.capacity for name, bar in bodies.items()}
    others = {n: C for n, C in m.network.nodes.items() if n not in home}
    levers = {
        o: {b: sum(v for n, v in nodes.items() if home[n] == b) for b in {home[n] for n in nodes}}
        for o, nodes in m.levers.items()
    }
    return {"network": replace(network, nodes=capacity | others), "bodies": bodies, "levers": levers}


def test_the_paper_s_machine_can_have_most_effects() -> None:
    m = five_axis()
    assert sum(bool(e.places(m)) for e in EFFECTS.values()) >= 24
