"""Formulas of heat in machines: speeds in rpm, temperatures in degC, heat in W."""

from __future__ import annotations

import numpy as np

from discovery.virtual.network import Array, Form, Law, Switch, heat, link

RPM = 2.0 * np.pi / 60.0  # rad/s per rpm

# Vogel: nu ~ exp(a/(T + b)). Mineral oil ISO VG 32: 32 mm2/s at 40 degC, 5.4 at 100 degC. A pole at -95 degC.
VOGEL_B = 95.0
VG32 = 804.0  # K; ln(32/5.4) = a (1/135 - 1/195)


def viscous_shape(exponent: float, reference: float = 22.0, a: float = VG32) -> tuple[float, float, float]:
    """Shape of the forms VISCOUS and STRIBECK: viscosity to a power, 1 at `reference` [degC].

    >>> shape = viscous_shape(1.0, 40.0)
    >>> round(float(32.0 * np.exp(shape[0] / (100.0 + shape[1]) - shape[0] / (40.0 + shape[1]))), 1)
    5.1
    """
    return exponent * a, VOGEL_B, reference


def palmgren_power(speed: Array, mean_diameter_mm: float, f0: float = 2.0, nu: float = 25.0) -> Array:
    """Load-free friction of a rolling bearing [W]: M_0 = 1e-7 f_0 (nu n)^(2/3) d_m^3 N mm for nu n > 2000.

    f_0: 2 (oil-air) to 8 (oil bath); nu in mm2/s. Source: Palmgren 1959; Harris, Rolling Bearing Analysis.

    >>> float(palmgren_power(np.array([3000.0]), 100.0).round(1)[0])
    111.7
    """
    torque = 1e-7 * f0 * np.maximum(nu * speed, 2000.0) ** (2.0 / 3.0) * mean_diameter_mm**3 * (speed > 0)
    return np.asarray(torque * 1e-3 * speed * RPM)


def film(
    name: str, pump: str, flow_kg: float = 8e-4, thickness_kg: float = 0.12, dry_s: float = 2400.0
) -> list[Law]:
    """A film of fluid [kg/m2] on a wall: fed by the pump, drained by gravity with its cube, dried slowly.

    Nusselt's film: the mass that runs off goes with the cube of the thickness. It fills within
    thickness/flow; that and a third of it should not be much shorter than a step of the plant.
    """
    drain = flow_kg / thickness_kg**3
    return [
        heat(f"{name} fed", name, flow_kg, pump),
        Law(f"{name} drains", Form.POWER, name, size=drain, shape=(2.0,)),
        Law(f"{name} dries", Form.LINK, name, size=1.0 / dry_s),
    ]


def chiller(
    tank: str, power: float, target: str | float, band: float
) -> tuple[list[Law], dict[str, float], dict[str, Switch]]:
    """A chiller on a tank: its evaporator, 4 kJ/K, is cooled while it is on. Laws, nodes, switches."""
    plate, name = f"{tank} evaporator", f"{tank} chiller"
    laws = [
        Law(name, Form.HEAT, plate, size=-power, switch=name),
        link(f"{name} plate", tank, plate, power / 4.0),
    ]
    return laws, {plate: 4e3}, {name: Switch(tank, target, band)}
