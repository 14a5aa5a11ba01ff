"""Output-error fit: the model runs freely, and its outputs are compared with the readings at their times."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory
from discovery.errors import RunsAwayError
from discovery.fitting.begin import another_minimum, first_noise, first_spreads, gains_first, is_settled
from discovery.fitting.covariance import covariance_of, with_intervals
from discovery.fitting.kalman import innovations
from discovery.fitting.noise import Noise, readings_as_one, resolution, white_noise
from discovery.fitting.problem import FORMER, Prior, Problem, make_problem
from discovery.fitting.resolution import resolved
from discovery.fitting.solve import Loss, Solution, free_runs, solve
from discovery.models import Model, State
from discovery.recordings import Campaign
from discovery.threads import one_thread

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_ROUNDS = 3  # of a fit that also finds how much a prior counts
_MOST = 20  # ... or a reading noise that is not stated: it falls from what the start values leave
_ROUGH = 15  # of Levenberg-Marquardt in a round between the first and the last


@dataclass(frozen=True)
class Fit:
    """A fitted model with its residuals and the covariance of its parameters."""

    problem: Problem
    theta: Array  # (U,)
    covariance: Array  # (U, U)
    noise: Noise
    trajectories: tuple[Trajectory, ...]
    cost: float  # half the sum of squared whitened residuals and priors
    unidentified: tuple[str, ...]  # a sentence for each reason why recordings do not determine parameters
    seconds: float
    together: float = 1.0  # readings that count as one against what is known of inputs with a spread
    ended_early: bool = False  # it would not have come near its goal

    @property
    def model(self) -> Model:
        """The model with the values found and their 95 % intervals."""
        return with_intervals(self.problem, self.theta, self.standard_errors)

    @property
    def standard_errors(self) -> Array:
        """(U,) standard errors."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def residuals(self) -> dict[str, Array]:
        """Readings minus model by recording, (R, Y)."""
        return {t.system.grid.recording: self.problem.residual(t) for t in self.trajectories}

    @property
    def offsets(self) -> dict[str, dict[str, tuple[float, float]]]:
        """Of each channel known only within a spread, by recording: estimated offset and standard error."""
        found: dict[str, dict[str, tuple[float, float]]] = {}
        for u, value, error in zip(self.problem.unknowns, self.theta, self.standard_errors, strict=True):
            if u.is_offset and u.recording is not None:
                found.setdefault(u.name, {})[u.recording] = (float(value), float(error))
        return found

    def offset_in(self, recording: str) -> dict[str, float]:
        """Of each channel known only within a spread: its estimated offset in a recording of the fit."""
        return {name: found[recording][0] for name, found in self.offsets.items() if recording in found}

    @property
    def zeros(self) -> dict[str, tuple[float, float]]:
        """Of each output with a zero of its own in each recording, and each input known only within a spread:
        mean and spread of its offset in another one.

        A mixture: recordings of the fit count once each, the spread that they show, or that is stated, as one
        part of their number.
        """
        found = {}
        for name in self.offsets:
            shown = max(
                u.prior[1] for u in self.problem.unknowns if u.is_offset and u.name == name and u.prior
            )
            seen = np.array(list(self.offsets[name].values()))
            count = len(seen)
            means, squares = np.r_[0.0, seen[:, 0]], np.r_[shown**2, np.nan_to_num(seen[:, 1]) ** 2]
            weights = np.r_[1 / count, np.ones(count)] / (1 / count + count)
            mean = float(weights @ means)
            found[name] = mean, float(np.sqrt(weights @ ((means - mean) ** 2 + squares)))
        return found

    def summary(self) -> str:
        """Return a page of text: parameters with 95 % intervals, rms of the residual of each recording, and
        the parameters that these recordings do not determine.
        """
        from discovery.fitting.shown import summary

        return summary(self)

    def to_frame(self) -> pd.DataFrame:
        """Return a row for each parameter: value, low and high (95 % interval), unit, fixed."""
        from discovery.fitting.shown import to_frame

        return to_frame(self)

    def plot(self) -> Figure:
        """Plot readings and model: a column for each fitted recording, a row for each output."""
        from discovery.fitting.shown import plot

        return plot(self)

    def __repr__(self) -> str:
        return self.summary()

    def _repr_html_(self) -> str:
        return self.to_frame().to_html(float_format="{:.4g}".format)


