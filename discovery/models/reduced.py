"""Equation (9): one first-order equation for each error, all influences identified together from one cycle.

    dy/dt = p1 y + p2 u1 + p3 u2 + p4 u3 + p5

(Mayr et al., "Compensation of cutting fluid influences on five axis machine tools", eq. (9)): p1 weighs the
error itself, p2 ... weigh the inputs, the last one balances the zero. Equation (7) is the case of one input:
p2 (u + p3) = p2 u + p2 p3.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from discovery.models.model import TIME_UNITS, Model, Parameter, State
from discovery.recordings import Channel
from discovery.terms import Apply, Name, Term

TIME_UNIT = "h"  # rates per hour: a machine's poles are then between 0.1 and 10
POLE_MAX = -0.01  # 1/h: slower than 100 h is a drift that no recording separates from an offset


def reduced(inputs: Sequence[str], outputs: Sequence[str], channels: Mapping[str, Channel]) -> Model:
    """Equation (9) for every output; parameters p1_E, p2_E, ... in the order of the inputs, then the zero
    balance.

    Start values are generic (two hours, no influence); `fitting.warm_start` finds good ones from fit
    recordings.

    Args:
        inputs: channels u1, u2, ...
        outputs: errors; each becomes a state that starts at its first reading.
        channels: of the campaign, for the units.
    """
    parameters: dict[str, Parameter] = {}
    states: dict[str, State] = {}
    terms: list[Term] = []
    for output in outputs:
        unit = channels[output].unit
        states[output] = State(output, unit, scale=1.0 / TIME_UNITS[TIME_UNIT])
        pole = f"p1_{output}"
        parameters[pole] = Parameter(-0.5, f"1/{TIME_UNIT}", max=POLE_MAX)
        terms.append(Term(f"{output} itself", output, Apply("*", (Name(pole), Name(output)))))
        for k, channel in enumerate(inputs, start=2):
            gain = f"p{k}_{output}"
            parameters[gain] = Parameter(0.0, rate_unit(unit, channels[channel].unit))
            terms.append(Term(f"{channel} on {output}", output, Apply("*", (Name(gain), Name(channel)))))
        zero = f"p{len(inputs) + 2}_{output}"
        parameters[zero] = Parameter(0.0, rate_unit(unit))
        terms.append(Term(f"zero balance of {output}", output, Name(zero)))
    return Model("reduced, eq. (9)", parameters, states, tuple(terms), {}, TIME_UNIT)


def rate_unit(of: str, per: str = "1", power: int = 1) -> str:
    """Unit of a rate of `of` per hour and per unit of an input; a difference of degC counts in K.

    >>> rate_unit("um", "degC"), rate_unit("um/m", "W"), rate_unit("um")
    ('um/K/h', 'um/m/W/h', 'um/h')
    """
    return f"{per_unit(of, '1' if power == 0 else per)}/{TIME_UNIT}"


def per_unit(of: str, per: str) -> str:
    """Unit of a gain: `of` per unit of an input.

    >>> per_unit("um", "degC"), per_unit("um", "1"), per_unit("V", "m/s")
    ('um/K', 'um', 'V/(m/s)')
    """
    names = {"degC": "K", "degF": "delta_degF"}
    per = names.get(per, per)
    divided = "" if per == "1" else f"/({per})" if set("/* ") & set(per) else f"/{per}"
    return f"{names.get(of, of)}{divided}"
