"""The thermobalance: five thermally uniform bodies of the rotary table, built from a table of numbers.

    C_i T_i' = sum_j G_ij (T_j - T_i) + hA_i (T_env - T_i) + loss_i P_drive + cool_i (T_cool - T_i)
               + pump hF_i h(n, h_nozzle) (T_fluid - T_i)

Table, C-Body 1 and 2, B-Body 1 and 2 as in figure 4 of Mayr et al., "Compensation of cutting fluid influences
on five axis machine tools"; the fluid floods Table and C-Body 1 with the film coefficient h of eqs. (1) to
(5), spelt out in the expression (see `convection` for what they mean and where they hold). Drive losses and
internal cooling enter the C axis. Capacities and levers come from drawings; the rest is a rough start that a
fit replaces. Of eq. (1) only the product of area and coefficient can be calibrated: hF is an effective area.
"""

from __future__ import annotations

from dataclasses import dataclass

from discovery.models.convection import Speeding
from discovery.models.model import Model, Parameter, State
from discovery.terms import Term, parse


@dataclass(frozen=True)
class Body:
    """Capacity [J/K], and start values of what acts on it; None: it does not."""

    capacity: float
    air: float  # W/K
    loss: float | None = None  # share of drive power
    cooling: float | None = None  # W/K, internal
    wet: float | None = None  # m2


BODIES = {
    "table": Body(45e3, 3.0, loss=0.1, wet=0.05),
    "c_body_1": Body(62e3, 2.0, loss=0.4, cooling=20.0, wet=0.03),
    "c_body_2": Body(82e3, 2.0, loss=0.5, cooling=80.0),
    "b_body_1": Body(165e3, 5.0),
    "b_body_2": Body(240e3, 7.0),
}
# into, from: start value [W/K]
LINKS = {
    ("table", "c_body_1"): 20.0,
    ("c_body_1", "c_body_2"): 20.0,
    ("c_body_1", "b_body_1"): 20.0,
    ("c_body_2", "b_body_1"): 15.0,
    ("b_body_1", "b_body_2"): 15.0,
}
# error: expansion (10.8 cast iron, 11.5 steel, um/m/K) x lever [m] of each body
LEVERS = {
    "E_Y0C": "-1.6740*(c_body_1 - T_ref) -0.8640*(c_body_2 - T_ref)"
    " -5.1840*(b_body_1 - T_ref) -2.7216*(b_body_2 - T_ref)",
    "E_Z0T": "0.7360*(table - T_ref) +1.7365*(c_body_1 - T_ref)"
    " +2.0700*(c_body_2 - T_ref) +1.7135*(b_body_1 - T_ref)",
    "E_R0T": "1.9205*(table - T_ref)",
    "E_A0C": "5.8300*(c_body_1 - T_ref) +2.8700*(c_body_2 - T_ref)"
    " -6.2900*(b_body_1 - T_ref) -2.4100*(b_body_2 - T_ref)",
}
SPEED_NEW = {  # eq. (6), in rpm
    "none": "max(speed, n_min)",
    "printed": "where(speed > 750, 4*(max(speed, 750) - 750)**5 + 750, max(speed, n_min))",
    "1.5": "where(speed > 750, 4*(max(speed, 750) - 750)**1.5 + 750, max(speed, n_min))",
}


def film(variant: Speeding = "none") -> str:
    """Expression of eqs. (1) to (6) in W/m2K: h_nozzle and d_n in mm, speed in rpm (0.10472 rad/s each),
    h_still at rest.
    """
    ekman = f"(nu/(4*0.10472*{SPEED_NEW[variant]}*r_d**2))"
    nusselt = f"(h_nozzle/d_n)**0.0909*Re**0.75*{ekman}**(-0.1111)*(lambda_s/lambda_f)**(-0.9)"
    moving = f"1.97619*1000*lambda_f/d_n*{nusselt}"
    return f"where(speed > n_min, {moving}, h_still)"


def thermobalance(*, fluid: bool = True, variant: Speeding = "none") -> Model:
    """The five bodies, and the bed that follows the room.

    Inputs: T_env, T_cool, P_drive, and with `fluid` T_fluid, pump, speed, h_nozzle.

    Args:
        fluid: whether cutting fluid wets Table and C-Body 1.
        variant: of eq. (6); doubtful as printed, and hardly seen in the errors.
    """
    parameters = {f"G_{_short(a)}_{_short(b)}": _positive(G, "W/K") for (a, b), G in LINKS.items()}
    parameters["G_b2_bed"] = _positive(8.0, "W/K")
    terms = [
        Term(f"conduction {b} to {a}", a, parse(f"G_{_short(a)}_{_short(b)}*({b} - {a})"), b)
        for a, b in LINKS
    ]
    terms.append(Term("conduction bed to b_body_2", "b_body_2", parse("G_b2_bed*(bed - b_body_2)")))
    terms.append(Term("bed follows the room", "bed", parse("(T_env - bed)/tau_bed")))
    for name, body in BODIES.items():
        parameters[f"hA_{_short(name)}"] = _positive(body.air, "W/K")
        terms.append(Term(f"air around {name}", name, parse(f"hA_{_short(name)}*(T_env - {name})")))
    for name, body in BODIES.items():
        if body.loss is not None:
            parameters[f"loss_{_short(name)}"] = Parameter(body.loss, "1", 0.0, 1.0)
            terms.append(Term(f"drive loss into {name}", name, parse(f"loss_{_short(name)}*P_drive")))
    for name, body in BODIES.items():
        if body.cooling is not None:
            parameters[f"cool_{_short(name)}"] = _positive(body.cooling, "W/K")
            flow = f"cool_{_short(name)}*(T_cool - {name})"
            terms.append(Term(f"internal cooling of {name}", name, parse(flow)))
    parameters["tau_bed"] = Parameter(90e3, "s", 20e3, 400e3)
    for name, body in BODIES.items():
        if fluid and body.wet is not None:
            parameters[f"hF_{_short(name)}"] = _positive(body.wet, "m**2")
            flow = f"hF_{_short(name)}*pump*{film(variant)}*(T_fluid - {name})"
            terms.append(Term(f"cutting fluid on {name}", name, parse(flow)))
    if fluid:
        parameters |= _fluid_parameters()
    parameters["T_ref"] = Parameter(22.0, "degC", fixed=True)
    states = {
        name: State(name, "degC", body.capacity, parse("T_env"), scale=1.0 / body.capacity)
        for name, body in BODIES.items()
    }
    states["bed"] = State("bed", "degC", None, parse("T_env"), scale=1.0)
    outputs = {error: parse(levers) for error, levers in LEVERS.items()}
    title = "thermobalance, five bodies" if fluid else "dry thermobalance, five bodies"
    return Model(title, parameters, states, tuple(terms), outputs)


def _fluid_parameters() -> dict[str, Parameter]:
    def given(value: float, unit: str) -> Parameter:
        return Parameter(value, unit, fixed=True)

    return {
        "h_still": Parameter(400.0, "W/m**2/K", 0.0, 3000.0),
        "d_n": given(10.0, "mm"),
        "r_d": given(0.25, "m"),
        "Re": given(1000.0, "1"),
        "nu": given(1.2e-6, "m**2/s"),
        "lambda_f": given(0.58, "W/m/K"),
        "lambda_s": given(45.0, "W/m/K"),
        "n_min": given(1.0, "rpm"),
    }


def _positive(start: float, unit: str) -> Parameter:
    return Parameter(start, unit, 0.0)


def _short(body: str) -> str:
    return body.replace("_body_", "")
