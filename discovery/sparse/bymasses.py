"""Discovery of one output as a sum of filtered inputs, through `pysindy.SINDy`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.fitting import Fit, fit_model
from discovery.fitting.noise import roughness
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.sparse.borrowed import borrowed
from discovery.sparse.choice import Choice, chosen, stability
from discovery.sparse.constraints import matched
from discovery.sparse.discovery import Discovery, PathPoint, about_bound, path_points
from discovery.sparse.drives import Drives
from discovery.sparse.folds import PREDICT
from discovery.sparse.library import STILL, Feature, FilteredInputs
from discovery.sparse.masses import Response, Rules, mass_model, responses_of, slowest, surprise, within
from discovery.sparse.optimiser import SparseSearch, features_of
from discovery.sparse.options import SparseOptions
from discovery.sparse.problem import WHOLE
from discovery.sparse.ratedata import half_forgotten
from discovery.terms import evaluate, parse

Array = NDArray[np.float64]

CLEAR = 1.96  # standard errors that a gain must be from zero
_SEARCHES = 3  # of an output: each takes for noise what the model of the one before leaves
_MORE = 1.2  # times the noise: so much is left where the model lacks something


@dataclass(frozen=True)
class MassData:
    """What all outputs share: drives, and the grid of each recording to fit."""

    drives: Drives
    grids: Mapping[str, Grid]


def discover_masses(
    data: MassData,
    campaign: Campaign,
    recordings: Sequence[str],
    output: str,
    options: SparseOptions,
) -> Discovery:
    """Choose the inputs and time constants of one output and fit their numbers.

    A term whose time constant the fit moves to the slow end only adds up its input there: the search then
    begins anew with one term fewer of its family. It also begins anew, once, where the fit finds that masses
    forget otherwise without a flow than the search took them to. Where the masses begin in a further
    recording follows from all outputs together: see `starts_of`.
    """
    options = matched(options, data.drives.expressions, campaign.path)
    grids = {r: data.grids[r].part(outputs=[output]) for r in recordings}
    readings = [grids[r].readings[:, 0] for r in recordings]
    channel = campaign.channels[output]
    stated = channel.noise
    lasting = _lasting(data)
    library = FilteredInputs(
        ["time", *data.drives.inputs, "read"],
        [d for d in data.drives.expressions if d not in options.forbid],
        options.time_constants,
        data.drives.linear,
        data.drives.settled,
        integrals=[d for d in data.drives.integrals if d not in options.forbid],
        # how far zeros are apart is stated, or known from several recordings alone
        zeroed=channel.spread > 0 or (channel.role == "error" and len(recordings) >= WHOLE),
        gate=data.drives.gate,
    )
    most: dict[int, int] = {}
    while True:
        choice, noise = _searched(
            library, grids, data.drives.inputs, options, stated or roughness(readings), most, lasting
        )
        features = features_of(library, choice.terms)
        rules = Rules(
            output,
            {name: c.unit for name, c in campaign.channels.items()},
            data.drives.settled,
            {f.drive: lasting[f.drive] for f in features if f.drive in lasting and 0.0 < f.tau < np.inf},
            options.bounds,
            (float(library.taus_[0]), float(library.taus_[-1])),
            choice.start_sd,
            choice.zero_sd if library.zeroed and not channel.spread else None,  # the fit finds a stated one
            data.drives.gate or "",
        )
        # a fit that does not know the noise takes for it what the model leaves
        missed = (stated or choice.fit[choice.row]) / noise
        model, kept, slow = _clear(rules, features, choice, campaign, recordings, grids, options, missed)
        fewer = {int(f): int(np.sum(choice.terms.family == f)) - 1 for f in choice.terms.family[slow]}
        if library.still == STILL and (still := _still(model)):
            library.still = still
        elif all(most.get(f, many + 1) <= many for f, many in fewer.items()):
            return Discovery(model, *_evidence(output, features, kept, over(choice, noise), library))
        most |= fewer


def _searched(
    library: FilteredInputs,
    grids: Mapping[str, Grid],
    inputs: Sequence[str],
    options: SparseOptions,
    noise: float,
    most: Mapping[int, int],
    lasting: Mapping[str, float],
) -> tuple[Choice, float]:
    """The choice of a search, and the noise that it was made with.

    Where the model leaves more than the noise, starts and gains would bend to what it lacks: the search
    begins anew and takes for noise what was left. Recordings may begin cold, or while the machine works:
    where masses that begin cold do not predict what was left out, the first search tries both, and that one
    stands which predicts it better.

    Args:
        noise: of a reading, as stated or as rough as the readings are. most: terms of some families.
        lasting: how long drives have lasted [s] where recordings begin warm.
    """
    import pysindy

    theirs = options.optimiser != "search"
    select = borrowed(options.optimiser, options.optimiser_arguments) if theirs else chosen
    tables = [_table(grid, inputs) for grid in grids.values()]
    readings = [grid.readings for grid in grids.values()]

    def searched(begun: Mapping[str, float]) -> Choice:
        library.lasting = begun
        search = SparseSearch(
            library,
            options.max_terms,
            options.bounds,
            options.keep,
            [noise],
            PREDICT if options.tolerance is None else options.tolerance,
            options.blocks,
            0,
            options.seed,
            lambda problem: select(replace(problem, families=problem.families.limited(most))),
        )
        sindy = pysindy.SINDy(optimizer=search, feature_library=library)
        sindy.fit(tables, t=1.0, x_dot=readings)
        return search.choices_[0]

    begun: Mapping[str, float] = {}
    for k in range(_SEARCHES):
        choice = searched(begun)
        if k == 0 and lasting and choice.left_out[choice.row] > _MORE * noise:
            other = searched(lasting)
            if other.left_out[other.row] < choice.left_out[choice.row]:
                choice, begun = other, lasting
        if choice.fit[choice.row] <= _MORE * noise:
            break
        noise, before = choice.fit[choice.row], noise
    else:
        noise = before
    if choice.problem is not None:  # of the choice that stands alone: each bootstrap is a search
        last = choice.problem.changed(bootstraps=options.bootstraps)
        choice = replace(choice, stability=stability(last, choice.terms), problem=None)
    return choice, noise


def _lasting(data: MassData) -> dict[str, float]:
    """How long [s] drives have been about what they are, in the mean over an exponential autocorrelation."""
    found = {}
    for drive in data.drives.passing:
        halves = []
        for grid in data.grids.values():
            series = np.broadcast_to(evaluate(parse(drive), dict(grid.nodes)).value, grid.time.shape)
            if len(grid.time) > 1 and np.ptp(series) > 0:
                halves.append(half_forgotten(grid.time, np.asarray(series)))
        if halves:
            found[drive] = float(np.median(halves) / np.log(2.0))
    return found


def _still(model: Model) -> float | None:
    """How fast masses forget without a flow, where the fit excludes what the search began with."""
    rests = [p for name, p in model.parameters.items() if "_rest" in name and p.low is not None]
    sure = [p.value for p in rests if not (p.low or 0.0) <= STILL <= (p.high or 1.0)]
    return float(f"{np.median(sure):.2g}") if sure else None


def over(choice: Choice, noise: float) -> Choice:
    """The choice with what it misses counted in reading noises."""
    left_out, fit = (tuple(rms / noise for rms in some) for some in (choice.left_out, choice.fit))
    return replace(choice, left_out=left_out, fit=fit)


def _table(grid: Grid, inputs: Sequence[str]) -> Array:
    """Rows of a recording as the library wants them: time, inputs, whether there is a reading."""
    read = np.zeros(len(grid.time))
    read[grid.read] = 1.0
    return np.column_stack([grid.time, *(grid.nodes[name] for name in inputs), read])


def _clear(
    rules: Rules,
    features: Sequence[Feature],
    choice: Choice,
    campaign: Campaign,
    recordings: Sequence[str],
    grids: Mapping[str, Grid],
    options: SparseOptions,
    missed: float,
) -> tuple[Model, list[Feature], NDArray[np.bool_]]:
    """The model of the chosen features, fitted by output error, without those whose interval holds zero;
    these; and which of the chosen ones (n,) end as slow as a mass may be.

    Recordings may begin cold, or while the machine works and its masses have followed their drives: of both
    that one stands which makes the readings likelier.

    Args:
        missed: noise by which the fit weighs readings, over that of the search: the prior of a gain counts
            against a residual alike in both.
    """
    found = zip(features, choice.terms.theta, choice.terms.pole, choice.spreads, strict=True)
    responses = [Response(f, float(gain), int(pole), f, missed * spread) for f, gain, pole, spread in found]
    slow = np.zeros(len(features), dtype=bool)
    if not options.refine:
        return mass_model(rules, responses), list(features), slow

    def fitted(model: Model) -> Fit:
        return fit_model(model, campaign, recordings, [rules.output], grids=grids)

    cold = replace(rules, lasting={})
    while True:
        fit = fitted(mass_model(cold, responses))
        responses, strength = responses_of(fit, responses)
        ended = {r.chosen for r in responses if slowest(rules, r)}
        slow |= [f in ended for f in features]
        inside = within(rules, responses)
        if inside != responses:
            responses = inside
            continue
        free = [i for i, r in enumerate(responses) if r.feature.drive not in options.keep]
        weakest = min(free, key=lambda i: strength[i], default=None)
        if weakest is None or strength[weakest] >= CLEAR:
            begun = [fit, fitted(mass_model(rules, responses))] if rules.lasting else [fit]
            return min(begun, key=surprise).model, [r.chosen for r in responses], slow
        responses = [r for i, r in enumerate(responses) if i != weakest]


def _evidence(
    output: str, features: Sequence[Feature], left: Sequence[Feature], choice: Choice, library: FilteredInputs
) -> tuple[tuple[PathPoint, ...], dict[str, float], dict[str, Any]]:
    """Path, stability and report."""
    points = path_points([output], choice, library.drive_of_family_)
    stability = {f"{output}: {f}": s for f, s in zip(features, choice.stability, strict=True) if f in left}
    report = {
        "outputs": [output],
        "form": "masses",
        "terms": len(left),
        "left_out_rms": round(choice.left_out[choice.row], 4),
        "library": library.families_.columns,
        "kept": [str(f) for f in left],
        "costs": {
            str(f): round(cost, 4)
            for f, cost in zip(features, choice.costs, strict=True)
            if f in left and np.isfinite(cost)
        },
        "binding": [about_bound(output, library.drive_of_family_[f], asked) for f, asked in choice.binding],
    }
    return points, stability, report
