"""The same page across runs: their models side by side on the recordings that they share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discovery.errors import UserError
from discovery.files import write_atomic
from discovery.models import Model
from discovery.report.page import render
from discovery.report.run import Array, Predictions, Run, load_run


def write_comparison(run_dirs: Sequence[Path], out: Path) -> Path:
    """Write one page on the models of several runs.

    A recording counts as unseen only where no run has fitted it. Each run is called by the name of its
    experiment, or of its folder where two experiments have the same name.

    Raises:
        UserError: fewer than two runs, runs without a common recording, or a run that cannot be read.
    """
    if len(run_dirs) < 2:
        raise UserError("a comparison needs two runs or more; name their folders")
    out = Path(out)
    path = out if out.suffix == ".html" else out / "comparison.html"
    write_atomic(path, render(merged([load_run(Path(folder)) for folder in run_dirs], path.parent)))
    return path


def merged(runs: Sequence[Run], folder: Path) -> Run:
    """One run that holds the models of all, on the recordings that all have."""
    labels = [run.name for run in runs]
    if len(set(labels)) < len(labels):
        labels = [run.folder.resolve().name for run in runs]
    if len(set(labels)) < len(labels):
        labels = [f"run {number}" for number, _ in enumerate(runs, start=1)]
    common = [name for name in _recordings(runs[0]) if all(name in _recordings(run) for run in runs)]
    if not common:
        each = "; ".join(
            f"{label}: {', '.join(_recordings(run))}" for label, run in zip(labels, runs, strict=True)
        )
        raise UserError(f"the runs share no recording ({each}); compare runs of one campaign")
    fitted = {name for run in runs for name in run.results.get("fit", [])}
    models: dict[str, Any] = {}
    files: dict[str, Model] = {}
    for label, run in zip(labels, runs, strict=True):
        for name, entry in run.results.get("models", {}).items():
            scores = {
                recording: entry["recordings"][recording]
                for recording in common
                if recording in entry["recordings"]
            }
            models[f"{name}, {label}"] = {**entry, "kind": entry.get("kind", name), "recordings": scores}
        files |= {f"{name}, {label}": model for name, model in run.models.items()}
    results = {
        "experiment": f"comparison of {' and '.join(labels)}",
        "fit": [name for name in common if name in fitted],
        "held_out": [name for name in common if name not in fitted],
        "units": _together(runs, "units"),
        "noise": _together(runs, "noise"),
        "parts": {part: name for part, name in _together(runs, "parts").items() if name in common},
        "simulated": any(run.results.get("simulated") for run in runs),
        "models": models,
        "inputs": {
            f"{label}: {name}": digest
            for label, run in zip(labels, runs, strict=True)
            for name, digest in run.results.get("inputs", {}).items()
        },
    }
    predictions = {
        name: _predictions(runs, labels, name)
        for name in common
        if all(name in run.predictions for run in runs)
    }
    inputs = {name: one for run in runs for name, one in run.inputs.items() if name in common}
    return Run(folder, results, None, predictions, files, inputs)


def _recordings(run: Run) -> list[str]:
    return list(
        dict.fromkeys(
            name for entry in run.results.get("models", {}).values() for name in entry.get("recordings", {})
        )
    )


def _together(runs: Sequence[Run], key: str) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for run in runs:
        part = run.results.get(key)
        if isinstance(part, Mapping):
            found |= part
    return found


def _predictions(runs: Sequence[Run], labels: Sequence[str], recording: str) -> Predictions:
    """Readings and predictions of all runs at the instants of all."""
    parts = [run.predictions[recording] for run in runs]
    time = np.unique(np.concatenate([part.time for part in parts]))

    def spread(part: Predictions, values: Array) -> Array:
        out = np.full(len(time), np.nan)
        out[np.searchsorted(time, part.time)] = values
        return out

    readings = {
        output: spread(part, values) for part in parts[::-1] for output, values in part.readings.items()
    }
    models = {
        f"{name}, {label}": {output: spread(part, values) for output, values in columns.items()}
        for label, part in zip(labels, parts, strict=True)
        for name, columns in part.models.items()
    }
    return Predictions(time, readings, models)
