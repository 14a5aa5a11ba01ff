"""Concealed cases: exact plant, honest sizes, the same bytes twice, keys that say what was done."""

import gzip
import io
import tomllib
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import least_squares

from discovery.virtual import laws
from discovery.virtual.cases import KINDS, Case, draw_kinds, make_case
from discovery.virtual.chains import propagator, run
from discovery.virtual.fine import (
    BODIES,
    COOLED,
    LINKS,
    LOSSES,
    STEP_S,
    WET,
    draw_inputs,
    draw_machine,
    lumped,
)
from discovery.virtual.outside import OUTSIDE
from discovery.virtual.world import draw_world, lumping

Array = NDArray[np.float64]


@pytest.fixture(scope="module")
def cases() -> dict[str, Case]:
    return {kind: make_case(7, kind) for kind in KINDS}


def table(case: Case, name: str) -> pd.DataFrame:
    return pd.read_csv(io.BytesIO(gzip.decompress(case.files[name])))


def test_lumped_plant_against_lsoda() -> None:
    """One node a body is the baseline: its equations written out anew, integrated from step to step."""
    rng = np.random.default_rng(3)
    m = lumped(draw_machine(rng))
    u = draw_inputs(rng, m, hours=3.0)
    start = np.array([20.0, 21.0, 22.0, 23.0, 24.0])
    got = run(propagator(m), u, start, np.zeros((len(u.air), 5)))

    def rhs(_: float, T: Array, k: int) -> Array:
        q = m.air * (u.air[k] - T)
        for (i, j), G in zip(LINKS, m.links, strict=True):
            q[i] += G * (T[j] - T[i])
            q[j] += G * (T[i] - T[j])
        q[list(LOSSES)] += m.loss * u.drive[k]
        q[COOLED] -= m.cooling * u.cooling[k]
        q[list(WET)] += m.wet * u.pump[k] * (u.fluid[k] - T[list(WET)])
        return np.asarray(q / m.capacity)

    T = start
    for k in range(len(u.air)):
        T = solve_ivp(rhs, (0, STEP_S), T, method="LSODA", rtol=1e-10, atol=1e-10, args=(k,)).y[:, -1]
    np.testing.assert_allclose(got[-1], T, atol=1e-6)


def test_fine_plant_keeps_its_energy() -> None:
    """Stored heat grows by what comes in: a machine without air, fluid and cooling, heated by 100 W."""
    rng = np.random.default_rng(4)
    m = draw_machine(rng)
    closed = replace(m, air=np.zeros(5), wet=np.zeros(2), loss=np.zeros(3), cooling=0.0)
    u = draw_inputs(rng, m, hours=2.0)
    heat = np.zeros((len(u.air), 5))
    heat[:, 3] = 100.0
    bodies = run(propagator(closed), u, np.full(5, 22.0), heat)
    stored = float((bodies[-1] - bodies[0]) @ m.capacity)
    assert stored == pytest.approx(100.0 * 7200.0, rel=1e-9)
    assert 20 <= m.nodes.sum() <= 50


def test_a_law_of_link_keeps_energy_and_zero_size_is_nothing() -> None:
    rng = np.random.default_rng(5)
    m = draw_machine(rng)
    u = draw_inputs(rng, m, hours=2.0)
    p, quiet, start = propagator(m), np.zeros((len(u.air), 5)), np.array([30.0, 20.0, 22.0, 25.0, 18.0])
    plain = run(p, u, start, quiet)
    for maker in (*laws.ONE, *OUTSIDE):
        effect = maker(np.random.default_rng(1), m)
        np.testing.assert_array_equal(run(p, u, start, quiet, effect.laws(0.0, u)), plain)
        acting = run(p, u, start, quiet, effect.laws(effect.trial, u))
        assert np.isfinite(acting).all(), effect.effect
        assert np.abs(acting - plain).max() > 1e-4, effect.effect


