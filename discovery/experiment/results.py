"""What a run leaves behind: results.json, diagnosis.json, models, predictions."""

from __future__ import annotations

import csv
import io
import json
import math
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

import discovery
from discovery.evaluation.paper import parts_of_the_paper
from discovery.evaluation.recommendation import recommend
from discovery.evaluation.shares import term_shares
from discovery.experiment.document import ResultsDocument
from discovery.experiment.experiment import Experiment
from discovery.experiment.inputfiles import hashes, input_files
from discovery.experiment.quality import guessed
from discovery.files import write_atomic
from discovery.models import Model, write_model
from discovery.models.equations import equations
from discovery.recordings.finding import Finding, folded
from discovery.recordings.roles import is_input
from discovery.report.chart import thinned
from discovery.runfolder import DIAGNOSIS, INPUTS, RESULTS

if TYPE_CHECKING:
    from discovery.experiment.fitted import Fitted

Array = NDArray[np.float64]

_SHOWN = 500  # points of an input that the page draws
_PACKAGES = ("numpy", "scipy", "numba", "pandas", "scikit-learn", "pysindy", "pint")


def write_run(
    folder: Path,
    verb: str,
    experiment: Experiment,
    fitted: Mapping[str, Fitted],
    diagnosis: Mapping[str, Any] | None,
    seconds: float,
    findings: Sequence[Finding],
    further: Mapping[str, Any] | None = None,
) -> None:
    """Everything that a run leaves behind but the report.

    Args:
        verb: of the command that made it.
        findings: what is wrong with the recordings.
        further: what results.json holds in addition to the models: "role_matrix", "paper".
    """
    document = results_document(verb, experiment, fitted, seconds, findings, further)
    write_json(folder / RESULTS, document.model_dump(exclude_unset=True))
    write_json(folder / INPUTS, inputs_over_time(experiment))
    if diagnosis is not None:
        write_json(folder / DIAGNOSIS, diagnosis)
    for name, one in fitted.items():
        write_model(folder / "models" / f"{name}.toml", one.model)
    for recording in (*experiment.fit, *experiment.held_out):
        if any(recording in one.predictions for one in fitted.values()):
            write_atomic(folder / "predictions" / f"{recording}.csv", predictions_table(recording, fitted))


def command_of(verb: str, experiment: Experiment) -> str:
    """The command that makes a run, as one would type it."""
    return shlex.join(["discovery", verb, str(experiment.path)])


def results_document(
    verb: str,
    experiment: Experiment,
    fitted: Mapping[str, Fitted],
    seconds: float,
    findings: Sequence[Finding],
    further: Mapping[str, Any] | None = None,
) -> ResultsDocument:
    """The content of results.json."""
    channels = experiment.campaign.channels
    content = {
        "experiment": experiment.name,
        "command": command_of(verb, experiment),
        "campaign": experiment.campaign.name,
        "campaign_file": str(experiment.campaign.path.resolve()),  # an export may start elsewhere
        "simulated": experiment.campaign.simulated,
        "fit": list(experiment.fit),
        "held_out": list(experiment.held_out),
        "outputs": list(experiment.outputs),
        "roles": {name: channels[name].role for name in experiment.outputs},
        "units": {name: channels[name].unit for name in experiment.outputs},
        "input_units": {name: c.unit for name, c in channels.items() if name not in experiment.outputs},
        "noise": {name: channels[name].noise for name in experiment.outputs},
        "parts": parts_of_the_paper(experiment.campaign, experiment.fit, experiment.held_out),
        "notes": {name: r.note for name, r in experiment.campaign.recordings.items() if r.note},
        "findings": folded(findings),
        "guessed": guessed(experiment),
        "models": {name: model_entry(one) for name, one in fitted.items()},
        "recommended": recommended(experiment, fitted),
        "seconds": seconds,
        "versions": versions(),
        "inputs": hashes(input_files(experiment)),
        **(further or {}),
    }
    return ResultsDocument.model_validate(_plain(content))


def inputs_over_time(experiment: Experiment) -> dict[str, dict[str, dict[str, Any]]]:
    """By recording and input: `time` [s] and `value`, and whether it is `held` between them. Of a held input
    the changes are listed, of others (and of too many changes) the lowest and highest of each bin; constant
    inputs are not.
    """
    found: dict[str, dict[str, dict[str, Any]]] = {}
    for name in (*experiment.fit, *experiment.held_out):
        one = experiment.campaign.recordings[name]
        for channel, values in one.values.items():
            known = values[np.isfinite(values)]
            if is_input(experiment.campaign.channels[channel].role) and known.size and np.ptp(known) > 0:
                held = experiment.campaign.channels[channel].between == "held"
                time, value = _changes(one.time, values) if held else (one.time, values)
                time, value = thinned(time, value, _SHOWN)
                found.setdefault(name, {})[channel] = {"time": time, "value": value, "held": held}
    return found


