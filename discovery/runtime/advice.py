"""What to record where recordings do not tell two explanations apart, in the inputs that the machine has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from discovery.export.document import Exported
from discovery.printed import printed
from discovery.recordings import Campaign


def to_distinguish(exported: Exported, campaign: Campaign, recordings: Sequence[str]) -> str:
    """What further recordings must hold, given which inputs never moved in these."""
    still: dict[str, float] = {}
    for one in exported.inputs:
        series = [campaign.recordings[r].values.get(one.name, np.zeros(0)) for r in recordings]
        every = np.concatenate([s[np.isfinite(s)] for s in series])
        if len(every) and np.ptp(every) == 0.0:
            still[one.name] = float(every[0])
    return measure_more([one.name for one in exported.inputs if one.name not in still], still)


def measure_more(moving: Sequence[str], still: Mapping[str, float] | None = None) -> str:
    """Advice on inputs that move, and on those that are constant.

    >>> measure_more(["P"], {"T_room": 26.0})
    'measure more often, with P as different as can be, and where T_room is not 26'
    >>> measure_more(["P", "flow"])
    'measure more often, with P and flow each high and low, not only together'
    """
    said = "measure more often"
    if len(moving) > 1:
        said += f", with {', '.join(moving[:-1])} and {moving[-1]} each high and low, not only together"
    elif moving:
        said += f", with {moving[0]} as different as can be"
    if still:
        said += ", and where " + " and ".join(f"{n} is not {printed(v)}" for n, v in still.items())
    return said
