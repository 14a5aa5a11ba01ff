"""Equation (8): every influence has its own first-order equation, and the error is their sum.

    d/dt y_tot = sum_i dy_i/dt,   dy_i/dt = p_(3i-2) y_i + p_(3i-1) (u_i + p_(3i))

(Mayr et al., "Compensation of cutting fluid influences on five axis machine tools", eqs. (7) and (8)). The
text there names y_2 the fluid and y_3 the losses, but u_2 the cooling power and u_3 the fluid temperature;
here input i is influence i.

In a joint fit only the steady sum of the zero balances p3, p6, p9 is determined. So only the first is free
there; the others stay where their influence vanishes: at the reference temperature of 20 degC (ISO 1), at
zero for everything else. Fitted one influence at a time, from recordings of their own (`fitting.sequential`),
each has its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from discovery.models.model import TIME_UNITS, Model, Parameter, State
from discovery.models.reduced import POLE_MAX, TIME_UNIT, rate_unit
from discovery.recordings import Channel
from discovery.terms import Apply, Expression, Name, Number, Term

REFERENCE = 20.0  # degC, ISO 1


def superposition(inputs: Sequence[str], outputs: Sequence[str], channels: Mapping[str, Channel]) -> Model:
    """Equation (8) for every output; parameters p1_E, p2_E, p3_E of the first input, p4_E ... of the second.

    Args:
        inputs: channels u1, u2, ..., one influence each.
        outputs: errors.
        channels: of the campaign, for the units.
    """
    parameters: dict[str, Parameter] = {}
    states: dict[str, State] = {}
    terms: list[Term] = []
    sums: dict[str, Expression] = {}
    for output in outputs:
        unit = channels[output].unit
        for k, channel in enumerate(inputs):
            state = influence(output, channel)
            pole, gain, zero = (f"p{3 * k + j}_{output}" for j in (1, 2, 3))
            of = channels[channel].unit
            parameters[pole] = Parameter(-0.5, f"1/{TIME_UNIT}", max=POLE_MAX)
            parameters[gain] = Parameter(0.0, rate_unit(unit, of))
            parameters[zero] = Parameter(-REFERENCE if of == "degC" else 0.0, of, fixed=k > 0)
            # The first influence absorbs the first reading. Free starts would be free offsets of
            # whichever influence turns out slow, found in the fit and missing in every prediction.
            start = Name(output) if k == 0 else Number(0.0)
            states[state] = State(state, unit, None, start, 0.0, 1.0 / TIME_UNITS[TIME_UNIT])
            terms.append(Term(f"{state} itself", state, Apply("*", (Name(pole), Name(state)))))
            shifted = Apply("+", (Name(channel), Name(zero)))
            terms.append(Term(f"{channel} on {output}", state, Apply("*", (Name(gain), shifted))))
            part = Name(state)
            sums[output] = Apply("+", (sums[output], part)) if output in sums else part
    return Model("superposition, eq. (8)", parameters, states, tuple(terms), sums, TIME_UNIT)


def influence(output: str, channel: str) -> str:
    """Name of the state that is the part of an output which an input causes."""
    return f"{output}_by_{channel}"
