"""The report: one HTML file that is complete in itself."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discovery import __version__
from discovery.evaluation import paper
from discovery.files import write_atomic
from discovery.report import equations, mismatch, series
from discovery.report.answer import answer
from discovery.report.chart import Chart, Panel, Series, payload
from discovery.report.printed import Line, Printed, paper_tables, rms_tables, summary
from discovery.report.ranking import is_discovered, is_error, origin, ranked
from discovery.report.run import Run, load_run
from discovery.report.text import counted, listed, number, percent

_HERE = Path(__file__).parent
_BUDGET = 300_000  # numbers that all curves of a page may hold together, below 2 MB
_OFTEN = 0.2  # share of the repeated searches from which a term is listed
_MOST_CURVES = 6  # more than that cannot be told apart


def write_report(run_dir: Path) -> Path:
    """Write ``report.html`` of a run folder: one file, no network, below 3 MB.

    What the folder does not hold (diagnosis, predictions, a discovered model) does not show.

    Raises:
        UserError: no results there, or a file that cannot be read.
    """
    run = load_run(Path(run_dir))
    path = run.folder / "report.html"
    write_atomic(path, render(run))
    return path


def render(run: Run) -> str:
    """The page of a run as HTML."""
    order = shown_models(run)
    curves = series.prediction_charts(run, order)
    groups = [
        _group(run, recording, [c for c in curves if c.group == recording]) for recording in run.recordings
    ]
    missing, residual, found = mismatch.section(run), _residual(run, order), _discovery(run, order)
    charts = [*curves]
    for part in (missing, found, residual):
        charts += part["charts"] if part else []
    tables = paper_tables(run) if is_error(run) else rms_tables(run)
    shown = 2 if tables and "Table 1" in tables[0].title else 1  # the other recordings fold away
    view: dict[str, Any] = {
        "title": f"{run.name}: report",
        "eyebrow": _eyebrow(run),
        "answer": answer(run),
        "predictions": groups,
        "shaded": any(chart.shades for chart in curves),
        "curves": _legend(run, order, curves),
        "summary": summary(run),
        "errors": is_error(run),
        "unseen": bool(run.held_out),
        "tables": tables[:shown],
        "more_tables": tables[shown:],
        "paper": paper.SOURCE if set(run.outputs) & set(paper.TABLE_3) else "",
        "diagnosis": missing,
        "network": mismatch.network(run),
        "models": [_model(run, name) for name in _detailed(run)],
        "discovery": found,
        "residual": residual,
        "quality": _quality(run),
        "reproduce": _reproduce(run),
    }
    return fill("page.html.j2", view, charts)


def charts_of(run: Run) -> list[Chart]:
    """Every chart of a run's page."""
    order = shown_models(run)
    charts = series.prediction_charts(run, order)
    for part in (mismatch.section(run), _discovery(run, order), _residual(run, order)):
        charts += part["charts"] if part else []
    return charts


