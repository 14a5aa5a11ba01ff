"""Discovery of a sparse model: recordings to fit in, a model with its evidence out."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from discovery.dynamics import make_grid
from discovery.errors import RunsAwayError, UserError
from discovery.fitting import Fit, fit_model
from discovery.models.check import check_model
from discovery.models.modelfile import read_model
from discovery.progress import Progress, silent
from discovery.recordings import Campaign
from discovery.sparse.bymasses import MassData, discover_masses
from discovery.sparse.byrates import discover_rates
from discovery.sparse.bystates import discover_states, leaves_noise, left_out_of
from discovery.sparse.constraints import UnknownTermError, kept
from discovery.sparse.discovery import Discovery, joined
from discovery.sparse.drives import FLOW, Inputs, make_drives, make_inputs
from discovery.sparse.families import candidates
from discovery.sparse.folds import CLAIM, PREDICT, choose
from discovery.sparse.growth import Growth, grown
from discovery.sparse.masses import fit_masses
from discovery.sparse.options import FAMILIES, HIDDEN, SparseOptions
from discovery.sparse.ratedata import make_rate_data
from discovery.sparse.rates import with_candidates
from discovery.sparse.structures import WORDS
from discovery.sparse.temperatures import discover_temperatures
from discovery.terms import names, parse
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
    """Discover a sparse model of `outputs` from `recordings`; other recordings are not used.

    Errors become sums of filtered inputs. Measured temperatures, baseline files, and systems with a library
    of states get terms in the rates of their states. For other outputs both forms are tried. Free runs on
    left-out data (recordings, or parts of a few) choose the number of terms. All parameters are fitted by
    output error and have 95 % intervals.

    Args:
        recordings: names of the recordings to fit.
        outputs: measured channels.
        progress: is called with a few words when a step begins.
        folder: folder of a relative baseline file; default that of the campaign.

    Raises:
        UserError: an option does not fit the campaign.
    """
    began = clock.perf_counter()
    inputs = make_inputs(campaign, recordings, options.inputs)
    roles = {campaign.channels[name].role for name in outputs}
    if not warmed(campaign):  # a displacement like any other
        roles = {"other output" if role == "error" else role for role in roles}
    together = False  # whether all outputs are masses
    if options.built_on_file:
        progress("terms on the baseline")
        parts = [_on_file(campaign, recordings, outputs, inputs, options, folder or campaign.path.parent)]
    else:
        warm, others, parts = _warm(campaign, outputs, roles, options), list(outputs), []
        if warm:
            progress("terms of " + ", ".join(warm))
            parts = [discover_temperatures(campaign, recordings, warm, inputs, options)]
            others = [name for name in outputs if name not in warm]
        if others:
            forms = _forms(roles - {"temperature"} if warm else roles, options, others)
            parts += _each(campaign, recordings, others, inputs, forms, options, progress)
            together = not warm and forms == ("masses",)
    found = joined("discovered", parts, 0.0)
    if together:
        found = _begun(found, campaign, recordings, outputs, options)
    found.report["seconds"] = round(clock.perf_counter() - began, 2)
    return found


def _begun(
    found: Discovery,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    options: SparseOptions,
) -> Discovery:
    """Masses with their starts in a further recording: those of all outputs are warm together."""
    if not options.refine:
        return found
    return replace(found, model=fit_masses(found.model, campaign, recordings, outputs).model)


def fitting(report: Mapping[str, Any]) -> Callable[..., Fit]:
    """How a discovered model is fitted, by the report of its discovery: `fit_model`, or `fit_masses` for one
    of masses alone.
    """
    groups = report.get("groups", ())
    masses = bool(groups) and all(group["form"] == "masses" for group in groups)
    return fit_masses if masses else fit_model


def warmed(campaign: Campaign) -> bool:
    """Whether any channel says what warms or cools: only then is an error a thermal one."""
    inputs = [channel for channel in campaign.channels.values() if channel.is_input]
    return any(c.role not in (FLOW, "other input") or c.unit in ("degC", "K") for c in inputs)


def _warm(campaign: Campaign, outputs: Sequence[str], roles: set[str], options: SparseOptions) -> list[str]:
    """The temperatures among the outputs, if bodies with sensors stand behind them: where no error is among
    them, of which temperatures are a part.
    """
    if options.form != "auto" or "error" in roles:
        return []
    return [name for name in outputs if campaign.channels[name].role == "temperature"]


def _forms(roles: set[str], options: SparseOptions, outputs: Sequence[str]) -> tuple[str, ...]:
    """Forms to try, the plainer one first: "masses", and what may stand behind an output in rates."""
    states = HIDDEN if options.hidden == "auto" else (options.hidden,)
    if options.form == "masses":
        return ("masses",)
    if options.form == "rates":
        return ("own",) if options.hidden == "auto" and roles == {"error"} else states
    if options.hidden != "auto":
        return states
    if any(_names_states(word, outputs) for word in options.library or ()):
        return ("own",) if roles == {"error"} else states
    return ("masses",) if roles <= {"error", "temperature"} else ("masses", *states)


def _each(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    forms: Sequence[str],
    options: SparseOptions,
    progress: Progress,
) -> list[Discovery]:
    """A discovery of each output, or of all together where outputs move each other, as a position and its
    rate do, or two masses with a spring between them.

    Together they need no further hidden states. So this comes first, and ends the search if it leaves nothing
    but white noise; otherwise the better one on left-out data stands.
    """
    if _coupled(options.library or (), outputs) and options.form != "masses":
        whole = [form for form in forms if form != "upstream"] if len(outputs) > 1 else forms
        return [_best(campaign, recordings, outputs, inputs, whole or forms, options, progress)]
    together: list[Discovery] = []
    rates = None
    if len(outputs) > 1 and "own" in forms and options.library is None:
        rates = make_rate_data(campaign, recordings, outputs, inputs.names, options.blocks)
        coupled = options.model_copy(update={"library": (*WORDS, "coupling")})
        for one in discover_states(rates, coupled, [f for f in forms if f in ("own", "rate")], progress):
            with suppress(RunsAwayError):  # between the readings that the search has thinned out
                if leaves_noise(campaign, recordings, one.model, outputs):
                    return [one]
                together.append(one)
    parts = [_best(campaign, recordings, [name], inputs, forms, options, progress) for name in outputs]
    if not together or rates is None:
        return parts
    tried = [parts, *([one] for one in together)]
    errors = np.array([left_out_of(rates, joined("tried", one, 0.0).model) for one in tried])
    return tried[choose(errors, PREDICT if options.tolerance is None else options.tolerance)]


def _coupled(library: Sequence[str], outputs: Sequence[str]) -> bool:
    """Whether terms of a library hold other outputs in the rate of one."""
    if "coupling" in library or len(outputs) < 2:
        return "coupling" in library
    return "product" in library or any(_names_states(word, outputs, ()) for word in library)


def _names_states(word: str, outputs: Sequence[str], states: Sequence[str] = ("y", "rate", "up")) -> bool:
    """Whether a word of a library is an expression of states, or of outputs."""
    own = () if word in FAMILIES else names(parse(word, "library of the discovery"))
    return not {*states, *outputs}.isdisjoint(own)


def _best(
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str],
    inputs: Inputs,
    forms: Sequence[str],
    options: SparseOptions,
    progress: Progress,
) -> Discovery:
    """The plainest form whose free runs on what was left out are within the tolerance of the best.

    Forms are tried from the plainest on, until one leaves nothing but white noise.
    """
    found: list[Discovery] = []
    if "masses" in forms:
        progress(f"filtered inputs of {', '.join(outputs)}")
        grids = {r: make_grid(campaign, r, inputs.names, outputs) for r in recordings}
        data = MassData(make_drives(inputs, campaign, options.library), grids)
        try:
            masses = [discover_masses(data, campaign, recordings, name, options) for name in outputs]
            found.append(masses[0] if len(masses) == 1 else joined("masses", masses, 0.0))
        except UnknownTermError:
            if len(forms) == 1:
                raise
    states = [form for form in forms if form != "masses"]
    if not states:
        return found[0]
    found = [_begun(one, campaign, recordings, outputs, options) for one in found]
    rates = make_rate_data(campaign, recordings, outputs, inputs.names, options.blocks)
    errors = [left_out_of(rates, one.model) for one in found]
    binding: list[str] = []
    done = bool(found) and leaves_noise(campaign, recordings, found[0].model, outputs)
    if not done:
        rival = float(errors[0].mean()) if errors else np.inf
        for one in discover_states(rates, options, states, progress, rival, binding):
            with suppress(RunsAwayError):
                done = leaves_noise(campaign, recordings, one.model, outputs)
                found.append(one)
                errors.append(left_out_of(rates, one.model))
                if done:
                    break
    if not found:
        raise UserError(
            f"{campaign.path}: no model of {', '.join(outputs)} in the form asked for stays finite on "
            "its own readings and has the terms under keep and bounds; offer other terms under library, or "
            + "; ".join(["leave out form and hidden", *binding])
        )
    best = found[choose(np.array(errors), PREDICT if options.tolerance is None else options.tolerance)]
    if done or not binding:
        return best
    own = best.report.get("binding", [])
    return replace(best, report=best.report | {"binding": [*own, *binding]})


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
                f"{path}: the discovery adds terms into '{name}', which is not a state of this model "
                f"({', '.join(baseline.states)}); correct the name under into"
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
        return discover_rates(data, model, labels, kept(labels, options, campaign.path), options)
    always = kept(labels, options, campaign.path)
    growth = Growth(tuple(always), tuple(always), options.max_terms, restart=baseline.values())
    model, labels = grown(data, model, labels, growth, options)
    return discover_rates(data, model, labels, always, options, grown=True, tolerance=CLAIM)
