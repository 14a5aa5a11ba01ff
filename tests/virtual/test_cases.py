"""Concealed cases: the same bytes twice, keys that say what was done, honest sizes."""

import gzip
import io
import json
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache, reduce
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from discovery.challenge.prepare import adopt, draw_orders
from discovery.cli import app
from discovery.errors import UsageError
from discovery.experiment import load_experiment
from discovery.models import read_model
from discovery.recordings import load_campaign
from discovery.virtual import faults
from discovery.virtual.cases import FAULTS, KINDS, Case, Plan, draw_plans, make_case
from discovery.virtual.effects import EFFECTS, Shapes
from discovery.virtual.families import FAMILIES
from discovery.virtual.families.headstock import headstock
from discovery.virtual.machine import Machine
from discovery.virtual.network import Form
from discovery.virtual.signals import Draw
from discovery.virtual.world import FIT, World, draw_world

HOURS = 24.0
PLANS = {
    "none": Plan("none"),
    "one": Plan("one", "second_thermal_mass"),
    "input": Plan("input", "input_heat"),
    "two": Plan("two"),
    "measuring": Plan("measuring", "sensor_offset"),
    "outside": Plan("outside", "2"),
}


def once(draw: Callable[..., World]) -> Callable[..., World]:
    """Cases of one seed have the same machine and inputs, which are drawn once."""
    drawn: dict[str, tuple[World, Mapping[str, Any]]] = {}

    def world(rng: np.random.Generator, family: Callable[..., Machine], *, coloured: bool) -> World:
        asked = repr((rng.bit_generator.state, family, coloured))
        if asked not in drawn:
            drawn[asked] = draw(rng, family, coloured=coloured), rng.bit_generator.state
        found, rng.bit_generator.state = drawn[asked]
        return found

    return world


DRAWN_ONCE = once(draw_world)


def short_headstock(rng: Draw) -> Machine:
    """A headstock that is recorded for one day, not for three."""
    machine = headstock(rng)
    return replace(machine, pace=replace(machine.pace, hours=HOURS, before_h=12.0))


def drawn(seed: int, plan: Plan) -> Case:
    with patch.dict(FAMILIES, headstock=short_headstock):
        return make_case("headstock", seed, plan)


@cache
def case_of(kind: str, seed: int = 7) -> Case:
    with patch("discovery.virtual.cases.draw_world", DRAWN_ONCE):
        return drawn(seed, PLANS[kind])


@pytest.fixture(scope="module")
def world() -> World:
    return draw_world(np.random.default_rng(12), short_headstock, coloured=False)


def table(case: Case, name: str) -> pd.DataFrame:
    return pd.read_csv(io.BytesIO(gzip.decompress(case.files[name])))


def test_the_same_bytes_twice() -> None:
    again = drawn(7, PLANS["none"])
    assert again.files == case_of("none").files
    assert again.key == case_of("none").key
    assert case_of("none", 1).files["a.csv.gz"] != again.files["a.csv.gz"]


@pytest.mark.parametrize("kind", PLANS)
def test_a_case_is_a_case_folder_with_a_key(kind: str, tmp_path: Path) -> None:
    case = case_of(kind)
    for name, content in case.files.items():
        (tmp_path / name).write_bytes(content)
    campaign, model = load_campaign(tmp_path / "campaign.toml"), read_model(tmp_path / "baseline.toml")
    experiment = tomllib.loads((tmp_path / "experiment.toml").read_text())
    assert sorted(case.files) == sorted(
        [*(f"{r}.csv.gz" for r in "abc"), "baseline.toml", "campaign.toml", "experiment.toml"]
    )
    assert load_experiment(tmp_path / "experiment.toml").fit == ("a", "b")  # every name may be that of a file
    assert (experiment["fit"], experiment["held_out"]) == (["a", "b"], ["c"])
    assert set(model.inputs) <= set(campaign.channels)
    for recording in campaign.recordings.values():
        assert recording.time[-1] == pytest.approx(HOURS * 3600.0, abs=1000.0)
        assert np.isfinite(recording.values["E_Z"]).sum() > 80
    everything = b"".join(v for k, v in case.files.items() if k.endswith("toml")).decode()
    for word in [e["effect"] for e in case.key.get("effects", [case.key]) if e["effect"]]:
        assert word not in everything
    _says_what_is_concealed(case, kind)


