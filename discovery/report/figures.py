"""Figures worth publishing: the charts of the page as SVG and PDF, drawn by matplotlib."""

from __future__ import annotations

import re
import string
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from discovery.errors import UserError
from discovery.report.chart import Chart, Panel, Series
from discovery.report.page import charts_of
from discovery.report.run import load_run
from discovery.threads import jobs

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
    "axes.axisbelow": True,
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
}
_WORTH = 12  # charts from which another process is worth its start
WIDTH = 3.5  # inches, one column of a journal
_LEFT, _RIGHT, _BOTTOM, _TOP, _GAP = 0.58, 0.06, 0.4, 0.06, 0.1  # inches around and between panels
_FIRST, _NEXT = 1.35, 0.68  # inches, height of the panels


def write_figures(run_dir: Path) -> list[Path]:
    """Write every chart of a run's report as SVG and PDF into ``figures/`` of the run folder.

    Raises:
        UserError: no results there, or nothing in them that can be drawn.
    """
    run = load_run(Path(run_dir))
    charts = charts_of(run)
    if not charts:
        raise UserError(
            f"{run_dir}: there are no predictions to draw; make them with `discovery run EXPERIMENT`"
        )
    folder = run.folder / "figures"
    folder.mkdir(exist_ok=True)
    parts = min(jobs(), max(1, len(charts) // _WORTH))
    if parts == 1:
        return _write_all(charts, folder)
    from joblib import Parallel, delayed  # processes: matplotlib is not made for threads

    work = [delayed(_write_all)(charts[k::parts], folder) for k in range(parts)]
    written = {path for part in Parallel(n_jobs=parts)(work) for path in part}
    return [path for chart in charts for path in _paths(chart, folder) if path in written]


def _write_all(charts: Sequence[Chart], folder: Path) -> list[Path]:
    with small_font(charts) as font:
        return [path for chart in charts for path in _write(chart, folder, font)]


def _paths(chart: Chart, folder: Path) -> list[Path]:
    name = re.sub(r"[^\w.-]+", "_", chart.key)
    return [folder / f"{name}.{form}" for form in ("svg", "pdf")]


def _write(chart: Chart, folder: Path, font: str) -> list[Path]:
    """A chart as SVG and PDF."""
    import matplotlib as mpl
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.backends.backend_pdf import FigureCanvasPdf
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    paths = _paths(chart, folder)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, _FIRST))
        FigureCanvasAgg(figure)  # measures the legend
        _draw(figure, chart)
        svg: Any = FigureCanvasSVG(figure)
        svg.print_svg(paths[0], metadata={"Date": None})
        with mpl.rc_context({"font.sans-serif": [font]}):
            pdf: Any = FigureCanvasPdf(figure)
            pdf.print_pdf(paths[1], metadata={"CreationDate": None})
    return paths


@contextmanager
def small_font(charts: Sequence[Chart]) -> Iterator[str]:
    """Name of a font with the characters of these charts alone. A PDF embeds the glyphs that it uses; cutting
    them out of a whole font for each chart takes longer than drawing it.
    """
    from fontTools import subset
    from matplotlib import font_manager

    options = subset.Options(drop_tables=["GSUB", "GPOS", "GDEF", "kern", "FFTM", "PfEd"], glyph_names=True)
    whole = font_manager.findfont(font_manager.FontProperties(family=["sans-serif"]))
    manager, known = font_manager.fontManager, list(font_manager.fontManager.ttflist)
    cutter = subset.Subsetter(options)
    texts = [text for chart in charts for text in _texts(chart)]
    cutter.populate(text="".join([string.printable, "−×", *texts]))
    with tempfile.TemporaryDirectory() as folder, closing(subset.load_font(whole, options)) as font:
        cutter.subset(font)
        font["name"].setName(f"{font['name'].getDebugName(1)} cut", 1, 3, 1, 0x409)
        path = Path(folder) / "cut.ttf"
        font.save(path)
        manager.addfont(path)
        try:
            yield manager.ttflist[-1].name
        finally:
            manager.ttflist[:] = known


def _texts(chart: Chart) -> list[str]:
    panels = [text for panel in chart.panels for text in (panel.label, *(one.name for one in panel.series))]
    return [chart.x_label, *chart.marks, *panels]


def _draw(figure: Any, chart: Chart) -> None:
    """Panels of one size below each other, a legend above them; equal margins, so that figures align."""
    heights = [_FIRST] + [_NEXT] * (len(chart.panels) - 1)
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    for ax, panel in zip(axes, chart.panels, strict=True):
        _panel(ax, panel, chart)
        ax.yaxis.set_label_coords(0.16 / WIDTH, 0.5, transform=_across(figure, ax))
    axes[-1].set_xlabel(chart.x_label)
    handles: dict[str, Any] = {}
    for ax in axes:  # curves of the first panel are thick, those below are thin
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            handles.setdefault(label, handle)
    above = _legend(figure, handles) if len(handles) > 1 else 0.0
    whole = above + _TOP + sum(heights) + _GAP * (len(heights) - 1) + _BOTTOM
    figure.set_size_inches(WIDTH, whole)
    figure.subplots_adjust(
        left=_LEFT / WIDTH,
        right=1 - _RIGHT / WIDTH,
        bottom=_BOTTOM / whole,
        top=1 - (above + _TOP) / whole,
        hspace=_GAP / (sum(heights) / len(heights)),
    )


def _across(figure: Any, ax: Axes) -> Any:
    """Horizontal in widths of the figure, vertical in heights of the panel."""
    from matplotlib.transforms import blended_transform_factory

    return blended_transform_factory(figure.transFigure, ax.transAxes)


def _legend(figure: Any, handles: Mapping[str, Any]) -> float:
    """Draw a legend at the top with as many columns as fit. Return its height in inches."""
    for columns in range(min(3, len(handles)), 0, -1):
        legend = figure.legend(
            handles.values(), handles.keys(), loc="upper center", ncols=columns, columnspacing=1.2
        )
        box = legend.get_window_extent(figure.canvas.get_renderer())
        if box.width < 0.98 * figure.bbox.width or columns == 1:
            break
        legend.remove()
    return float(box.height / figure.dpi)


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
