"""Rates: a baseline model and candidate terms in the rates of its states, every coefficient a parameter.

The whole library is one model, in which a removed term has the coefficient zero. Its fit by output error
gives the sensitivity column of every coefficient (the term filtered through the model's own dynamics), and
the normal equations of these columns rank all subsets at once: `residual = S_params d_theta + S_candidates
theta` needs no derivative of a reading and works with states that are not measured.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.errors import UserError
from discovery.fitting import Fit, Noise, Unknown, fit_model, make_problem
from discovery.models import Model, Parameter
from discovery.recordings import Campaign
from discovery.sparse.choice import Choice
from discovery.sparse.gram import Gram
from discovery.sparse.options import SparseOptions
from discovery.sparse.problem import Problem
from discovery.terms import Apply, Expression, Name, Number, Term, names, parse, text

Array = NDArray[np.float64]

_ENOUGH = 1e-5  # relative change of the cost that ends a fit: far below what a term has to bring


@dataclass(frozen=True)
class Candidate:
    """A term that may be added: `coefficient * expression` into a state (and out of `source`, where heat is
    exchanged).
    """

    into: str
    expression: Expression
    low: float = -np.inf
    high: float = np.inf
    start: float = 0.0
    source: str | None = None

    @property
    def label(self) -> str:
        """What reports and options call it."""
        return text(self.expression)


def with_candidates(model: Model, candidates: Sequence[Candidate]) -> tuple[Model, dict[str, str]]:
    """The model with every candidate in it, and the label of each new coefficient by its name."""
    parameters: dict[str, Parameter] = {}
    terms, labels = [], {}
    count: dict[str, int] = {}
    for candidate in candidates:
        count[candidate.into] = count.get(candidate.into, 0) + 1
        name = f"{candidate.into}_p{count[candidate.into]}"
        if name in model.parameters or name in model.states:
            raise UserError(
                f"model '{model.name}': the name '{name}' is needed for a new term; rename it in the model"
            )
        unit = f"{model.states[candidate.into].unit}/{model.time_unit}"
        if model.states[candidate.into].capacity:
            unit = "W"
        parameters[name] = Parameter(candidate.start, unit, candidate.low, candidate.high)
        product = text(candidate.expression)
        expression = parse_product(name, product)
        terms.append(Term(f"{product} in {candidate.into}", candidate.into, expression, candidate.source))
        labels[name] = f"{candidate.into}: {product}"
    return model.with_terms(*terms, parameters=parameters), labels


def parse_product(name: str, factor: str) -> Expression:
    """`name*(factor)` as an expression; the factor 1 is left out."""
    return parse(name) if factor == "1" else parse(f"{name}*({factor})")


def without(model: Model, gone: Sequence[str]) -> Model:
    """The model without the coefficients that are zero; a term with nothing else disappears.

    A coefficient that shares its term with others becomes a fixed zero.
    """
    dropped = set(gone)
    terms = []
    for term in model.terms:
        own = names(term.expression) & set(model.parameters)
        if not (own and own & dropped and _vanishes(term.expression, own & dropped)):
            terms.append(term)
    left = model.start_names.union(
        *(names(t.expression) for t in terms), *(names(e) for e in model.outputs.values())
    )
    parameters = {
        name: replace(p, value=0.0, fixed=True, min=min(p.min, 0.0), max=max(p.max, 0.0))
        if name in dropped
        else p
        for name, p in model.parameters.items()
        if name in left or name not in dropped
    }
    return replace(model, terms=tuple(terms), parameters=parameters)


def without_idle(model: Model, outputs: Sequence[str]) -> Model:
    """The model without states that move no output, their terms and what these alone used."""
    read = [model.outputs[name] for name in outputs if name in model.outputs]
    needed = {*outputs}.union(*(names(e) for e in read)) & set(model.states)
    while True:
        mine = [t for t in model.terms if needed & {t.into, t.source}]
        more = needed.union(*(names(t.expression) for t in mine)) & set(model.states)
        if more == needed:
            break
        needed = more
    states = {name: state for name, state in model.states.items() if name in needed}
    left = replace(model, states=states, terms=tuple(mine))
    used = left.start_names.union(*(names(t.expression) for t in mine), *(names(e) for e in read))
    gone = [names(t.expression) for t in model.terms if t not in mine]
    idle = model.start_names.union(*gone) - used
    parameters = {name: p for name, p in model.parameters.items() if name not in idle}
    return replace(left, parameters=parameters)


def _vanishes(expression: Expression, zero: set[str] | frozenset[str]) -> bool:
    """Whether an expression is identically zero once these names are."""
    match expression:
        case Number(value=value):
            return value == 0
        case Name(id=name):
            return name in zero
        case Apply(function="*", arguments=(a, b)):
            return _vanishes(a, zero) or _vanishes(b, zero)
        case Apply(function="/", arguments=(a, _)):
            return _vanishes(a, zero)
        case Apply(function="neg", arguments=(a,)):
            return _vanishes(a, zero)
        case Apply(function="+" | "-", arguments=(a, b)):
            return _vanishes(a, zero) and _vanishes(b, zero)
        case _:
            return False


@dataclass(frozen=True)
class Linearised:
    """A fit as a linear regression, everything over the noise: target = columns theta + nuisance delta.

    theta are all common parameters, delta start values and what belongs to one recording, with normal priors.
    """

    names: tuple[str, ...]  # (M,)
    columns: tuple[Array, ...]  # (R Y, M) by recording, a row for each output of each reading
    target: tuple[Array, ...]  # (R Y,), NaN where nothing was read
    nuisance: tuple[Array, ...]
    precision: tuple[Array, ...]
    times: tuple[Array, ...]  # (R Y,) s
    low: Array  # (M,)
    high: Array

    @property
    def count(self) -> int:
        """Number of readings."""
        return sum(int(np.isfinite(one).sum()) for one in self.target)


def around(fit: Fit, model: Model, campaign: Campaign) -> Fit:
    """The fit of a smaller model as one of `model`, which adds terms to it: nothing is fitted.

    The added coefficients are as `model` has them, and known to nothing: there is no covariance.
    """
    grids = {s.grid.recording: s.grid for s in fit.problem.systems}
    problem = make_problem(model, campaign, list(grids), fit.problem.outputs, grids)
    known = {u.key: (u, value) for u, value in zip(fit.problem.unknowns, fit.theta, strict=True)}
    unknowns = [replace(u, prior=known[u.key][0].prior) if u.key in known else u for u in problem.unknowns]
    theta = np.array([known[u.key][1] if u.key in known else u.start for u in unknowns])
    problem = replace(problem, unknowns=tuple(unknowns))
    runs = tuple(problem.run(s, theta) for s in problem.systems)
    size = len(theta)
    return replace(
        fit, problem=problem, theta=theta, covariance=np.full((size, size), np.nan), trajectories=runs
    )


def linearised(fit: Fit) -> Linearised:
    """Linearise a fit: rows J theta + residual against J."""
    problem, sd = fit.problem, np.array(fit.noise.white)
    common = [i for i, u in enumerate(problem.unknowns) if not u.is_start and u.recording is None]
    means = np.array(
        [u.prior[0] if u.prior and i not in common else 0.0 for i, u in enumerate(problem.unknowns)]
    )
    theta = fit.theta - means
    columns, target, nuisance, precision, times = [], [], [], [], []
    for trajectory in fit.trajectories:
        grid = trajectory.system.grid
        rest = [i for i in problem.concerns(trajectory.system) if i not in common]
        residual = (problem.residual(trajectory) / sd).ravel()
        jacobian = (problem.jacobian(trajectory) / sd[:, None]).reshape(len(residual), -1)
        columns.append(jacobian[:, common])
        nuisance.append(jacobian[:, rest])
        target.append(residual + jacobian @ theta)
        precision.append(np.array([_precision(problem.unknowns[i], fit.together) for i in rest]))
        times.append(np.repeat(grid.time[grid.read], len(sd)))
    chosen = [problem.unknowns[i] for i in common]
    return Linearised(
        tuple(u.name for u in chosen),
        tuple(columns),
        tuple(target),
        tuple(nuisance),
        tuple(precision),
        tuple(times),
        np.array([u.low for u in chosen]),
        np.array([u.high for u in chosen]),
    )


def _precision(unknown: Unknown, together: float) -> float:
    """Inverse variance of the prior of what belongs to one recording."""
    if unknown.prior is None:
        return 0.0
    return float(unknown.prior[1] ** -2.0 * (together if unknown.is_offset else 1.0))


def regress(
    seen: Linearised,
    keep: Sequence[str],
    options: SparseOptions,
    select: Callable[[Problem], Choice],
    max_terms: int | None = None,
) -> Choice:
    """The choice of coefficients of a linearised fit, by `pysindy.SINDy` with a library of its filtered
    terms.
    """
    import pysindy

    from discovery.sparse.library import ModelTerms
    from discovery.sparse.optimiser import SparseSearch

    seen = _read(seen)
    library = ModelTerms(seen.names, seen.columns, seen.nuisance, seen.precision, seen.times)
    bounds = {
        name: ends for name, *ends in zip(seen.names, seen.low.tolist(), seen.high.tolist(), strict=True)
    }
    search = SparseSearch(
        library,
        options.max_terms if max_terms is None else max_terms,
        bounds,  # type: ignore[arg-type]
        keep,
        [1.0],
        blocks=options.blocks,
        bootstraps=options.bootstraps,
        seed=options.seed,
        select=select,
    )
    sindy = pysindy.SINDy(optimizer=search, feature_library=library)
    sindy.fit([t[:, None] for t in seen.times], t=1.0, x_dot=[y[:, None] for y in seen.target])
    return search.choices_[0]


def _read(seen: Linearised) -> Linearised:
    """The rows at which an output was read; pysindy takes no others. Where one output is read, another may
    not be.
    """
    read = [np.isfinite(one) for one in seen.target]

    def kept(parts: Sequence[Array]) -> tuple[Array, ...]:
        return tuple(part[rows] for part, rows in zip(parts, read, strict=True))

    return replace(
        seen,
        columns=kept(seen.columns),
        target=kept(seen.target),
        nuisance=kept(seen.nuisance),
        times=kept(seen.times),
    )


def extended_bic(g: Gram, sizes: Sequence[int], costs: Sequence[float], library: int) -> Array:
    """Extended Bayesian criterion (Chen & Chen, Biometrika 95, 2008): cost + k (log n + 2 log p), cost over
    the noise.

    The second part pays for the choice among `library` columns, without which one term in eight models is by
    chance.
    """
    penalty = np.log(max(g.count, 2)) + 2 * np.log(library)
    return np.asarray(np.array(costs) + np.array(sizes) * penalty)


def masked(grid: Grid, keep: NDArray[np.bool_]) -> Grid:
    """The grid with some readings (R,) left out, save the first of each output: free runs begin there."""
    first = np.cumsum(np.isfinite(grid.readings), axis=0) <= 1
    return replace(grid, readings=np.where(keep[:, None] | first, grid.readings, np.nan))


def refit(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    values: Mapping[str, float],
    grids: Mapping[str, Grid],
    noise: Noise | None = None,
    max_rounds: int = 25,
    goal: float = np.inf,
) -> Fit:
    """Fit from values that are already near; a given noise is kept, else it is estimated.

    It ends where sizes are compared, not where the last digit stands: the chosen model is fitted once more.
    It ends early where it would not reach the cost `goal`.
    """
    inside = {
        name: float(np.clip(value, model.parameters[name].min, model.parameters[name].max))
        for name, value in values.items()
        if name in model.parameters and not model.parameters[name].fixed
    }
    return fit_model(
        model.with_values(inside),
        campaign,
        recordings,
        outputs,
        noise=noise,
        grids=grids,
        max_rounds=max_rounds,
        tolerance=_ENOUGH,
        goal=goal,
    )
