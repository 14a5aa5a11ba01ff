"""Inputs: are they known where they are needed."""

from collections.abc import Collection, Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array, Columns
from discovery.recordings.finding import Finding, more

_MOSTLY_EMPTY = 0.7  # share of rows with a value
_SPARSE = 3  # columns
_FEWEST = 30  # values that have not repeated
_GAP = 20.0  # a stretch of so many usual steps without a value is a gap


def input_findings(
    file: Path,
    columns: Columns,
    channels: Mapping[str, Channel],
    values: Mapping[str, Array],
    *,
    pauses: bool,
) -> Iterator[Finding]:
    """Inputs without any value (an error) or with long empty stretches, and readings in those (warnings).

    Args:
        pauses: the logger writes only what has changed, so empty stretches are none.
    """
    uncovered = {}
    for name, column in values.items():
        if not channels[name].is_input:
            continue
        known = np.isfinite(column)
        if not known.any():
            do = f"measure it, or say set = {{ {name} = ... }} in the campaign file"
            yield Finding("error", file, None, f"the input '{name}' has no value at all", do)
            continue
        gaps = [] if pauses else long_gaps(columns.time, known)
        yield from _findings(file, columns, channels[name], gaps)
        uncovered[name] = inside(gaps, columns.time.size) & ~known
    for name, column in values.items():
        if channels[name].measured:
            yield from _alone(file, columns, name, np.isfinite(column), uncovered)


def written_on_change(columns: Collection[Array]) -> bool:
    """Whether a logger wrote a value only when it had changed: then an empty cell means unchanged.

    That is so if most columns (each (T,)) are empty in many rows, each in other ones, and no value repeats
    the one before it.
    """
    known = [np.isfinite(column) for column in columns]
    sparse = [one for one in known if 1 < one.sum() < _MOSTLY_EMPTY * one.size]
    apart = len({one.tobytes() for one in sparse}) == len(sparse) >= _SPARSE
    moves = all((np.diff(column[one]) != 0).all() for column, one in zip(columns, known, strict=True))
    return bool(apart and moves and len(sparse) > len(columns) / 2 and sum(map(np.sum, sparse)) >= _FEWEST)


def long_gaps(time: Array, known: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last row of each long stretch of rows without a value."""
    rows = np.flatnonzero(known)
    usual = float(np.median(np.diff(time[rows]))) if rows.size > 1 else 0.0
    edges = np.concatenate([[-1], rows, [known.size]])
    gaps = []
    for before, after in pairwise(edges):
        if after - before > 1:
            length = time[min(after, known.size - 1)] - time[max(before, 0)]
            if length > _GAP * usual:
                gaps.append((int(before) + 1, int(after) - 1))
    return gaps


def _findings(
    file: Path, columns: Columns, channel: Channel, gaps: list[tuple[int, int]]
) -> Iterator[Finding]:
    if not gaps:
        return
    first, last = gaps[0]
    length = columns.time[last] - columns.time[first]
    what = f"the input '{channel.name}' is empty for {length:g} s, up to line {columns.lines[last]}"
    bridge = "the line between the values around it" if channel.between == "linear" else "the value before it"
    do = f"{bridge} is used there; fill it in, or split the recording"
    if first == 0:
        do = "the first known value is used there; cut the beginning off"
    kind = f"gap {gaps}"  # columns that are empty in the same rows share a line
    yield Finding("warning", file, int(columns.lines[first]), what + more(len(gaps)), do, kind, channel.name)


def inside(gaps: list[tuple[int, int]], size: int) -> NDArray[np.bool_]:
    """Whether each of `size` rows lies in a gap, (size,)."""
    found = np.zeros(size, dtype=np.bool_)
    for first, last in gaps:
        found[first : last + 1] = True
    return found


def _alone(
    file: Path,
    columns: Columns,
    name: str,
    readings: NDArray[np.bool_],
    uncovered: Mapping[str, NDArray[np.bool_]],
) -> Iterator[Finding]:
    together: dict[bytes, list[str]] = {}
    for one, empty in uncovered.items():
        together.setdefault((readings & empty).tobytes(), []).append(one)
    for names in together.values():
        rows = np.flatnonzero(readings & uncovered[names[0]])
        if rows.size:
            said = ", ".join(f"'{one}'" for one in names)
            what = (
                f"{said} {'is' if len(names) == 1 else 'are'} not known at {rows.size} of {readings.sum()} "
            )
            do = f"record {'it' if len(names) == 1 else 'them'} as long as the readings, or leave these out"
            kind = f"alone {names}"
            yield Finding(
                "warning", file, int(columns.lines[rows[0]]), f"{what}readings of '{name}'", do, kind, name
            )
