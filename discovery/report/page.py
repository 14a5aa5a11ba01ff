"""The report: one HTML file that is complete in itself."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery import __version__
from discovery.evaluation import paper
from discovery.files import write_atomic
from discovery.report import heat, mismatch, sections, series
from discovery.report.answer import Answer, Part, answer
from discovery.report.chart import Chart, payload
from discovery.report.printed import Printed, is_paper, paper_tables, rms_tables, summary
from discovery.report.ranking import is_error, origin, ranked
from discovery.report.recommended import table as best_by_output
from discovery.report.run import Run, load_run
from discovery.report.text import listed

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

_HERE = Path(__file__).parent
_BUDGET = 300_000  # numbers that all curves of a page may hold together, below 2 MB
_MOST_CURVES = 6  # more of them cannot be distinguished


def write_report(run_dir: Path) -> Path:
    """Write ``report.html`` of a run folder: one file, no network, below 3 MB.

    The report has no section for a result that the folder does not hold, for example a diagnosis.

    Args:
        run_dir: folder of a finished `discovery run`.

    Returns:
        Path of the report.

    Raises:
        UserError: no results there, or a file that cannot be read.
    """
    run = load_run(Path(run_dir))
    path = run.folder / "report.html"
    write_atomic(path, render(run))
    return path


def render(run: Run, runs: Printed | None = None, groups: Sequence[Run] = ()) -> str:
    """The page of a run as HTML.

    Args:
        runs: the list that the page of several runs opens with.
        groups: runs that share recordings, merged, where not all do.
    """
    order = shown_models(run)
    curves = series.prediction_charts(run, order)
    predictions = [
        _group(run, recording, [c for c in curves if c.group == recording]) for recording in run.recordings
    ]
    missing, residual, found = (
        mismatch.section(run),
        sections.residual(run, order),
        sections.discovery(run, order),
    )
    charts = [*curves]
    for part in (missing, found, residual):
        charts += part["charts"] if part else []
    tables = paper_tables(run) if is_error(run) else rms_tables(run)
    shown = sum("Table 1" in one.title for one in tables) if is_error(run) else len(tables)  # the rest folds
    view: dict[str, Any] = {
        "title": f"{run.name}: report",
        "eyebrow": _eyebrow(run),
        "answer": answer(run) if run.results.get("models") or run.diagnosis else _of_groups(groups),
        "runs": runs,
        "groups": [_side_by_side(one) for one in groups],
        "predictions": predictions,
        "shaded": any(chart.shades for chart in curves),
        "curves": _legend(run, order, curves),
        "not_drawn": listed([model for model in _predicted(run) if model not in order]),
        "summary": summary(run),
        "held_out": bool(run.held_out),
        "by_output": best_by_output(run),
        "tables": tables[:shown],
        "more_tables": tables[shown:],
        "paper": paper.SOURCE if is_paper(run) else "",
        "missing_first": mismatch.leads(run),
        "diagnosis": missing,
        "network": heat.network(run),
        "models": [sections.model(run, name) for name in sections.detailed(run)],
        "discovery": found,
        "residual": residual,
        "roles": sections.roles(run),
        "budgets": sections.budgets(run),
        "quality": sections.quality(run),
        "not_made": [c["failed"] for c in (run.results.get("paper") or {}).values() if c.get("failed")],
        "reproduce": sections.reproduce(run),
    }
    return fill("page.html.j2", view, charts, _contents(view))


def _of_groups(groups: Sequence[Run]) -> Answer:
    """The answer on runs that do not all share recordings."""
    if not groups:
        text = "Only their list is shown. To compare models side by side, name runs of the same recordings."
        return Answer(Part("These runs share no recording", (text,)), Part())
    points = tuple(f"{_campaign(one)}: {_lower(answer(one).first.headline)}" for one in groups)
    return Answer(Part("Runs are compared on the recordings that they share", points), Part())


def _lower(sentence: str) -> str:
    return sentence[:1].lower() + sentence[1:]


def _campaign(run: Run) -> str:
    return str(run.results.get("campaign") or run.name)


def _side_by_side(run: Run) -> dict[str, Any]:
    """The models of runs that share recordings."""
    return {
        "title": _campaign(run),
        "about": _eyebrow(run),
        "summary": summary(run),
        "by_output": best_by_output(run),
        "command": run.results.get("command"),
    }


def charts_of(run: Run) -> list[Chart]:
    """Every chart of a run's page."""
    order = shown_models(run)
    charts = series.prediction_charts(run, order)
    for part in (mismatch.section(run), sections.discovery(run, order), sections.residual(run, order)):
        charts += part["charts"] if part else []
    return charts