def _changes(time: Array, value: Array) -> tuple[Array, Array]:
    """Where a held input changes, with the first and the last instant."""
    known = np.isfinite(value)
    time, value = time[known], value[known]
    keep = np.flatnonzero(np.diff(value)) + 1
    index = np.unique([0, *keep, len(value) - 1])
    return time[index], value[index]


def recommended(experiment: Experiment, fitted: Mapping[str, Fitted]) -> dict[str, dict[str, Any]]:
    """By output: the model that is best on the held-out recordings, and how far behind the others are [%]."""
    found = {}
    for output in experiment.outputs:
        left: dict[str, list[Array]] = {}
        for name, one in fitted.items():
            runs = [one.predictions[r] for r in experiment.held_out if r in one.predictions]
            left[name] = [
                run.readings[:, y] - run.predicted[:, y]
                for run in runs
                for y in [k for k, given in enumerate(run.outputs) if given == output]
            ]
        best = recommend(output, left)
        if best is not None:
            found[output] = {
                "model": best.best,
                "rms": best.rms,
                "ties": list(best.ties),
                "against": {one.model: asdict(one) for one in best.others},
            }
    return found


def model_entry(one: Fitted) -> dict[str, Any]:
    """One model in results.json; terms and parameters are counted over all its equations."""
    model = one.model
    return {
        "kind": one.kind,
        "terms": len(model.terms),
        "parameters": len(model.free),
        "seconds": one.seconds,
        "equations": equations(model),
        "shares": term_shares(one.fit),
        "recordings": {name: prediction.scores() for name, prediction in one.predictions.items()},
        "cross_validation": one.cross_validation,
        "values": parameter_values(model),
        "noise": dict(zip(one.fit.noise.outputs, one.fit.noise.white, strict=True)),
        "notes": list(one.notes),
        **({"budgets": budgets} if (budgets := budgets_of(one)) else {}),
        **({"search": one.report} if one.report else {}),
    }


def budgets_of(one: Fitted) -> dict[str, dict[str, Any]]:
    """Energy and fluid budget [MJ] by recording; empty for a model without heat capacities."""
    return {
        name: {**asdict(p.budget), "gap": p.budget.gap} for name, p in one.predictions.items() if p.budget
    }


def parameter_values(model: Model) -> dict[str, dict[str, Any]]:
    """Value, 95 % interval and unit of each parameter."""
    found = {}
    for name, p in model.parameters.items():
        entry: dict[str, Any] = {"value": p.value, "low": p.low, "high": p.high, "unit": p.unit}
        found[name] = (
            entry
            | ({"fixed": True} if p.fixed else {})
            | ({"recordings": dict(p.values)} if p.values else {})
            | ({"intervals": {run: list(ends) for run, ends in p.intervals.items()}} if p.intervals else {})
        )
    return found


def predictions_table(recording: str, fitted: Mapping[str, Fitted]) -> str:
    """CSV with a row for each reading: time, then each output as read, then OUTPUT|MODEL as predicted."""
    measured: dict[str, dict[float, float]] = {}
    predicted: dict[str, dict[float, float]] = {}
    for name, one in fitted.items():
        p = one.predictions.get(recording)
        if p is None:  # the model runs away there, its notes say so
            continue
        stamps = [float(t) for t in p.time]
        for y, output in enumerate(p.outputs):
            measured[output] = measured.get(output, {}) | dict(
                zip(stamps, p.readings[:, y].tolist(), strict=True)
            )
            predicted[f"{output}|{name}"] = dict(zip(stamps, p.predicted[:, y].tolist(), strict=True))
    columns = measured | predicted
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time", *columns])
    for t in sorted({t for column in columns.values() for t in column}):
        writer.writerow([f"{t:.10g}", *(_cell(column.get(t, math.nan)) for column in columns.values())])
    return text.getvalue()


def _cell(value: float) -> str:
    return "" if math.isnan(value) else f"{value:.6g}"


def versions() -> dict[str, str]:
    """Of Python, of the workbench and of the packages that its figures depend on."""
    found = {"python": sys.version.split()[0], "discovery": discovery.__version__}
    for name in _PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            continue
    return found


def write_json(path: Path, content: Mapping[str, Any]) -> None:
    """JSON with six significant digits and null for what is not a number."""
    write_atomic(path, json.dumps(_plain(content), indent=1, ensure_ascii=False, allow_nan=False) + "\n")


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, (list, tuple, set, frozenset)):
        return [_plain(item) for item in value]
    if isinstance(value, np.generic):
        return _plain(value.item())
    if isinstance(value, float):
        return float(f"{value:.6g}") if math.isfinite(value) else None
    return value
