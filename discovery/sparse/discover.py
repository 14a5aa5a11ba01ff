"""Discovery of a sparse model: recordings to fit in, a model with its evidence out."""

from __future__ import annotations

import time as clock
from collections.abc import Sequence
from pathlib import Path

from discovery.dynamics import make_grid
from discovery.errors import UserError
from discovery.fitting import fit_model
from discovery.models import Model, State
from discovery.models.check import check_model
from discovery.models.modelfile import read_model
from discovery.progress import Progress, silent
from discovery.recordings import Campaign
from discovery.sparse.bymasses import MassData, discover_error
from discovery.sparse.byrates import discover_rates
from discovery.sparse.discovery import Discovery, joined
from discovery.sparse.drives import AMBIENT, Inputs, make_drives, make_inputs
from discovery.sparse.families import candidates
from discovery.sparse.growth import Growth
from discovery.sparse.options import SparseOptions
from discovery.sparse.ratedata import make_rate_data
from discovery.sparse.rates import with_candidates
from discovery.sparse.starts import started
from discovery.sparse.temperatures import discover_temperatures
from discovery.terms import names
from discovery.threads import one_thread

FILE_FAMILIES = ("wet", "rotation", "coupling")


@one_thread
def discover(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    options: SparseOptions,
    progress: Progress = silent,
    folder: Path | None = None,
) -> Discovery:
    """Discover a sparse model of `outputs` from `recordings`; no other recording is looked at.

    Errors become sums of hidden thermal masses; measured temperatures, user-given expressions and baseline
    files get terms in the rates of their states. Sizes are chosen by free runs on what was left out, one
    recording at a time (or by blocks of a single one); numbers are fitted by output error and carry 95 %
    intervals.

    Args:
        recordings: names of the recordings to fit.
        outputs: channels of role error or temperature.
        progress: told in a few words what is being done.
        folder: where a relative baseline file is looked for; default the campaign's folder.

    Raises:
        UserError: an option that does not fit the campaign.
    """
    began = clock.perf_counter()
    inputs = make_inputs(campaign, recordings, options.inputs)
    if options.built_on_file:
        progress("terms on the baseline")
        parts = [_on_file(campaign, recordings, outputs, inputs, options, folder or campaign.path.parent)]
    elif all(campaign.channels[name].role == "temperature" for name in outputs):
        progress("terms of " + ", ".join(outputs))
        parts = [discover_temperatures(campaign, recordings, outputs, inputs, options)]
    elif options.form == "rates" or (options.form == "auto" and options.library):
        parts = []
        for name in outputs:
            progress(f"terms of {name}")
            parts.append(_error_rates(campaign, recordings, name, inputs, options))
    else:
        progress("filtered inputs")
        data = _mass_data(campaign, recordings, outputs, inputs, options)
        parts = []
        for name in outputs:
            progress(f"masses of {name}")
            parts.append(discover_error(data, campaign, recordings, name, options))
    return joined("discovered", parts, clock.perf_counter() - began)


def _mass_data(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    options: SparseOptions,
) -> MassData:
    grids = {r: make_grid(campaign, r, inputs.names, outputs) for r in recordings}
    return MassData(make_drives(inputs, campaign, options.library or ()), grids)


def _error_rates(
    campaign: Campaign, recordings: Sequence[str], output: str, inputs: Inputs, options: SparseOptions
) -> Discovery:
    """Terms in the rate of one error: eq. (9) and what the library adds, started from the weak form."""
    unit = campaign.channels[output].unit
    state = State(output, unit, None, None, max(1.0, campaign.channels[output].noise or 0.0), 1 / 3600)
    empty = Model(output, {}, {output: state}, (), {}, "h")
    baseline = ["y", "1", *inputs.of(AMBIENT, "heat load", "fluid temperature")]
    words = list(dict.fromkeys([*baseline, *(options.library or ("linear", "wet", "rotation"))]))
    found = candidates([output], empty, campaign, inputs, words, options)
    data = make_rate_data(campaign, recordings, [output], inputs.names, options.blocks)
    model, labels = with_candidates(empty, started(found, data, {output: output}))
    always = [
        name
        for name, label in labels.items()
        if options.keep_baseline and label.split(": ", 1)[1] in (output, *baseline)
    ]
    return discover_rates(data, model, labels, always, options)


def _on_file(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    options: SparseOptions,
    folder: Path,
) -> Discovery:
    """A gray-box model file and what the library adds to its states."""
    path = Path(options.baseline) if Path(options.baseline).is_absolute() else folder / options.baseline
    baseline = read_model(path)
    check_model(baseline, {n: c.unit for n, c in campaign.channels.items()}, path)
    for name in options.into or ():
        if name not in baseline.states:
            raise UserError(
                f"{path}: the discovery adds terms into '{name}', which is no state of this model "
                f"({', '.join(baseline.states)}); mend the name under into"
            )
    bodies = [name for name, state in baseline.states.items() if state.capacity] or list(baseline.states)
    found = candidates(
        list(options.into or bodies), baseline, campaign, inputs, options.library or FILE_FAMILIES, options
    )
    channels = sorted({*inputs.names, *baseline.inputs} & set(campaign.channels) - set(outputs))
    data = make_rate_data(campaign, recordings, outputs, channels, options.blocks)
    fitted = fit_model(baseline, data.campaign, recordings, outputs, grids=data.grids).model
    model, labels = with_candidates(fitted, found)
    if options.keep_baseline is False:
        used = baseline.start_names.union(*(names(e) for e in baseline.outputs.values()))
        labels |= {
            n: n
            for n in baseline.free
            if baseline.parameters[n].min <= 0 <= baseline.parameters[n].max and n not in used
        }
    growth = Growth(most=options.max_terms, restart=baseline.values())
    return discover_rates(
        data, model, labels, (), options, None if options.keep_baseline is False else growth
    )
