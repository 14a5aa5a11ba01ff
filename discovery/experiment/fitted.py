"""What became of a model of the experiment, whatever its kind: its fit judged, free runs, notes."""

from __future__ import annotations

import time as clock
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import at_rest
from discovery.dynamics import predict as model_outputs
from discovery.errors import RunsAwayError
from discovery.evaluation import evaluate
from discovery.evaluation.budget import Budget, budget
from discovery.evaluation.crossvalidation import Refit, cross_validate
from discovery.experiment.experiment import Experiment
from discovery.fitting import Fit, predict_recording
from discovery.models import Model
from discovery.models.convection import validity_of_model
from discovery.models.dimensions import check_dimensions
from discovery.models.units import differences
from discovery.progress import Progress, silent
from discovery.recordings import Channel

Array = NDArray[np.float64]
_AT_BOUND = 1e-4  # share of a bound that counts as at it
_NEGLIGIBLE = 0.01  # of the spread of an input: a smaller offset is not reported
_UNREST = 0.5  # of what a state moves in all: so far from its balance it was in none
_FAR = 3.0  # spreads of an input: a larger offset is told to be too large


@dataclass(frozen=True)
class Prediction:
    """Free run of a model on a recording, at its readings: time (R,) in s, readings and predicted (R, Y)."""

    outputs: tuple[str, ...]
    time: Array
    readings: Array
    predicted: Array
    reference: Array  # (Y,) what would be assumed without a model: no error, or the first temperature
    budget: Budget | None = None  # of heat and fluid; None for a model without heat capacities

    def scores(self) -> dict[str, dict[str, Any]]:
        """Criteria by output."""
        columns = zip(self.outputs, self.readings.T, self.predicted.T, self.reference, strict=True)
        return {name: evaluate(read, predicted, float(zero)) for name, read, predicted, zero in columns}


@dataclass(frozen=True)
class Fitted:
    """A model of the experiment, whatever its kind, with what became of it."""

    name: str
    kind: str
    start: Model  # that the fit began from
    fit: Fit
    predictions: Mapping[str, Prediction]  # by recording
    cross_validation: Mapping[str, Mapping[str, float]]
    report: Mapping[str, Any]  # what the search has to say
    notes: tuple[str, ...]
    seconds: float

    @property
    def model(self) -> Model:
        """The fitted model."""
        return self.fit.model


def judged(
    experiment: Experiment,
    name: str,
    kind: str,
    model: Model,
    fit: Fit,
    report: Mapping[str, Any] | None = None,
    seconds: float = 0.0,
    progress: Progress = silent,
    refit: Refit | None = None,
) -> Fitted:
    """A model and its fit: cross-validation on the fit recordings alone, free runs on all, notes."""
    began = clock.perf_counter() - seconds
    outputs = fit.problem.outputs
    validation: Mapping[str, Mapping[str, float]] = {}
    lost = []
    if experiment.form.cross_validate:
        progress(f"cross-validating {name}")
        try:
            seen, names = experiment.fitting, experiment.fit
            validation = cross_validate(fit.model, seen, names, outputs, fit.noise, refit)
        except RunsAwayError:  # a finding about the model, no mistake of the user's
            lost.append(f"the fit of {name} diverges if a part of the readings is left out: do not trust it")
    seconds = clock.perf_counter() - began
    predictions = {r: predict(fit, experiment, r) for r in experiment.fit}
    for recording in experiment.held_out:
        try:
            predictions[recording] = predict(fit, experiment, recording)
        except RunsAwayError as error:
            lost.append(str(error))
    notes = [
        *missing_outputs(experiment, name, model),
        *coarse_notes(fit),
        *lost,
        *fit.unidentified,
        *check_dimensions(model, experiment.campaign.channels),
    ]
    notes += bound_notes(fit.model, remedy_of_limits(experiment, name))
    notes += (report or {}).get("binding", ())
    notes += offset_notes(fit, experiment.campaign.channels)
    notes += start_notes(fit)
    notes += validity_of_model(fit.model, experiment.fitting, experiment.fit)
    return Fitted(name, kind, model, fit, predictions, validation, report or {}, tuple(notes), seconds)


def missing_outputs(experiment: Experiment, name: str, model: Model) -> list[str]:
    """A sentence where a model of the experiment lacks outputs that the experiment asks for.

    That may be meant (a model of the temperatures alone), or a slip in the name of an output.
    """
    entry = experiment.form.models.get(name)
    given = {*model.outputs, *model.states}
    missing = [output for output in (experiment.outputs_of(entry) if entry else ()) if output not in given]
    if not missing:
        return []
    spare = [output for output in model.outputs if output not in experiment.campaign.channels]
    near = [(output, hit) for output in missing for hit in get_close_matches(output, spare, n=1)]
    hint = "".join(f"; is its output '{hit}' meant to be '{output}'?" for output, hit in near)
    return [f"gives no {', '.join(missing)}, which the experiment asks for, and is not compared there{hint}"]


