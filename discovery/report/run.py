"""A run folder as it lies on disk: results, diagnosis, predictions and models."""

from __future__ import annotations

import csv
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.files import read_text
from discovery.models import Model
from discovery.models.modelfile import read_model
from discovery.runfolder import DIAGNOSIS, INPUTS, RESULTS, read_diagnosis, read_results

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Predictions:
    """Readings of a recording and what each model made of them.

    `time` (N,) in s; `readings[output]` (N,) with NaN where nothing was read; `models[model][output]` (N,).
    """

    time: Array
    readings: Mapping[str, Array]
    models: Mapping[str, Mapping[str, Array]]

    def left_over(self, model: str, output: str) -> Array:
        """Reading minus model (N,), NaN where nothing was read."""
        return np.asarray(self.readings[output] - self.models[model][output])


@dataclass(frozen=True)
class Run:
    """Everything that a report is made from. `inputs`: by recording and input, time [s] and value (K,) of
    the curve; a held input is a curve of steps.
    """

    folder: Path
    results: Mapping[str, Any]
    diagnosis: Mapping[str, Any] | None
    predictions: Mapping[str, Predictions]
    models: Mapping[str, Model]
    inputs: Mapping[str, Mapping[str, tuple[Array, Array]]] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the experiment."""
        return str(self.results.get("experiment", self.folder.name))

    @property
    def outputs(self) -> list[str]:
        """Errors that were compared, in the order of the results."""
        found: dict[str, None] = {}
        for model in self.results.get("models", {}).values():
            for recording in model.get("recordings", {}).values():
                found |= dict.fromkeys(recording)
        for recording in self.predictions.values():
            found |= dict.fromkeys(recording.readings)
        return list(found)

    @property
    def held_out(self) -> list[str]:
        """Recordings that no fit has seen."""
        return list(self.results.get("held_out", []))

    @property
    def recordings(self) -> list[str]:
        """Recordings with predictions: held-out ones first, since they are the proof."""
        order = [*self.held_out, *self.results.get("fit", [])]
        return sorted(self.predictions, key=lambda name: order.index(name) if name in order else len(order))

    def unit(self, output: str) -> str:
        """Unit of an error, as the results state it, else as its name implies (ISO 230-1)."""
        stated = self.results.get("units", {})
        if output in stated:
            return pretty_unit(str(stated[output]))
        for model in self.models.values():
            if output in model.states:
                return pretty_unit(model.states[output].unit)
        return "µm/m" if output[:3] in ("E_A", "E_B", "E_C") else "µm" if output.startswith("E_") else ""

    def noise(self, output: str) -> float | None:
        """Reading noise (standard deviation, unit of the output): stated in the campaign, else the least that
        the diagnosis or a fit found, because what a model does not explain passes for noise.
        """
        if stated := self.results.get("noise", {}).get(output):
            return float(stated)
        parts = [(self.diagnosis or {}).get("detection", {}), *self.results.get("models", {}).values()]
        found = [float(size) for part in parts if (size := (part.get("noise") or {}).get(output))]
        return min(found, default=None)

    def band(self, model: str, output: str) -> float | None:
        """Half width of the 95 % prediction band of a model: 1.96 times its rms in cross-validation; with
        recordings left out where there are several, else with blocks of time.
        """
        found = self.results.get("models", {}).get(model, {}).get("cross_validation") or {}
        rms = (found.get("recordings") or found.get("blocks") or {}).get(output)
        return 1.96 * float(rms) if rms else None


def load_run(folder: Path) -> Run:
    """Read a run folder; what is not there is left out.

    Raises:
        UserError: no results in the folder, or a file in it cannot be read.
    """
    folder = Path(folder)
    has_results, has_diagnosis = (folder / RESULTS).exists(), (folder / DIAGNOSIS).exists()
    if not has_results and not has_diagnosis:
        raise UserError(
            f"{folder}: neither results.json nor diagnosis.json is there; "
            "make them with `discovery run EXPERIMENT`"
        )
    results = read_results(folder) if has_results else {}
    diagnosis = read_diagnosis(folder) if has_diagnosis else None
    predictions = {
        path.stem: read_predictions(path) for path in sorted((folder / "predictions").glob("*.csv"))
    }
    models = {path.stem: read_model(path) for path in sorted((folder / "models").glob("*.toml"))}
    return Run(folder, results, diagnosis, predictions, models, read_inputs(folder / INPUTS))


def read_inputs(path: Path) -> dict[str, dict[str, tuple[Array, Array]]]:
    """Inputs over time by recording; empty where the run left none. Raises UserError for a broken file."""
    if not path.exists():
        return {}
    try:
        return {
            recording: {
                name: _curve(np.array(one["time"], dtype=float), np.array(one["value"], dtype=float), one)
                for name, one in inputs.items()
            }
            for recording, inputs in json.loads(read_text(path)).items()
        }
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise UserError(f"{path}: cannot be read ({error}); make the run again") from None


def _curve(time: Array, value: Array, one: Mapping[str, Any]) -> tuple[Array, Array]:
    """The curve of an input: a held one keeps its value until the next."""
    return (np.repeat(time, 2)[1:], np.repeat(value, 2)[:-1]) if one.get("held") else (time, value)


def read_predictions(path: Path) -> Predictions:
    """A file with the columns time, NAME and NAME|model. Raises UserError for anything else."""
    rows = list(csv.reader(read_text(path).splitlines()))
    if not rows or "time" not in rows[0]:
        raise UserError(f"{path}, line 1: the column 'time' is missing; make the run again")
    columns: list[list[float]] = [[] for _ in rows[0]]
    for number, row in enumerate(rows[1:], start=2):
        if len(row) != len(columns):
            raise UserError(f"{path}, line {number}: {len(row)} cells where {len(columns)} are expected")
        for column, cell in zip(columns, row, strict=True):
            column.append(_number(cell, path, number))
    table = {name: np.array(column) for name, column in zip(rows[0], columns, strict=True)}
    time = table.pop("time")
    models: dict[str, dict[str, Array]] = {}
    for name in [name for name in table if "|" in name]:
        output, model = name.split("|", 1)
        models.setdefault(model, {})[output] = table.pop(name)
    return Predictions(time, table, models)


def _number(cell: str, path: Path, line: int) -> float:
    try:
        return float(cell) if cell else math.nan
    except ValueError:
        raise UserError(f"{path}, line {line}: '{cell}' is not a number") from None


_PRETTY = {"um": "µm", "um/m": "µm/m", "degC": "°C", "1": "", "delta_degC": "K"}


def pretty_unit(unit: str) -> str:
    """A unit in print.

    >>> pretty_unit("um/m"), pretty_unit("1"), pretty_unit("degC/h"), pretty_unit("W/K/(l/min)")
    ('µm/m', '', 'K/h', 'W/K per l/min')
    """
    return _PRETTY.get(
        unit,
        unit.replace("/(l/min)", " per l/min")
        .replace("**2", "²")
        .replace("**3", "³")
        .replace("**", "^")
        .replace("*", "·")
        .replace("delta_degC", "K")
        .replace("degC", "K")
        .replace("um", "µm"),
    )
