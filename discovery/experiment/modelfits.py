"""One model of an experiment: how its fit starts, the fit, and the judgement of its cross-validation."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from discovery.errors import UserError
from discovery.evaluation.crossvalidation import ROUNDS, Refit
from discovery.experiment.experiment import Experiment, only
from discovery.experiment.fileunits import converted_notes, in_file_units
from discovery.experiment.fitted import Fitted, judged
from discovery.experiment.form import (
    FileEntry,
    ModelEntry,
    PysindyEntry,
    ReducedEntry,
    RegressionEntry,
    SuperpositionEntry,
    ThermobalanceEntry,
    separate,
)
from discovery.fitting import Fit, fit_model
from discovery.fitting.ridge import fit_ridge
from discovery.fitting.sequential import fit_one_at_a_time
from discovery.fitting.solve import Loss
from discovery.fitting.starts import warm_start
from discovery.models import Model, check_model
from discovery.models.dimensions import with_coefficient_units
from discovery.models.reduced import reduced
from discovery.models.regression import regression
from discovery.models.superposition import superposition
from discovery.models.thermobalance import thermobalance
from discovery.progress import Progress, silent
from discovery.recordings import Campaign
from discovery.sparse.options import SparseOptions


def fit_entry(experiment: Experiment, name: str, entry: ModelEntry, progress: Progress = silent) -> Fitted:
    """One model: start values, fit, cross-validation on the fit recordings alone; then free runs on all."""
    began = clock.perf_counter()
    progress(f"fitting {name}")
    common, experiment = experiment.fit, experiment.seen_by(entry)
    if isinstance(entry, PysindyEntry | RegressionEntry):
        fitted = compared(experiment, name, entry, progress)
    else:
        model, report, fit = fit_of(experiment, name, entry, progress)
        seconds = clock.perf_counter() - began
        refit = _refit(fit, report) if isinstance(entry, SparseOptions) else None
        fitted = judged(experiment, name, entry.kind, model, fit, report, seconds, progress, refit)
    also = [recording for recording in experiment.fit if recording not in common]
    first = [f"also fitted to {', '.join(also)}"] if also else []
    if isinstance(entry, FileEntry):
        first += converted_notes(experiment.model_file(name), fitted.start, experiment.campaign.channels)
    return replace(fitted, notes=(*first, *fitted.notes), seconds=clock.perf_counter() - began)


def _fitting(report: Mapping[str, Any]) -> Callable[..., Fit]:
    from discovery.sparse.discover import fitting

    return fitting(report)


def _refit(fit: Fit, report: Mapping[str, Any]) -> Refit:
    """Return how a discovered model is fitted to the recordings that a fold leaves."""

    def refit(campaign: Campaign, recordings: Sequence[str]) -> Fit:
        outputs = fit.problem.outputs
        return _fitting(report)(fit.model, campaign, recordings, outputs, noise=fit.noise, max_rounds=ROUNDS)

    return refit


def fit_of(
    experiment: Experiment,
    name: str,
    entry: ModelEntry,
    progress: Progress = silent,
    max_rounds: int = 60,
) -> tuple[Model, dict[str, Any], Fit]:
    """A model as its fit starts, what a search reports, and the fit to the recordings of `fit`."""
    campaign, recordings = experiment.fitting, experiment.fit
    outputs = experiment.outputs_of(entry)
    if isinstance(entry, RegressionEntry):  # its strength is found, not only its numbers
        fit = fit_ridge(campaign, recordings, outputs, experiment.inputs(entry))
        return replace(fit.problem.model, name=name), {}, fit
    if isinstance(entry, PysindyEntry):
        from discovery.sparse.plain import fit_plain, settings

        fit, _, said = fit_plain(
            campaign, recordings, outputs, experiment.inputs(entry), settings(entry.form)
        )
        return replace(fit.model, name=name), said, fit
    model, report = starting_model(experiment, name, entry, progress)
    given = [y for y in outputs if y in model.outputs or y in model.states]
    if not given:
        raise UserError(
            f"{experiment.path}: model '{name}' gives none of the outputs {', '.join(outputs)}; "
            "write them under [outputs] of the model"
        )
    if isinstance(entry, SparseOptions):
        return model, report, _fitting(report)(model, campaign, recordings, given, max_rounds=max_rounds)
    loss: Loss = getattr(entry, "loss", "linear")

    def fitted(some: Model) -> Fit:
        return fit_model(some, campaign, recordings, given, loss=loss, max_rounds=max_rounds, minima=True)

    fit = fitted(model)
    if isinstance(entry, FileEntry):
        model, fit = in_file_units(model, fit, campaign.channels, fitted)
    return model, report, fit


def compared(
    experiment: Experiment, name: str, entry: PysindyEntry | RegressionEntry, progress: Progress = silent
) -> Fitted:
    """A model to compare with, with the numbers of its own method; cross-validated by that method, too."""
    began = clock.perf_counter()
    inputs, outputs = experiment.inputs(entry), experiment.outputs_of(entry)

    report: dict[str, Any] = {}
    seen, recordings = experiment.fitting, experiment.fit
    if isinstance(entry, RegressionEntry):

        def refit(campaign: Campaign, recordings: Sequence[str]) -> Fit:
            return fit_ridge(campaign, recordings, outputs, inputs)

        fit = refit(seen, recordings)
    else:
        from discovery.sparse.plain import fit_plain, settings

        fit, best, report = fit_plain(seen, recordings, outputs, inputs, settings(entry.form))

        def refit(campaign: Campaign, recordings: Sequence[str]) -> Fit:
            return fit_plain(campaign, recordings, outputs, inputs, [best])[0]

    model = replace(fit.model, name=name)
    seconds = clock.perf_counter() - began
    return judged(experiment, name, entry.kind, model, fit, report, seconds, progress, refit)


def starting_model(
    experiment: Experiment, name: str, entry: ModelEntry, progress: Progress = silent
) -> tuple[Model, dict[str, Any]]:
    """The model that a fit starts from, and what a search reports. From here on nothing asks for the kind."""
    campaign, recordings = experiment.fitting, experiment.fit
    inputs, outputs = experiment.inputs(entry), experiment.outputs_of(entry)
    report: dict[str, Any] = {}
    match entry:
        case FileEntry():
            return experiment.model_file(name), report
        case RegressionEntry():
            model = regression(inputs, outputs, campaign.channels)
        case ReducedEntry():
            model = warm_start(reduced(inputs, outputs, campaign.channels), campaign, recordings, outputs)
        case SuperpositionEntry(separate=None):
            model = warm_start(
                superposition(inputs, outputs, campaign.channels), campaign, recordings, outputs
            )
        case SuperpositionEntry():
            alone = only(experiment.campaign, {one for names in separate(entry).values() for one in names})
            model = fit_one_at_a_time(alone, separate(entry), outputs)
        case ThermobalanceEntry():
            model = thermobalance(fluid=entry.fluid, variant=entry.speeding, jet=entry.jet)
            check_model(model, {n: c.unit for n, c in experiment.campaign.channels.items()}, experiment.path)
        case SparseOptions():
            model, report = discovered(experiment, entry, progress)
    return replace(model, name=name), report


def discovered(
    experiment: Experiment, options: SparseOptions, progress: Progress = silent
) -> tuple[Model, dict[str, Any]]:
    """What the sparse search finds on the fit recordings."""
    from discovery.sparse.discover import discover

    folder = experiment.path.parent
    found = discover(experiment.fitting, experiment.fit, experiment.outputs, options, progress, folder)
    return with_coefficient_units(found.model, experiment.campaign.channels), dict(found.report)
