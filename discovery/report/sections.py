"""Parts of the page: models in detail, the search, residuals, recordings, how to reproduce."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from discovery import __version__
from discovery.evaluation import rolematrix
from discovery.evaluation.tables import budget_tables
from discovery.models import Model
from discovery.printed import counted
from discovery.report import equations, heat, series
from discovery.report.chart import Chart, Panel, Series
from discovery.report.printed import Line, Printed, printed
from discovery.report.ranking import is_discovered, is_error, ranked
from discovery.report.run import Run
from discovery.report.text import number, percent
from discovery.terms import names

_MOST_DETAILED = 6  # models with a section of their own
_OFTEN = 0.2  # share of the repeated searches from which a term is listed


def detailed(run: Run) -> list[str]:
    """The models whose equations are worth a section: best, best discovered, diagnosed and repaired ones."""
    order = [name for name in ranked(run) if name in run.models] or list(run.models)
    wanted = [*order[:1], *[name for name in order if is_discovered(run, name)][:1]]
    subject = heat.diagnosed(run)
    wanted += [
        name for name, model in run.models.items() if model is subject or any(t.effect for t in model.terms)
    ]
    return list(dict.fromkeys(wanted))[:_MOST_DETAILED]


def model(run: Run, name: str) -> dict[str, Any]:
    """A model in detail: equations, terms with their numbers and shares, what is worth knowing."""
    model = _as_answered(run, run.models[name])
    entry = run.results.get("models", {}).get(name, {})
    shares = entry.get("shares") or {}
    sizes = {"state": model.states, "term": model.terms, "free parameter": model.free}
    count = ", ".join(counted(len(items), word) for word, items in sizes.items())
    rates = (
        ""
        if model.time_unit == "s" or any(s.capacity for s in model.states.values())
        else f" Time in {model.time_unit}."
    )
    return {
        "name": name,
        "about": f"{count}.{rates}",
        "equations": equations.equations(model),
        "rows": equations.rows(model, shares),
        "shares": bool(shares),
        "share_note": "Share: how much the outputs change without the term, to first order. "
        "All terms together are 100 %.",
        "others": equations.other_values(model),
        "capacities": equations.capacities(model),
        "notes": entry.get("notes") or [],
    }


def _as_answered(run: Run, model: Model) -> Model:
    """The model with the intervals of the answer at the effects that the diagnosis has added: those allow for
    other explanations, too.
    """
    stated = {
        name: p for one in (run.diagnosis or {}).get("physics") or [] for name, p in one["parameters"].items()
    }
    added = {name for term in model.terms if term.effect for name in names(term.expression)} & set(stated)
    parameters = {
        name: replace(p, low=stated[name]["low"], high=stated[name]["high"]) if name in added else p
        for name, p in model.parameters.items()
    }
    return replace(model, parameters=parameters)


def discovery(run: Run, order: Sequence[str]) -> dict[str, Any] | None:
    """How models were found: error against size, stability of terms; None where nothing was searched."""
    names = [
        name for name in order or ranked(run) if run.results.get("models", {}).get(name, {}).get("search")
    ]
    if not names:
        return None
    charts: list[Chart] = []
    tables: list[Printed] = []
    for name in names:
        entry = run.results["models"][name]["search"]
        charts += _pareto(name, entry.get("path") or [])
        costs = [pair for group in entry.get("groups") or [] for pair in _costs(group)]
        if costs:
            head = f"{name}: increase of the rms on left-out data without each term"
            tables.append(Printed(head, ("Term", "Increase"), tuple(Line(pair) for pair in costs)))
        if entry.get("stability"):
            shares = sorted(entry["stability"].items(), key=lambda pair: -pair[1])
            rare = [share for _, share in shares if share < _OFTEN]
            shares = [pair for pair in shares if pair[1] >= _OFTEN]
            rows = tuple(Line((str(term), percent(share))) for term, share in shares)
            rows += (Line((f"{len(rare)} others", f"< {percent(_OFTEN)}")),) if rare else ()
            tables.append(
                Printed(
                    f"{name}: share of repeated searches, each on a part of the data, that choose the term",
                    ("Term", "Chosen"),
                    rows,
                )
            )
    about = (
        "A term is added only if it lowers the error on data that the choice has not used. "
        "A term that is chosen in most repetitions does not depend on which hours were recorded."
    )
    return {"about": about, "charts": charts, "tables": tables}


def _costs(group: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Each term of a group of outputs and by how much the rms on what was left out grows without it."""
    where = ", ".join(group.get("outputs") or [])
    known = {term: cost for term, cost in (group.get("costs") or {}).items() if cost is not None}
    costs = sorted(known.items(), key=lambda pair: -pair[1])
    return [(f"{where}: {term}", f"+{100 * cost:.1f} %".replace("+-", "−")) for term, cost in costs]


def _pareto(name: str, path: Sequence[Mapping[str, Any]]) -> list[Chart]:
    """Error against size, one chart for each group of outputs that was searched together."""
    charts = []
    for outputs in dict.fromkeys(tuple(point["outputs"]) for point in path):
        points = sorted((p for p in path if tuple(p["outputs"]) == outputs), key=lambda p: p["terms"])
        if len(points) < 2:
            continue
        terms = np.array([float(p["terms"]) for p in points])
        curves = []
        for key, label, color in (
            ("left_out_rms", "on data left out", "0"),
            ("fit_rms", "on data fitted", "1"),
        ):
            error = np.array([math.nan if p.get(key) is None else float(p[key]) for p in points])
            curves += [
                Series(label, terms, error, "line", color),
                Series(label, terms, error, "points", color),
            ]
        chosen = [float(p["terms"]) for p in points if p.get("chosen")]
        marks = {"chosen": chosen[0]} if chosen else {}
        title = f"{name}: {', '.join(outputs)}, error against size"
        panel = Panel("rms [reading noise]", tuple(curves))
        charts.append(Chart(f"size-{name}-{outputs[0]}", title, "terms [-]", (panel,), marks=marks))
    return charts