def fill(template: str, view: Mapping[str, Any], charts: Sequence[Chart]) -> str:
    """A template with its view, style, script and the data of its charts."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(_HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    curves = sum(len(panel.series) for chart in charts for panel in chart.panels)
    most = int(np.clip(_BUDGET / max(curves, 1) / 2, 120, 1500))
    data = json.dumps(payload(list(charts), most), separators=(",", ":"), allow_nan=False).replace(
        "<", "\\u003c"
    )
    return environment.get_template(template).render(
        **view,
        contents=_contents(view),
        version=__version__,
        css=Markup((_HERE / "page.css").read_text("utf-8")),
        script=Markup((_HERE / "charts.js").read_text("utf-8")),
        data=Markup(data),
    )


def _contents(view: Mapping[str, Any]) -> list[tuple[str, str]]:
    parts = [
        ("predictions", "Measured, predicted"),
        ("summary", "Models compared"),
        ("diagnosis", "What was left out"),
        ("network", "Thermal network"),
        ("models", ""),
        ("discovery", "How it was found"),
        ("residual", "What is left"),
        ("quality", "The recordings"),
        ("reproduce", "Reproduce"),
    ]
    anchors = {"summary": "comparison", "diagnosis": "mismatch"}
    out = [("answer", "The answer")]
    for key, name in parts:
        if key == "models":
            out += [
                (f"model-{index}", f"Model “{m['name']}”") for index, m in enumerate(view["models"], start=1)
            ]
        elif view.get(key):
            out.append((anchors.get(key, key), name))
    return out


def shown_models(run: Run) -> list[str]:
    """Models with predictions, best first, as many as can be told apart."""
    having = list(dict.fromkeys(model for p in run.predictions.values() for model in p.models))
    order = [model for model in ranked(run) if model in having]
    return [*order, *(model for model in having if model not in order)][:_MOST_CURVES]


def _legend(run: Run, order: Sequence[str], curves: Sequence[Chart]) -> list[dict[str, Any]]:
    if not curves:
        return []
    noise = any(one.color == "noise" for chart in curves for panel in chart.panels for one in panel.series)
    other = [name for name in order[1:] if origin(run, name) != origin(run, order[0])] or list(order[1:])
    first = {*order[:1], *other[:1]}  # more curves at once hide each other
    items = [{"name": "measured", "color": "measured", "on": True}]
    items += [{"name": name, "color": str(index), "on": name in first} for index, name in enumerate(order)]
    return items + ([{"name": "reading noise, ±2σ", "color": "noise", "on": True}] if noise else [])


def _group(run: Run, recording: str, charts: list[Chart]) -> dict[str, Any]:
    tag = (
        "unseen" if recording in run.held_out else "fitted" if recording in run.results.get("fit", []) else ""
    )
    note = (run.results.get("notes") or {}).get(recording, "")
    return {"name": recording, "tag": tag, "note": note, "charts": charts}


def _eyebrow(run: Run) -> str:
    parts = [run.name]
    if run.results.get("fit"):
        parts.append(f"fitted to {_brief(run.results['fit'])}")
    if run.held_out:
        parts.append(f"judged on {_brief(run.held_out)}, which no fit, choice or threshold has seen")
    return " · ".join(parts)


def _brief(names: Sequence[str]) -> str:
    return listed(names) if len(names) < 5 else f"{len(names)} recordings"


def _detailed(run: Run) -> list[str]:
    """The models whose equations are worth a section: best, best discovered, diagnosed and repaired ones."""
    order = [name for name in ranked(run) if name in run.models] or list(run.models)
    wanted = [*order[:1], *[name for name in order if is_discovered(run, name)][:1]]
    subject = mismatch.diagnosed(run)
    wanted += [
        name for name, model in run.models.items() if model is subject or any(t.effect for t in model.terms)
    ]
    return list(dict.fromkeys(wanted))


def _model(run: Run, name: str) -> dict[str, Any]:
    model = run.models[name]
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
        "largest": max(shares.values(), default=1.0) or 1.0,
        "share_note": "Share of the effect: what the errors would lose without the term, to first order; "
        "all terms together are 100 %.",
        "others": equations.other_values(model),
        "capacities": equations.capacities(model),
        "notes": entry.get("notes") or [],
    }


def _discovery(run: Run, order: Sequence[str]) -> dict[str, Any] | None:
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
        if entry.get("stability"):
            shares = sorted(entry["stability"].items(), key=lambda pair: -pair[1])
            rare = [share for _, share in shares if share < _OFTEN]
            shares = [pair for pair in shares if pair[1] >= _OFTEN]
            rows = tuple(Line((str(term), percent(share))) for term, share in shares)
            rows += (Line((f"{len(rare)} others", f"< {percent(_OFTEN)}")),) if rare else ()
            tables.append(
                Printed(
                    f"{name}: how often each term is chosen when the search is repeated on parts of the data",
                    ("Term", "Chosen"),
                    rows,
                )
            )
    about = (
        "Each further term must earn its place on data that the choice has not used. "
        "Terms that are chosen again and again do not depend on which hours were recorded."
    )
    return {"about": about, "charts": charts, "tables": tables}


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


def _residual(run: Run, order: Sequence[str]) -> dict[str, Any] | None:
    recording = next((r for r in run.recordings if r in run.held_out), next(iter(run.recordings), None))
    if recording is None or not order:
        return None
    model = order[0]
    rows = series.residual_table(run, model, recording)
    if not rows:
        return None
    keys = ("rms", "ratio", "mean", "memory", "largest", "beyond", "count")
    lines = tuple(
        Line((f"{row['output']} [{row['unit'] or '-'}]", *(number(row[k]) for k in keys))) for row in rows
    )
    header = (
        "Error",
        "rms",
        "rms / noise",
        "mean",
        "correlation of neighbours",
        "largest",
        "beyond 3σ [%]",
        "readings",
    )
    return {
        "about": f"What “{model}” leaves on {recording}. If only sensor noise were left, neighbours "
        "would not be alike and bars would stay inside the band.",
        "table": Printed(f"Left over on {recording}", header, lines),
        "charts": series.residual_charts(run, model, recording),
    }


def _quality(run: Run) -> dict[str, Any] | None:
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
    findings = [str(line) for line in run.results.get("findings") or run.results.get("quality") or []]
    if not rows and not findings:
        return None
    header = ("Recording", "Error", "Readings", "Over", "Usually every", "Longest gap", "Range")
    return {
        "tables": [Printed("Readings", header, tuple(rows), frozenset({1, 6}))] if rows else [],
        "findings": findings,
    }


def _duration(seconds: float) -> str:
    if not math.isfinite(seconds):
        return "–"
    for size, unit in ((3600, "h"), (60, "min")):
        if seconds >= 2 * size:
            return f"{number(seconds / size)} {unit}"
    return f"{number(seconds)} s"


def _reproduce(run: Run) -> dict[str, Any]:
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
            "Versions, and hashes of what went in", ("What", "Value"), tuple(rows), frozenset({1})
        ),
    }
