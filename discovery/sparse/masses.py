"""Hidden masses: an output is a sum of first-order responses to inputs, each with a gain and a time constant.

    tau_j ds_j/dt = sum_k g_jk phi_k(u) - s_j          y = sum_j s_j + sum_k g_k phi_k(u) + offset

Eq. (8) generalised: there every input has one mass of its own, in eq. (9) all inputs share one. An input may act
without a mass, or be added up without bound, as charge is.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from discovery.fitting import Fit
from discovery.models import Model, Parameter, State
from discovery.models.dimensions import unit_of
from discovery.models.units import differences
from discovery.sparse.library import Feature
from discovery.terms import Number, Term, parse, text

QUICKER = 10.0  # times below the grid that the time constant of a fit may go


@dataclass(frozen=True)
class Response:
    """A feature with its coefficient; responses of one pole share a hidden mass."""

    feature: Feature
    gain: float
    pole: int


@dataclass(frozen=True)
class Rules:
    """What the model of an output is written with."""

    output: str
    units: Mapping[str, str]  # of channels
    settled: Collection[str]  # drives whose mass begins in balance with them
    bounds: Mapping[str, tuple[float, float]]
    time_constants: tuple[float, float]  # s
    start_sd: float


def mass_model(rules: Rules, offset: float | None, responses: Sequence[Response]) -> Model:
    """The responses written as a model: one hidden state for each time constant."""
    y = rules.output
    unit = rules.units[y]
    parameters: dict[str, Parameter] = {}
    states: dict[str, State] = {}
    terms: list[Term] = []
    direct: list[str] = []
    if offset is not None:
        parameters[f"{y}_0"] = Parameter(offset, unit)
        direct.append(f"{y}_0")
    lagged = [r for r in responses if 0 < r.feature.tau < np.inf]
    number = {pole: k for k, pole in enumerate(dict.fromkeys(r.pole for r in lagged), start=1)}
    for k, r in enumerate(responses, start=1):
        drive, gain = r.feature.drive, f"{y}_gain{k}"
        of = unit_of(parse(drive), rules.units)
        low, high = rules.bounds.get(drive, (-np.inf, np.inf))
        per = unit if of == "1" else f"{unit}/({of})" if set("*/") & set(of) else f"{unit}/{of}"
        driven = text(parse(f"{gain}*({drive})"))
        if r.feature.tau == 0.0:
            direct.append(driven)
        elif np.isinf(r.feature.tau):
            per, state = f"{per}/s", f"{y}_sum{k}"
            states[state] = State(state, unit, None, Number(0.0), rules.start_sd, 1.0)
            terms.append(Term(f"{drive} adds up in {state}", state, parse(driven)))
        else:
            state, tau = f"{y}_{number[r.pole]}", f"{y}_tau{number[r.pole]}"
            if state not in states:
                least, most = rules.time_constants
                parameters[tau] = Parameter(r.feature.tau, "s", least / QUICKER, most)
                states[state] = State(state, unit, None, Number(0.0), rules.start_sd, 1.0)
                terms.append(Term(f"{state} settles", state, parse(f"-{state}/{tau}")))
            if drive in rules.settled:
                start = states[state].start
                begun = driven if start == Number(0.0) else f"{text(start)} + {driven}" if start else driven
                states[state] = replace(states[state], start=parse(begun))
            terms.append(Term(f"{drive} through {state}", state, parse(f"{driven}/{tau}")))
        parameters[gain] = Parameter(r.gain, per, low, high)
    output = parse(" + ".join([*states, *direct]) or "0")
    return Model(y, parameters, states, tuple(terms), {y: output}, "s")


def responses_of(fit: Fit, responses: Sequence[Response]) -> tuple[float | None, list[Response], list[float]]:
    """Offset, responses with the fitted gains and time constants, and how many standard errors each gain is from 0."""
    y = fit.problem.outputs[0]
    values = fit.model.parameters
    errors = {u.name: e for u, e in zip(fit.problem.unknowns, fit.standard_errors, strict=True) if not u.is_nuisance}
    lagged = [r for r in responses if 0 < r.feature.tau < np.inf]
    number = {pole: k for k, pole in enumerate(dict.fromkeys(r.pole for r in lagged), start=1)}
    found, strength = [], []
    for k, r in enumerate(responses, start=1):
        gain = f"{y}_gain{k}"
        tau = values[f"{y}_tau{number[r.pole]}"].value if r in lagged else r.feature.tau
        found.append(Response(replace(r.feature, tau=tau), values[gain].value, r.pole))
        strength.append(abs(values[gain].value) / max(errors[gain], 1e-300))
    offset = values[f"{y}_0"].value if f"{y}_0" in values else None
    return offset, found, strength
