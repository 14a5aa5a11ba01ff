"""Heat transfer of a jet of cutting fluid on a rotating table: equations (1) to (6) of the paper, as plain
functions.

    Nu = 1.97619 beta^0.0909 Re^0.75 Ek^-0.1111 eps^-0.9                                           (1)
    Ek = nu_f / (4 Omega r_d^2)   eps = lambda_s/lambda_f   beta = h_n/d_n   h = Nu lambda_f/d_n   (2) to (5)

Source: Mayr et al., "Compensation of cutting fluid influences on five axis machine tools", section 3, after a
correlation of numerical results for small rotating disks; only the paper is witness for its coefficient and
exponents. Read here as it must be meant: nu_f is the kinematic viscosity in m2/s (the paper's "dynamic
viscosity" has the wrong dimension), Omega is in rad/s, and h_n is the vertical distance of the nozzle (the
paper says "horizontal").

Limits, said plainly. The ranges of the paper belong to a disk of a few millimetres: on a table of 0.25 m the
Ekman number is 1000 times below its limit at any speed, and a flood of 10 l/min has a Reynolds number above
its limit. At standstill eq. (1) gives no heat transfer at all, so a floor is needed. Where the table is well
wetted it follows the fluid whatever h is: a factor in front of h has to be fitted, and differences between
the variants hardly show.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from typing import Literal

import numpy as np

from discovery.models.model import Model
from discovery.recordings import Campaign

Speeding = Literal["none", "printed", "1.5"]

# (quantity, lowest, highest) of the paper's list of validity
EKMAN = (4.42e-5, math.inf)
REYNOLDS = (500.0, 1500.0)
PRANDTL = (1.29, 124.44)
BIOT = (3.73e-3, 0.118)
SPEED = (0.0, 750.0)  # rpm
SPEED_NEW = (0.0, 1200.0)  # rpm, with eq. (6)


class OutsideValidity(UserWarning):
    """A correlation is used where its source does not claim it to hold."""


def rad_per_s(rpm: float) -> float:
    """Angular speed in rad/s.

    >>> round(rad_per_s(600), 2)
    62.83
    """
    return rpm * math.pi / 30.0


def ekman(nu_f: float, omega: float, r_d: float) -> float:
    """Ekman number, eq. (2).

    Args:
        nu_f: kinematic viscosity of the fluid [m2/s].
        omega: angular speed [rad/s]; 0 gives infinity.
        r_d: radius of the table [m].

    >>> f"{ekman(5.0e-7, rad_per_s(750), 6.001e-3):.3g}"  # the disk that the printed limit belongs to
    '4.42e-05'
    """
    return math.inf if omega == 0.0 else nu_f / (4.0 * omega * r_d**2)


def nusselt(beta: float, reynolds: float, ekman_number: float, epsilon: float) -> float:
    """Nusselt number, eq. (1), of nozzle distance h_n/d_n, jet Reynolds, Ekman number and lambda_s/lambda_f.

    0 at standstill, where the Ekman number is infinite: a floor is up to the caller.
    """
    if math.isinf(ekman_number):
        return 0.0
    return float(1.97619 * beta**0.0909 * reynolds**0.75 * ekman_number**-0.1111 * epsilon**-0.9)


def speed_new(rpm: float, variant: Speeding = "none") -> float:
    """Speed that takes the place of the table's in eq. (2) above 750 rpm, eq. (6) [rpm].

        Omega_new = 4 (Omega - 750)^5 + 750                                                            (6)

    As "printed" the heat transfer doubles between 750 and 760 rpm and is 16.6 times larger at 1200 rpm, more
    than the fluid can carry: doubtful, though the law behind it, h ~ (Omega - 750)^0.556, is tame. "1.5"
    replaces the exponent 5 by 1.5 (1.55 times at 1200 rpm). "none", the default, does not change the speed.

    >>> [f"{speed_new(1000, variant):.4g}" for variant in ("printed", "1.5", "none")]
    ['3.906e+12', '1.656e+04', '1000']
    """
    if variant == "none" or rpm <= SPEED[1]:
        return rpm
    return float(4.0 * (rpm - 750.0) ** (5.0 if variant == "printed" else 1.5) + 750.0)


def film_coefficient(
    rpm: float,
    h_n: float,
    reynolds: float,
    *,
    d_n: float = 0.010,
    r_d: float = 0.25,
    nu_f: float = 1.2e-6,
    lambda_s: float = 45.0,
    lambda_f: float = 0.58,
    variant: Speeding = "none",
    floor: float = 0.0,
    prandtl: float | None = None,
    thickness: float | None = None,
) -> float:
    """Heat transfer coefficient h [W/m2K] of eqs. (1) to (6), at least `floor`.

    Args:
        rpm: speed of the table.
        h_n: vertical distance of the nozzle [m].
        reynolds: of the jet, V_j d_n/nu_f.
        d_n, r_d: diameter of the nozzle, radius of the table [m].
        nu_f: kinematic viscosity [m2/s].
        lambda_s, lambda_f: conductivity of table and fluid [W/m/K].
        variant: of eq. (6).
        floor: of a table at rest; a film under gravity, 1 to 2 mm thick, gives 500 to 1000 W/m2K.
        prandtl: of the fluid, for the check of validity alone.
        thickness: of the table [m], for the check of validity (Biot number) alone.

    Warns:
        OutsideValidity: for each range of the paper that is left.

    >>> import warnings
    >>> with warnings.catch_warnings():
    ...     warnings.simplefilter("ignore", OutsideValidity)
    ...     [round(film_coefficient(600, h_n, 1000)) for h_n in (0.05, 0.10)]
    [2902, 3091]
    """
    number = ekman(nu_f, rad_per_s(speed_new(rpm, variant)), r_d)
    h = max(floor, nusselt(h_n / d_n, reynolds, number, lambda_s / lambda_f) * lambda_f / d_n)
    biot = None if thickness is None else h * thickness / lambda_s
    at_rest = rpm == 0.0 and floor == 0.0
    for sentence in validity(ekman(nu_f, rad_per_s(rpm), r_d), reynolds, rpm, prandtl, biot, variant):
        warnings.warn(sentence, OutsideValidity, stacklevel=2)
    if at_rest:
        warnings.warn(
            "eq. (1) gives no heat transfer at standstill; set a floor", OutsideValidity, stacklevel=2
        )
    return h


def validity(
    ekman_number: float,
    reynolds: float,
    rpm: float,
    prandtl: float | None = None,
    biot: float | None = None,
    variant: Speeding = "none",
) -> list[str]:
    """A sentence for each range of the paper that is left."""
    speed = SPEED if variant == "none" else SPEED_NEW
    checks = (
        ("Ekman number", ekman_number, EKMAN),
        ("Reynolds number", reynolds, REYNOLDS),
        ("Prandtl number", prandtl, PRANDTL),
        ("Biot number", biot, BIOT),
        ("speed in rpm", rpm, speed),
    )
    return [
        f"{name} {value:.3g} lies outside {low:g} to {high:g}, where eq. (1) is claimed to hold"
        for name, value, (low, high) in checks
        if value is not None and not low <= value <= high
    ]


# Names of the parameters in a model that spells out eqs. (1) to (5); n_limit belongs to eq. (6).
SYMBOLS = ("nu", "r_d", "d_n", "lambda_s", "lambda_f")
HEAT_OF_FLUID = 4.15e6  # J/m3/K, volumetric, emulsion of 5 to 10 %
TABLE_THICKNESS = 0.06  # m, b in figure 5 of the paper; of the Biot number alone


def jet_velocity(flow: float, d_n: float) -> float:
    """Velocity of the fluid V_j [m/s] of a flow [l/min] through a nozzle of diameter d_n [m].

    >>> round(jet_velocity(10.0, 0.010), 3)  # 10 l/min through 10 mm
    2.122
    """
    return flow / 60e3 / (math.pi / 4.0 * d_n**2)


def prandtl_number(nu_f: float, lambda_f: float) -> float:
    """Prandtl number nu/a of the fluid, a = lambda/(rho c).

    >>> round(prandtl_number(1.2e-6, 0.58), 2)
    8.59
    """
    return nu_f * HEAT_OF_FLUID / lambda_f


def biot_number(h: float, thickness: float, lambda_s: float) -> float:
    """Biot number h b/lambda_s of a table of thickness b [m]: above 0.1 it is no body of one temperature.

    >>> biot_number(3000.0, 0.06, 45.0)
    4.0
    """
    return h * thickness / lambda_s


def validity_of_model(model: Model, campaign: Campaign, recordings: Sequence[str]) -> list[str]:
    """One sentence on all ranges that a model with eqs. (1) to (5) leaves on some recordings; none for other
    models.
    """

    def extremes(role: str, unit: str = "") -> tuple[float, float] | None:
        channels = campaign.channels.values()
        used = [
            c.name for c in channels if c.role == role and c.name in model.inputs and unit in ("", c.unit)
        ]
        found = [campaign.recordings[r].values[n] for r in recordings for n in used[:1]]
        moving = np.concatenate([x[x > 0] for x in found] or [np.empty(0)])
        return (float(moving.min()), float(moving.max())) if len(moving) else None

    speeds, heights = extremes("rotation speed"), extremes("nozzle height")
    if not set(SYMBOLS) <= set(model.parameters) or speeds is None or heights is None:
        return []
    p = model.values()
    d_n = p["d_n"] / 1000.0
    flows = extremes("fluid flow", "l/min")
    jets = (
        [jet_velocity(q, d_n) * d_n / p["nu"] for q in flows]
        if flows and "Re" not in p
        else [p.get("Re", 1000.0)]
    )
    variant: Speeding = "printed" if "n_limit" in p else "none"
    sentences: dict[str, str] = {}
    for rpm in speeds:
        for reynolds in jets:
            number = ekman(p["nu"], rad_per_s(rpm), p["r_d"])
            beta, epsilon = heights[1] / p["d_n"], p["lambda_s"] / p["lambda_f"]
            h = nusselt(beta, reynolds, number, epsilon) * p["lambda_f"] / d_n
            pr, bi = prandtl_number(p["nu"], p["lambda_f"]), biot_number(h, TABLE_THICKNESS, p["lambda_s"])
            for sentence in validity(number, reynolds, rpm, pr, bi, variant):
                sentences[sentence.split(" lies ")[0].rsplit(" ", 1)[0]] = sentence.split(",")[0]
    if not sentences:
        return []
    return [
        f"eq. (1) is used where its source does not claim it to hold: {'; '.join(sentences.values())}. "
        "Its area factor is fitted, so only how h varies with speed and height is taken from it"
    ]
