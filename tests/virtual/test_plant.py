"""The plant against equations written out anew for LSODA, the energy balance, the paper's magnitudes."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from discovery.virtual.cycles import Cycle, make_cycle
from discovery.virtual.effects import EFFECTS, PAIRS, Request, sizes
from discovery.virtual.machine import BODIES, Machine
from discovery.virtual.measurement import Chain
from discovery.virtual.plant import errors_of, simulate
from discovery.virtual.record import Order, take

Array = NDArray[np.float64]


def steady(hours: float, speed: float, flow: float) -> Cycle:
    n = round(hours * 360)
    return Cycle(
        10.0,
        np.full(n, 22.0),
        np.full(n, speed),
        np.full(n, flow),
        np.full(n, 0.05),
        np.zeros(n),
        np.array([0.0]),
        22.0,
    )


def test_wet_balance_closes() -> None:
    """Drive and pump power in, cooler, sump and air out: 1093.6 W at 600 rpm."""
    run = simulate(steady(500, 600.0, 1.0))
    m, rise = Machine(), run.bodies[-1] - 22.0
    sump = m.sump_ua * (run.fluid[-1] - 22.0)
    to_air = float(np.dot(m.air, rise)) + m.G_b2_bed * rise[4]
    assert run.drive[-1] + m.pump_power == pytest.approx(1093.6, abs=0.1)
    assert run.cooling[-1] + sump + to_air == pytest.approx(run.drive[-1] + m.pump_power, rel=1e-6)
    np.testing.assert_allclose(rise, [6.0, 5.1, 3.5, 3.4, 1.4], atol=0.1)


def test_dry_warm_up_has_the_known_errors() -> None:
    """15 h at 600 rpm without fluid: -26.2, 21.0, 8.1 um and 11.9 um/m."""
    run = simulate(steady(15, 600.0, 0.0))
    np.testing.assert_allclose(run.errors[-1], [-26.2, 21.0, 8.1, 11.9], atol=0.1)


def test_against_lsoda() -> None:
    """The plain plant, written out anew, integrated from switch to switch with rtol 1e-10."""
    cycle = make_cycle("fit", 11, hours=12)
    m = Machine()
    run = simulate(cycle, m)
    G = np.zeros((5, 5))
    for i, j, g in ((0, 1, 24.0), (1, 2, 25.0), (1, 3, 29.0), (2, 3, 11.0), (3, 4, 13.0)):
        G[i, j] = G[j, i] = g

    def rhs(_: float, x: Array, air: float, n: float, pump: float) -> Array:
        T, bed, fluid = x[:5], x[5], x[6]
        w = n * 2 * np.pi / 60
        torque = (2.84 + 2.72 * (n / 600) ** (2 / 3)) if n > 0 else 0.0
        motor = 80 * (n / 600) ** 1.5 + 40 * (torque / 6.5) ** 2
        h = 300.0
        if n > 0:
            ek = 1.2e-6 / (4 * w * 0.25**2)
            nu = 1.97619 * 5.0**0.0909 * 1000**0.75 * ek**-0.1111 * (45 / 0.58) ** -0.9
            h = (300.0**4 + (nu * 0.58 / 0.01) ** 4) ** 0.25
        wet = pump * h * np.array([0.0757, 0.0224, 0, 0, 0])
        jacket = 220 * (1 - np.exp(-np.array([0, 30, 113, 0, 0]) / 220))
        q = G @ T - G.sum(1) * T + np.array(m.air) * (air - T) + jacket * (bed - T) + wet * (fluid - T)
        q += torque * w * np.array(m.friction_share) + motor * np.array(m.motor_share)
        q[4] += 9.6 * (bed - T[4])
        tank = pump * 635 + wet @ (T - fluid) - 91 * (fluid - air)
        return np.concatenate([q / np.array(m.capacity), [(air - bed) / 108e3, tank / 1.2e6]])

    x = np.concatenate([np.full(5, cycle.air[0]), [cycle.air[0], cycle.fluid_start]])
    for k in range(720):  # the first two hours, with stops and the warm fluid on the cold table
        inputs = (cycle.air[k], cycle.speed[k], cycle.flow[k])
        x = solve_ivp(rhs, (0, 10.0), x, method="LSODA", rtol=1e-10, atol=1e-10, args=inputs).y[:, -1]
    reached = np.concatenate([run.bodies[720], [run.bed[720], run.fluid[720]]])
    np.testing.assert_allclose(reached, x, atol=1e-5)


@pytest.mark.parametrize("effect", PAIRS)
def test_an_isolated_machine_keeps_its_energy(effect: str) -> None:
    """Heat that only moves between bodies is neither made nor lost."""
    none = (0.0,) * 5
    closed = Machine(air=none, cooling_ua=none, wet_area=none, G_b2_bed=0.0)
    start = np.array([30.0, 20.0, 25.0, 22.0, 18.0])
    request = Request(effect, 0.02 if effect == "contact_conductance" else 5.0, ("c_body_1", "b_body_1"))
    run = simulate(steady(3, 0.0, 1.0), closed, sizes([request]), start=start)
    energy = run.bodies @ np.array(closed.capacity)
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)
    assert abs(run.bodies[-1] - start).max() > 1.0


def test_zero_size_is_the_plain_plant() -> None:
    cycle = make_cycle("fit", 3, hours=6)
    nothing = sizes([Request(name, 0.0, e.at) for name, e in EFFECTS.items()])
    np.testing.assert_array_equal(simulate(cycle, effects=nothing).errors, simulate(cycle).errors)


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e not in ("unmeasured_heat", "swarf_heat")])
def test_every_effect_acts_and_stays_moderate(effect: str) -> None:
    """At its largest size an effect changes the errors, by less than the errors themselves."""
    cycle = make_cycle("flow" if effect == "fluid_convection_flow" else "fit", 5, hours=36)
    e = EFFECTS[effect]
    run = simulate(cycle, effects=sizes([Request(effect, e.high, e.at)]), age=1.0)
    change = np.abs(run.errors - simulate(cycle).errors).max()
    assert 0.005 < change < 60.0
    assert np.isfinite(run.errors).all()


def test_table_3_magnitudes() -> None:
    """Mean of six cycles against the paper: peak and mean within 30 %, variance within a factor of 3."""
    peak, mean, spread = [], [], []
    for seed in range(20, 26):
        cycle = make_cycle("fit", seed)
        y = simulate(cycle).errors[(cycle.readings / 10).astype(int)]
        peak.append(np.abs(y).max(0))
        mean.append(y.mean(0))
        spread.append(y.var(0))
    np.testing.assert_allclose(np.mean(peak, 0), [49, 42, 15, 38], rtol=0.3)
    np.testing.assert_allclose(np.mean(mean, 0), [-35, 28, 11, 16], rtol=0.3)
    np.testing.assert_array_less(np.abs(np.log(np.mean(spread, 0) / [73, 44, 1.7, 80])), np.log(3.0))


def test_uniform_growth_does_not_tilt() -> None:
    assert errors_of(np.full((1, 5), 27.0), Machine())[0, 3] == pytest.approx(0.0, abs=1e-9)


def test_an_effect_changes_nothing_but_itself() -> None:
    """Room, noise and everyday heat are the same with and without an effect."""
    order = Order("x", hours=8.0, seed=9)
    plain = take(order).columns
    heated = take(replace(order, effects=(Request("unmeasured_heat", 80.0, ("table",)),)))
    assert all(
        np.array_equal(plain[c], heated.columns[c], equal_nan=True) for c in ("T_env", "speed", "pump")
    )
    ((state, start, end),) = heated.windows
    assert state == "table"
    assert end > start
    difference = heated.columns["E_R0T"] - plain["E_R0T"]
    read = ~np.isnan(difference)
    before = plain["time"] < start
    assert np.abs(difference[read & before]).max(initial=0.0) < 1e-9
    assert difference[read].max() > 1.0


def test_readings_are_noisy_by_the_chain() -> None:
    order = Order("x", hours=72.0, seed=4, chain=Chain(white=(0.5,) * 4, slow=0.0, heat_w=0.0))
    quiet = replace(order, chain=replace(order.chain, white=(0.0,) * 4))
    for name in ("E_Y0C", "E_A0C"):
        noise = take(order).columns[name] - take(quiet).columns[name]
        assert np.nanstd(noise) == pytest.approx(0.5, rel=0.15)


def test_recorded_means_keep_the_heat() -> None:
    """Held channels are means: the energy in the log is the energy of the plant."""
    order = Order("x", hours=10.0, seed=6)
    columns = take(order).columns
    cycle = make_cycle("fit", 6, 10.0)
    run = simulate(cycle)
    logged = np.nansum(columns["P_drive"]) * 60.0
    assert logged == pytest.approx(run.drive.sum() * 10.0, rel=1e-9)
    assert len(BODIES) == run.bodies.shape[1]
