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
from discovery.sparse.choice import Choice, chosen
from discovery.sparse.constraints import matched
from discovery.sparse.discovery import Discovery, PathPoint, path_points
from discovery.sparse.drives import Drives
from discovery.sparse.folds import PREDICT
from discovery.sparse.library import Feature, FilteredInputs
from discovery.sparse.masses import Response, Rules, mass_model, responses_of, within
from discovery.sparse.optimiser import SparseSearch, features_of
from discovery.sparse.options import SparseOptions
from discovery.sparse.problem import WHOLE

Array = NDArray[np.float64]

CLEAR = 1.96  # standard errors that a gain must be from zero


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

    Where the masses begin in a further recording follows from all outputs together: see `starts_of`.
    """
    import pysindy

    options = matched(options, data.drives.expressions, campaign.path)
    grids = {r: data.grids[r].part(outputs=[output]) for r in recordings}
    readings = [grids[r].readings[:, 0] for r in recordings]
    noise = campaign.channels[output].noise or roughness(readings)
    library = FilteredInputs(
        ["time", *data.drives.inputs, "read"],
        [d for d in data.drives.expressions if d not in options.forbid],
        options.time_constants,
        data.drives.linear,
        data.drives.settled,
        integrals=[d for d in data.drives.integrals if d not in options.forbid],
        # how far zeros are apart is known from several recordings alone
        zeroed=campaign.channels[output].role == "error" and len(recordings) >= WHOLE,
    )
    search = SparseSearch(
        library,
        options.max_terms,
        options.bounds,
        options.keep,
        [noise],
        PREDICT if options.tolerance is None else options.tolerance,
        options.blocks,
        options.bootstraps,
        options.seed,
        chosen if options.optimiser == "search" else borrowed(options.optimiser, options.optimiser_arguments),
    )
    sindy = pysindy.SINDy(optimizer=search, feature_library=library)
    tables = [_table(grids[r], data.drives.inputs) for r in recordings]
    sindy.fit(tables, t=1.0, x_dot=[grids[r].readings for r in recordings])
    choice = search.choices_[0]
    features = features_of(library, choice.terms)
    rules = Rules(
        output,
        {name: c.unit for name, c in campaign.channels.items()},
        data.drives.settled,
        options.bounds,
        (float(library.taus_[0]), float(library.taus_[-1])),
        choice.start_sd,
        library.zeroed,
    )
    model, left = _clear(rules, features, choice, campaign, recordings, grids, options)
    return Discovery(model, *_evidence(output, features, left, over(choice, noise), library))


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
) -> tuple[Model, list[Feature]]:
    """The model of the chosen features, fitted by output error, without those whose interval holds zero;
    and these.
    """
    found = zip(features, choice.terms.theta, choice.terms.pole, choice.spreads, strict=True)
    responses = [Response(f, float(gain), int(pole), f, spread) for f, gain, pole, spread in found]
    if not options.refine:
        return mass_model(rules, responses), list(features)

    def fitted(model: Model) -> Fit:
        return fit_model(model, campaign, recordings, [rules.output], grids=grids)

    while True:
        fit = fitted(mass_model(rules, responses))
        responses, strength = responses_of(fit, responses)
        inside = within(rules, responses)
        if inside != responses:
            responses = inside
            continue
        free = [i for i, r in enumerate(responses) if r.feature.drive not in options.keep]
        weakest = min(free, key=lambda i: strength[i], default=None)
        if weakest is None or strength[weakest] >= CLEAR:
            return fit.model, [r.chosen for r in responses]
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
    }
    return points, stability, report
