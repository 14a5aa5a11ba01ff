"""The air around the machine, where nobody measured it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discovery.firsthour.guess import Guess
from discovery.firsthour.table import Array, Column
from discovery.firsthour.words import DEGREES
from discovery.recordings.units import conversion

_USUAL = (22.0, 5.0)  # degC and its spread, where nothing hints at a room
_ROOMS = (5.0, 35.0)  # degC: what people work in; a recording that starts hot shows none


@dataclass(frozen=True)
class Room:
    """A constant [degC], known within `spread` [K], and why."""

    degrees: float
    spread: float
    why: str


def guess_room(columns: Sequence[Column], guesses: Mapping[str, Guess]) -> Room | None:
    """The coolest readings if they can be those of a room, else a usual one; None where one is measured."""
    if any(one.role == "ambient temperature" for one in guesses.values()):
        return None
    coolest = math.inf
    for column in columns:
        one = guesses[column.name]
        if one.role == "temperature" or (one.role == "other input" and one.unit in DEGREES):
            rule = conversion(one.unit, "temperature")
            coolest = min(coolest, _coolest(column.values) * rule.factor + rule.offset)
    if math.isinf(coolest):
        return Room(*_USUAL, "no ambient temperature: a usual room is taken; write what it was")
    if not _ROOMS[0] <= coolest <= _ROOMS[1]:
        why = f"no ambient temperature, and the coolest readings ({coolest:.3g} degC) are no room"
        return Room(*_USUAL, f"{why}: a usual one is taken; write what it was")
    why = "no ambient temperature: the coolest readings are taken as the room"
    return Room(round(coolest, 1), 1.0, why)


def _coolest(values: Array) -> float:
    """The lowest median of five readings in a row: an outlier is no room."""
    known = values[np.isfinite(values)]
    if len(known) < 5:
        return float(known.min()) if len(known) else math.inf
    return float(np.median(np.lib.stride_tricks.sliding_window_view(known, 5), axis=1).min())
