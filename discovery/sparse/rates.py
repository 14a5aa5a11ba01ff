"""Rates: a baseline model and candidate terms in the rates of its states, every coefficient a parameter.

The whole library is one model, in which a term that has left has the coefficient zero. Its fit by output
error gives the sensitivity column of every coefficient (the term filtered through the model's own dynamics),
and the normal equations of these columns rank all subsets at once: `residual = S_params d_theta +
S_candidates theta` needs no derivative of a reading and works with states that nobody measures.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.errors import UserError
from discovery.fitting import Fit, Noise, fit_model
from discovery.models import Model, Parameter
from discovery.recordings import Campaign
from discovery.sparse.folds import Blocks
from discovery.sparse.gram import Gram, gram, project_out, total
from discovery.terms import Apply, Expression, Name, Number, Term, names, parse, text

Array = NDArray[np.float64]


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
    """The model with coefficients set to zero taken out: a term that holds nothing else disappears.

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
    idle = frozenset().union(*(names(t.expression) for t in model.terms if t not in mine)) - used
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
class Evidence:
    """Normal equations of all common parameters around a fit, by block; starts and per-recording values ride
    along.
    """

    names: tuple[str, ...]  # (M,) common parameters
    blocks: tuple[Gram, ...]  # (B,) columns [parameters, nuisance]
    precision: Array  # of the nuisance priors
    low: Array
    high: Array

    def pooled(self, weights: Array | None = None) -> Gram:
        """Sum over blocks with the nuisance taken out."""
        whole = total(self.blocks, None if weights is None else weights.tolist())
        return project_out(whole, np.arange(len(self.names), len(whole.vector)), self.precision)


def evidence(fit: Fit, blocks: Blocks) -> Evidence:
    """Linearise a fit: rows J theta + residual against J, over the noise."""
    problem = fit.problem
    order = [i for i, u in enumerate(problem.unknowns) if not u.is_start and u.recording is None]
    common = len(order)
    order += [i for i in range(len(problem.unknowns)) if i not in order]
    centre = np.array(
        [u.prior[0] if u.prior and i not in order[:common] else 0.0 for i, u in enumerate(problem.unknowns)]
    )
    theta = (fit.theta - centre)[order]
    sd = np.array(fit.noise.white)
    empty = Gram(np.zeros((len(order), len(order))), np.zeros(len(order)), 0.0, 0)
    found = [empty] * blocks.count
    for trajectory, block in zip(fit.trajectories, blocks.of, strict=True):
        residual = problem.residual(trajectory) / sd
        jacobian = problem.jacobian(trajectory)[:, :, order] / sd[:, None]
        for b in np.unique(block):
            rows = np.isfinite(residual) & (block == b)[:, None]
            j = jacobian[rows]
            found[b] = gram(j, residual[rows] + j @ theta)
    rest = [problem.unknowns[i] for i in order[common:]]
    chosen = [problem.unknowns[i] for i in order[:common]]
    return Evidence(
        tuple(u.name for u in chosen),
        tuple(found),
        np.array(
            [
                0.0 if u.prior is None else u.prior[1] ** -2.0 * (fit.together if u.is_offset else 1.0)
                for u in rest
            ]
        ),
        np.array([u.low for u in chosen]),
        np.array([u.high for u in chosen]),
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
    """The grid with some readings (R,) left out."""
    return replace(grid, readings=np.where(keep[:, None], grid.readings, np.nan))


def refit(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    values: Mapping[str, float],
    grids: Mapping[str, Grid],
    noise: Noise | None = None,
    max_rounds: int = 25,
) -> Fit:
    """Fit from values that are already near; a given noise is kept, else it is estimated along the way."""
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
    )