def coarse_notes(fit: Fit) -> list[str]:
    """A sentence where recordings hold so many instants that the fit works on a coarser grid."""
    grids = [s.grid for s in fit.problem.systems if s.grid.instants]
    if not grids:
        return []
    largest = max(grids, key=lambda grid: grid.instants)
    names = ", ".join(grid.recording for grid in grids)
    readings = int(max(largest.means.counts.max(), 1)) if largest.means else 1
    return [
        f"{names}: up to {largest.instants} instants, finer than needed; readings are averaged to "
        f"{len(largest.read)} means of up to {readings}, and the rms is that of the means; inputs are "
        f"averaged over {float(np.median(largest.step)):.3g} s, but large steps keep their times"
    ]


def remedy_of_limits(experiment: Experiment, name: str) -> str:
    """Where the limits of a model of the experiment can be changed: in its file, or in a copy of the fitted
    one, which becomes its file.
    """
    file = getattr(experiment.form.models.get(name), "file", None)
    if file:
        return f"change the limit in {file}"
    return (
        f"to change the limit, copy models/{name}.toml of the results next to the experiment, change it "
        f'there, and write {{ file = "{name}.toml" }} for this model into [models]'
    )


def bound_notes(model: Model, remedy: str) -> list[str]:
    """A sentence for each number that stands at a bound other than zero: the readings ask for more."""
    notes = []
    for name, p in model.parameters.items():
        for bound, which in ((p.min, "lower"), (p.max, "upper")):
            near = _AT_BOUND * max(abs(bound), 1e-12) if np.isfinite(bound) else 0.0
            unit = "" if p.unit == "1" else f" {p.unit}"
            if near and bound != 0 and not p.fixed and abs(p.value - bound) <= near:
                notes.append(
                    f"{name} is at its {which} limit, {bound:.4g}{unit}: {remedy}; or diagnose what the "
                    "model lacks"
                )
    return notes


def offset_notes(fit: Fit, channels: Mapping[str, Channel]) -> list[str]:
    """One sentence for each input known only within a spread: what the fit makes of it, if anything."""
    notes = []
    for name, found in fit.offsets.items():
        if max(abs(value) for value, _ in found.values()) < _NEGLIGIBLE * channels[name].spread:
            continue  # no reading contradicts what was given
        low, high = (pick(found, key=lambda r: found[r][0]) for pick in (min, max))
        unit = differences(channels[name].unit)
        most = f" to {found[high][0]:+.2g} {unit} in '{high}'" if high != low else ""
        times = max(abs(value) for value, _ in found.values()) / channels[name].spread
        far = ", far beyond it: the model lacks something, or `spread` is too small" if times > _FAR else ""
        notes.append(
            f"{name} is known within {channels[name].spread:.3g} {unit}; estimated offset: "
            f"{found[low][0]:+.2g} {unit} in '{low}'{most}{far}; in a held-out recording, these and "
            "the first reading are used to estimate it"
        )
    return notes


def start_notes(fit: Fit) -> list[str]:
    """A sentence where states that nobody reads begin in balance with the first inputs of a recording, and a
    state that is read there was in no balance: a machine that was just switched on.
    """
    for t in fit.trajectories:
        grid, model = t.system.grid, t.system.model
        unread = [n for n, s in model.states.items() if s.start is None and not s.memory]
        if not unread:
            return []
        try:
            rest = at_rest(t.system, t.values)
        except RunsAwayError:  # a model that is far from any balance has none to compare with
            continue
        for name, x in zip(t.system.states, rest, strict=True):
            state = model.states[name]
            shown = grid.readings[:, grid.outputs.index(state.read_as)] if state.read_as else np.zeros(0)
            read = shown[np.isfinite(shown)]
            if len(read) and abs(x - read[0]) > _UNREST * np.ptp(read):
                away = f"{abs(x - read[0]):.2g} {differences(state.unit)}"
                return [
                    f"'{grid.recording}' begins where {name} is {away} from its balance with the first "
                    f"inputs, and {', '.join(unread)} without a start in that balance; if the machine was "
                    f'just switched on, write how it began, as start = "{name}"'
                ]
    return []


def predict(fit: Fit, experiment: Experiment, recording: str) -> Prediction:
    """Free run with the fitted model, zeroed on the first reading as on a controller."""
    outputs = fit.problem.outputs
    trajectory = predict_recording(
        fit.model,
        experiment.campaign,
        recording,
        outputs,
        fit.noise.white,
        known=fit.offset_in(recording),
        zeros=fit.zeros,
    )
    grid = trajectory.system.grid
    reference = np.zeros(len(outputs))
    for y, name in enumerate(outputs):
        taken = grid.readings[grid.measured[:, y], y]
        if experiment.campaign.channels[name].role != "error" and len(taken):
            reference[y] = taken[0]
    predicted = model_outputs(trajectory)
    heat = budget(trajectory, experiment.campaign)
    return Prediction(outputs, grid.time[grid.read], grid.readings, predicted, reference, heat)
