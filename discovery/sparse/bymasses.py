"""Discovery of one output as a sum of filtered inputs, through `pysindy.SINDy`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.fitting import Fit, fit_model
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.sparse.choice import Choice
from discovery.sparse.discovery import Discovery, PathPoint
from discovery.sparse.drives import Drives
from discovery.sparse.folds import PREDICT
from discovery.sparse.library import Feature, FilteredInputs
from discovery.sparse.masses import Response, Rules, mass_model, responses_of
from discovery.sparse.optimiser import SparseSearch, rough_noise
from discovery.sparse.options import SparseOptions

Array = NDArray[np.float64]

CLEAR = 1.96  # standard errors that a gain must be from zero


@dataclass(frozen=True)
class MassData:
    """What all outputs share: drives, and the grid of each recording to fit."""

    drives: Drives
    grids: Mapping[str, Grid]


def discover_error(
    data: MassData,
    campaign: Campaign,
    recordings: Sequence[str],
    output: str,
    options: SparseOptions,
) -> Discovery:
    """Choose the inputs and time constants of one output and fit their numbers."""
    import pysindy

    column = data.grids[recordings[0]].outputs.index(output)
    grids = {
        r: replace(data.grids[r], outputs=(output,), readings=data.grids[r].readings[:, [column]])
        for r in recordings
    }
    readings = [grids[r].readings[:, 0] for r in recordings]
    noise = campaign.channels[output].noise or rough_noise(readings)
    library = FilteredInputs(
        ["time", *data.drives.inputs, "read"],
        [d for d in data.drives.expressions if d not in options.forbid],
        options.time_constants,
        data.drives.linear,
        data.drives.settled,
        integrals=[d for d in data.drives.integrals if d not in options.forbid],
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
    )
    sindy = pysindy.SINDy(optimizer=search, feature_library=library)
    tables = [_table(grids[r], data.drives.inputs) for r in recordings]
    sindy.fit(tables, t=1.0, x_dot=[grids[r].readings for r in recordings])
    choice = search.choices_[0]
    features = [library.feature_at(int(f), float(p)) for f, p in zip(choice.terms.family, choice.terms.place)]
    rules = Rules(
        output,
        {name: c.unit for name, c in campaign.channels.items()},
        data.drives.settled,
        options.bounds,
        (float(library.taus_[0]), float(library.taus_[-1])),
        choice.start_sd,
    )
    model, fit, left = _clear(rules, features, choice, campaign, recordings, output, grids, options)
    return Discovery(model, *_evidence(output, features, left, choice, model, library))


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
    output: str,
    grids: Mapping[str, Grid],
    options: SparseOptions,
) -> tuple[Model, Fit | None, list[Feature]]:
    """The model of the chosen features, fitted by output error, without those whose interval holds zero."""
    terms = choice.terms
    offset: float | None = None
    responses = []
    for feature, gain, pole in zip(features, terms.theta, terms.pole, strict=True):
        if feature.drive == "1":
            offset = float(gain)
        else:
            responses.append(Response(feature, float(gain), int(pole)))
    model = mass_model(rules, offset, responses)
    if not options.refine:
        return model, None, list(features)
    names = {id(r): f for r, f in zip(responses, [f for f in features if f.drive != "1"], strict=True)}
    kept = [names[id(r)] for r in responses]
    while True:
        fit = fit_model(mass_model(rules, offset, responses), campaign, recordings, [output], grids=grids)
        offset, responses, strength = responses_of(fit, responses)
        free = [i for i, r in enumerate(responses) if r.feature.drive not in options.keep]
        weakest = min(free, key=lambda i: strength[i], default=None)
        if weakest is None or strength[weakest] >= CLEAR:
            return fit.model, fit, kept
        responses = [r for i, r in enumerate(responses) if i != weakest]
        kept = [f for i, f in enumerate(kept) if i != weakest]


def _evidence(output, features, left, choice, model, library):  # type: ignore[no-untyped-def]
    labels = [str(f) for f in features]
    rms = np.sqrt(choice.left_out.mean(axis=1))
    points = tuple(
        PathPoint((output,), size, float(rms[k]), float(np.sqrt(choice.fit[k])), k == choice.chosen, ())
        for k, size in enumerate(choice.sizes)
    )
    stability = {f"{output}: {l}": s for l, s, f in zip(labels, choice.stability, features) if f in left}
    report = {
        "outputs": [output],
        "form": "masses",
        "terms": len(left),
        "left_out_rms": round(float(rms[choice.chosen]), 4),
        "library": library.families_.columns,
        "kept": [str(f) for f in left],
        "costs": {str(f): round(c, 4) for f, c in zip(features, choice.costs) if f in left},
    }
    return points, stability, report
