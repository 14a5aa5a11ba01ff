"""Discovery of terms in the rates of outputs of any kind, with hidden states where these predict better."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from discovery import terms
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Noise, fit_model
from discovery.fitting.noise import readings_as_one
from discovery.models import Model, Parameter
from discovery.models.model import TIME_UNITS
from discovery.progress import Progress
from discovery.recordings import Campaign
from discovery.sparse.beginning import FIRST, Begun, begin, fit_briefly, model_of
from discovery.sparse.bymasses import CLEAR
from discovery.sparse.byrates import discover_rates
from discovery.sparse.constraints import UnknownTermError, check_names, matched
from discovery.sparse.discovery import Discovery, about_bound
from discovery.sparse.folds import PREDICT
from discovery.sparse.freeruns import left_out
from discovery.sparse.growth import Growth, grown
from discovery.sparse.laws import with_levels
from discovery.sparse.options import SparseOptions
from discovery.sparse.ratedata import RateData, rough_noise, with_short_steps
from discovery.sparse.rates import refit, with_candidates, without
from discovery.sparse.structures import FLOWS, WORDS, Structure, balanced, own, rate, started, upstream
from discovery.terms import Number

Array = NDArray[np.float64]

THERMAL_ROLES = {"error", "temperature"}  # their rates count per hour
_SLOW = 60.0  # s: what moves more quickly is not thermal
_ROUNDS = 6  # of a fit in a fold
_LAST = 40  # of a fit with free levels
_GROWTHS = 3  # of a set, levels refined in between
_MOVED = 0.02  # share by which a level moves that makes the set grow anew
_NEAREST = 3  # of these starts, by their first step, are fitted further
_FAR = 3.0  # times the rms of another form at its start
_WHITE = 1.5  # readings that say the same once: less is noise
_CHAIN = (0.3, 1.0, 3.0)  # times the time scale of the readings: time constants that a chain starts from


@dataclass(frozen=True)
class Start:
    """Where a kind of hidden state begins, the data with steps that are short enough for it, and the options
    as they match its terms.
    """

    data: RateData
    begun: Begun
    options: SparseOptions


def discover_states(
    data: RateData,
    options: SparseOptions,
    hidden: Sequence[str],
    progress: Progress,
    rival: float = np.inf,
    binding: list[str] | None = None,
) -> Iterator[Discovery]:
    """A discovery for each kind of hidden state that was asked for and does not run away, made when it is
    asked for; none for a kind that begins far from the readings where another one begins near.

    Args:
        rival: mean squared error of another model on left-out data. A kind that leaves more of the readings
            that it is fitted to is no better on others: it is not made. Nor is one that begins far from it.
        binding: takes a sentence for each bound that binds, in any kind.
    """
    words = options.library or WORDS
    check_names(data.campaign.path, words, [*data.outputs, *next(iter(data.grids.values())).samples], hidden)
    roles = {data.campaign.channels[y].role for y in data.outputs}
    unit = "h" if roles <= THERMAL_ROLES and data.scale >= _SLOW else time_unit(data.scale)
    if options.stable is None:  # heat flows downhill; anything else may swing by itself
        options = options.model_copy(update={"stable": roles <= THERMAL_ROLES})
    flows = [word for word in FLOWS if word in words] or ["linear"]
    kinds = [k for kind in hidden for k in ([f"{kind} {f}" for f in flows] if kind == "upstream" else [kind])]
    goal = 0.5 * rival * sum(int(data.grids[r].measured.sum()) for r in data.recordings)
    nearest = goal
    lacking: UnknownTermError | None = None
    starts: dict[str, Start] = {}

    def start(kind: str) -> None:
        nonlocal nearest, lacking
        try:
            starts[kind] = _start(data, kind, words, unit, options, nearest)
            nearest = min(nearest, starts[kind].begun.cost)
            if binding is not None:
                binding.extend(_about_bounds(starts[kind]))
        except RunsAwayError:
            pass
        except UnknownTermError as error:  # a term that this form does not have: another one may
            lacking = error

    for kind in kinds:
        if not kind.startswith("upstream"):  # quick to begin: which is near is known before one grows
            start(kind)
    for kind in kinds:
        progress(f"terms of {', '.join(data.outputs)}, {kind}")
        if kind not in starts and kind.startswith("upstream"):
            start(kind)
        if kind in starts and starts[kind].begun.cost <= _FAR**2 * nearest:
            try:
                found = _discovered(kind.split()[0], starts[kind], goal)
            except RunsAwayError:
                continue
            if found:
                yield found
    if lacking is not None and not starts and rival == np.inf:
        raise lacking


def _start(
    data: RateData, kind: str, words: Sequence[str], unit: str, options: SparseOptions, nearest: float
) -> Start:
    """Where a kind of hidden state begins: by the weak form, or as a chain of two bodies ("upstream sqrt": of
    the law of its flow).
    """
    y = data.outputs[0]
    if kind.startswith("upstream"):
        full, cost = _chain(data, y, kind.split()[1], words, unit)
        structure, options = _allowed(data, full, options)
        entered = {i for i, c in enumerate(structure.candidates) if c.start != 0.0}
        return Start(data, Begun(structure, entered, cost=cost), options)
    bare = (own if kind == "own" else rate)(data, data.outputs, words, unit, bool(options.stable))
    bare, options = _allowed(data, bare, options)
    begun = begin(data, bare, nearest)
    near = 0.5 * sum(int(data.grids[r].measured.sum()) for r in data.recordings)
    if begun.cost <= _FAR**2 * near:  # short steps do not bring a law near that is far from the readings
        finer = with_short_steps(data, model_of(begun.structure, begun.entered))
        if finer is not data:
            data, begun = finer, begin(finer, bare, nearest)
    return Start(data, begun, options)


def _discovered(kind: str, start: Start, goal: float) -> Discovery | None:
    """The terms that the readings ask for: grown, levels refined after each growth, then chosen by free
    runs; None where they leave more than `goal`.
    """
    data, options = start.data, start.options
    structure, entered = start.begun.structure, start.begun.entered
    stay = {i for i, c in enumerate(structure.candidates) if c.label in options.keep}
    for _ in range(_GROWTHS):
        model, labels = with_candidates(structure.model, structure.candidates)
        names = list(labels)
        growth = Growth(
            tuple(names[i] for i in sorted(stay | entered)),
            tuple(names[i] for i in sorted(stay)),
            options.max_terms,
            model.values(),
            goal,
        )
        small, kept = grown(data, model, labels, growth, options)
        entered = {names.index(name) for name in kept} | stay
        structure, moved = _refined(data, structure, small, names)
        if not moved:
            break
    if fit_briefly(data, small, FIRST).cost > goal:
        return None
    always = [names[i] for i in stay]
    found = discover_rates(data, small, kept, always, options, grown=True, tolerance=PREDICT)
    report = found.report | {"hidden": kind}
    if not options.refine:
        return replace(found, report=report)
    model = with_free_levels(data, found.model)
    model = _clear(data, model, [name for name in kept if name in model.free and name not in always])
    left = {kept[name] for name in kept if name in model.free}
    report["kept"] = [label for label in report["kept"] if label in left]
    report["costs"] = {label: cost for label, cost in report["costs"].items() if label in left}
    stability = {label: share for label, share in found.stability.items() if label in left}
    return replace(found, model=model, stability=stability, report=report | {"terms": len(report["kept"])})


def _clear(data: RateData, model: Model, names: Sequence[str]) -> Model:
    """The model without those of the coefficients whose 95 % interval holds zero, the least sure one first,
    where the criterion does not ask for it. Terms that stand for each other become surer that way.
    """

    def fitted(one: Model, noise: Noise | None) -> Fit:
        return refit(one, data.campaign, data.recordings, data.outputs, {}, data.grids, noise, _LAST)

    fit, tried = fitted(model, None), set[str]()
    while True:
        se = dict(zip((u.name for u in fit.problem.unknowns), fit.standard_errors, strict=True))
        sure = {n: abs(fit.model.parameters[n].value) / max(se[n], 1e-300) for n in names if n in se}
        weakest = min(sure.keys() - tried, key=lambda n: (sure[n], n), default=None)
        if weakest is None or sure[weakest] >= CLEAR:
            return fit.model
        tried.add(weakest)
        with suppress(RunsAwayError):
            other = fitted(_without_term(fit.model, weakest), fit.noise)
            count = sum(int(np.isfinite(r).sum()) for r in other.residuals().values())
            effective = count / readings_as_one(list(other.residuals().values()))
            if effective * np.log(other.cost / fit.cost) < np.log(effective):
                fit = fitted(other.model, None)


def _without_term(model: Model, name: str) -> Model:
    """The model without a coefficient, its term and what that alone used."""
    small = without(model, [name])
    read = [*small.outputs.values(), *(term.expression for term in small.terms)]
    used = small.start_names.union(*(terms.names(one) for one in read))
    return replace(small, parameters={n: p for n, p in small.parameters.items() if n in used})


def _about_bounds(start: Start) -> list[str]:
    """Sentences on bounds that bind."""
    said = []
    for i, asked in start.begun.binding.items():
        c = start.begun.structure.candidates[i]
        given = c.label in start.options.bounds
        said.append(about_bound(c.into, c.label, asked, "bounds" if given else "stable = true"))
    return said


def _refined(
    data: RateData, structure: Structure, small: Model, names: Sequence[str]
) -> tuple[Structure, bool]:
    """The structure with the values, and the levels of roots and thresholds, that its terms in use ask for.

    Returns:
        the structure, and whether a level moved.
    """
    fitted = with_free_levels(data, small)
    found, moved = list(structure.candidates), False
    parameters = {
        n: replace(p, value=fitted.parameters[n].value) for n, p in structure.model.parameters.items()
    }
    for term in fitted.terms:
        used = sorted(terms.names(term.expression) & set(names))
        if not used:
            continue
        i = names.index(used[0])
        expression = found[i].expression
        for level in sorted(n for n in terms.names(term.expression) if "_level" in n):
            value = float(f"{fitted.parameters[level].value:.4g}")
            named, before = with_levels(expression, level) or (expression, value)
            expression = terms.substitute(named, {level: Number(value)})
            moved = moved or abs(value - before) > _MOVED * max(abs(before), abs(value))
        found[i] = replace(found[i], expression=expression, start=fitted.parameters[used[0]].value)
    model = replace(structure.model, parameters=parameters)
    return replace(structure, model=model, candidates=tuple(found)), moved


def _allowed(data: RateData, structure: Structure, options: SparseOptions) -> tuple[Structure, SparseOptions]:
    """The structure without forbidden terms and within the bounds; the options as they match its terms."""
    y = data.outputs[0]
    aliases = {"y": y, "rate": f"{y}_rate", "up": f"{y}_up"}
    options = matched(options, [c.label for c in structure.candidates], data.campaign.path, aliases)
    kept = []
    for c in structure.candidates:
        if c.label in options.forbid:
            continue
        low, high = options.bounds.get(c.label, (c.low, c.high))
        kept.append(replace(c, low=low, high=high))
    return replace(structure, candidates=tuple(kept)), options


def _chain(
    data: RateData, output: str, flow: str, words: Sequence[str], unit: str
) -> tuple[Structure, float]:
    """A hidden body upstream, begun as the chain of two bodies with one law of flow that fits the readings
    best; and its cost.

    Args:
        flow: word of the law, as "sqrt".
    """
    bare = upstream(data, output, [flow], unit)
    fits: list[Fit] = []
    for first, then in product(_CHAIN, _CHAIN):
        guess = balanced(data, bare, first * data.scale, then * data.scale)
        model, _ = with_candidates(bare.model, started(bare, guess).candidates)
        with suppress(RunsAwayError):
            fits.append(fit_briefly(data, model, 1))
    nearest = sorted(fits, key=lambda one: one.cost)[:_NEAREST]
    fits = []
    for one in nearest:
        with suppress(RunsAwayError):
            fits.append(fit_briefly(data, one.model, FIRST, min((f.cost for f in fits), default=np.inf)))
    if not fits:
        raise RunsAwayError(f"no chain of two bodies stays finite on the readings of {output}")
    fit = min(fits, key=lambda one: one.cost)
    column = list(fit.problem.model.states).index(f"{output}_up")
    level = np.concatenate([t.x[:, column] for t in fit.trajectories])
    full = upstream(data, output, words, unit, level)
    _, labels = with_candidates(bare.model, bare.candidates)
    found = dict(zip([(c.into, c.source, c.label) for c in bare.candidates], labels, strict=True))
    values = {
        i: fit.model.parameters[found[c.into, c.source, c.label]].value
        for i, c in enumerate(full.candidates)
        if (c.into, c.source, c.label) in found
    }
    return started(full, values), fit.cost


def with_free_levels(data: RateData, model: Model) -> Model:
    """The model fitted with the levels at which its roots and thresholds begin as parameters."""
    parameters, found = dict(model.parameters), []
    count = 0
    for term in model.terms:
        name = f"{term.into}_level{count + 1}"
        levelled = with_levels(term.expression, name)
        if levelled is not None:
            count += 1
            expression, level = levelled
            spread = 3 * max(abs(level), 1.0)
            unit = model.states[term.into].unit
            parameters[name] = Parameter(level, unit, level - spread, level + spread)
            term = replace(term, expression=expression)
        found.append(term)
    if not count:
        return model
    return fit_briefly(data, replace(model, parameters=parameters, terms=tuple(found)), _LAST).model


def leaves_noise(campaign: Campaign, recordings: Sequence[str], model: Model, outputs: Sequence[str]) -> bool:
    """Whether the residual of a model is white: then a further state has nothing to explain."""
    fit = fit_model(model, campaign, recordings, outputs, max_rounds=_ROUNDS)
    return readings_as_one(list(fit.residuals().values())) < _WHITE


def left_out_of(data: RateData, model: Model) -> Array:
    """Mean squared error (B,) on each block of a model whose numbers are fitted without its fold."""
    return left_out(data, model, rough_noise(data), _ROUNDS)


def time_unit(seconds: float) -> str:
    """The unit of time in which a time scale is a handy number.

    >>> time_unit(0.2), time_unit(400.0), time_unit(7200.0)
    ('s', 'min', 'h')
    """
    return next((unit for unit in ("d", "h", "min") if seconds >= 2 * TIME_UNITS[unit]), "s")
