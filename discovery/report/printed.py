"""Tables as the page prints them: every cell a text."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from discovery.evaluation import tables
from discovery.report.lead import Lead, lead_over
from discovery.report.ranking import (
    cells,
    is_error,
    kind,
    mean_rms,
    origin,
    ranked,
    removed,
    rms_unit,
    rms_units,
)
from discovery.report.run import Run
from discovery.report.text import number, with_unit

_MOST_RECORDINGS = 4  # with a column each in the summary; of more, median and worst
_AGAINST = "rms against the best"
_MOST_COLUMNS = 8  # models with a column of their own
_MOST_CHOSEN = 40  # models of which each can be the one to compare with


@dataclass(frozen=True)
class Line:
    """A row; `look` is a class of the style sheet."""

    cells: tuple[str, ...]
    look: str = ""
    repeated: str = ""  # the first cell, where it is printed only once for several rows
    link: str = ""  # where the first cell leads
    about: str = ""  # a second line below the first cell


@dataclass(frozen=True)
class Against:
    """Columns whose cells depend on the row that the reader chooses to compare with.

    Attributes:
        columns: which, from 0, and `heads`: their heads, with {} for the name of the chosen row.
        cells: by chosen row, then by row: a text for each of `columns`.
    """

    columns: tuple[int, ...]
    heads: tuple[str, ...]
    cells: tuple[tuple[tuple[str, ...], ...], ...]

    @property
    def packed(self) -> str:
        """As JSON for the page; equal texts are stored once."""
        texts: dict[str, int] = {}
        rows = [
            [[texts.setdefault(text, len(texts)) for text in row] for row in chosen] for chosen in self.cells
        ]
        content = {"columns": self.columns, "heads": self.heads, "cells": rows, "texts": list(texts)}
        return json.dumps(content, separators=(",", ":"), ensure_ascii=False)


@dataclass(frozen=True)
class Printed:
    """A table of texts; `left` are the columns (from 0) that are aligned left."""

    title: str
    header: tuple[str, ...]
    rows: tuple[Line, ...]
    left: frozenset[int] = field(default_factory=frozenset)
    against: Against | None = None


def printed(table: tables.Table, left: Sequence[int] = ()) -> Printed:
    """A table of the evaluation; a line above each group of rows with the same first cell. Columns of the
    paper in which it prints nothing are left out.
    """
    empty = {
        k
        for k, head in enumerate(table.header)
        if head.startswith("paper") and all(row[k] is None or row[k] == "" for row in table.rows)
    }
    table = replace(
        table,
        header=tuple(head for k, head in enumerate(table.header) if k not in empty),
        rows=tuple(tuple(cell for k, cell in enumerate(row) if k not in empty) for row in table.rows),
    )
    rows, before = [], None
    grouped = len({row[0] for row in table.rows}) < len(table.rows)
    for row in table.rows:
        texts = [cell if isinstance(cell, str) else "" if cell is None else number(cell) for cell in row]
        new = texts[0] != before
        before = texts[0]
        rows.append(
            Line(tuple(texts), "first" if grouped else "")
            if new
            else Line(("", *texts[1:]), repeated=texts[0])
        )
    return Printed(table.title, table.header, tuple(rows), frozenset(left))


def summary(run: Run) -> Printed | None:
    """Models, best first, with what they improve on held-out recordings and what they cost."""
    order = [model for model in ranked(run) if cells(run, model)]
    if not order:
        return None
    recordings = list(dict.fromkeys(r for model in order for r, _ in cells(run, model)))
    errors = is_error(run)
    units = rms_units(run)
    what = "Removed rms [%]" if errors else f"rms [{', '.join(units)}]"
    few = len(recordings) <= _MOST_RECORDINGS
    shown = recordings if few else [f"{word} of {len(recordings)} recordings" for word in ("median", "worst")]
    header = ("Model", "Terms", "Parameters", *shown, _AGAINST, "Fit [s]")
    rows = []
    for model in order:
        entry = run.results["models"][model]
        each = [_scores(run, model, recording) for recording in recordings]
        if not few:
            worst = np.min if errors else np.max
            each = [[float(of(found)) for found in zip(*each, strict=True)] for of in (np.median, worst)]
        figures = [", ".join(number(one, 2 if errors else 3) for one in scores) for scores in each]
        made = {one.lower(): one for one in (origin(run, model), kind(run, model))}.values()
        size = [number(entry.get("terms") or None), number(entry.get("parameters"))]
        times = "best" if model == order[0] else behind(lead_over(run, order[0], model))
        look = "best" if model == order[0] else ""
        line = (model, *size, *figures, times, number(entry.get("seconds"), 2))
        rows.append(Line(line, look, about=", ".join(made)))
    seen = "held-out recordings" if run.held_out else "recordings of the fit"
    title = f"{what}, {seen}, {'geometric mean over all errors' if errors else 'over all outputs of a unit'}"
    against = None
    if 1 < len(order) <= _MOST_CHOSEN:
        choices = tuple(
            tuple(
                ("reference" if model == chosen else behind(lead_over(run, chosen, model)),)
                for model in order
            )
            for chosen in order
        )
        against = Against((header.index(_AGAINST),), ("rms against {}",), choices)
    return Printed(title, header, tuple(rows), frozenset(), against)


def _scores(run: Run, model: str, recording: str) -> list[float]:
    """On a recording: the removed rms [%] of errors, or the rms over the outputs of each unit."""
    if is_error(run):
        return [removed(run, model, recording)]
    found = mean_rms(run, model, recording)
    return [found.get(unit, math.nan) for unit in rms_units(run)]


def behind(lead: Lead | None) -> str:
    """How much more rms than the model that leads (less: a minus), with its 95 % interval.

    >>> behind(Lead(0.8, 0.75, 0.9, 1.0)), behind(None)
    ('+25 % (+11 to +33)', '–')
    """
    if lead is None or lead.ratio <= 0:
        return "–"
    more = [100 * (1 / one - 1) for one in (lead.ratio, lead.high, lead.low) if one > 0]
    middle, *ends = (f"{one:+.0f}".replace("-", "−") if abs(one) >= 0.5 else "0" for one in more)
    return (
        f"{middle} % ({ends[0]} to {ends[1]})" if lead.low < lead.high and len(ends) == 2 else f"{middle} %"
    )


def paper_tables(run: Run) -> list[Printed]:
    """Criteria (Table 3 of the paper) for each recording, held-out ones first; Table 1 for a
    thermobalance.
    """
    found = run.results.get("models", {})
    recordings = list(dict.fromkeys([*run.held_out, *run.results.get("fit", [])]))
    scored = [r for r in recordings if any(r in model.get("recordings", {}) for model in found.values())]
    order = ranked(run)
    printed_too = is_paper(run)
    out = [
        printed(_in_units(run, tables.table_3(run.results, r, order, printed_too)), left=[1]) for r in scored
    ]
    parts = (run.results.get("parts") or {}) if printed_too else {}
    for model in order:
        if "thermobalance" in (model, kind(run, model)) and found[model].get("recordings") and parts:
            out.insert(0, printed(tables.table_1(run.results, model, parts)))
            break
    return out


def is_paper(run: Run) -> bool:
    """Whether the campaign is that of the paper: then its printed figures stand next to those of the run."""
    return "paper" in run.results


def _in_units(run: Run, table: tables.Table) -> tables.Table:
    """The table with each error named in its unit."""
    rows = ((with_unit(str(error), run.unit(str(error))), *cells) for error, *cells in table.rows)
    return replace(table, rows=tuple(rows))


def rms_tables(run: Run) -> list[Printed]:
    """rms of the residuals of temperatures: a row for each recording and output, held-out ones first."""
    every, found = ranked(run), run.results.get("models", {})
    order = every[:_MOST_COLUMNS]
    rows, units = [], rms_units(run)
    for recording in dict.fromkeys([*run.held_out, *run.results.get("fit", [])]):
        for index, output in enumerate(run.outputs):
            scores = [
                found[model].get("recordings", {}).get(recording, {}).get(output, {}).get("rms")
                for model in order
            ]
            seen = "held out" if recording in run.held_out else "fitted"
            named = output if len(units) == 1 else with_unit(output, rms_unit(run, output))
            first = Line((recording, named, *map(number, scores)), "first", about=seen)
            rows.append(first if index == 0 else Line(("", named, *map(number, scores)), repeated=recording))
    said = [with_unit(model, units[0]) if len(units) == 1 else model for model in order]
    header = ("Recording", "Output", *said)
    title = "rms of the residual" + (f", best {len(order)} of {len(every)} models" if order != every else "")
    return [Printed(title, header, tuple(rows), frozenset({1}))] if rows else []