@one_thread
def fit_model(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str] | None = None,
    *,
    noise: Noise | None = None,
    loss: Loss = "linear",
    grids: Mapping[str, Grid] | None = None,
    priors: Mapping[str, Prior] | None = None,
    belief: Mapping[str, float] | None = None,
    guess: Mapping[str, float] | None = None,
    begin: Fit | None = None,
    max_rounds: int = 60,
    tolerance: float = 1e-9,
    goal: float = inf,
    minima: bool = False,
) -> Fit:
    """Fit the free parameters and start values of a model to recordings.

    Minimises, summed over the recordings,

        rho(L (y - y_model)) + n ((x0 - start)/start_sd)^2 + n (offset/spread)^2

    L whitens with the noise model. The last term is for inputs with a spread. n is the number of correlated
    readings that count as one (`readings_as_one`: 1 if the model lacks nothing). A measured state starts at
    its first reading, with the reading noise as spread. The reading noise is the `noise` of the channel, or
    is estimated from the residual if the campaign states none.

    Args:
        model: start values, bounds, and which parameters are free.
        recordings: names of the recordings to fit; others are not used.
        outputs: measured channels to compare; default all that model and campaign share.
        noise: covariance of the residual; default white.
        loss: "soft_l1", "huber" or "cauchy" limit the weight of outliers (scipy.optimize.least_squares).
        grids: grids to share between fits; default as in `predict_recording`.
        priors, belief: as in `make_problem`.
        guess: first values of parameters, if they differ from the start values of the model.
        begin: a fit to start from, of a model that has most of the unknowns; `guess` overrides it.
        max_rounds: of Levenberg-Marquardt.
        tolerance: relative change of the cost that ends them.
        goal: the cost that is good enough to matter; a fit that would not reach it ends early.
        minima: look for a better minimum from other values, too.

    Returns:
        The fit. `model` has the fitted values with 95 % intervals, `residuals()` gives readings minus model
        by recording, (readings, outputs), `unidentified` names what these recordings do not determine.

    Raises:
        UserError: an input that a recording does not hold.
        RunsAwayError: the model does not stay finite where the fit begins.
    """
    began = clock.perf_counter()
    problem = make_problem(model, campaign, recordings, outputs, grids, priors, belief)
    stated = {name: campaign.channels[name].noise for name in problem.outputs}
    theta = np.clip(_beginning(problem, guess or {}, begin), *problem.bounds)
    least = resolution([system.grid.single for system in problem.systems])
    runs = free_runs(problem, theta)
    if not guess and begin is None:
        theta, runs = gains_first(problem, theta, noise or first_noise(problem, runs, stated, least), runs)
    current = noise or first_noise(problem, runs, stated, least)
    weighed = any((u.prior and not u.is_penalty) or u.is_nuisance for u in problem.unknowns)
    problem = problem.spread(current, first_spreads(problem, runs))
    kept = [i for i, u in enumerate(problem.unknowns) if not is_settled(u)]
    problem, theta = problem.among(kept), theta[kept]
    together = 1.0
    rounds = _ROUNDS if noise is None or weighed else 1
    unknown = noise is None and any(stated[name] is None for name in problem.outputs)
    settled = False
    solution: Solution | None = None
    for k in range(_MOST):
        last = (k >= rounds - 1 and not unknown) or settled or k == _MOST - 1
        most = max_rounds if last or (k == 0 and not unknown) else min(_ROUGH, max_rounds)
        solution = solve(
            problem, theta, current, loss, most, tolerance, together, goal, solution, () if solution else runs
        )
        theta = solution.theta
        if not np.isfinite(solution.gram).all():
            raise RunsAwayError(f"the sensitivities of model '{model.name}' to its parameters are not finite")
        if last or solution.ended_early:
            break
        left = [problem.residual(t) for t in solution.trajectories]
        settled = True
        if noise is None:
            single = [r * s.grid.per_reading for r, s in zip(left, problem.systems, strict=True)]
            updated = white_noise(problem.outputs, stated, single, least)
            change = max(abs(np.log(a / b)) for a, b in zip(updated.white, current.white, strict=True))
            settled, current = change < 0.02, updated
            unknown = unknown and not settled
        if weighed:
            alone = [innovations(t, current, r) for t, r in zip(solution.trajectories, left, strict=True)]
            before, together = together, readings_as_one(alone)
            settled = settled and abs(np.log(together / before)) < 0.1
            spreads = _found_spreads(problem, solution.gram, theta, together)
            settled = settled and all(abs(np.log(new / old)) < 0.1 for new, old in spreads.values())
            asked = [u for u in problem.unknowns if u.spread == "fitted" and u.name in spreads]
            problem = problem.spread(current, {u.key: spreads[u.name][0] for u in asked})
        if settled and solution.converged:
            break
    assert solution is not None
    other = (
        another_minimum(problem, theta, solution.cost, current, together)
        if minima and loss == "linear"
        else None
    )
    if other is not None:
        further: dict[str, Any] = {"noise": noise, "loss": loss, "grids": grids, "priors": priors}
        limits: dict[str, Any] = {"belief": belief, "max_rounds": max_rounds, "tolerance": tolerance}
        better = fit_model(model, campaign, recordings, outputs, guess=other, **further, **limits)
        if _unlikely(better.problem, better.cost, better.noise) < _unlikely(problem, solution.cost, current):
            return replace(better, seconds=clock.perf_counter() - began)
    excess = 1.0
    if noise is None and loss == "linear":  # else the noise model says how alike readings are
        left = [problem.residual(t) / current.white for t in solution.trajectories]
        excess = _excess(problem, solution) * max(readings_as_one(left) / together, 1.0)
    covariance, lost = _covariance(problem, solution, together, excess)
    fit = Fit(
        problem,
        theta,
        covariance,
        current,
        solution.trajectories,
        solution.cost,
        tuple(lost),
        clock.perf_counter() - began,
        together,
        solution.ended_early,
    )
    finer = resolved(fit.trajectories, current.white, model.free) if grids is None else None
    if finer is None:
        return fit
    options: dict[str, Any] = {"noise": noise, "loss": loss, "priors": priors, "belief": belief}
    ends: dict[str, Any] = {"max_rounds": max_rounds, "tolerance": tolerance, "goal": goal}
    again = fit_model(model, campaign, recordings, outputs, grids=finer, begin=fit, **options, **ends)
    return replace(again, seconds=clock.perf_counter() - began)


