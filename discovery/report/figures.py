"""Figures worth publishing: the charts of the page as SVG and PDF, drawn by matplotlib."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery.errors import UserError
from discovery.report.chart import Chart, Panel, Series
from discovery.report.page import charts_of
from discovery.report.run import load_run

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLORS = {
    "measured": "#39424e",
    "noise": "#8a94a1",
    "0": "#0a58b0",
    "1": "#b84a00",
    "2": "#14683f",
    "3": "#7a3fc0",
    "4": "#b3253b",
    "5": "#00707c",
    "6": "#8a6100",
    "7": "#a03b8f",
}
DASHES: dict[str, Any] = {"1": (6, 2.5), "2": (2, 1.5), "3": (7, 2, 1.5, 2), "4": (4, 1.5)}
STYLE: Any = {
    "font.family": "sans-serif",
    "font.size": 8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "grid.linewidth": 0.4,
    "grid.color": "#d8dde3",
    "lines.linewidth": 1.0,
    "legend.frameon": False,
    "legend.fontsize": 7,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "svg.fonttype": "none",
    "svg.hashsalt": "discovery",
    "pdf.fonttype": 42,
    "figure.constrained_layout.use": True,
}
WIDTH = 3.5  # inches, one column of a journal


def write_figures(run_dir: Path) -> list[Path]:
    """Write every chart of a run's report as SVG and PDF into ``figures/`` of the run folder.

    Raises:
        UserError: no results there, or nothing in them that can be drawn.
    """
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    run = load_run(Path(run_dir))
    charts = charts_of(run)
    if not charts:
        raise UserError(
            f"{run_dir}: no predictions are there to draw; make them with `discovery run EXPERIMENT`"
        )
    folder = run.folder / "figures"
    folder.mkdir(exist_ok=True)
    written = []
    with mpl.rc_context(STYLE):
        for chart in charts:
            figure = Figure(figsize=(WIDTH, 1.9 + 0.9 * (len(chart.panels) - 1)))
            FigureCanvasAgg(figure)  # measures the legend
            _draw(figure, chart)
            name = re.sub(r"[^\w.-]+", "_", chart.key)
            for form in ("svg", "pdf"):
                path = folder / f"{name}.{form}"
                figure.savefig(path, metadata={"Date": None} if form == "svg" else {"CreationDate": None})
                written.append(path)
    return written


def _draw(figure: Any, chart: Chart) -> None:
    ratios = [2.0] + [1.0] * (len(chart.panels) - 1)
    axes = figure.subplots(len(chart.panels), 1, sharex=True, squeeze=False, height_ratios=ratios)[:, 0]
    for ax, panel in zip(axes, chart.panels, strict=True):
        _panel(ax, panel, chart)
    axes[-1].set_xlabel(chart.x_label)
    handles: dict[str, Any] = {}
    for ax in axes:  # the first panel shows a curve as it is; those below it are thin
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    if len(handles) > 1:
        _legend(figure, handles)


def _legend(figure: Any, handles: Mapping[str, Any]) -> None:
    """A legend above the panels with as many columns as the width holds; the figure grows by its height."""
    for columns in range(min(3, len(handles)), 0, -1):
        legend = figure.legend(
            handles.values(), handles.keys(), loc="outside upper center", ncols=columns, columnspacing=1.2
        )
        box = legend.get_window_extent(figure.canvas.get_renderer())
        if box.width < 0.98 * figure.bbox.width or columns == 1:
            break
        legend.remove()
    width, height = figure.get_size_inches()
    figure.set_size_inches(width, height + box.height / figure.dpi)


def _panel(ax: Axes, panel: Panel, chart: Chart) -> None:
    for start, end, _ in chart.shades:
        ax.axvspan(start, end, color="#f6c34a", alpha=0.25, linewidth=0, label="mismatch")
    if panel.zero:
        ax.axhline(0, color="#55606e", linewidth=0.6)
    for series in panel.series:
        _series(ax, series, thin=panel.zero or chart.solid)
    for name, x in chart.marks.items():
        ax.axvline(x, color="#55606e", linewidth=0.7, linestyle="--")
        ax.annotate(
            name,
            (x, 0.95),
            xycoords=("data", "axes fraction"),
            xytext=(3, 0),
            textcoords="offset points",
            va="top",
        )
    ax.set_ylabel(panel.label)


def _series(ax: Axes, series: Series, *, thin: bool) -> None:
    color = COLORS.get(series.color, "#39424e")
    if series.kind == "band" and series.low is not None and series.high is not None:
        ax.fill_between(
            series.x, series.low, series.high, color=color, alpha=0.2, linewidth=0, label=series.name
        )
        return
    known = np.isfinite(series.y)
    x, y = series.x[known], series.y[known]
    if series.kind == "points":
        ax.plot(x, y, ".", color=color, markersize=1.8, label=series.name, rasterized=len(x) > 3000)
    elif series.kind == "bars":
        ax.bar(x, y, width=0.6, color=color, label=series.name)
    else:
        (line,) = ax.plot(x, y, color=color, label=series.name, linewidth=0.6 if thin else 1.0)
        if not thin and series.color in DASHES:
            line.set_dashes(DASHES[series.color])
