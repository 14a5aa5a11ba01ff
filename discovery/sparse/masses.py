"""Hidden masses: an output is a sum of first-order responses to inputs, each with a gain and a time constant.

    tau_j ds_j/dt = sum_k g_jk phi_k(u) - s_j          y = sum_j s_j + sum_k g_k phi_k(u) + offset

This generalises eq. (8), where every input has its own mass, and eq. (9), where all inputs share one. An
input may also act without a mass, or be integrated without limit, such as a current (charge).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory
from discovery.fitting import Fit, Noise, fit_model
from discovery.models import Model, Parameter, State
from discovery.models.dimensions import unit_of
from discovery.recordings import Campaign
from discovery.sparse.library import STILL, Feature
from discovery.terms import Number, Term, parse, text

Array = NDArray[np.float64]

_AT = 1e-3  # share of a bound that counts as at it
_DOUBT = 0.1  # share of the variance of an input at the start that says nothing of how warm masses are
_OWN = 1e-4  # share of the variance of a start that the starts of other masses never explain
RESTS = (1e-3, 1.0)  # how fast a mass may forget without a flow, of its rate with it
QUICKER, SLOWER = 10.0, 3.0  # times beyond the grid that the time constant of a fit may go


@dataclass(frozen=True)
class Response:
    """A feature with its coefficient; responses of one pole share a hidden mass."""

    feature: Feature
    gain: float
    pole: int
    chosen: Feature  # as the search chose it; the fit moves its time constant
    spread: float = np.inf  # of the gain in its prior

    @property
    def lagged(self) -> bool:
        """Whether it has a time constant."""
        return 0 < self.feature.tau < np.inf


@dataclass(frozen=True)
class Rules:
    """What the model of an output is written with."""

    output: str
    units: Mapping[str, str]  # of channels
    settled: Collection[str]  # drives whose mass begins in balance with them
    lasting: Mapping[str, float]  # s, for which another drive has been about what it is at the start
    bounds: Mapping[str, tuple[float, float]]
    time_constants: tuple[float, float]  # s, of the grid of the search
    start_sd: float
    zero_sd: float | None = None  # of the zero that each recording has of its own; None: they have none
    gate: str = ""  # flow without which some masses forget more slowly

    @property
    def limits(self) -> tuple[float, float]:
        """Least and largest time constant of a fit [s]."""
        return self.time_constants[0] / QUICKER, self.time_constants[1] * SLOWER


def mass_model(rules: Rules, responses: Sequence[Response]) -> Model:
    """The responses written as a model: a hidden state for each time constant; the drive 1 is the offset."""
    y, unit = rules.output, rules.units[rules.output]
    parameters: dict[str, Parameter] = {}
    states: dict[str, State] = {}
    terms: list[Term] = []
    direct: list[str] = []
    number = _numbers(responses)
    for k, r in enumerate(responses):
        drive, gain = r.feature.drive, _gain(y, k, r)
        of = unit_of(parse(drive), rules.units)
        low, high = rules.bounds.get(drive, (-np.inf, np.inf))
        per = unit if of == "1" else f"{unit}/({of})" if set("*/") & set(of) else f"{unit}/{of}"
        driven = gain if drive == "1" else text(parse(f"{gain}*({drive})"))
        if r.feature.tau == 0.0:
            direct.append(driven)
        elif not r.lagged:
            per, state = f"{per}/s", f"{y}_sum{k}"
            states[state] = State(state, unit, None, Number(0.0), rules.start_sd, 1.0)
            terms.append(Term(f"{drive} adds up in {state}", state, parse(driven)))
        else:
            state, tau = f"{y}_{number[r.pole]}", f"{y}_tau{number[r.pole]}"
            rest = f"{y}_rest{number[r.pole]}" if r.feature.rest < 1.0 else ""
            rate = f"({rest} + (1 - {rest})*({rules.gate}))" if rest else "1"
            if state not in states:
                parameters[tau] = Parameter(r.feature.tau, "s", *rules.limits)
                states[state] = State(
                    state, unit, None, Number(0.0), _start_sd(rules, responses, r.pole), 1.0
                )
                if rest:
                    parameters[rest] = Parameter(r.feature.rest, "1", *RESTS, prior=(STILL, STILL))
                terms.append(Term(f"{state} settles", state, parse(text(parse(f"-{state}*{rate}/{tau}")))))
            if share := _share(rules, drive, tau):
                start = states[state].start
                begun = text(parse(f"{driven}*{share}"))
                begun = begun if start in (None, Number(0.0)) else f"{text(start)} + {begun}"
                states[state] = replace(states[state], start=parse(begun))
            terms.append(Term(f"{drive} through {state}", state, parse(f"{driven}/{tau}")))
        prior = (0.0, r.spread) if 0.0 < r.spread < np.inf else None  # exact readings need none
        parameters[gain] = Parameter(r.gain, per, low, high, prior=prior)
    if rules.zero_sd is not None and responses:
        states[f"{y}_zero"] = State(f"{y}_zero", unit, None, Number(0.0), rules.zero_sd, 1.0)
    output = parse(" + ".join([*states, *direct]) or "0")
    return Model(y, parameters, states, tuple(terms), {y: output}, "s")


def _share(rules: Rules, drive: str, tau: str) -> str:
    """The share of its balance with a drive that a mass has at the start, or "": all of it where the mass
    settles sooner than the drive changes.

    Of a drive u whose autocorrelation falls off as exp(-t/T), E[s | u] = gain u T/(T + tau).
    """
    if drive not in rules.lasting:
        return "1" if drive in rules.settled else ""
    lasts = f"{rules.lasting[drive]:.4g}"
    return f"({lasts}/({lasts} + {tau}))"


def _start_sd(rules: Rules, responses: Sequence[Response], pole: int) -> float:
    """Spread of the start of a mass: a mass that settles sooner than its drives change is near its balance.

    A drive that lasts T explains T/(T + tau) of the variance; the drive that explains least counts.
    """
    left = []
    for r in (r for r in responses if r.lagged and r.pole == pole):
        lasts = rules.lasting.get(r.feature.drive, 0.0)
        left.append(r.feature.tau / (lasts + r.feature.tau))
    return rules.start_sd * float(np.sqrt(max(left)))


def _gain(output: str, k: int, response: Response) -> str:
    return f"{output}_0" if response.feature.drive == "1" else f"{output}_gain{k}"


def _numbers(responses: Sequence[Response]) -> dict[int, int]:
    """Number of the hidden mass of each pole."""
    return {pole: k for k, pole in enumerate(dict.fromkeys(r.pole for r in responses if r.lagged), start=1)}


def responses_of(fit: Fit, responses: Sequence[Response]) -> tuple[list[Response], list[float]]:
    """Responses with the fitted gains and time constants, and by how many standard errors each gain is not
    0.
    """
    y, values = fit.problem.outputs[0], fit.model.parameters
    unknowns = zip(fit.problem.unknowns, fit.standard_errors, strict=True)
    errors = {u.name: e for u, e in unknowns if not u.is_nuisance}
    number = _numbers(responses)
    found, strength = [], []
    for k, r in enumerate(responses):
        gain = _gain(y, k, r)
        tau = values[f"{y}_tau{number[r.pole]}"].value if r.lagged else r.feature.tau
        rest = values[f"{y}_rest{number[r.pole]}"].value if r.feature.rest < 1.0 else 1.0
        rest = 1.0 if rest > RESTS[1] * (1 - _AT) else rest
        found.append(replace(r, feature=replace(r.feature, tau=tau, rest=rest), gain=values[gain].value))
        strength.append(abs(values[gain].value) / max(errors[gain], 1e-300))
    return found, strength


def surprise(fit: Fit) -> float:
    """-log of how likely the readings are under where the masses of a fit are said to begin, up to a constant
    (Laplace): a wide prior of starts costs what it leaves open.
    """
    starts = [k for k, u in enumerate(fit.problem.unknowns) if u.is_start and u.prior]
    spreads = [np.log(u.prior[1]) for u in fit.problem.unknowns if u.is_start and u.prior]
    found = float(np.linalg.slogdet(fit.covariance[np.ix_(starts, starts)])[1]) if starts else 0.0
    return fit.cost / fit.together + float(np.sum(spreads)) - 0.5 * found


def slowest(rules: Rules, response: Response) -> bool:
    """Whether a time constant is at the long limit: the recordings do not determine it."""
    return response.lagged and response.feature.tau >= rules.limits[1] * (1 - _AT)


def within(rules: Rules, responses: Sequence[Response]) -> list[Response]:
    """The responses whose time constant is not at a limit: at the short end there is no mass."""
    least = rules.limits[0] * (1 + _AT)
    found = []
    for r in responses:
        if not r.lagged or (r.feature.tau > least and not slowest(rules, r)):
            found.append(r)
        elif r.feature.tau <= least:
            direct = replace(r.feature, tau=0.0, rest=1.0)
            if all(direct != other.feature for other in responses):
                found.append(replace(r, feature=direct))
    return found


def fit_masses(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    noise: Noise | None = None,
    max_rounds: int = 60,
) -> Fit:
    """Fit a model of masses alone; the model then says where masses start in another recording.

    These starts belong to the numbers of that fit: a slow mass may start warmer, and the offset make up for
    it, without a change in the recordings that were fitted.
    """
    fit = fit_model(model, campaign, recordings, outputs, noise=noise, max_rounds=max_rounds)
    begun = replace(fit.problem.model, states=starts_of(fit).states)
    return replace(fit, problem=replace(fit.problem, model=begun))


def starts_of(fit: Fit) -> Model:
    """The fitted model with the start values of its masses in another recording: means that follow the inputs
    of that moment, spreads, and how the start of each follows those of the masses above it.

    A recording may be cut out of a longer one; then the masses start anywhere in their range. That counts as
    one start among those that were found: a few cold starts do not prove that all are cold. Masses are warm
    together, so the first reading says much of each; and what is recorded at that moment, as the power of a
    cooler, says how warm they are.
    """
    order = list(fit.problem.model.states)
    if not order:
        return fit.model
    inputs = [name for name in fit.problem.model.inputs if all(name in g.nodes for g in _grids(fit))]
    mean, covariance = _population(fit, inputs)
    covariance, along = conditioned(covariance, mean[: len(inputs)])
    states = dict(fit.model.states)
    for i, name in enumerate(order):
        above = covariance[:i, :i] + _OWN * np.diag(np.diag(covariance)[:i])
        follows = np.linalg.solve(above, covariance[:i, i])
        rest = max(covariance[i, i] - follows @ covariance[:i, i], _OWN * covariance[i, i])
        parts = [
            f"{by:.6g}*({u} - {usual:.6g})"
            for by, u, usual in zip(along[:, i], inputs, mean, strict=False)
            if by != 0.0
        ]
        states[name] = replace(
            states[name],
            start=parse(" + ".join([f"{mean[len(inputs) + i]:.6g}", *parts])),
            start_sd=float(np.sqrt(rest)),
            start_with=dict(zip(order[:i], follows.tolist(), strict=True)),
        )
    return replace(fit.model, states=states)


def conditioned(covariance: Array, usual: Array) -> tuple[Array, Array]:
    """The last n of normal numbers given the first m, of which `usual` (m,) is the mean: covariance (n, n),
    and how their mean follows each of these (m, n).

    Few recordings say how inputs and starts go together: where inputs hardly differ, starts follow little.
    """
    count = len(usual)
    first, rest = covariance[:count, :count], covariance[:count, count:]
    scale = np.sqrt(np.diag(first))
    moving = scale > 1e-9 * np.abs(usual)  # else it is constant but for rounding
    along = np.zeros(rest.shape)
    alike = first[np.ix_(moving, moving)] / np.outer(scale[moving], scale[moving])
    along[moving] = (
        np.linalg.solve(alike + _DOUBT * np.eye(len(alike)), rest[moving] / scale[moving, None])
        / scale[moving, None]
    )
    left = covariance[count:, count:] - along.T @ rest - rest.T @ along + along.T @ first @ along
    return left, along


def _grids(fit: Fit) -> list[Grid]:
    return [run.system.grid for run in fit.trajectories]


def _population(fit: Fit, inputs: Sequence[str]) -> tuple[Array, Array]:
    """Mean (m + n,) and covariance of the inputs (m) and the masses (n) where another recording starts.

    Known are the starts that the fit found, each with its covariance; a recording that is cut out of a longer
    one starts anywhere in the range of the masses.
    """
    m, n = len(inputs), len(fit.problem.model.states)
    both = [
        np.column_stack([*(run.system.grid.nodes[u] for u in inputs), run.x])[run.system.grid.read]
        for run in fit.trajectories
    ]
    every = np.concatenate(both)
    anywhere = every.mean(axis=0), np.cov(every.T, bias=True).reshape(m + n, -1)
    seen = []
    for rows, run in zip(both, fit.trajectories, strict=True):
        covariance = np.zeros((m + n, m + n))
        covariance[m:, m:] = _start_covariance(fit, run)
        seen.append((np.r_[rows[0, :m], run.x[0]], covariance))
    return next_start(seen, anywhere)


def next_start(seen: Sequence[tuple[Array, Array]], unseen: tuple[Array, Array]) -> tuple[Array, Array]:
    """Mean (n,) and covariance (n, n) of the start values in another recording.

    A mixture: each recording that was seen has weight 1, and whatever was not seen has weight 1/count, so it
    counts less the more recordings have shown how they begin.

    Args:
        seen: mean and covariance of the start of each recording, at least one.
        unseen: mean and covariance of a start unlike all of them.
    """
    means, covariances = (np.array(both) for both in zip(unseen, *seen, strict=True))
    weights = np.r_[1 / len(seen), np.ones(len(seen))]
    weights = weights / weights.sum()
    mean = weights @ means
    apart = means - mean
    return mean, (weights * apart.T) @ apart + np.tensordot(weights, covariances, 1)


def _start_covariance(fit: Fit, trajectory: Trajectory) -> Array:
    """Covariance (n, n) of the starts that the fit found in a recording."""
    order, recording = list(fit.problem.model.states), trajectory.system.grid.recording
    place = {u.name: k for k, u in enumerate(fit.problem.unknowns) if u.is_start and u.recording == recording}
    free = [i for i, name in enumerate(order) if name in place]
    rows = [place[order[i]] for i in free]
    found = np.zeros((len(order), len(order)))
    found[np.ix_(free, free)] = fit.covariance[np.ix_(rows, rows)]
    return found
