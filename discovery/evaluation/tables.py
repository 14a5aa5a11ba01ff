"""Tables 1 and 3 of the paper: the same layout, our figures next to the paper's."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

from discovery.evaluation.paper import EQUATION, TABLE_1, TABLE_1_COLUMNS, TABLE_3

CRITERIA = {"peak": "P_V", "mean": "M_V", "variance": "Q_M"}
_MOST_RECORDINGS = 6  # with a column each
_SMALL_HEAT = 0.1  # MJ


@dataclass(frozen=True)
class Table:
    """Rows of words and numbers, ready to be printed; a cell of None is empty."""

    title: str
    header: tuple[str, ...]
    rows: tuple[tuple[str | float | None, ...], ...]


def table_1(results: Mapping[str, Any], model: str, recordings: Mapping[str, str]) -> Table:
    """Table 1: improvement [%] of the arithmetic mean by one model, one column for each part of the paper.

    Args:
        results: content of results.json.
        recordings: column of the paper -> recording that plays its part (see `paper.parts_of_the_paper`).
    """
    found = results["models"][model]["recordings"]
    header = ["Error"]
    for column in TABLE_1_COLUMNS:
        header += [f"{column} ({recordings[column]})" if column in recordings else column, "paper"]
    rows = []
    for error in _errors(found):
        row: list[str | float | None] = [error]
        for k, column in enumerate(TABLE_1_COLUMNS):
            entry = found.get(recordings.get(column, ""), {}).get(error)
            row += [entry and entry["improvement"]["mean"], TABLE_1[error][k] if error in TABLE_1 else None]
        rows.append(tuple(row))
    return Table(f"Reduction of the arithmetic mean by '{model}' [%] (Table 1)", tuple(header), tuple(rows))


def without_model(results: Mapping[str, Any], outputs: Sequence[str]) -> str:
    """What outputs are called that no model predicts: nobody compensates a temperature.

    >>> without_model({"roles": {"T": "temperature", "E": "error"}}, ["T"]), without_model({}, ["E"])
    ('without a model', 'uncompensated')
    """
    roles = results.get("roles") or {}
    errors = all(roles.get(name, "error") == "error" for name in outputs)
    return "uncompensated" if errors else "without a model"


def table_3(
    results: Mapping[str, Any],
    recording: str,
    models: Sequence[str] | None = None,
    paper: bool = True,
) -> Table:
    """Table 3: P_V, M_V, Q_M and rms of each error on one recording, uncompensated and left over by each
    model.

    With `paper`, the figures that the paper prints stand next to the uncompensated rows and those of
    equations (8) and (9).
    """
    chosen = [
        name for name in models or results["models"] if recording in results["models"][name]["recordings"]
    ]
    found = {name: results["models"][name]["recordings"][recording] for name in chosen}
    header = ("Error", "", *(word for short in CRITERIA.values() for word in (short, "paper")), "rms")
    rows: list[tuple[str | float | None, ...]] = []
    for error in dict.fromkeys(error for entries in found.values() for error in entries):
        having = [name for name in chosen if error in found[name]]
        raw = found[having[0]][error]["uncompensated"]
        rows.append(_row(error, without_model(results, [error]), raw, "uncompensated"))
        equations = {name: EQUATION.get(str(results["models"][name].get("kind"))) for name in having}
        rows += [_row(error, name, found[name][error], equations[name]) for name in having]
        for name in having:
            equation = equations[name] and f"{equations[name]} %"
            rows.append(_row(error, f"improvement {name} [%]", found[name][error]["improvement"], equation))
    if not paper:
        keep = [k for k, name in enumerate(header) if name != "paper"]
        short = tuple(tuple(row[k] for k in keep) for row in rows)
        return Table(f"Recording '{recording}'", tuple(header[k] for k in keep), short)
    return Table(f"Recording '{recording}' (Table 3)", header, tuple(rows))


def budget_tables(found: Mapping[str, Any]) -> tuple[Table, ...]:
    """Heat by term, and what the fluid did: a column for each recording; of many, the smallest value, the
    median and the largest one.
    """
    each = list(found.values())
    terms = dict.fromkeys(t for one in each for t in one["entering"])
    heat = {t: [one["entering"].get(t) for one in each] for t in terms}
    heat["stored in the bodies"] = [sum(one["stored"].values()) for one in each]
    heat["entered, not stored"] = [one["gap"] for one in each]
    largest = max((abs(v) for row in heat.values() for v in row if v is not None), default=0.0)
    scale, unit = (1.0, "MJ") if largest >= _SMALL_HEAT else (1e3, "kJ")
    fluid = {
        k: [one["fluid"].get(k) for one in each]
        for k in dict.fromkeys(k for one in each for k in one["fluid"])
    }
    few = len(each) <= _MOST_RECORDINGS
    head = tuple(found) if few else (f"smallest of {len(each)} recordings", "median", "largest")

    def row(name: str, values: Sequence[float | None], times: float = 1.0) -> tuple[str | float | None, ...]:
        scaled = [None if v is None else times * v for v in values]
        known = [v for v in scaled if v is not None]
        return (name, *(scaled if few else (min(known), median(known), max(known))))

    tables = [
        Table(
            f"Heat into the bodies [{unit}]",
            ("Term", *head),
            tuple(row(t, v, scale) for t, v in heat.items()),
        )
    ]
    if fluid:
        tables.append(Table("Cutting fluid", ("Quantity", *head), tuple(row(k, v) for k, v in fluid.items())))
    return tuple(tables)


def _row(
    error: str, label: str, ours: Mapping[str, float], paper: str | None
) -> tuple[str | float | None, ...]:
    printed = TABLE_3.get(error, {}).get(paper or "", (None, None, None))
    cells: list[str | float | None] = []
    for key, figure in zip(CRITERIA, printed, strict=True):
        cells += [ours[key], figure]
    return (error, label, *cells, ours["rms"])


def _errors(recordings: Mapping[str, Any]) -> list[str]:
    return list(dict.fromkeys(error for entries in recordings.values() for error in entries))


def as_text(table: Table) -> str:
    """The table in plain characters, for a terminal."""
    lines = [table.header, *(tuple(_cell(cell) for cell in row) for row in table.rows)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(table.header))]
    body = [
        "  ".join(
            cell.rjust(w) if i > 1 else cell.ljust(w)
            for i, (cell, w) in enumerate(zip(line, widths, strict=True))
        )
        for line in lines
    ]
    return "\n".join([table.title, *(line.rstrip() for line in body)])


def _cell(cell: str | float | None) -> str:
    return "" if cell is None else cell if isinstance(cell, str) else f"{cell:.3g}"