def _unlikely(problem: Problem, cost: float, noise: Noise) -> float:
    """-log likelihood of a fit, up to a constant; its reading noise may be estimated."""
    grids = [system.grid for system in problem.systems]
    return cost + sum(float(np.sum(np.log(g.sd(noise.white)[g.measured]))) for g in grids)


def _covariance(
    problem: Problem, solution: Solution, together: float, excess: float
) -> tuple[Array, list[str]]:
    """Covariance (U, U) of the unknowns, and a sentence for each reason why parameters are not determined.

    Args:
        together: readings that counted as one: priors were counted as often; here they count once.
        excess: factor on the variance of the readings.
    """
    return covariance_of(problem, solution.gram / (excess * together), solution.theta)


def written_with(fit: Fit, model: Model, campaign: Campaign) -> Fit:
    """The fit with its model in another form: same readings and parameters, nothing is fitted.

    Args:
        model: has no unknown that the fit has not; one number in the fit may be one of each recording here.
        campaign: of the recordings.
    """
    grids = {s.grid.recording: s.grid for s in fit.problem.systems}
    problem = make_problem(model, campaign, list(grids), fit.problem.outputs, grids)
    place = {u.key: i for i, u in enumerate(fit.problem.unknowns)}
    # what a memory holds where a recording begins at rest is no unknown
    still = [n for n, state in model.states.items() if state.memory]
    problem = problem.among(
        [i for i, u in enumerate(problem.unknowns) if u.key in place or not (u.is_start and u.name in still)]
    )
    index = [place[u.key if u.key in place else replace(u, recording=None).key] for u in problem.unknowns]
    theta = fit.theta[index]
    return replace(
        fit,
        problem=problem,
        theta=theta,
        covariance=fit.covariance[np.ix_(index, index)],
        trajectories=tuple(problem.run(s, theta) for s in problem.systems),
    )


