"""Frames of results as tables for a publication."""

from __future__ import annotations

from typing import TYPE_CHECKING

from discovery.report.run import pretty_unit
from discovery.report.text import latex, number

if TYPE_CHECKING:
    import pandas as pd

INTERVAL = "95 % interval"


def latex_table(frame: pd.DataFrame) -> str:
    """Return a frame as a LaTeX table (`tabular`), for example `latex_table(fit.to_frame())`.

    Numbers have three significant digits, names and units are escaped, and what is missing is a dash. Columns
    `low` and `high` become one column, the 95 % interval. An index that only counts the rows is left out.
    """
    import pandas as pd

    shown = frame if isinstance(frame.index, pd.RangeIndex) else frame.reset_index()
    columns: dict[str, list[str]] = {}
    for name in map(str, shown.columns):
        if name == "low" and "high" in shown:
            columns[INTERVAL] = [_interval(*ends) for ends in zip(shown["low"], shown["high"], strict=True)]
        elif name != "high" or "low" not in shown:
            columns[name] = [_text(name, value) for value in shown[name]]
    numeric = [name in shown and pd.api.types.is_float_dtype(shown[name]) for name in columns]
    head = [latex("" if name == "index" else name) for name in columns]
    lines = [" & ".join(row) + r" \\" for row in (head, *zip(*columns.values(), strict=True))]
    sides = "".join("r" if one else "l" for one in numeric)
    table = [rf"\begin{{tabular}}{{{sides}}}", r"\hline", lines[0], r"\hline", *lines[1:], r"\hline"]
    return "\n".join([*table, r"\end{tabular}", ""])


def _text(column: str, value: object) -> str:
    """A cell."""
    if isinstance(value, str):
        return latex(pretty_unit(value) if column == "unit" else value)
    if isinstance(value, bool):
        return "yes" if value else "no"
    return latex(number(_known(value)))


def _interval(low: object, high: object) -> str:
    """An interval, or a dash where there is none."""
    ends = [number(_known(end)) for end in (low, high)]
    return latex("–" if "–" in ends else " to ".join(ends))


def _known(value: object) -> float | None:
    return float(value) if isinstance(value, int | float) else None
