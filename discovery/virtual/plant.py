"""The plant integrated finely: Runge-Kutta of fourth order, 10 s steps, independent of `discovery.dynamics`.

The shortest time constant is about 60 s, so a step is wrong by less than 1e-6 K (tested against LSODA).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.virtual import physics as law
from discovery.virtual.cycles import Cycle
from discovery.virtual.effects import Sizes, sizes
from discovery.virtual.machine import Machine

Array = NDArray[np.float64]

BED, SUMP, HIDDEN, WETNESS, COOLANT, NOZZLE, STATES = 5, 6, 7, 12, 17, 18, 19


@dataclass(frozen=True)
class Trajectory:
    """What the plant did; n steps of `step_s`, states at n + 1 instants."""

    step_s: float
    bodies: Array  # (n + 1, 5) degC
    bed: Array  # (n + 1,) degC
    fluid: Array  # (n + 1,) degC, in the sump, where the sensor is
    coolant: Array  # (n,) degC, what the coolant sensor shows
    drive: Array  # (n,) W, mean over the step, as recorded
    cooling: Array  # (n,) W, at the coolant temperature that the sensor shows
    errors: Array  # (n + 1, 4) um, um, um, um/m


def simulate(
    cycle: Cycle,
    machine: Machine | None = None,
    effects: Sizes | None = None,
    *,
    heat: Array | None = None,
    start: Array | None = None,
    age: float = 0.0,
) -> Trajectory:
    """Run `cycle` on the plant.

    heat (n, 5) [W]: unrecorded heat at the bodies. start (5,) [degC]: of the bodies, default the room.
    age: 0 in the first recording, 1 in the next ...; `wear` grows with it.
    """
    m, e = machine or Machine(), effects or sizes()
    n = len(cycle.speed)
    heat = np.zeros((n, 5)) if heat is None else heat
    x0 = np.zeros(STATES)
    x0[:5] = cycle.air[0] if start is None else start
    x0[BED] = cycle.air[0]
    x0[SUMP] = cycle.fluid_start
    x0[HIDDEN:WETNESS] = x0[:5]
    x0[WETNESS:COOLANT] = cycle.flow[0] > 0
    states, drive, cooling = _integrate(
        x0, cycle.step_s, cycle.air, cycle.speed, cycle.flow, cycle.height, cycle.sump_heat, heat, age, m, e
    )
    growth = np.empty((n + 1, 5))
    _joints(states[:, :5], e.joint_hysteresis, growth)
    return Trajectory(
        cycle.step_s,
        states[:, :5],
        states[:, BED],
        states[:, SUMP],
        states[:-1, BED],
        drive,
        cooling,
        errors_of(growth, m),
    )


def errors_of(bodies: Array, m: Machine) -> Array:
    """Errors (n, 4) of body temperatures (n, 5), zero at T_ref: levers x expansion."""
    rise = bodies - m.T_ref
    table = np.array([1.0, 0.0, 0.0, 0.0, 0.0])
    return np.column_stack(
        [
            -m.alpha_cast * rise @ np.array(m.length_y),
            m.alpha_steel * rise @ np.array(m.length_z),
            m.alpha_steel * m.radius * rise @ table,
            rise @ np.array(m.tilt),
        ]
    )


@njit(cache=True)
def _joints(bodies: Array, width: Array, growth: Array) -> None:
    """Body temperatures as the levers see them: behind a joint with play, nothing shows until it slips."""
    growth[:] = bodies
    for i in range(5):
        if width[i] > 0.0:
            for k in range(1, len(bodies)):
                growth[k, i] = law.play(bodies[k, i], width[i], growth[k - 1, i])


@njit(cache=True)
def rates(
    x: Array, late: float, air: float, speed: float, flow: float, height: float, sump_heat: float,
    heat: Array, age: float, chiller: float, m: Machine, e: Sizes, dx: Array,
) -> tuple[float, float]:  # fmt: skip
    """Right-hand side: fills dx (19,), returns recorded drive power and cooling power [W].

    late: fluid temperature that reaches the machine now. chiller: 1 while the on/off chiller runs.
    """
    wet = flow > 0.0
    rotation = speed / 600.0
    nozzle = late + x[NOZZLE]
    coolant = x[BED] + x[COOLANT]
    torque = law.friction_torque(speed, m)
    friction, motor = torque * speed * law.RPM, law.motor_loss(speed, m)
    coulomb = m.M_coulomb * speed * law.RPM
    film = law.film_coefficient(speed, height, m)
    drive, cooling, load, returned = friction + motor, 0.0, 0.0, 0.0
    q = heat.copy()

    _conduct(q, x, 0, 1, m.G_table_c1, e)
    _conduct(q, x, 1, 2, m.G_c1_c2, e)
    _conduct(q, x, 1, 3, m.G_c1_b1, e)
    _conduct(q, x, 2, 3, m.G_c2_b1, e)
    _conduct(q, x, 3, 4, m.G_b1_b2, e)
    q[4] += m.G_b2_bed * (x[BED] - x[4])

    for i in range(5):
        T = x[i]
        # the plain plant: air, drive, jacket, film
        q[i] += m.air[i] * (air - T) + m.friction_share[i] * friction + m.motor_share[i] * motor
        jacket = m.coolant_flow * (1.0 - np.exp(-m.cooling_ua[i] / m.coolant_flow))
        q[i] += jacket * (coolant - T)
        cooling += jacket * (T - x[BED])
        load += jacket * (T - coolant)
        if wet:
            G = m.wet_area[i] * film * flow ** (m.flow_exponent - e.fluid_convection_flow[i])
            G *= 1.0 - e.rim_detachment[i] * (1.0 - 1.0 / (1.0 + (speed / 200.0) ** 2))
            G += flow * (e.fluid_convection[i] + e.fluid_convection_speed[i] * rotation ** (2.0 / 3.0))
            q[i] += G * (nozzle - T)
            returned += G * (T - nozzle)
            q[i] += e.film_drag[i] * flow * rotation**2
            returned += e.film_drag[i] * flow * rotation**2
        q[i] -= e.evaporation_drying[i] * law.evaporation(T, air, x[WETNESS + i])
        # drive
        extra = (
            e.friction_speed[i] * rotation ** (5.0 / 3.0)
            + e.viscosity_temperature[i] * rotation ** (5.0 / 3.0) * law.viscosity_change(T)
            + e.thermal_preload[i] * coulomb * (T - x[3])
            + e.copper_resistance[i] * 0.00393 * (T - 22.0) * law.copper_loss(speed, m)
            - e.wear[i] * age * m.friction_share[i] * friction
        )
        q[i] += extra + e.windage[i] * rotation**2.8
        drive += m.power_seen * extra
        # air and structure
        q[i] += (e.rotating_air_convection[i] * rotation**0.8 + e.air_convection[i]) * (air - T)
        q[i] += e.natural_convection[i] * law.natural(T, air) + e.radiation[i] * law.radiation(T, air)
        q[i] += e.bed_memory[i] * (x[BED] - T)
        q[i] += e.second_thermal_mass[i] * (x[HIDDEN + i] - T)
        dx[HIDDEN + i] = (T - x[HIDDEN + i]) / law.TAU_HIDDEN
        film_tau = law.TAU_WETTING if wet else law.TAU_DRYING
        dx[WETNESS + i] = ((1.0 if wet else 0.0) - x[WETNESS + i]) / film_tau
        for j in range(5):
            across = (e.flooded_gap[i, j] * flow + e.conduction_path[i, j]) * (x[j] - T)
            q[i] += across
            q[j] -= across

    for i in range(5):
        dx[i] = q[i] / m.capacity[i]
    dx[BED] = (air - x[BED]) / m.tau_bed
    pump = flow * m.pump_power if wet else 0.0
    dx[SUMP] = (pump + sump_heat + returned - m.sump_ua * (x[SUMP] - air)) / m.sump_capacity
    swing = e.cooling_hysteresis.max()
    dx[COOLANT] = (load - law.CHILLER * chiller) / law.COOLANT_CAPACITY if swing > 0.0 else 0.0
    dx[NOZZLE] = (e.fluid_sump.max() * flow - x[NOZZLE]) / law.TAU_SUMP
    return drive, cooling


@njit(cache=True)
def _conduct(q: Array, x: Array, i: int, j: int, G: float, e: Sizes) -> None:
    """Conduction between two bodies; what enters one leaves the other."""
    k = e.contact_conductance[i, j] + e.contact_conductance[j, i]
    flow = G * (1.0 + k * ((x[i] + x[j]) / 2.0 - 22.0)) * (x[j] - x[i])
    q[i] += flow
    q[j] -= flow


@njit(cache=True)
def _integrate(
    x: Array, step: float, air: Array, speed: Array, flow: Array, height: Array, sump_heat: Array,
    heat: Array, age: float, m: Machine, e: Sizes,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Runge-Kutta of fourth order with inputs held over each step."""
    n = len(speed)
    states, drive, cooling = np.empty((n + 1, len(x))), np.empty(n), np.empty(n)
    states[0] = x
    stage, slope = np.empty_like(x), np.empty((4, len(x)))
    weights, reach = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0, np.array([0.0, 0.5, 0.5, 1.0])
    swing, delay, chiller = e.cooling_hysteresis.max(), e.fluid_delay.max(), 0.0
    for k in range(n):
        before = states[k]
        if swing > 0.0 and abs(before[COOLANT]) > swing:  # the chiller switches at the edges of its band
            chiller = 1.0 if before[COOLANT] > 0.0 else 0.0
        drive[k] = cooling[k] = 0.0
        for r in range(4):
            stage[:] = before
            if r > 0:
                stage += reach[r] * step * slope[r - 1]
            late = stage[SUMP] if delay <= 0.0 else states[max(0, k - round(delay / step)), SUMP]
            p, c = rates(
                stage, late, air[k], speed[k], flow[k], height[k], sump_heat[k],
                heat[k], age, chiller, m, e, slope[r],
            )  # fmt: skip
            drive[k] += weights[r] * p
            cooling[k] += weights[r] * c
        for i in range(len(x)):
            slope_mean = 0.0
            for r in range(4):
                slope_mean += weights[r] * slope[r, i]
            states[k + 1, i] = before[i] + step * slope_mean
    return states, drive, cooling