def _found_spreads(
    problem: Problem, gram: Array, theta: Array, together: float
) -> dict[str, tuple[float, float]]:
    """By state: the spread of its starts that makes them most likely, and the one before. By output with a
    zero of its own in each recording: the same of its zeros.

    One step of expectation maximisation over the recordings. One recording says little about the start of one
    body, and a model that lacks something may find it at rest where it was not: the mean over all bodies of
    its kind counts as `FORMER` recordings.
    """
    asked = {u.name: u.prior[1] for u in problem.unknowns if u.spread == "fitted" and u.prior}
    if not asked:
        return {}
    covariance, states = np.linalg.pinv(gram, hermitian=True), problem.model.states
    found, squares = {}, {}
    for name, before in asked.items():
        mine = [i for i, u in enumerate(problem.unknowns) if u.name == name and u.spread == "fitted"]
        if problem.unknowns[mine[0]].is_offset:
            grid = problem.systems[0].grid
            known = np.linalg.pinv(covariance[np.ix_(mine, mine)], hermitian=True) / together
            found[name] = likeliest_spread(theta[mine], known, before, grid.spread[name]), before
        else:
            squares[name] = theta[mine] ** 2 + together * np.diag(covariance)[mine]
    for name, own in squares.items():
        alike = [other for other in squares if _kind(states[other]) == _kind(states[name])]
        shared = FORMER * np.mean([np.mean(squares[other]) for other in alike])
        square = (shared + np.sum(own)) / (FORMER + len(own))
        found[name] = float(np.sqrt(square)), asked[name]
    return found


def _kind(state: State) -> tuple[str, bool]:
    """Starts of bodies are of a kind, and those of other states in the same unit."""
    return state.unit, state.capacity is not None


def likeliest_spread(zeros: Array, precision: Array, before: float, stated: float) -> float:
    """Spread of the zeros (K,) that makes the readings most likely, at most about the stated one.

    With all other unknowns integrated out, the readings say b'z - z'Lz/2 of the zeros z. Then
    log p(s) = b'(L + 1/s^2)^-1 b/2 - log det(1 + s^2 L)/2 - (s/stated)^2/2. A constant that all zeros share
    with the model says nothing of their spread.

    Args:
        precision: (K, K) of the zeros under the spread `before`.
    """
    b = precision @ zeros
    values, vectors = np.linalg.eigh(precision - np.eye(len(zeros)) / before**2)
    values, b = np.maximum(values, 0.0), vectors.T @ b
    tried = stated * np.geomspace(0.02, 2.0, 60)
    squares = tried[:, None] ** 2
    log_p = 0.5 * np.sum(b**2 * squares / (1 + squares * values) - np.log1p(squares * values), axis=1)
    return float(tried[np.argmax(log_p - 0.5 * (tried / stated) ** 2)])


def _excess(problem: Problem, solution: Solution) -> float:
    """Residual variance over that of the stated noise, at least 1.

    Stated noise is a claim about the sensor, not about the model: intervals follow the larger of the two.
    With estimated noise the factor is one by construction.
    """
    count = sum(int(system.grid.measured.sum()) for system in problem.systems)
    return max(1.0, 2 * solution.cost / max(1, count - len(solution.theta)))


def _beginning(problem: Problem, guess: Mapping[str, float], begin: Fit | None) -> Array:
    """Where a fit begins, by unknown."""
    found = (
        {u.key: float(v) for u, v in zip(begin.problem.unknowns, begin.theta, strict=True)} if begin else {}
    )
    return np.array(
        [
            guess[u.name] if u.name in guess and not u.is_nuisance else found.get(u.key, u.start)
            for u in problem.unknowns
        ]
    )
