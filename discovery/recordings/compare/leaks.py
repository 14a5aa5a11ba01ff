"""Recordings and channels that are copies of each other, with noise added, cut, scaled or shifted.

The noise of readings is drawn anew each time. Two series whose second differences hang together share their
noise: one is a copy of the other, whatever was done to it. Recordings of one program move alike, too, if they
are read so seldom that second differences hold the response: so what inputs explain does not count.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from discovery.recordings.campaign import Campaign, Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen
from discovery.recordings.finding import Finding

_FEWEST = 60  # readings in common
_ALIKE = 0.8  # correlation of second differences
_TOGETHER = 0.99  # correlation of the readings of a channel and its copy
_JUMPS = 0.1  # of the second differences, at most
_MEMORY = 12  # readings for which an input may act on second differences
_TAIL = 3.0  # robust standard deviations beyond which a second difference is a jump, no noise


def copied_channels(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """Errors that stand once more among the inputs, and channels recorded twice. Two bodies under one sun may
    move alike on some days: a channel that is recorded twice is so in every recording.
    """
    alike: dict[tuple[str, str], list[tuple[Seen, bool]]] = {}
    for one in recordings:
        for pair, found in _pairs(one, channels):
            alike.setdefault(pair, []).append((one, found))
    for (a, b), each in alike.items():
        output, other = (a, b) if channels[a].measured else (b, a)
        for one in [one for one, found in each if found]:
            if channels[other].is_input:
                what = f"the input '{other}' is a copy of '{output}'"
                do = "take it out: a model would read its own answer"
                yield Finding("error", one.file, None, what, do, "leak", other, 5.0)
            elif channels[a].role == channels[b].role and all(found for _, found in each):
                what, do = f"'{other}' and '{output}' are the same readings", "take one of the two out"
                yield Finding("warning", one.file, None, what, do, "copy", other, 1.0)


def _pairs(one: Seen, channels: Mapping[str, Channel]) -> Iterator[tuple[tuple[str, str], bool]]:
    """Pairs of channels of a recording, one of them measured, and whether they share their noise."""
    names = [
        n
        for n, c in channels.items()
        if n in one.values and n not in one.constant and c.role != "applied correction"
    ]
    for a, b in combinations(names, 2):
        both = np.isfinite(one.values[a]) & np.isfinite(one.values[b])
        if (channels[a].measured or channels[b].measured) and both.sum() >= _FEWEST:
            yield (a, b), share_noise(one.values[a][both], one.values[b][both])


def near_copies(
    recordings: Sequence[Seen], channels: Mapping[str, Channel]
) -> Iterator[tuple[str, str, str]]:
    """Pairs of recordings that share their noise: names, and the channel that shows it."""
    measured = [n for n, c in channels.items() if c.measured]
    series = {
        (one.name, name): _second(one.known(name)[1])
        for one in recordings
        for name in measured
        if name in one.values and one.known(name)[1].size >= _FEWEST
    }
    for k, a in enumerate(recordings):
        for b in recordings[k + 1 :]:
            for name in measured:
                left, right = series.get((a.name, name)), series.get((b.name, name))
                if left is None or right is None or not _overlap(left, right):
                    continue
                if _overlap(*(_unexplained(one, name, channels) for one in (a, b))):
                    yield a.name, b.name, name
                    break


def copies(campaign: Campaign, some: Collection[str], others: Collection[str]) -> Iterator[tuple[str, str]]:
    """Each of some recordings that is a near copy of one of the others."""
    wanted = {*some, *others}
    seen = [
        Seen(name, campaign.path, one.time, one.values, np.arange(len(one.time)))
        for name, one in campaign.recordings.items()
        if name in wanted
    ]
    for a, b, _ in near_copies(seen, campaign.channels):
        for one, other in ((a, b), (b, a)):
            if one in some and other in others:
                yield one, other


def share_noise(a: Array, b: Array) -> bool:
    """Whether two series of the same stamps share their noise, and what they move."""
    return _alike(_second(a), _second(b)) and abs(float(np.corrcoef(a, b)[0, 1])) > _TOGETHER


def _unexplained(one: Seen, name: str, channels: Mapping[str, Channel]) -> Array:
    """Second differences of the readings of a channel that those of the inputs, up to some readings before,
    do not explain.
    """
    at, read = one.known(name)
    moves = []
    for other, channel in channels.items():
        if channel.is_input and other in one.values and (known := one.known(other))[0].size:
            moves.append(np.diff(np.interp(at, *known), 2))
    target = np.diff(read, 2)
    past = [np.concatenate((np.zeros(k), move[: move.size - k])) for move in moves for k in range(_MEMORY)]
    past = [column for column in past if column.any()]
    if not past or 2 * len(past) > target.size:
        return _second(read)
    columns = np.column_stack(past)
    left: Array = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return _noise(left)


def _second(readings: Array) -> Array:
    """Return second differences of the noise: jumps are cut to a few standard deviations."""
    return _noise(np.diff(readings, 2))


def _noise(second: Array) -> Array:
    """Return second differences in standard deviations, jumps cut to a few of them."""
    scale = 1.4826 * float(np.median(np.abs(second - np.median(second))))
    if scale <= 0 or np.mean(np.abs(second) > _TAIL * scale) > _JUMPS:
        return np.zeros(0)  # a series of jumps has no noise that could be shared
    return np.asarray(np.clip(second / scale, -_TAIL, _TAIL))


def _alike(a: Array, b: Array) -> bool:
    if a.size < _FEWEST or a.size != b.size:
        return False
    return abs(float(np.corrcoef(a, b)[0, 1])) > _ALIKE


def _overlap(a: Array, b: Array) -> bool:
    """Return whether one series is correlated with the other at any shift."""
    if a.size < _FEWEST or b.size < _FEWEST:
        return False
    lags = np.arange(1 - b.size, a.size)
    size = 1 << (len(lags) - 1).bit_length()  # to load scipy.signal for this takes far longer
    together = np.fft.irfft(np.fft.rfft(a, size) * np.fft.rfft(b[::-1], size), size)[: len(lags)]
    count = np.minimum(a.size, b.size + lags) - np.maximum(0, lags)
    enough = count >= max(_FEWEST, 0.25 * min(a.size, b.size))
    if not enough.any():
        return False
    norm = float(np.sqrt(np.mean(a**2) * np.mean(b**2)))
    return bool(np.max(np.abs(together[enough] / count[enough])) > _ALIKE * norm)
