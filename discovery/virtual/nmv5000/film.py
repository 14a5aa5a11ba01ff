"""What fluid and air do on a table that rests or turns: W/K and W by the inputs, (n,)."""

from __future__ import annotations

import numpy as np

from discovery.virtual.network import Array, Inputs
from discovery.virtual.physics import RPM

# fluid: 6 % emulsion at 25 degC
RHO, HEAT, NU, LAMBDA, PRANDTL = 1000.0, 4100.0, 1.2e-6, 0.58, 8.5
LATENT = 2.45e6  # J/kg
G = 9.81
NOZZLE = 0.010  # m
TABLE_AREA = 0.196  # m2, 0.5 m across
LEFT = 0.3  # share of the fluid that still meets the table when the nozzle stands on the left
PER_LITRE = RHO * HEAT / 60e3  # W/K of a flow of 1 l/min


def rest(u: Inputs) -> Array:
    """1 where the table stands, (n,)."""
    return np.asarray((np.abs(u["speed"]) < 1.0).astype(float))


def on_table(u: Inputs) -> Array:
    """Share of the fluid that meets the table, by the side of the nozzle (0 centre, 1 left)."""
    return np.asarray(1.0 - (1.0 - LEFT) * np.clip(u["nozzle_side"], 0.0, 1.0))


def jet(u: Inputs) -> Array:
    """Exchange [W/K] of a jet with a table at rest, as far as its hydraulic jump.

    The jet falls: V^2 = V_0^2 + 2 g h. Wall jet: h = 0.6 lambda Pr^(1/3) (V/(nu r))^(1/2) (Liu, Lienhard,
    Lombara, J. Heat Transfer 113, 1991). Jump: r = 0.1 m (Q/10)^(5/8) (V/V_0)^(1/5) (powers of Watson 1964).
    """
    Q = np.maximum(u["flow"], 1e-3)
    V0 = Q / 60e3 / (np.pi * NOZZLE**2 / 4)
    V = np.sqrt(V0**2 + 2 * G * u["h_nozzle"] / 1000.0)
    r = np.minimum(0.1 * (Q / 10.0) ** 0.625 * (V / V0) ** 0.2, 0.24)
    return np.asarray(0.6 * LAMBDA * PRANDTL ** (1 / 3) * np.sqrt(V / (NU * r)) * np.pi * r**2)


def table_film(u: Inputs) -> Array:
    """Exchange [W/K] of the table with its film: the jet at rest, a centrifugal film where it turns.

    Nusselt's film in the field of w^2 r: h = 1.88 lambda/delta, delta = (3 nu Q/(2 pi w^2 r^2))^(1/3),
    r = 0.17 m;    three quarters of the table are covered. Beyond the jump a slow film of 300 W/m2K.
    """
    Q = np.maximum(u["flow"], 1e-3) * on_table(u)
    w = np.maximum(np.abs(u["speed"]) * RPM, 1e-3)
    delta = (3 * NU * Q / 60e3 / (2 * np.pi * w**2 * 0.17**2)) ** (1 / 3)
    turning = 0.75 * TABLE_AREA * 1.88 * LAMBDA / delta
    still = (jet(u) + 300.0 * 0.3 * TABLE_AREA * np.minimum(Q / 10.0, 1.0) ** 0.6) * on_table(u)
    return np.asarray((still**4 + turning**4) ** 0.25)


def below_film(u: Inputs) -> Array:
    """Exchange [W/K] of C-Body 1 with what runs down; with speed the rim throws more of it off."""
    n = np.abs(u["speed"])
    return np.asarray(75.0 * (0.25 + 0.75 / (1.0 + (n / 180.0) ** 2)) * on_table(u))


def disk_air(u: Inputs) -> Array:
    """Exchange [W/K] of the table with air, half of it where the top is wet.

    Rotating disk: Nu = 0.36 Re^0.5 laminar, 0.015 Re^0.8 beyond Re = 2.4e5 (Kreith; Dorfman), r = 0.25 m.
    """
    n = np.abs(u["speed"])
    Re = n * RPM * 0.25**2 / 1.55e-5
    laminar, turbulent = 0.36 * np.sqrt(Re), 0.015 * Re**0.8
    h = 5.0 + 0.026 / 0.25 * np.where(Re < 2.4e5, laminar, turbulent)
    return np.asarray(h * 0.26 * (1.0 - 0.5 * (u["flow"] > 0)))


def evaporating(u: Inputs) -> Array:
    """W at 22 degC against dry air (Lewis, h_m = h/(rho c_p Le^(2/3))): 280 W/m2 at rest."""
    return np.asarray(55.0 * (1.0 + 3.9 * (np.abs(u["speed"]) / 600.0) ** 0.8) * on_table(u))


def drag(u: Inputs) -> Array:
    """Power [W] that brings the film to the speed of the rim, half of it heat on the table: m' (w r)^2/2."""
    w = np.abs(u["speed"]) * RPM
    return np.asarray(0.5 * RHO * u["flow"] / 60e3 * on_table(u) * (w * 0.2) ** 2)


def flow(u: Inputs) -> Array:
    """Heat that the fluid carries over the table [W/K]."""
    return np.asarray(PER_LITRE * u["flow"] * on_table(u))


def aside(u: Inputs) -> Array:
    """Heat that the fluid carries past the table."""
    return np.asarray(PER_LITRE * u["flow"] * (1.0 - on_table(u)))


def fed(u: Inputs) -> Array:
    """How fast the film is fed, 1 at 10 l/min over the centre."""
    return np.asarray(u["flow"] / 10.0 * on_table(u))


def spun(u: Inputs) -> Array:
    """How fast the film is thrown off, in its rate at 90 rpm."""
    return np.asarray((u["speed"] / 90.0) ** 2)


def splash(u: Inputs) -> Array:
    """Splash on the B corpus, while the table turns."""
    return np.asarray((u["flow"] > 0) * (1.0 - np.exp(-np.abs(u["speed"]) / 400.0)) * on_table(u))


def left(u: Inputs) -> Array:
    """The nozzle stands on the left and runs."""
    return np.asarray(np.clip(u["nozzle_side"], 0.0, 1.0) * (u["flow"] > 0))