def test_size_is_what_a_nonlinear_refit_leaves() -> None:
    """Against scipy's least squares over every free number of the baseline, on noise-free readings."""
    world = draw_world(np.random.default_rng(12), coloured=False)
    effect = laws.flooded_gap(np.random.default_rng(0), world.plant.machine)
    truth = world.readings([effect.laws(30.0, u) for u in world.inputs])[: world.seen]
    coarse = lumped(world.plant.machine)
    quiet = np.zeros((len(world.inputs[0].air), 5))

    def residual(z: Array) -> Array:
        m = replace(
            coarse,
            links=coarse.links * np.exp(z[:5]),
            air=coarse.air * np.exp(z[5:10]),
            loss=coarse.loss * np.exp(z[10:13]),
            wet=coarse.wet * np.exp(z[13:15]),
            cooling=coarse.cooling * float(np.exp(z[15])),
        )
        p = propagator(m)
        bodies = [
            run(p, world.inputs[k], world.starts[k] + z[16 + 5 * k : 21 + 5 * k], quiet) for k in (0, 1)
        ]
        shown = [((b[::30] - 22.0) @ m.outputs.T).ravel() for b in bodies]
        return np.asarray(np.concatenate(shown) - truth)

    left = least_squares(residual, np.zeros(26), method="trf", max_nfev=6).fun
    size = float(np.sqrt(np.mean(left**2))) / world.noise
    predicted = world.size_of(world.readings([effect.laws(30.0, u) for u in world.inputs]) - world.readings())
    assert predicted == pytest.approx(size, rel=0.35)


@pytest.mark.parametrize("seed", range(4))
def test_lumping_stays_below_noise(seed: int) -> None:
    assert lumping(draw_world(np.random.default_rng(seed), coloured=False)) <= 0.25


def test_the_same_bytes_twice(cases: dict[str, Case]) -> None:
    again = make_case(7, "two")
    assert again.files == cases["two"].files
    assert again.key == cases["two"].key
    assert make_case(8, "two").files["a.csv.gz"] != again.files["a.csv.gz"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_case_is_a_case_folder(kind: str, cases: dict[str, Case]) -> None:
    case = cases[kind]
    campaign, baseline, experiment = (
        tomllib.loads(case.files[f"{name}.toml"].decode()) for name in ("campaign", "baseline", "experiment")
    )
    assert set(case.files) == {
        "campaign.toml",
        "baseline.toml",
        "experiment.toml",
        "a.csv.gz",
        "b.csv.gz",
        "c.csv.gz",
    }
    assert list(campaign["recordings"]) == ["a", "b", "c"]
    assert (experiment["fit"], experiment["held_out"]) == (["a", "b"], ["c"])
    assert tuple(baseline["states"]) == BODIES
    held_out = table(case, "c.csv.gz")
    assert set(campaign["channels"]) == set(held_out.columns) - {"time"}
    read = held_out.dropna()
    noise = read[["E_Y0C", "E_Z0T", "E_R0T", "E_A0C"]].to_numpy() - case.truth[: len(read)]
    slow = 0.15 if case.key["coloured"] else 0.0
    assert noise.std() == pytest.approx(np.hypot(case.key["noise"], slow), rel=0.1)
    everything = b"".join(v for k, v in case.files.items() if k.endswith("toml")).decode()
    for word in [e["effect"] for e in case.key.get("effects", [case.key]) if e["effect"]]:
        assert word not in everything


def test_keys_say_what_is_concealed(cases: dict[str, Case]) -> None:
    assert cases["none"].key["effect"] is None
    assert max(cases["none"].key["held_out"]["c"]["effect_rms"].values()) == 0.0
    one = cases["one"].key
    assert one["effect"] in {"unmeasured_heat", *(maker.__name__ for maker in laws.ONE)}
    assert set(one["states"]) <= set(BODIES)
    assert 0.45 < one["rms_over_noise"] < 4.5
    assert len({e["effect"] for e in cases["two"].key["effects"]}) == 2
    assert cases["measuring"].key["recording"] in "ab"
    assert cases["outside"].key["accepts"] == ["unexplained"]


def test_kinds_have_their_shares() -> None:
    kinds = draw_kinds(200, 1)
    assert {kind: kinds.count(kind) for kind in KINDS} == {
        "none": 50,
        "one": 80,
        "two": 20,
        "measuring": 20,
        "outside": 30,
    }
    assert len(draw_kinds(7, 1)) == 7
    assert kinds != draw_kinds(200, 2)


def test_half_of_the_quiet_cases_are_coloured() -> None:
    assert [make_case(seed, "none").key["coloured"] for seed in (2, 3)] == [False, True]
