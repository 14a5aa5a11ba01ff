"""One description of a chart for two renderers: the small script in the page, and matplotlib for print."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Kind = Literal["line", "points", "bars", "band"]


@dataclass(frozen=True)
class Series:
    """`x`, `y` (N,); for a band `low`, `high` (N,) as well. `color`: measured, noise, or a model's number."""

    name: str
    x: Array
    y: Array
    kind: Kind = "line"
    color: str = "0"
    low: Array | None = None
    high: Array | None = None


@dataclass(frozen=True)
class Panel:
    """One pair of axes; `label` names the quantity with its unit."""

    label: str
    series: tuple[Series, ...]
    zero: bool = False  # draw the zero line and keep it in view


@dataclass(frozen=True)
class Chart:
    """Panels above one another that share their x axis."""

    key: str
    title: str
    x_label: str
    panels: tuple[Panel, ...]
    shades: tuple[tuple[float, float, str], ...] = ()  # from, to, why
    group: str = ""  # charts of a group zoom together
    marks: Mapping[str, float] = field(default_factory=dict)  # named vertical lines
    solid: bool = False  # thin solid curves, without the dashes that distinguish models
    own_key: bool = True  # names its curves below; otherwise the legend of the section does

    @property
    def anchor(self) -> str:
        """Id of its figure in the page, for links."""
        return "chart-" + re.sub(r"[^A-Za-z0-9]+", "-", self.key)

    @property
    def key_items(self) -> list[Series]:
        """Curves that the legend below the chart names."""
        named = {s.name: s for panel in self.panels for s in panel.series if s.kind in ("line", "band")}
        return list(named.values()) if self.own_key and len(named) > 1 else []


def thinned(x: Array, y: Array, most: int) -> tuple[Array, Array]:
    """At most about `most` points that keep the look of a curve: lowest and highest of each bin; of a curve
    with steps also the first and the last, so that a value that was held stays flat.

    >>> x = np.arange(1000.0)
    >>> a, b = thinned(x, np.where(x == 500, 9.0, 0.0), 100)
    >>> len(a) <= 100, b.max()
    (True, np.float64(9.0))
    """
    known = np.isfinite(x) & np.isfinite(y)
    x, y = x[known], y[known]
    if len(x) <= most:
        return x, y
    inner = np.arange(1, len(x) - 1)
    stepped = bool((np.diff(x) == 0).any())
    if stepped:
        edges = np.linspace(x[0], x[-1], max(2, most // 4))
        parts = [part for part in np.split(inner, np.searchsorted(x[inner], edges[1:-1])) if len(part)]
    else:
        parts = np.array_split(inner, max(1, most // 2 - 1))
    keep = [0, len(x) - 1]
    for part in parts:
        keep += [int(part[np.argmin(y[part])]), int(part[np.argmax(y[part])])]
        keep += [int(part[0]), int(part[-1])] if stepped else []
    index = np.unique(keep)
    return x[index], y[index]


def payload(charts: list[Chart], most: int) -> dict[str, Any]:
    """The charts as plain JSON; equal x arrays are stored once."""
    arrays: list[list[float]] = []
    known: dict[bytes, int] = {}

    def stored(values: Array) -> int:
        data = _rounded(values)
        key = np.array(data).tobytes()
        if key not in known:
            known[key] = len(arrays)
            arrays.append(data)
        return known[key]

    def series(one: Series) -> dict[str, Any]:
        out: dict[str, Any] = {"name": one.name, "kind": one.kind, "color": one.color}
        if one.low is not None and one.high is not None:
            step = max(1, len(one.x) // most)
            out |= {"x": stored(one.x[::step]), "y": _rounded(one.y[::step])}
            return out | {"low": _rounded(one.low[::step]), "high": _rounded(one.high[::step])}
        x, y = (one.x, one.y) if one.kind == "bars" else thinned(one.x, one.y, most)
        return out | {"x": stored(x), "y": _rounded(y)}

    def chart(one: Chart) -> dict[str, Any]:
        panels = [
            {"label": panel.label, "zero": panel.zero, "series": [series(s) for s in panel.series]}
            for panel in one.panels
        ]
        out = {"key": one.key, "title": one.title, "x": one.x_label, "panels": panels, "group": one.group}
        return out | {"shades": [list(shade) for shade in one.shades], "marks": dict(one.marks)}

    listed = [chart(one) for one in charts]
    return {"arrays": arrays, "charts": listed}


def _rounded(values: Array) -> list[float]:
    """Numbers with as many digits as a screen can show: a 4000th of their range."""
    values = np.asarray(values, dtype=float)
    if not len(values):
        return []
    size = max(float(np.ptp(values)), 1e-3 * float(np.abs(values).max()), 1e-12)
    digits = int(np.clip(np.ceil(np.log10(4000 / size)), 0, 12))
    return [float(value) if value % 1 else int(value) for value in np.round(values, digits).tolist()]
