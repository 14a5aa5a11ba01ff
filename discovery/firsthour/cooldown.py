"""A machine that cools down although the name of its file says that it runs.

A number in a file's name is held for the whole recording. Where the temperatures rise above the room and then
fall back, the machine stood still at the end, and a model that believes the name learns a wrong law. Nothing
is changed by this rule: the temperatures are what models predict, so they may not decide on an input.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from discovery.firsthour.guess import Guess
from discovery.firsthour.measures import DEGREES
from discovery.firsthour.recorded import Recorded
from discovery.firsthour.table import Array, OwnTable
from discovery.printed import lasting

_HEATS = ("speed", "power")  # quantities without which a machine cools down
_FALL = 0.3  # of the rise: a warm spindle that runs falls by less
_NEAR = 0.05  # of the rise: before it has fallen by more, noise decides where its peak is
_LEAST_K = 1.0  # of a rise
_WINDOW = 0.02  # of a recording, over which a temperature is smoothed


def cooldowns(found: Recorded, guesses: Mapping[str, Guess]) -> Iterator[str]:
    """A sentence for each recording that cools down while a number of its name is held."""
    for quantity, (unit, values) in found.constants.items():
        for name, value in values.items():
            cooled = _cooldown(found.recordings[name], guesses)
            if quantity in _HEATS and value and cooled:
                header, start, share = cooled
                yield (
                    f"warning: {name}: {header} cools down from {lasting(start)} on (by {share:.0%} of its "
                    f"rise), but {quantity} = {value:g} {unit} of the file's name is held until the end; if "
                    f"the machine stood still then, cut the file there, or give every file a column of "
                    f"{quantity}"
                )


def _cooldown(run: OwnTable, guesses: Mapping[str, Guess]) -> tuple[str, float, float] | None:
    """The temperature that rises most above the room and falls back: its header, when it begins to fall [s
    from the start], and by how much of its rise; None where it does not.
    """
    room = [c.values for c in run.columns if guesses[c.name].role == "ambient temperature"]
    air = np.mean([_smooth(run.time, values) for values in room], axis=0) if room else 0.0
    found: tuple[float, str, float, float] | None = None
    for column in run.columns:
        one = guesses[column.name]
        sensor = one.role == "temperature" or (one.role == "other input" and one.unit in DEGREES)
        if not sensor or not np.isfinite(column.values).any():
            continue
        excess = _smooth(run.time, column.values) - air
        peak = int(np.argmax(excess))
        rise, fall = float(excess[peak] - excess[0]), float(excess[peak] - excess[-1])
        if found is None or rise > found[0]:
            begin = np.flatnonzero(excess >= excess[peak] - _NEAR * rise)[-1]
            found = rise, column.header, float(run.time[begin] - run.time[0]), fall
    if found is None or found[0] < _LEAST_K or found[3] < _FALL * found[0]:
        return None
    return found[1], found[2], found[3] / found[0]


def _smooth(time: Array, values: Array) -> Array:
    """A running mean, without gaps; its ends are means of what is there."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros(len(time))
    full = np.interp(time, time[known], values[known])
    total = np.concatenate(([0.0], np.cumsum(full)))
    half = max(0, round(0.5 * _WINDOW * len(full)))
    at = np.arange(len(full))
    first, last = np.maximum(at - half, 0), np.minimum(at + half + 1, len(full))
    return np.asarray((total[last] - total[first]) / (last - first))
