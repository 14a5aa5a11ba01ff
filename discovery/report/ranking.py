"""Which model is best on what no fit has seen, and by how much."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, TypeGuard

from discovery.report.run import Run

GIVEN = ("reduced", "superposition", "file", "thermobalance", "convection")


def kind(run: Run, model: str) -> str:
    """The kind of a model as the experiment names it; the name itself where results do not say."""
    return str(run.results["models"].get(model, {}).get("kind") or model)


def is_discovered(run: Run, model: str) -> bool:
    """Whether a model was found from data and not written by hand."""
    word = kind(run, model)
    return word.startswith(("sindy", "discovered", "sparse")) or (word not in GIVEN and "discover" in model)


def origin(run: Run, model: str) -> str:
    """Where a model comes from: "given" (its structure was written or chosen), "discovered", "repaired" after
    a diagnosis, or a method to compare with: "PySINDy", "regression".
    """
    if kind(run, model) in ("repaired", "regression"):
        return kind(run, model)
    if kind(run, model) == "pysindy":
        return "PySINDy"
    return "discovered" if is_discovered(run, model) else "given"


def cells(run: Run, model: str) -> dict[tuple[str, str], Mapping[str, Any]]:
    """Scores of a model by (recording, error), held-out recordings only (all where none is held out)."""
    found = run.results["models"][model].get("recordings", {})
    wanted = [r for r in run.held_out if r in found] or list(found)
    return {(r, output): score for r in wanted for output, score in found[r].items()}


def astray(run: Run, model: str) -> list[str]:
    """Held-out recordings without scores of a model: it runs away there."""
    return [r for r in run.held_out if r not in run.results["models"][model].get("recordings", {})]


def ratio(
    run: Run, model: str, other: str | None, within: Collection[tuple[str, str]] | None = None
) -> float:
    """Geometric mean over held-out recordings and errors of rms(model)/rms(other); NaN: nothing is shared.

    A ratio has no unit: um and um/m can be averaged.

    Args:
        other: None for the error without compensation.
        within: the (recording, output) pairs to use; all that the two share if None.
    """
    mine = cells(run, model)
    theirs = (
        {key: score["uncompensated"] for key, score in mine.items() if "uncompensated" in score}
        if other is None
        else cells(run, other)
    )
    logs = [
        math.log(mine[key]["rms"] / theirs[key]["rms"])
        for key in mine
        if key in theirs
        and (within is None or key in within)
        and _positive(mine[key].get("rms"))
        and _positive(theirs[key].get("rms"))
    ]
    return math.exp(sum(logs) / len(logs)) if logs else math.nan


def _positive(value: object) -> bool:
    return _is_number(value) and value > 0


def ranked(run: Run) -> list[str]:
    """Models, best first, by their rms on the held-out recordings and outputs that all have; those that run
    away on a recording, or have no score, last.
    """
    models = list(run.results.get("models", {}))
    if not models:
        return []
    reference = min(models, key=lambda model: len(astray(run, model)))  # shares the most with the others
    whole = [m for m in models if cells(run, m) and len(astray(run, m)) == len(astray(run, reference))]
    shared = set.intersection(*(set(cells(run, m)) for m in whole)) if whole else set()

    def place(model: str) -> tuple[int, float]:
        score = ratio(run, model, reference, shared if model in whole and shared else None)
        return len(astray(run, model)), score if math.isfinite(score) else math.inf

    return sorted(models, key=place)


def removed(run: Run, model: str, recording: str | None = None) -> float:
    """How much of the rms of the errors a model removes [%], by the mean that also ranks the models; NaN:
    the errors without compensation are not known.
    """
    return 100 * (
        1 - ratio(run, model, None, {key for key in cells(run, model) if recording in (None, key[0])})
    )


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and math.isfinite(value)


def is_error(run: Run) -> bool:
    """Whether the outputs are errors, which are zero where nothing is wrong."""
    if roles := run.results.get("roles"):
        return all(roles[output] == "error" for output in run.outputs if output in roles)
    return not any(run.unit(output) in ("°C", "K", "°F") for output in run.outputs)


def rms_by_unit(run: Run, model: str, recording: str | None = None) -> dict[str, list[float]]:
    """rms of each output (on a recording), by unit, because micrometres and kelvins must not be mixed."""
    found: dict[str, list[float]] = {}
    for (name, output), score in cells(run, model).items():
        if recording in (None, name) and _is_number(score.get("rms")):
            found.setdefault(rms_unit(run, output), []).append(float(score["rms"]))
    return found


def rms_units(run: Run) -> list[str]:
    """Units in which the rms of the outputs are said, in their order."""
    return list(dict.fromkeys(rms_unit(run, output) for output in run.outputs))


def rms_unit(run: Run, output: str) -> str:
    """Unit of an rms: a difference of temperatures is one of kelvins."""
    return run.unit(output).replace("°C", "K")


def mean_rms(run: Run, model: str, recording: str) -> dict[str, float]:
    """Quadratic mean of the rms over the outputs of each unit, on a recording."""
    return {
        unit: math.sqrt(sum(rms**2 for rms in found) / len(found))
        for unit, found in rms_by_unit(run, model, recording).items()
    }
