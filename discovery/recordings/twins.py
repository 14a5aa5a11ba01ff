"""Recordings that hold the same readings, whatever their files and names."""

import hashlib
from collections.abc import Collection, Iterable, Iterator

import numpy as np

from discovery.recordings.campaign import Campaign
from discovery.recordings.columns import Array


def fingerprint(time: Array, readings: Iterable[Array]) -> str | None:
    """The same for two recordings with the same stamps since their first and the same readings, each (T,).

    Inputs do not count: a copy with another constant is still a copy. None where nothing varies, since two
    recordings in which nothing happens may be alike.

    >>> time, noisy = np.array([5.0, 6.0]), np.array([0.1, np.nan])
    >>> fingerprint(time, [noisy]) is None, fingerprint(time, [time]) == fingerprint(time + 1, [time])
    (True, True)
    """
    columns = [column for column in readings if np.unique(column[np.isfinite(column)]).size > 1]
    if not columns:
        return None
    digest = hashlib.sha256()
    for column in (time - time[0], *columns):
        digest.update((np.where(np.isnan(column), np.nan, column) + 0.0).tobytes())  # one NaN, one zero
    return digest.hexdigest()


def twins(campaign: Campaign, some: Collection[str], others: Collection[str]) -> Iterator[tuple[str, str]]:
    """Each of some recordings that holds the same readings as one of the others."""
    prints = {
        name: fingerprint(one.time, [v for c, v in one.values.items() if campaign.channels[c].measured])
        for name, one in campaign.recordings.items()
        if name in (*some, *others)
    }
    for one in some:
        yield from ((one, other) for other in others if prints[one] and prints[one] == prints[other])
