"""Readings of sensors that hung: they show the body as it was, and are set aside before any fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from discovery.recordings import Campaign
from discovery.recordings.standing import longest_run


@dataclass(frozen=True)
class Hung:
    """A sensor that repeats one reading, `value`, `count` times from `start` to `end` [s], while its body
    goes on. The first of these readings is right.
    """

    output: str
    recording: str
    start: float
    end: float
    value: float
    count: int


def without_hung(campaign: Campaign, outputs: Sequence[str]) -> tuple[Campaign, tuple[Hung, ...]]:
    """The campaign without what sensors repeat while they hang, and where that was.

    Args:
        outputs: measured channels to look at. A controller may hold what it sets: only sensors hang.
    """
    found, recordings = [], dict(campaign.recordings)
    for run, recording in campaign.recordings.items():
        for name in outputs:
            readings = recordings[run].values.get(name)
            if readings is None or not campaign.channels[name].is_sensor:
                continue
            known = np.flatnonzero(np.isfinite(readings))
            longest = longest_run(readings[known])
            if longest is None or not longest.hung:
                continue
            rows = known[longest.first : longest.last + 1]
            time = recording.time[rows]
            value = float(readings[rows[0]])
            found.append(Hung(name, run, float(time[0]), float(time[-1]), value, longest.count))
            kept = readings.copy()
            kept[rows[1:]] = np.nan
            values = {**recordings[run].values, name: kept}
            recordings[run] = replace(recordings[run], values=values)
    return (replace(campaign, recordings=recordings) if found else campaign), tuple(found)
