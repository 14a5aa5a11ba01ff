"""The part of the page that tells what a model left out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from discovery.report.chart import Chart, Panel, Series
from discovery.report.network import drawing
from discovery.report.printed import Line, Printed
from discovery.report.run import Run, pretty_unit
from discovery.report.series import time_axis
from discovery.report.text import listed, number, percent, with_unit, words


def section(run: Run) -> dict[str, Any] | None:
    """Texts, tables and charts of the diagnosis; None where there is none."""
    d = run.diagnosis
    if not d:
        return None
    found = [_physics(d), _outputs(run, d), _windows(d), _rivals(d)]
    charts = heat_charts(run)
    return {
        "about": _about(d),
        "tables": [table for table in found if table.rows],
        "charts": charts,
        "heat_note": "Heat of unknown cause that would close the gap (band: 95 %), over time and against each input: what it follows is what is missing.",
        "next": d.get("next_experiment"),
    }


def _about(d: Mapping[str, Any]) -> str:
    verdict, model = d.get("verdict", "unknown"), d.get("model", "the model")
    text = f"Verdict on “{model}”: {verdict}."
    regime = (d.get("location") or {}).get("regime")
    if regime:
        text += f" It shows where {regime}."
    smallest = (d.get("detection") or {}).get("smallest_visible") or d.get("smallest_detectable")
    if isinstance(smallest, str):
        text += f" {smallest}"
    return text


def _physics(d: Mapping[str, Any]) -> Printed:
    rows = []
    for one in d.get("physics") or []:
        sizes = [
            f"{name} = {number(p.get('value'))} {pretty_unit(str(p.get('unit', '')))} ({number(p.get('low'))} to {number(p.get('high'))})"
            for name, p in (one.get("parameters") or {}).items()
        ]
        cells = (
            words(one["effect"]),
            listed(one.get("states", [])),
            percent(one.get("probability")),
            one.get("expression") or "",
            "; ".join(sizes),
        )
        rows.append(Line(cells))
    return Printed(
        "What the repaired model adds",
        ("Effect", "Where", "Probability", "Term", "Size (95 %)"),
        tuple(rows),
        frozenset({1, 3, 4}),
    )


def _outputs(run: Run, d: Mapping[str, Any]) -> Printed:
    detection, shares = d.get("detection") or {}, (d.get("location") or {}).get("outputs") or {}
    noise, rms = detection.get("noise") or {}, detection.get("residual_rms") or {}
    rows = [
        Line(
            (
                with_unit(name, run.unit(name)),
                number(noise.get(name)),
                number(rms.get(name)),
                percent(shares.get(name)),
            )
        )
        for name in dict.fromkeys([*rms, *noise, *shares])
    ]
    return Printed(
        "Where it shows", ("Error", "Reading noise", "Left over, rms", "Share of the mismatch"), tuple(rows)
    )


def _windows(d: Mapping[str, Any]) -> Printed:
    rows = [
        Line(
            (
                str(w.get("recording")),
                f"{number(w['start_s'] / 3600)} h",
                f"{number(w['end_s'] / 3600)} h",
                str(w.get("state") or ""),
                number(w.get("heat_W")),
            )
        )
        for w in (d.get("location") or {}).get("windows") or []
    ]
    return Printed(
        "When it shows", ("Recording", "From", "To", "Body", "Missing heat [W]"), tuple(rows), frozenset({3})
    )


def _rivals(d: Mapping[str, Any]) -> Printed:
    rows = []
    for one in d.get("alternatives") or []:
        below = one.get("log_evidence_below_best")
        judged = (
            ""
            if below is None
            else "cannot be told apart"
            if below < 3
            else "less likely"
            if below < 10
            else "ruled out"
        )
        rows.append(Line((words(one["effect"]), listed(one.get("states", [])), number(below), judged)))
    return Printed(
        "Rivals",
        ("Effect", "Where", "Log evidence below best", "With these recordings"),
        tuple(rows),
        frozenset({1, 3}),
    )


def network(run: Run) -> dict[str, str] | None:
    """The heat map on the thermal network of the diagnosed (else the first thermal) model."""
    named = str((run.diagnosis or {}).get("model", ""))
    candidates = [named, *run.models]
    model = next(
        (
            run.models[n]
            for n in candidates
            if n in run.models and any(s.capacity for s in run.models[n].states.values())
        ),
        None,
    )
    if model is None:
        return None
    location = (run.diagnosis or {}).get("location") or {}
    watts = location.get("unmodelled_heat_W") or location.get("heat_W") or {}
    if watts:
        note = "The darker a body, the more heat (rms) the recordings ask for that no term of the model provides."
        svg = drawing(model, {k: float(v) for k, v in watts.items() if k in model.states})
    elif location.get("states"):
        note = "The darker a body, the larger its share of the mismatch."
        svg = drawing(model, {k: float(v) for k, v in location["states"].items() if k in model.states}, "")
    else:
        note, svg = "", drawing(model, {})
    return {
        "model": model.name,
        "note": note,
        "svg": svg,
        "title": "Where heat is missing" if note else "The thermal network",
    }


def heat_charts(run: Run) -> list[Chart]:
    """Missing heat over time and against each input, where the diagnosis has reconstructed it."""
    charts = []
    for index, one in enumerate((run.diagnosis or {}).get("missing_heat") or []):
        time, heat = np.array(one["time_s"], dtype=float), np.array(one["heat_W"], dtype=float)
        unit = pretty_unit(str(one.get("unit", "W")))
        label = with_unit("missing heat" if unit == "W" else "missing rate", unit)
        x, x_label, _ = time_axis(time)
        series = [Series("missing heat", x, heat, "line", "0")]
        if one.get("low") and one.get("high"):
            low, high = np.array(one["low"], dtype=float), np.array(one["high"], dtype=float)
            series.insert(0, Series("95 %", x, heat, "band", "0", low, high))
        place = f"{one.get('state', '')}, {one.get('recording', '')}".strip(", ")
        charts.append(
            Chart(
                f"heat-{index}",
                f"Missing heat at {place}",
                x_label,
                (Panel(label, tuple(series), zero=True),),
            )
        )
        for name, values in (one.get("inputs") or {}).items():
            given = np.array(values["values"] if isinstance(values, Mapping) else values, dtype=float)
            axis = (
                with_unit(name, pretty_unit(str(values.get("unit", ""))))
                if isinstance(values, Mapping)
                else name
            )
            order = np.argsort(given, kind="stable")
            points = Series("missing heat", given[order], heat[order], "points", "0")
            charts.append(
                Chart(f"heat-{index}-{name}", f"Against {name}", axis, (Panel(label, (points,), zero=True),))
            )
    return charts