def _says_what_is_concealed(case: Case, kind: str) -> None:
    key = case.key
    assert key["kind"] == kind
    assert key["family"] == "headstock"
    assert len(key["noise"]) == 3
    assert 0.15 < key["lumping_over_noise"] <= 0.6
    assert json.loads(json.dumps(key)) == key
    bodies = set(FAMILIES["headstock"](np.random.default_rng(0)).bodies)
    says: dict[str, Callable[[], bool]] = {
        "none": lambda: key["effect"] is None,
        "one": lambda: key["effect"] == "second_thermal_mass" and {*key["states"]} < bodies,
        "input": lambda: key["input"] == "P_dresser",
        "two": lambda: len({e["effect"] for e in key["effects"]}) == 2,
        "measuring": lambda: key["recording"] in FIT,
        "outside": lambda: "unexplained" in key["accepts"],
    }
    assert says[kind]()


def test_what_is_below_the_noise_need_not_be_named(world: World) -> None:
    from discovery.virtual.cases import with_size

    key = {"effect": "bed_memory", "states": ["base"]}
    for size, accepted in ((0.2, True), (60.0, False)):
        machine = EFFECTS["bed_memory"].conceal(world.machine, ("base",), size, Shapes())
        found = with_size(world, machine, key)
        assert (found["rms_over_noise"] < 1.0) is accepted
        assert ("no mismatch" in found.get("accepts", ())) is accepted


def test_size_grows_with_the_effect_and_ignores_what_a_refit_absorbs(world: World) -> None:
    heat = EFFECTS["input_heat"]
    sizes = [world.size(heat.conceal(world.machine, ("base",), w, Shapes())) for w in (2.0, 4.0, 8.0)]
    assert sizes[1] / sizes[0] == pytest.approx(2.0, rel=0.05)
    assert sizes[2] / sizes[1] == pytest.approx(2.0, rel=0.05)
    scaled = world.machine.network.changed(
        lambda law: replace(law, size=1.1 * law.size) if law.name == "loss spindle" else law
    )
    absorbed = replace(world.machine, network=scaled)
    moved = float(np.sqrt(np.mean(world.change(absorbed) ** 2)))
    assert moved > 1.0  # a parameter of the baseline moves the errors
    assert world.size(absorbed) < 0.05 * moved  # and a refit follows


def test_an_effect_next_to_another_is_as_large_as_asked_by_itself(world: World) -> None:
    """What another one shows already is none of its size. Only free convection is not in proportion here."""
    heat = EFFECTS["input_heat"]
    small, large = (heat.conceal(world.machine, ("base",), w, Shapes()) for w in (2.0, 8.0))
    there = replace(world, machine=large)
    assert there.size(large) == 0.0
    both = heat.conceal(large, ("base",), 2.0, Shapes())
    assert there.size(both) == pytest.approx(world.size(small), rel=0.1)


def test_each_of_two_effects_shows(world: World) -> None:
    from discovery.virtual.cases import OF_TWO, VISIBLE, conceal

    for seed in range(3):
        _, key = conceal(np.random.default_rng(seed), world, Plan("two"))
        own = [effect["rms_over_noise"] for effect in key["effects"]]
        assert all(VISIBLE <= rms < 1.2 * OF_TWO[1] for rms in own)
        assert key["rms_over_noise"] > VISIBLE


def test_visible_is_what_a_nonlinear_refit_leaves(world: World) -> None:
    """Of an offset from half way on: a closed form, of which the refit takes its part."""
    clean = world.logs(world.machine, FIT)
    jump = 5.0 * world.sigma[0]
    at = 0.5 * HOURS * 3600.0
    faulty = clean | {"b": faults.sensor_offset(clean["b"], "E_Z", jump, at)}
    rows = sum(np.isfinite(c["E_Z"]).sum() for c in clean.values()) * 3
    hit = (np.isfinite(clean["b"]["E_Z"]) & (clean["b"]["time"] >= at)).sum()
    raw = 5.0 * np.sqrt(hit / rows)
    assert 0.5 * raw < world.visible(faulty) <= 1.001 * raw


