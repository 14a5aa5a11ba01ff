"""Thermometers in kelvin that models are fed with, in degC."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from discovery.firsthour.evidence import OTHER
from discovery.firsthour.guess import Guess
from discovery.firsthour.recorded import Recorded
from discovery.firsthour.table import Column, OwnTable

_ZERO = -273.15  # degC
_ABSOLUTE = 150.0  # K: no difference of temperatures on a machine is so large


def in_celsius(found: Recorded, guesses: Mapping[str, Guess]) -> tuple[Recorded, dict[str, Guess]]:
    """The recordings with such thermometers in degC, and the guesses with their new unit.

    Models count an input in degC from the temperature of a room. One in kelvin, which may also be a
    difference, would count from absolute zero.
    """
    names = {
        column.name
        for column in found.seen
        if (one := guesses[column.name]).role == OTHER
        and one.unit == "K"
        and not one.said
        and np.nanmin(column.values, initial=np.inf) > _ABSOLUTE
    }
    if not names:
        return found, dict(guesses)

    def moved(column: Column) -> Column:
        return replace(column, values=column.values + _ZERO) if column.name in names else column

    def converted(run: OwnTable) -> OwnTable:
        return replace(run, columns=tuple(map(moved, run.columns)))

    listed = ", ".join(f"'{column.name}'" for column in found.seen if column.name in names)
    changed = {
        name: replace(one, unit="degC", why=f"{one.why}; written in degC") if name in names else one
        for name, one in guesses.items()
    }
    return replace(
        found,
        recordings={name: converted(run) for name, run in found.recordings.items()},
        seen=tuple(map(moved, found.seen)),
        notes=(*found.notes, f"{listed}: converted from kelvin to degC"),
    ), changed
