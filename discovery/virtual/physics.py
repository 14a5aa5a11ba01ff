"""Laws of the plant, one small compiled function each; speeds in rpm, temperatures in degC, heat in W."""

from __future__ import annotations

import numpy as np
from numba import njit

from discovery.virtual.machine import Machine

RPM = 2.0 * np.pi / 60.0  # rad/s per rpm
STEFAN_BOLTZMANN = 5.670374e-8
TAU_HIDDEN = 3200.0  # s, second thermal mass
TAU_DRYING = 2400.0  # s, wet film after the pump stops
TAU_WETTING = 60.0  # s
TAU_SUMP = 13.3e3  # s, 3.7 h
HUMIDITY = 0.45
COOLANT_CAPACITY = 65e3  # J/K
CHILLER = 2000.0  # W


@njit(cache=True)
def film_coefficient(speed: float, height: float, m: Machine) -> float:
    """h [W/m2K] of eqs. (1) to (5), blended with the gravity film at standstill: (h_0^4 + h_1^4)^(1/4)."""
    if speed <= 0.0:
        return m.h_still
    ekman = m.nu / (4.0 * speed * RPM * m.disk_radius**2)
    nusselt = (
        1.97619
        * (height / m.nozzle) ** 0.0909
        * m.Re**0.75
        * ekman ** (-0.1111)
        * (m.lambda_s / m.lambda_f) ** (-0.9)
    )
    return float((m.h_still**4 + (nusselt * m.lambda_f / m.nozzle) ** 4) ** 0.25)


@njit(cache=True)
def friction_torque(speed: float, m: Machine) -> float:
    """Bearing torque [Nm], Coulomb and viscous part (Palmgren); none at standstill."""
    return float(m.M_coulomb + m.M_viscous * (speed / 600.0) ** (2.0 / 3.0)) if speed > 0.0 else 0.0


@njit(cache=True)
def copper_loss(speed: float, m: Machine) -> float:
    """Copper loss [W], by the square of the torque."""
    return m.copper * (friction_torque(speed, m) / 6.5) ** 2


@njit(cache=True)
def motor_loss(speed: float, m: Machine) -> float:
    """Iron and copper loss [W]."""
    return float(m.iron * (speed / 600.0) ** 1.5 + copper_loss(speed, m))


@njit(cache=True)
def vapour(T: float) -> float:
    """Saturated vapour relative to 22 degC (Magnus formula)."""
    return float(np.exp(17.62 * T / (243.12 + T) - 17.62 * 22.0 / (243.12 + 22.0)))


@njit(cache=True)
def evaporation(T: float, T_env: float, wetness: float) -> float:
    """Heat drawn from a wet surface, 1 at 22 degC in a room of 22 degC (Lewis relation, RH 45 %)."""
    return wetness * max(0.0, vapour(T) - HUMIDITY * vapour(T_env)) / (1.0 - HUMIDITY)


@njit(cache=True)
def natural(T: float, T_env: float) -> float:
    """Turbulence-free natural convection, (|dT|/5 K)^(1/4) dT: 1 W/K at 5 K."""
    dT = T_env - T
    return float((abs(dT) / 5.0) ** 0.25 * dT)


@njit(cache=True)
def radiation(T: float, T_env: float) -> float:
    """Radiated heat [W/m2] per emissive area."""
    return STEFAN_BOLTZMANN * ((T_env + 273.15) ** 4 - (T + 273.15) ** 4)


@njit(cache=True)
def viscosity_change(T: float) -> float:
    """Viscous friction against its value at 22 degC, -1: exp(-0.03 (T - 22)) - 1."""
    return float(np.exp(-0.03 * (T - 22.0)) - 1.0)


@njit(cache=True)
def play(x: float, width: float, y: float) -> float:
    """Prandtl-Ishlinskii play: y follows x only beyond +-width."""
    return max(x - width, min(x + width, y))
