"""Errors whose probe was not set to zero: counted from their first reading."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from discovery.firsthour.guess import Guess
from discovery.firsthour.recorded import Recorded
from discovery.firsthour.table import Array, OwnTable

_FAR = 3.0  # times the span: no thermal error starts so far from zero


def from_first_readings(found: Recorded, guesses: Mapping[str, Guess]) -> Recorded:
    """The recordings with errors counted from their first reading, where the zero of a probe is arbitrary.

    That is so if it starts in any recording further from zero than it then moves, several times over. All
    recordings are treated alike. Parts of one file keep the zero of that file.
    """
    runs = found.recordings
    errors = [name for name, one in guesses.items() if one.role == "error"]
    shifted = [name for name in errors if any(_far(_values(run, name)) for run in list(runs.values())[:-1])]
    if not shifted:
        return found
    zeros: dict[tuple[object, str, str], float] = {}  # by file and channel: the first part comes first
    for run in runs.values():
        for name in shifted:
            known = _known(_values(run, name))
            if known.size:
                zeros.setdefault((run.path, run.name, name), float(known[0]))

    def counted(run: OwnTable) -> OwnTable:
        zero = {name: zeros.get((run.path, run.name, name), 0.0) for name in shifted}
        columns = tuple(replace(c, values=c.values - zero.get(c.name, 0.0)) for c in run.columns)
        return replace(run, columns=columns)

    (first, run), *_ = runs.items()
    notes = tuple(
        f"'{name}' starts at {zeros[run.path, run.name, name]:g} in {first}, far from zero compared with how "
        "much it moves: in each file it is counted from its first reading"
        for name in shifted
        if (run.path, run.name, name) in zeros
    )
    moved = {name: counted(run) for name, run in runs.items()}
    return replace(found, recordings=moved, notes=(*found.notes, *notes))


def _far(values: Array) -> bool:
    known = _known(values)
    return bool(known.size and abs(known[0]) > _FAR * np.ptp(known) > 0.0)


def _known(values: Array) -> Array:
    return values[np.isfinite(values)]


def _values(run: OwnTable, name: str) -> Array:
    return next((column.values for column in run.columns if column.name == name), np.empty(0))
