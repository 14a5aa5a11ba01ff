"""Missing heat: on the thermal network, over time, against each input and state."""

from __future__ import annotations

from typing import Any

import numpy as np

from discovery.models import Model
from discovery.models.units import differences
from discovery.report.chart import Array, Chart, Panel, Series
from discovery.report.network import drawing, listing
from discovery.report.run import Run, pretty_unit
from discovery.report.series import time_axis
from discovery.report.text import with_unit


def network(run: Run) -> dict[str, Any] | None:
    """The thermal network of the diagnosed (else the first thermal) model; its bodies show where physics is
    missing.
    """
    added = named_places(run)
    first = repaired(run) if added else diagnosed(run)
    thermal = [m for m in (first, diagnosed(run), *run.models.values()) if m is not None and _is_thermal(m)]
    if not thermal:
        return None
    model = thermal[0]
    location = (run.diagnosis or {}).get("location") or {}
    watts = {
        k: float(v)
        for k, v in (location.get("unmodelled_heat_W") or {}).items()
        if k in model.states and v is not None
    }
    shares = {k: float(v) for k, v in (location.get("states") or {}).items() if k in model.states}
    if (run.diagnosis or {}).get("verdict") == "no mismatch":
        note, heat, unit = "", {}, ""
    elif added:  # what the answer names, with its probability
        note = (
            "Orange: bodies where the answer places missing physics, with its probability, and the heat "
            "paths that the repair adds."
        )
        heat, unit = {k: v for k, v in added.items() if k in model.states}, ""
    elif any(shares.values()):
        note = "The darker a body, the more probable it is that physics is missing there."
        heat, unit = shares, ""
    elif any(watts.values()):
        note = "The darker a body, the more heat (rms) is missing there."
        heat, unit = watts, heat_unit(run)
    else:
        note, heat, unit = "", {}, ""
    return {
        "model": model.name,
        "note": note,
        "svg": drawing(model, heat, unit),
        "bodies": listing(model, heat, unit),
        "title": "Where physics is missing" if note else "The thermal network",
    }


def named_places(run: Run) -> dict[str, float]:
    """By state: the probability of the surest effect that the diagnosis names there."""
    found: dict[str, float] = {}
    for one in (run.diagnosis or {}).get("physics") or []:
        for state in one.get("states") or []:
            found[state] = max(found.get(state, 0.0), float(one.get("probability") or 0.0))
    return found


def _is_thermal(model: Model) -> bool:
    return any(state.capacity or state.unit == "degC" for state in model.states.values())


def heat_charts(run: Run) -> list[Chart]:
    """Missing heat over time and against each input and state, where the diagnosis has reconstructed it and
    it differs from zero somewhere.
    """
    missing = (run.diagnosis or {}).get("missing_heat") or {}
    if not any(
        abs(heat) > 1.96 * sd
        for one in (missing.get("over_time") or {}).values()
        for heat, sd in zip(one["heat"], one["sd"], strict=True)
    ):
        return []
    unit, place = heat_unit(run), missing.get("state", "")
    label = with_unit("missing heat" if unit == "W" else "missing rate", unit)
    charts = []
    for recording, one in (missing.get("over_time") or {}).items():
        time, heat, sd = (np.array(one[key], dtype=float) for key in ("time_s", "heat", "sd"))
        x, x_label, _ = time_axis(time)
        panel = Panel(label, _curves(x, heat, 1.96 * sd), zero=True)
        charts.append(Chart(f"heat-{recording}", f"At {place}, {recording}", x_label, (panel,)))
    for name, one in (missing.get("against") or {}).items():
        order = np.argsort(np.array(one["value"], dtype=float))
        x, heat, error = (np.array(one[key], dtype=float)[order] for key in ("value", "heat", "error"))
        if len(x) < 2:
            continue
        bins = Series("bins", x, heat, "points", "0")
        panel = Panel(label, (*_curves(x, heat, 1.96 * error), bins), zero=True)
        charts.append(
            Chart(f"heat-against-{name}", f"Against {name}", with_unit(name, unit_of(run, name)), (panel,))
        )
    return charts


def _curves(x: Array, mean: Array, half: Array) -> tuple[Series, ...]:
    return (
        Series("95 %", x, mean, "band", "0", mean - half, mean + half),
        Series("mean", x, mean, "line", "0"),
    )


def unit_of(run: Run, name: str) -> str:
    """The unit of a state of the diagnosed model or of an input; empty where it has none."""
    model = diagnosed(run)
    if model and name in model.states:
        return pretty_unit(model.states[name].unit)
    return pretty_unit(str((run.results.get("input_units") or {}).get(name, "")))


def heat_unit(run: Run) -> str:
    """W where states have capacities; else heat is a rate of the states."""
    model = diagnosed(run)
    if model is None or any(state.capacity for state in model.states.values()):
        return "W"
    units = {pretty_unit(differences(state.unit)) for state in model.states.values() if state.unit}
    return f"{units.pop()}/{model.time_unit}" if len(units) == 1 else f"unit of the state/{model.time_unit}"


def diagnosed(run: Run) -> Model | None:
    """The fitted model that the diagnosis is about, by the name of its file or its own."""
    key = diagnosed_key(run)
    return None if key is None else run.models[key]


def subject(run: Run) -> str:
    """What the page calls the model that the diagnosis is about."""
    return diagnosed_key(run) or str((run.diagnosis or {}).get("model", "the model"))


def repaired(run: Run) -> Model | None:
    """The model that the diagnosis has repaired; None where the run did not keep it."""
    entries = run.results.get("models", {})
    return next((m for key, m in run.models.items() if entries.get(key, {}).get("kind") == "repaired"), None)


def diagnosed_key(run: Run) -> str | None:
    """The name, within the run, of the model that the diagnosis is about."""
    named = (run.diagnosis or {}).get("model")
    return next((key for key, model in run.models.items() if named in (key, model.name)), None)
