"""One page on several runs: a list of them, and their models side by side on the recordings they share."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discovery.errors import UsageError, UserError
from discovery.files import write_atomic
from discovery.models import Model
from discovery.report.page import render
from discovery.report.run import Array, Predictions, Run, load_run
from discovery.report.runlist import run_list
from discovery.report.text import listed
from discovery.runfolder import DIAGNOSIS, RESULTS

_NAMED = 3  # runs that a title names
_ROUNDING = 1e-9  # of the largest reading


def write_comparison(runs: Sequence[Run], out: Path) -> Path:
    """Write one page on several runs: a list of them, and their models on the recordings that all share.

    Args:
        runs: from `load_runs`; the others are compared with the first, until the reader chooses another one.
        out: the page, or its folder.
    """
    path = out if out.suffix == ".html" else out / "comparison.html"
    listing = run_list(runs, labels_of(runs), path.parent)
    found = [merged(runs, path.parent, of) for of in groups(runs) if len(of) > 1]
    if len(found) == 1 and found[0].recordings and len(groups(runs)) == 1:
        write_atomic(path, render(found[0], listing))
    else:
        write_atomic(path, render(merged(runs, path.parent), listing, found))
    return path


def groups(runs: Sequence[Run]) -> list[list[int]]:
    """The runs that share recordings, by their places in the list; a run that shares none is a group."""
    found: list[list[int]] = []
    for k, run in enumerate(runs):
        with_it = next((of for of in found if shared_recordings([*(runs[i] for i in of), run])), None)
        if with_it is None:
            found.append([k])
        else:
            with_it.append(k)
    return found


def load_runs(folders: Sequence[Path], against: Path | None = None) -> list[Run]:
    """The runs in some folders, or within one folder that holds them.

    Args:
        against: the run to compare with, which comes first.

    Raises:
        UsageError: fewer than two runs.
        UserError: a run that cannot be read.
    """
    wanted = [*([Path(against)] if against else []), *map(Path, folders)]
    found = {folder: _within(folder) for folder in wanted}
    places = list(dict.fromkeys(place for inside in found.values() for place in inside))
    if len(places) < 2 and len(found) < 2:
        raise UsageError(
            "compare takes two or more runs, as in `discovery compare runs/one runs/two`, or a folder that "
            "holds them, as in `discovery compare runs`"
        )
    for folder, inside in found.items():
        if not inside:
            raise UserError(f"{folder}: there is no run; name the folder of a finished `discovery run`")
    if len(places) < 2:
        raise UserError(f"{places[0]}: a run cannot be compared with itself; name a second one")
    return [load_run(place) for place in places]


def _within(folder: Path) -> list[Path]:
    """A run, or all runs within a folder, by name."""
    if any((folder / name).exists() for name in (RESULTS, DIAGNOSIS)):
        return [folder]
    found = {path.parent for name in (RESULTS, DIAGNOSIS) for path in folder.rglob(name)}
    return sorted(one for one in found if not one.name.startswith("."))  # .NAME: is being written


def labels_of(runs: Sequence[Run]) -> list[str]:
    """What each run is called: by its experiment, or by its folder where two would be called the same."""
    folders = [run.folder.resolve() for run in runs]
    for labels in ([run.name for run in runs], [folder.name for folder in folders]):
        if len(set(labels)) == len(labels):
            return labels
    return ["/".join(folder.parts[-2:]) for folder in folders]


def shared_recordings(runs: Sequence[Run]) -> list[str]:
    """Recordings that all runs have predicted, with the same readings: those of another machine may have the
    same name.
    """
    return [
        name
        for name in _recordings(runs[0])
        if all(name in _recordings(run) and _same(runs[0], run, name) for run in runs)
    ]


def _same(one: Run, other: Run, recording: str) -> bool:
    if recording not in one.predictions or recording not in other.predictions:
        return one.results.get("campaign") == other.results.get("campaign")
    a, b = one.predictions[recording], other.predictions[recording]
    both = [output for output in a.readings if output in b.readings]
    return bool(both) and all(_alike(_read(a, output), _read(b, output)) for output in both)


def _alike(one: Array, other: Array) -> bool:
    """Whether readings are the same, save for the zero that a recording may have of its own."""
    if one.shape != other.shape or not np.array_equal(one[0], other[0]):
        return False
    apart = one[1] - other[1]
    return not apart.size or float(np.ptp(apart)) <= _ROUNDING * float(np.abs(one[1]).max())


def _read(data: Predictions, output: str) -> Array:
    """Times and values of the readings of an output, (2, N)."""
    known = np.isfinite(data.readings[output])
    return np.stack([data.time[known], data.readings[output][known]])


def merged(runs: Sequence[Run], folder: Path, chosen: Sequence[int] | None = None) -> Run:
    """One run that holds the models of all, on the recordings that all have; no model where they have none.

    A recording counts as held out only where no run has fitted it.

    Args:
        chosen: only these of the runs, called as in the list of all.
    """
    chosen = range(len(runs)) if chosen is None else chosen
    names = labels_of(runs)
    labels, runs = [names[k] for k in chosen], [runs[k] for k in chosen]
    common = shared_recordings(runs)
    places = [os.path.relpath(run.folder) for run in runs]
    command = shlex.join(["discovery", "compare", *places]) if len(runs) <= _NAMED else ""
    fitted = {name for run in runs for name in run.results.get("fit", [])}
    models: dict[str, Any] = {}
    files: dict[str, Model] = {}
    for label, run in zip(labels, runs, strict=True) if common else ():
        for name, entry in run.results.get("models", {}).items():
            scores = {
                recording: entry["recordings"][recording]
                for recording in common
                if recording in entry["recordings"]
            }
            models[f"{name}, {label}"] = {**entry, "kind": entry.get("kind", name), "recordings": scores}
        files |= {f"{name}, {label}": model for name, model in run.models.items()}
    results = {
        "experiment": f"comparison of {listed(labels) if len(runs) <= _NAMED else f'{len(runs)} runs'}",
        "fit": [name for name in common if name in fitted],
        "held_out": [name for name in common if name not in fitted],
        "units": _together(runs, "units"),
        "roles": _together(runs, "roles"),
        "noise": _together(runs, "noise"),
        "parts": {part: name for part, name in _together(runs, "parts").items() if name in common},
        "input_units": _together(runs, "input_units"),
        "simulated": all(run.results.get("simulated") for run in runs),
        "models": models,
        "command": command,
        "campaign": next((str(one) for run in runs if (one := run.results.get("campaign"))), ""),
    }
    predictions = {
        name: _predictions(runs, labels, name)
        for name in common
        if all(name in run.predictions for run in runs)
    }
    inputs = {name: one for run in runs for name, one in run.inputs.items() if name in common}
    return Run(folder, results, None, predictions, files, inputs)


def _recordings(run: Run) -> list[str]:
    """Return the recordings of the fit and the held-out ones, without those to which only some models are
    fitted.
    """
    scored = {
        name for entry in run.results.get("models", {}).values() for name in entry.get("recordings", {})
    }
    named = dict.fromkeys([*run.results.get("fit", []), *run.results.get("held_out", [])])
    return [name for name in named if name in scored]


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