def test_a_key_lists_what_nature_has_and_the_baseline_has_not(world: World) -> None:
    """Free convection of the housing, by the size that a refit of the baseline leaves of it."""
    own = {(e["effect"], *e["states"]): e for e in case_of("one").key["also_true"]}
    assert ("natural_convection", "base") in own
    assert ("friction_speed", "front") not in own  # by Palmgren in the plant and in the baseline
    assert all(e["rms_over_noise"] < 1.0 for e in own.values())  # the noise was drawn so that it hides them
    found = {(effect, *states): rms for effect, states, rms in world.lacks}
    linear = next(lack for lack in world.machine.lacks if lack.laws == ("air base",))
    plain = world.machine.as_believed(linear)
    assert all(law.form == Form.LINK for law in plain.network.laws if law.name == "air base")
    assert found["natural_convection", "base"] == world.size(plain)
    every = [lack for lack in world.machine.lacks if lack.effect == "natural_convection"]
    together = found["natural_convection", *(body for lack in every for body in lack.states)]
    assert len(every) > 1
    assert together == world.size(reduce(Machine.as_believed, every, world.machine))


def test_wear_of_a_nut_acts_on_the_screw_that_it_rubs_on() -> None:
    """Its loss heats both; an answer that names both is right."""
    machine = FAMILIES["linear_axis"](np.random.default_rng(0))
    wear = EFFECTS["wear"]
    nut = ("nut", "screw_1", "screw_2", "screw_3")
    assert wear.places(machine) == [nut, ("bearing",)]
    worn = wear.conceal(machine, nut, 0.3, Shapes())
    new = {law.into for law in worn.network.laws if law.name == "wear of loss nut"}
    assert {body for body, bar in machine.bodies.items() if set(bar.nodes) & new} == set(nut)


def test_noise_is_what_the_key_says(world: World) -> None:
    noisy, clean = world.logs(world.machine, noisy=True), world.logs(world.machine)
    for j, output in enumerate(world.machine.outputs):
        difference = np.concatenate([noisy[r][output] - clean[r][output] for r in noisy])
        assert np.nanstd(difference) == pytest.approx(world.sigma[j], rel=0.12)
    for channel in ("speed", "T_env"):
        np.testing.assert_array_equal(noisy["a"][channel], clean["a"][channel])


def test_plans_have_their_shares_and_deal_every_effect() -> None:
    plans = draw_plans("portal", 100, 1)
    assert {k: sum(p.kind == k for p in plans) for k in KINDS} == {
        k: round(100 * s) for k, s in KINDS.items()
    }
    machine = FAMILIES["portal"](np.random.default_rng(0))
    possible = {w for w, e in EFFECTS.items() if e.places(machine)}
    assert {p.word for p in plans if p.kind in ("one", "input")} == possible
    assert {p.word for p in plans if p.kind == "measuring"} == set(FAULTS)
    assert plans != draw_plans("portal", 100, 2)


def test_orders_take_families_in_turn() -> None:
    orders = draw_orders(["portal", "printer"], 5, 1)
    assert [o.family for o in orders] == ["portal", "printer", "portal", "printer", "portal"]
    assert [o.name for o in orders] == [f"case_0{k}" for k in range(1, 6)]
    with pytest.raises(UsageError, match="no family 'lathe'; choose from: rotary_table, headstock"):
        draw_orders(["lathe"], 5, 1)


def test_the_command_lists_families_and_writes_cases(tmp_path: Path) -> None:
    listed = CliRunner().invoke(app, ["challenge", "--family", "help"])
    assert listed.exit_code == 0
    assert all(family in listed.output for family in FAMILIES)
    command = ["challenge", "--family", "bearing_rig", "--cases", "1", "--seed", "3", "--jobs", "1"]
    done = CliRunner().invoke(app, [*command, "--write", str(tmp_path / "rig")])
    assert done.exit_code == 0, done.output
    assert list(json.loads((tmp_path / "rig" / "keys.json").read_text())) == ["case_01"]
    (order,) = draw_orders(["bearing_rig"], 1, 3)
    texts = [p.read_text() for p in (tmp_path / "rig" / "case_01").glob("*.toml")]
    assert len(texts) == 3
    assert not any(str(order.seed) in text for text in texts)
    adopt(tmp_path / "challenge", tmp_path / "rig")
    assert len(list((tmp_path / "challenge" / "cases" / "case_01").iterdir())) == 6
    again = CliRunner().invoke(app, [*command, "--write", str(tmp_path / "rig")])
    assert (again.exit_code, "not empty" in again.output) == (1, True)
    wrong = CliRunner().invoke(app, ["challenge", "--family", "lathe", "--write", str(tmp_path / "x")])
    assert wrong.exit_code == 2
    assert not (tmp_path / "x").exists()
