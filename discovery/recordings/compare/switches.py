"""How a switch is used: the share of the time that it is on."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from discovery.recordings.compare.repairs import is_switch
from discovery.recordings.compare.seen import Seen

_NEAR = 0.1  # of the time: recordings that differ by less use it alike
_APART = 3.0  # times the range of the shares elsewhere


def used_inverted(one: Seen, recordings: Sequence[Seen], name: str) -> bool:
    """Whether a switch is on in one recording for as much of the time as it is off in all others, and on far
    longer there or here: a pump that runs but for breaks elsewhere, and only in breaks here.
    """
    if (here := _share(one, name)) is None:
        return False
    elsewhere = [_share(other, name) for other in recordings if other.name != one.name]
    shares = [share for share in elsewhere if share is not None]
    if len(shares) < 2:
        return False
    usual, width = float(np.median(shares)), max(float(np.ptp(shares)), _NEAR)
    return abs(1.0 - here - usual) <= width and abs(here - usual) > _APART * width


def _share(one: Seen, name: str) -> float | None:
    """The share of the time that a switch is on; None where it is no switch, or set by the campaign file."""
    if name not in one.values or name in one.constant:
        return None
    time, values = one.known(name)
    if len(time) < 2 or not is_switch(values):
        return None
    return float(np.sum(values[:-1] * np.diff(time)) / (time[-1] - time[0]))
