"""What new recordings say of a model at work: nothing, wear, a faulty input sensor, or something else.

All are hypotheses of one comparison. Around the model at work, the residual of new recordings is

    r = J_p dp + J_c dc + J_s ds + noise

with changes dp of parameters, dc of readings of inputs (an offset of a sensor) and ds of start values, all
Gaussian with mean zero. A hypothesis says how wide they are: under `nothing` the parameters are as uncertain
as their fit left them; under `wear` those that can age are wider; and so on. Noise is white and slow sensor
noise and random heat at each body in proportion to the heat flows through it, for a model of a few bodies
errs by some percent of its flows (process noise; whitened by `discovery.fitting.kalman`). The probability
of the residual under each hypothesis then is a Gaussian integral in closed form (marginal likelihood, e.g.
Rasmussen & Williams, Gaussian Processes for Machine Learning, 2006, section 2.3).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.dynamics.sensitivity import sensitivities
from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.knowledge import settle_starts
from discovery.fitting.covariance import Z95
from discovery.fitting.kalman import make_filter
from discovery.fitting.noise import HEAT_TIME, Noise
from discovery.fitting.problem import Problem, make_problem
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.terms import names, parse
from discovery.terms.dual import evaluate

Array = NDArray[np.float64]
Verdict = Literal["nothing", "wear", "input sensor", "something else", "undecided"]

# Chosen on seeds set aside for it and confirmed on others, see benchmarks/runtime.md
PROCESS = 0.03  # of the heat flows through a body: everyday error of a lumped model
STRANGE = 5.0  # times that: something else, in hours ...
FAST_S = 1200.0  # ... or in minutes: a chiller that swings, a joint that slips
WEAR = (0.05, 0.2)  # relative change of a parameter that ages; both widths count half
OTHER = (0.1, 0.4)  # relative change of a parameter that cannot age: something else changed
OFFSET = (0.5, 2.0)  # K, of the sensor of an input
LEAST_ODDS = 2.5  # log of the odds against `nothing`, below which nothing has changed
LEAST_LEAD = 1.0  # log of the odds against each rival, below which it is undecided
WORN = 3.0  # log of how much more often a machine wears that has worn before
RARE = 2.0  # log of how much less often a sensor fails, or something else changes, than a machine wears
MEMORY_S = 24 * 3600.0  # in which what was read counts less and less: wear goes on meanwhile
AGES = ("heat load", "rotation speed", "fluid flow", "cooling power", "coolant temperature")
START_SD = 0.5  # K, um: of states that are known where a recording begins
TEMPERATURES = ("ambient temperature", "fluid temperature", "coolant temperature", "temperature")


@dataclass(frozen=True)
class Comparison:
    """What the recordings say. `odds`: log of the probability of the residual under each hypothesis over that
    under `nothing`. `verdict` and `what`: the best one, and the sensor where it is one. `rms`: residual of
    the model at work in units of that of its fit. `change`: of the parameters that age, under wear, with
    standard
    deviations; `covariance` of all known parameters after it."""

    recordings: tuple[str, ...]
    readings: int
    verdict: Verdict
    what: str
    odds: Mapping[str, float]
    rms: float
    change: Mapping[str, tuple[float, float]]

    def __str__(self) -> str:
        others = ", ".join(f"{name} {value:+.1f}" for name, value in self.odds.items() if name != "nothing")
        what = f" ({self.what})" if self.what else ""
        return (
            f"{', '.join(self.recordings)}: {self.verdict}{what}; {self.readings} readings, "
            f"residual {self.rms:.2f} "
            f"of the fit's; log odds against no change: {others}"
        )


@dataclass(frozen=True)
class _Linear:
    """Whitened residual (N,) and its slopes (N, K) over all recordings, half the log-determinant, and how
    long
    before the end [s] each was read (N,)."""

    r: Array
    j: Array
    logdet: float
    age: Array


def ageing(exported: Exported) -> tuple[str, ...]:
    """Parameters that wear can change: all their terms depend on a load, a speed, a flow or a coolant. What
    conducts and what the air takes does not wear.
    """
    model, roles = exported.model, {i.name: i.role for i in exported.inputs}
    found = []
    for name in exported.document["knowledge"]["parameters"]:
        used = [names(term.expression) for term in model.terms if name in names(term.expression)]
        used += [names(expression) for expression in model.outputs.values() if name in names(expression)]
        if used and all(any(roles.get(other) in AGES for other in one) for one in used):
            found.append(name)
    return tuple(found)


def compare(
    exported: Exported, campaign: Campaign, recordings: Sequence[str], process: float = PROCESS
) -> Comparison:
    """Compare the hypotheses on recordings taken since the last revision.

    Args:
        process: everyday error of the model, as a share of its heat flows.

    Raises:
        UserError: a model without knowledge of its parameters, or no reading of any output.
    """
    known = exported.document["knowledge"]
    parameters = tuple(known["parameters"])
    if not parameters:
        raise UserError(
            f"model '{exported.model.name}' does not say how well its parameters are known; "
            "export it again from its run"
        )
    levels = {n: r for n, r in known["residual"].items() if r is not None}
    outputs = [n for n in levels if any(_read(campaign, r, n) for r in recordings)]
    if not outputs:
        raise UserError(
            f"{campaign.path}: recording '{recordings[0]}' holds no reading of {', '.join(levels)}; "
            "there is nothing to learn from"
        )
    problem = make_problem(exported.model, campaign, recordings, outputs)
    channels = tuple(i.name for i in exported.inputs if i.role in TEMPERATURES)
    settings = ((process, HEAT_TIME), (STRANGE * process, HEAT_TIME), (STRANGE * process, FAST_S))
    usual, strange, fast = _linear(problem, parameters, channels, known, outputs, settings)
    model, ages = exported.model, ageing(exported)
    p = np.array(known["covariance"])
    starts = _start_spreads(problem)
    size = np.array([max(abs(model.parameters[n].value), 1e-12) for n in parameters])
    old = np.array([n in ages for n in parameters])

    def prior(relative: Array | float = 0.0, channel: str = "", offset: float = 0.0) -> Array:
        total = np.zeros((len(p) + len(channels) + len(starts),) * 2)
        total[: len(p), : len(p)] = p + np.diag((relative * size) ** 2)
        for k, name in enumerate(channels):
            total[len(p) + k, len(p) + k] = offset**2 if name == channel else 0.0
        total[-len(starts) :, -len(starts) :] += np.diag(starts**2) if len(starts) else 0.0
        return total

    logs = {"nothing": _log_probability(usual, prior())}
    logs["wear"] = _mean([_log_probability(usual, prior(w * old)) for w in WEAR])
    for name in channels:
        logs[f"sensor of {name}"] = _mean([_log_probability(usual, prior(0.0, name, d)) for d in OFFSET])
    logs["something else"] = _mean(
        [
            *(_log_probability(usual, prior(w * ~old)) for w in OTHER),
            _log_probability(strange, prior()),
            _log_probability(fast, prior()),
        ]
    )
    worn = any("of" in entry for entry in exported.changelog)  # revisions are written for wear alone
    before = {"nothing": 0.0, "wear": WORN * worn}
    odds = {name: value - logs["nothing"] + before.get(name, -RARE) for name, value in logs.items()}
    verdict, what = _verdict(odds)
    rms = _rms(problem, levels, outputs)
    change = _change(usual, prior(WEAR[1] * old), parameters, old)
    count = int(sum(np.isfinite(s.grid.readings).sum() for s in problem.systems))
    return Comparison(tuple(recordings), count, verdict, what, odds, rms, change)


def _read(campaign: Campaign, recording: str, name: str) -> bool:
    values = campaign.recordings[recording].values
    return name in values and bool(np.isfinite(values[name]).any())


def _verdict(odds: Mapping[str, float]) -> tuple[Verdict, str]:
    """The best hypothesis, if it beats `nothing` and its rivals clearly."""
    best = max(odds, key=lambda name: odds[name])
    if odds[best] < LEAST_ODDS:
        return "nothing", ""
    rivals = [value for name, value in odds.items() if name != best]
    if odds[best] - max(rivals) < LEAST_LEAD:
        second = max((name for name in odds if name != best), key=lambda name: odds[name])
        return "undecided", f"{best} or {second}"
    if best.startswith("sensor of "):
        return "input sensor", best.removeprefix("sensor of ")
    return ("wear", "") if best == "wear" else ("something else", "")


def _linear(
    problem: Problem,
    parameters: tuple[str, ...],
    channels: tuple[str, ...],
    known: Mapping[str, Any],
    outputs: Sequence[str],
    settings: Sequence[tuple[float, float]],
) -> list[_Linear]:
    """The linearised residual over all recordings under each setting of the process noise (share, time
    [s]).
    """
    nuisance = [u for u in problem.unknowns if u.is_start]
    shared = len(parameters) + len(channels)
    blocks: list[list[tuple[Array, Array, float]]] = [[] for _ in settings]
    ages, after = [], sum(float(system.grid.time[-1]) for system in problem.systems)
    for system in problem.systems:
        trajectory = problem.run(system, problem.start)
        part = make_filter(trajectory)
        places = [k for k, u in enumerate(nuisance) if u.recording == system.grid.recording]
        dy = sensitivities(trajectory, [*parameters, *channels], [nuisance[k].name for k in places])
        data = np.concatenate([problem.residual(trajectory)[:, :, None], dy], axis=2)
        flows = heat_flows(trajectory)
        for found, (share, time) in zip(blocks, settings, strict=True):
            white, log = part.whitened(_noise(flows, known, outputs, share, time), data)
            own = np.zeros((len(white), shared + len(nuisance)))
            own[:, :shared] = white[:, 1 : 1 + shared]
            own[:, [shared + k for k in places]] = white[:, 1 + shared :]
            found.append((white[:, 0], own, float(np.sum(log))))
        rows = np.broadcast_to(system.grid.time[system.grid.read][:, None], system.grid.measured.shape)
        ages.append(after - rows[system.grid.measured])
        after -= float(system.grid.time[-1])
    age = np.concatenate(ages)
    return [
        _Linear(
            np.concatenate([r for r, _, _ in one]),
            np.concatenate([j for _, j, _ in one]),
            sum(half for _, _, half in one),
            age,
        )
        for one in blocks
    ]


def _noise(
    flows: Mapping[str, float], known: Mapping[str, Any], outputs: Sequence[str], process: float, time: float
) -> Noise:
    """White and slow noise of the readings as the fit left them, heat in proportion to the flows."""
    residual, share = known["residual"], float(known["slow_share"])
    white = tuple(float(residual[n]) * np.sqrt(1.0 - share) for n in outputs)
    slow = tuple(float(residual[n]) * np.sqrt(share) for n in outputs)
    heat = {name: process * value for name, value in flows.items()}
    return Noise(tuple(outputs), white, slow, heat, heat_time=time)


def heat_flows(trajectory: Trajectory) -> dict[str, float]:
    """rms of what flows through each state [W, or its rate], over a trajectory: root of the sum of squares of
    its terms.
    """
    system, env = trajectory.system, trajectory.at_ends()
    squares = dict.fromkeys(system.states, 0.0)
    for term in system.model.terms:
        value = np.broadcast_to(
            np.asarray(evaluate(term.expression, env, memory=system.ends).value, dtype=float),
            (2 * len(system.grid.step),),
        )
        size = float(np.mean(value**2))
        squares[term.into] += size
        if term.source is not None:
            squares[term.source] += size
    return {name: float(np.sqrt(value)) for name, value in squares.items()}


def _start_spreads(problem: Problem) -> Array:
    return np.array([u.prior[1] if u.prior else 1.0 for u in problem.unknowns if u.is_start])


def _log_probability(linear: _Linear, prior: Array) -> float:
    """log N(r; 0, I + J prior J^T), without what all hypotheses share."""
    root = _root(prior)
    a = linear.j @ root
    normal = a.T @ a + np.eye(root.shape[1])
    pull = a.T @ linear.r
    factor = np.linalg.cholesky(normal)
    solved = np.linalg.solve(factor, pull)
    return float(
        -0.5 * (linear.r @ linear.r - solved @ solved) - np.log(np.diag(factor)).sum() - linear.logdet
    )


def _root(covariance: Array) -> Array:
    """A square root of a covariance, without its empty directions."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    keep = values > 1e-14 * max(values.max(), 1e-300)
    return np.asarray(vectors[:, keep] * np.sqrt(values[keep]))