def fill(
    template: str, view: Mapping[str, Any], charts: Sequence[Chart], contents: Sequence[tuple[str, str]]
) -> str:
    """A template with its view, style, script and the data of its charts. `contents`: anchor and name."""
    from markupsafe import Markup

    curves = sum(len(panel.series) for chart in charts for panel in chart.panels)
    most = int(np.clip(_BUDGET / max(curves, 1) / 2, 120, 1500))
    data = json.dumps(payload(list(charts), most), separators=(",", ":"), allow_nan=False).replace(
        "<", "\\u003c"
    )
    return (
        templates(_HERE)
        .get_template(template)
        .render(
            **view,
            contents=contents,
            version=__version__,
            css=style(),
            script=Markup((_HERE / "charts.js").read_text("utf-8")),
            data=Markup(data),
        )
    )


def templates(folder: Path) -> Environment:
    """The templates of a folder; a name that a view does not have is a mistake, not an empty text."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    loader = FileSystemLoader(folder)
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True)


def style() -> Markup:
    """The style sheet of all pages."""
    from markupsafe import Markup

    return Markup((_HERE / "page.css").read_text("utf-8"))


def _contents(view: Mapping[str, Any]) -> list[tuple[str, str]]:
    compared = [
        ("predictions", "Measured and predicted"),
        ("summary", "Models compared"),
        ("roles", "Cross-validation over roles"),
    ]
    missing = [("diagnosis", "Missing physics"), ("network", "Thermal network")]
    parts = [
        ("runs", "Runs"),
        ("groups", ""),
        *(missing + compared if view["missing_first"] else compared + missing),
        ("models", ""),
        ("discovery", "Search for terms"),
        ("residual", "Residuals"),
        ("budgets", "Heat and fluid"),
        ("quality", "The recordings"),
        ("not_made", "Chapters not made"),
        ("reproduce", "Reproduce"),
    ]
    anchors = {"summary": "comparison", "diagnosis": "mismatch", "not_made": "not-made"}
    out = [("answer", "The answer")]
    for key, name in parts:
        if key == "groups":
            out += [(f"group-{k}", str(one["title"])) for k, one in enumerate(view["groups"], start=1)]
        elif key == "models":
            out += [
                (f"model-{index}", f"Model “{m['name']}”") for index, m in enumerate(view["models"], start=1)
            ]
        elif view.get(key):
            out.append((anchors.get(key, key), name))
    return out


def shown_models(run: Run) -> list[str]:
    """Models with predictions, best first, as many as the eye can distinguish."""
    order = _predicted(run)
    pair = [model for model in before_and_after(run) if model in order]
    others = [model for model in order if model not in pair][: _MOST_CURVES - len(pair)]
    return [model for model in order if model in (*pair, *others)]


def _predicted(run: Run) -> list[str]:
    """Models with predictions, best first."""
    having = list(dict.fromkeys(model for p in run.predictions.values() for model in p.models))
    order = [model for model in ranked(run) if model in having]
    return order + [model for model in having if model not in order]


def before_and_after(run: Run) -> list[str]:
    """The diagnosed and the repaired model, where the diagnosis found something."""
    if not mismatch.leads(run):
        return []
    subject = heat.diagnosed_key(run)
    return [
        model
        for model in run.results.get("models", {})
        if model == subject or origin(run, model) == "repaired"
    ]


def _legend(run: Run, order: Sequence[str], curves: Sequence[Chart]) -> list[dict[str, Any]]:
    if not curves:
        return []
    noise = any(one.color == "noise" for chart in curves for panel in chart.panels for one in panel.series)
    other = [name for name in order[1:] if origin(run, name) != origin(run, order[0])] or list(order[1:])
    pair = before_and_after(run)  # more curves at once hide each other
    first = set(pair) if len(pair) > 1 else {*order[:1], *other[:1]}
    items = [{"name": "measured", "color": "measured", "on": True}]
    items += [{"name": name, "color": str(index), "on": name in first} for index, name in enumerate(order)]
    names = {one.name for chart in curves for panel in chart.panels for one in panel.series}
    items += [{"name": series.BAND, "color": "band", "on": order[0] in first}] if series.BAND in names else []
    return items + ([{"name": "reading noise, ±2σ", "color": "noise", "on": True}] if noise else [])


def _group(run: Run, recording: str, charts: list[Chart]) -> dict[str, Any]:
    tag = (
        "held out"
        if recording in run.held_out
        else "fitted"
        if recording in run.results.get("fit", [])
        else ""
    )
    note = (run.results.get("notes") or {}).get(recording, "")
    return {"name": recording, "tag": tag, "note": note, "charts": charts}


def _eyebrow(run: Run) -> str:
    parts = ["Simulated machine"] if run.results.get("simulated") else []
    parts.append(run.name)
    if run.results.get("fit"):
        parts.append(f"fitted to {_brief(run.results['fit'])}")
    if run.held_out:
        parts.append(f"compared on {_brief(run.held_out)}, which no fit and no choice has used")
    return " · ".join(parts)


def _brief(names: Sequence[str]) -> str:
    return listed([f"“{name}”" for name in names]) if len(names) < 5 else f"{len(names)} recordings"