def residual(run: Run, order: Sequence[str]) -> dict[str, Any] | None:
    """Residuals of the best model on the first held-out recording; None without predictions."""
    recording = next((r for r in run.recordings if r in run.held_out), next(iter(run.recordings), None))
    if recording is None or not order:
        return None
    model = order[0]
    rows = series.residual_table(run, model, recording)
    if not rows:
        return None
    heads = {
        "rms": "rms",
        "ratio": "rms / noise",
        "mean": "mean",
        "memory": "correlation of neighbours",
        "largest": "largest",
        "beyond": "beyond 3σ [%]",
        "inside": "inside the 95 % band [%]",
        "count": "readings",
    }
    known = [key for key in heads if any(row[key] is not None for row in rows)]
    lines = tuple(
        Line((f"{row['output']} [{row['unit'] or '-'}]", *(number(row[k]) for k in known))) for row in rows
    )
    header = ("Error" if is_error(run) else "Output", *(heads[key] for key in known))
    return {
        "about": f"Reading minus “{model}” on {recording}. Pure sensor noise would have no correlation "
        "between neighbouring readings: all bars would be inside the band.",
        "table": Printed(f"Residuals on {recording}", header, lines),
        "charts": series.residual_charts(run, model, recording),
    }


def roles(run: Run) -> dict[str, Any] | None:
    """Cross-validation over roles; None where the experiment names none."""
    found = run.results.get("role_matrix")
    if not found:
        return None
    units = {error: run.unit(error) for error in run.outputs}
    return {
        "about": "Each role was left out of fit and search in turn, and every model was fitted to the "
        "others. "
        "Each column shows the error on a role when it was left out. The last column is the mean over the "
        "recordings that were fitted.",
        "summary": printed(rolematrix.left_out(found, units), left=[1]),
        "matrices": [printed(rolematrix.matrix(found, e, units[e]), left=[1]) for e in run.outputs],
        "steadiness": [printed(rolematrix.steadiness(found, m), left=[1, 2]) for m in found["models"]],
        "lost": [f"{name} {line}" for name, one in found["models"].items() for line in one["lost"]],
    }


def budgets(run: Run) -> dict[str, Any] | None:
    """Energy and fluid budgets by the best model that has heat capacities; None where there is none."""
    models = run.results.get("models", {})
    order = [name for name in ranked(run) if models[name].get("budgets")]
    if not order:
        return None
    found = models[order[0]]["budgets"]
    return {
        "about": f"Heat flows of the fitted model “{order[0]}”, integrated over each recording. Heat that "
        "enters but is not stored would be an error of the integration.",
        "tables": [printed(table) for table in budget_tables(found)],
    }


def quality(run: Run) -> dict[str, Any] | None:
    """Readings of each recording and the faults that were found; None without predictions."""
    rows = []
    for recording in run.recordings:
        data = run.predictions[recording]
        for output, readings in data.readings.items():
            read = data.time[np.isfinite(readings)]
            if not len(read):
                continue
            every = float(np.median(np.diff(read))) if len(read) > 1 else math.nan
            gap = float(np.max(np.diff(read))) if len(read) > 1 else math.nan
            known = readings[np.isfinite(readings)]
            span = f"{number(float(known.min()))} to {number(float(known.max()))} {run.unit(output)}"
            rows.append(
                Line(
                    (
                        recording,
                        output,
                        number(len(read), 6),
                        _duration(float(read[-1] - read[0])),
                        _duration(every),
                        _duration(gap),
                        span,
                    )
                )
            )
    findings = [str(line) for line in run.results.get("findings") or []]
    if not rows and not findings:
        return None
    header = ("Recording", "Output", "Readings", "Over", "Usually every", "Longest gap", "Range")
    return {
        "tables": [Printed("Readings", header, tuple(rows), frozenset({1, 6}))] if rows else [],
        "findings": findings,
        "sound": run.results.get("findings") == [],
    }


def _duration(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "–"
    for size, unit in ((3600, "h"), (60, "min")):
        if seconds >= 2 * size:
            return f"{number(seconds / size)} {unit}"
    return f"{number(seconds)} s"


def reproduce(run: Run) -> dict[str, Any]:
    """Command, versions and hashes."""
    versions, inputs = (
        run.results.get("versions") or {"discovery": __version__},
        run.results.get("inputs") or {},
    )
    rows = [Line((name, str(one))) for name, one in versions.items()]
    rows += [Line((f"{name}, sha256", str(digest)[:16])) for name, digest in inputs.items()]
    for name in ("results.json", "diagnosis.json"):
        path = run.folder / name
        if path.exists():
            rows.append(Line((f"{name}, sha256", hashlib.sha256(path.read_bytes()).hexdigest()[:16])))
    if run.results.get("seconds"):
        rows.append(Line(("computing time", f"{number(run.results['seconds'])} s")))
    return {
        "command": run.results.get("command", ""),
        "table": Printed(
            "Versions, and hashes of the input files", ("What", "Value"), tuple(rows), frozenset({1})
        ),
    }
