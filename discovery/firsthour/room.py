"""The air around the machine, where nobody measured it: an unknown of each recording, never a number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discovery.firsthour.guess import Guess
from discovery.firsthour.measures import DEGREES
from discovery.firsthour.table import OwnTable
from discovery.recordings.units import conversion

ROOM = "T_env"
_USUAL = (22.0, 5.0)  # degC and its spread, where nothing is known: 12 to 32 in 19 of 20 workshops
_ROOMS = (5.0, 35.0)  # degC: what people work in
_COLD = 1.5  # K: temperatures that agree so well at the start of a recording are those of the air
_COLD_SPREAD = 2.0  # K: an air that moves while the machine runs
_DAYS = 2.0  # K: what the same room differs from one recording to another
_FIRST = 5  # readings


@dataclass(frozen=True)
class Room:
    """What is believed before a fit: `degrees` [degC], within `spread` [K], in each recording; and why."""

    degrees: float
    spread: float
    why: str


def unknown_room(
    runs: Sequence[OwnTable], guesses: Mapping[str, Guess], outputs: Sequence[str]
) -> tuple[Room | None, str]:
    """The channel used as the air around, and a sentence; no room, and "", where it was measured.

    Temperatures lose heat to the air, so a model of them has it as an unknown of each recording. For errors
    nothing stands in: a constant drives nothing.

    Args:
        runs: recordings to fit.
    """
    if any(one.role == "ambient temperature" for one in guesses.values()):
        return None, ""
    if not any(guesses[name].role in ("temperature", "error") for name in outputs):
        return None, ""
    if not any(guesses[name].role == "temperature" for name in outputs):
        return None, (
            "no room temperature was recorded, and none is assumed: the effect of the air stays in the "
            "errors. Record it, or name a substitute with --room COLUMN"
        )
    cold = [degrees for run in runs for degrees in [_cold_start(run, guesses)] if degrees is not None]
    if cold:
        every = len(cold) == len(runs)
        degrees, other = float(np.mean(cold)), np.std(cold) if every else np.hypot(np.std(cold), _DAYS)
        spread = float(np.hypot(_COLD_SPREAD, other))
        where = "each recording" if every else f"{len(cold)} of {len(runs)} recordings"
        why = f"the temperatures agree at the start of {where}, near {degrees:.3g} degC"
    else:
        (degrees, spread), why = _USUAL, "nothing shows it"
    room = Room(round(degrees, 1), round(spread, 1), why)
    return room, (
        f"no room temperature was recorded: {ROOM} is an unknown of each recording, believed to be "
        f"{room.degrees:g} degC within {room.spread:g} K ({why}). A fit estimates it; better record "
        "it, or name "
        "a substitute with --room COLUMN"
    )


def _cold_start(run: OwnTable, guesses: Mapping[str, Guess]) -> float | None:
    """Return the mean of the first temperatures [degC] if they agree, as after a night at rest. None: they
    differ, or there is only one.
    """
    firsts = []
    for column in run.columns:
        one = guesses.get(column.name)
        known = column.values[np.isfinite(column.values)]
        if one is not None and known.size and one.unit in DEGREES:
            rule = conversion(one.unit, "temperature")
            firsts.append(float(np.median(known[:_FIRST])) * rule.factor + rule.offset)
    if len(firsts) < 2 or np.ptp(firsts) > _COLD or not _ROOMS[0] <= np.mean(firsts) <= _ROOMS[1]:
        return None
    return float(np.mean(firsts))