def _mean(logs: Sequence[float]) -> float:
    """Log of the mean of probabilities."""
    top = max(logs)
    return float(top + np.log(np.mean(np.exp(np.array(logs) - top))))


def _change(
    linear: _Linear, wide: Array, parameters: Sequence[str], old: NDArray[np.bool_]
) -> dict[str, tuple[float, float]]:
    """Change of each parameter that ages where all others do not change, and its standard deviation where
    they do not. Wear goes on while it is measured, so the last readings count most.
    """
    fade = np.exp(-linear.age / MEMORY_S)
    j, r = linear.j * fade[:, None], linear.r * fade
    count = len(parameters)
    free = np.concatenate([old, np.diag(wide)[count:] > 0.0])
    index = np.flatnonzero(free)
    root, whole = _root(wide[np.ix_(index, index)]), _root(wide)
    a, b = j[:, index] @ root, j @ whole
    shift = root @ np.linalg.solve(a.T @ a + np.eye(root.shape[1]), a.T @ r)
    spread = whole @ np.linalg.solve(b.T @ b + np.eye(whole.shape[1]), whole.T)
    return {
        parameters[k]: (float(value), float(np.sqrt(max(spread[k, k], 0.0))))
        for k, value in zip(index.tolist(), shift.tolist(), strict=True)
        if k < count
    }


def _rms(problem: Problem, levels: Mapping[str, float], outputs: Sequence[str]) -> float:
    """Residual of the model at work, start values settled, in units of that of its fit."""
    scale = np.array([levels[n] for n in outputs])
    found = np.concatenate([(r / scale)[np.isfinite(r)] for r in settle_starts(problem)[0]])
    return float(np.sqrt(np.mean(found**2)))


def begun(exported: Exported, states: Mapping[str, float]) -> Exported:
    """The model as it starts from states that are known: those it had where the recording begins."""
    model = exported.model
    started = {
        name: replace(state, start=parse(repr(float(states[name]))), start_sd=START_SD)
        for name, state in model.states.items()
    }
    return replace(exported, model=replace(model, states=started))


def model_with(model: Model, change: Mapping[str, tuple[float, float]]) -> Model:
    """The model with its parameters moved, within their bounds, with 95 % intervals."""
    parameters = dict(model.parameters)
    for name, (by, sd) in change.items():
        p = parameters[name]
        value = float(np.clip(p.value + by, p.min, p.max))
        low, high = max(value - Z95 * sd, p.min), min(value + Z95 * sd, p.max)
        parameters[name] = replace(p, value=value, low=low, high=high)
    return replace(model, parameters=parameters)
