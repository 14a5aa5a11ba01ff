"""Files as recordings of one machine: which of them are seen, and which of their columns say something."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from discovery.errors import UserError
from discovery.firsthour.clocks import bookkeeping, tells_time
from discovery.firsthour.guess import guess_all
from discovery.firsthour.table import Array, Column, OwnTable
from discovery.firsthour.words import electric, is_set_point, role_of, unit_of

_LAST_THIRD = 2 / 3


@dataclass(frozen=True)
class Recorded:
    """`recordings`: the last one is unseen. `seen`: each column, its values joined from all others.

    `notes`: what was left out.
    """

    recordings: dict[str, OwnTable]
    seen: tuple[Column, ...]
    notes: tuple[str, ...]


def recorded(tables: Sequence[OwnTable]) -> Recorded:
    """Recordings with the columns that all have and that say something in what is seen.

    Whatever is chosen or guessed is so from `seen` alone: what the unseen recording holds stays a question.

    Raises:
        UserError: files that have nothing in common, or of which nothing is left.
    """
    recordings = _named(tables)
    runs = list(recordings.values())
    common, notes = _common(runs)
    seen = [_joined(column, runs[:-1]) for column in runs[0].columns if column.name in common]
    guesses = guess_all(seen)
    kept = []
    for column in seen:
        of_runs = [(run.time, values) for run in runs[:-1] for values in _values(run, column.name)]
        why = _says_nothing(column, guesses[column.name].role, of_runs)
        if why:
            notes.append(f"column '{column.header}' {why}")
        else:
            kept.append(column)
    if not kept:
        raise UserError(
            f"{tables[0].path}: no column but time holds values that move; record a temperature or an error"
            + (f" ({'; '.join(notes)})" if notes else "")
        )
    names = [column.name for column in kept]
    return Recorded(
        {name: replace(run, columns=_of(run, names)) for name, run in recordings.items()},
        tuple(kept),
        tuple(dict.fromkeys(notes)),
    )


def never_moves(column: Column) -> bool:
    """Whether all readings are alike, or none is there."""
    return len(np.unique(column.values[np.isfinite(column.values)])) < 2


def _named(tables: Sequence[OwnTable]) -> dict[str, OwnTable]:
    if len(tables) == 1:
        split = round(_LAST_THIRD * len(tables[0].time))
        return {"first_part": _cut(tables[0], slice(split)), "last_part": _cut(tables[0], slice(split, None))}
    found: dict[str, OwnTable] = {}
    for table in tables:
        stem = re.sub(
            r"[^\w.+-]+", "_", table.path.name.removesuffix(".gz").rsplit(".", 1)[0], flags=re.ASCII
        ).strip("_.")
        name, count = stem or "recording", 1
        while name in found:
            count += 1
            name = f"{stem}_{count}"
        found[name] = table
    return found


def _cut(table: OwnTable, rows: slice) -> OwnTable:
    columns = tuple(replace(column, values=column.values[rows]) for column in table.columns)
    return replace(table, time=table.time[rows], columns=columns)


def _common(runs: Sequence[OwnTable]) -> tuple[set[str], list[str]]:
    """Names that all have, and what is said of the others."""
    first = {column.name for column in runs[0].columns}
    for table in runs[1:]:
        here = {column.name for column in table.columns}
        if not first & here:
            raise UserError(
                f"{table.path}: its columns differ from those of {runs[0].path} "
                f"({', '.join(sorted(first ^ here))}); recordings of one campaign have the same columns"
            )
    common = first.intersection(*({column.name for column in run.columns} for run in runs))
    others = [column.header for run in runs for column in run.columns if column.name not in common]
    return common, [f"column '{header}' is not in every file: left out" for header in others]


def _says_nothing(column: Column, role: str, of_runs: Sequence[tuple[Array, Array]]) -> str:
    """Why a column is left out, or ""."""
    known = unit_of(column.unit)[1]
    named = role_of(column.name, known, column.values)
    if all(tells_time(column.name, column.unit, values, time, named.role) for time, values in of_runs):
        return "is a clock, in exact proportion to the time: left out (if not, name its unit in the header)"
    unit = column.unit or electric(column.name)  # a ramp of a voltage is no clock
    books = [bookkeeping(column.name, unit, values, time, named.role) for time, values in of_runs]
    if all(books):
        return f"{books[0]}: left out" + ("" if column.unit else " (if not, name its unit in the header)")
    if is_set_point(column.name, known, column.values):
        return "is a set point, no measurement: left out"
    if not np.isfinite(column.values).any():
        return "holds nothing in what is fitted: left out"
    return "never moves: left out" if role == "other input" and never_moves(column) else ""


def _joined(column: Column, runs: Sequence[OwnTable]) -> Column:
    return replace(column, values=np.concatenate([v for run in runs for v in _values(run, column.name)]))


def _values(run: OwnTable, name: str) -> list[Array]:
    return [column.values for column in run.columns if column.name == name]


def _of(run: OwnTable, names: Sequence[str]) -> tuple[Column, ...]:
    by_name = {column.name: column for column in run.columns}
    return tuple(by_name[name] for name in names)
