"""Temperatures against each other and against themselves in the other recordings: where they start, how fast
they move.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from discovery.printed import lasting
from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen, warning
from discovery.recordings.finding import Finding

_FEWEST = 30  # readings
_START = 10.0  # K: the first reading against its siblings, beyond what it is elsewhere
_AGREE = 6.0  # K: siblings that agree so well show the odd one out in a single recording
_ALONE = 15.0  # K
_SPREADS = 8.0  # times the usual spread of a start between recordings
_FASTER = 8.0  # times the fastest that a temperature moves elsewhere
_CLIMB = 8.0  # K within a few minutes, at least
_MINUTES = 360.0  # s
_NEAR = 0.2  # of a climb: so near to where it is elsewhere
_WINDOWS = tuple(_MINUTES / 2**k for k in range(8))


def temperature_findings(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """Temperatures that climb as no other, or start far from the others."""
    temperatures = [channel for channel in channels.values() if channel.unit == "degC"]
    for channel in temperatures:
        having = [
            one for one in recordings if channel.name in one.values and channel.name not in one.constant
        ]
        if channel.between == "linear":  # what is held is set, not measured
            yield from _climbs(having, channel)
    yield from starts(recordings, temperatures)


def _climbs(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    """A temperature that moves far faster than it does in any other recording, and not by a single
    reading. Nothing is wrong where it goes to where it is in others: this one began with a cold machine.
    """
    fastest = {one.name: _fastest(*one.known(channel.name)) for one in recordings}
    for one in recordings:
        others = [abs(v) for name, (v, *_) in fastest.items() if name != one.name]
        if len(others) < 2:
            continue
        change, row, took = fastest[one.name]
        usual = max(others)
        elsewhere = np.concatenate([o.known(channel.name)[1] for o in recordings if o.name != one.name])
        reached = one.known(channel.name)[1][row] + change
        margin = _NEAR * abs(change)
        if elsewhere.min() - margin <= reached <= elsewhere.max() + margin:
            continue
        if abs(change) > max(_CLIMB, _FASTER * usual):
            word = "climbs" if change > 0 else "falls"
            what = (
                f"'{channel.name}' {word} by {abs(change):.3g} K within {lasting(took)}, "
                f"elsewhere by at most {usual:.2g} K within {lasting(_MINUTES)}"
            )
            yield warning(one, channel, row, what, "look at the sensor and its contact", "climbs", 2.0)


def _fastest(time: Array, read: Array) -> tuple[float, int, float]:
    """Largest lasting change within a few minutes [K], its first reading, and how long it takes [s]."""
    best = 0.0, 0, 0.0
    if read.size < _FEWEST:
        return best
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(read, 5), axis=1)
    stamps, last = time[2:-2], read.size - 5
    for window in _WINDOWS:  # what comes and goes is seen by a short one
        ahead = np.minimum(np.searchsorted(stamps, stamps + window), last)
        ahead = np.maximum(ahead, np.minimum(np.arange(last + 1) + 1, last))
        change = smooth[ahead] - smooth
        row = int(np.argmax(np.abs(change)))
        if abs(change[row]) > abs(best[0]):
            best = float(change[row]), row + 2, float(stamps[ahead[row]] - stamps[row])
    return best


def starts(recordings: Sequence[Seen], temperatures: Sequence[Channel]) -> Iterator[Finding]:
    """Find a temperature that differs from the others at a cold start, and does not in other recordings.

    Where it starts as its siblings do, nothing is wrong with it, wherever it starts elsewhere: the other
    recordings may have begun with a warm machine. Nor is anything where it starts as it does elsewhere: this
    recording may have begun so.
    """
    away: dict[tuple[str, str], float] = {}
    agree: dict[str, float] = {}
    for one in recordings:
        first = {}
        for c in temperatures:
            if c.name in one.values and c.name not in one.constant and one.known(c.name)[1].size >= 3:
                first[c.name] = _first(one, c.name)
        if len(first) < 2:
            continue
        for name, value in first.items():
            others = np.array([v for n, v in first.items() if n != name])
            away[one.name, name] = value - float(np.median(others))
            agree[f"{one.name}|{name}"] = float(np.percentile(others, 90) - np.percentile(others, 10))
    for one in recordings:
        for c in temperatures:
            if (one.name, c.name) not in away:
                continue
            here = away[one.name, c.name]
            elsewhere = np.array([v for (r, n), v in away.items() if n == c.name and r != one.name])
            siblings = sum(1 for r, _ in away if r == one.name) - 1
            if elsewhere.size >= 2:
                middle = float(np.median(elsewhere))
                spread = 1.4826 * float(np.median(np.abs(elsewhere - middle)))
                usual = max(_START, _SPREADS * spread, 1.5 * np.ptp(elsewhere))
                odd = abs(here - middle) > usual and abs(here) > _START
                odd = odd and agree[f"{one.name}|{c.name}"] < _START
                odd = odd and (siblings > 1 or _stays_apart(one, c.name, recordings))
                odd = odd and abs(_first(one, c.name) - _usual_start(one, c.name, recordings)) > _START
            else:
                odd = siblings >= 5 and abs(here) > _ALONE and agree[f"{one.name}|{c.name}"] < _AGREE
            if odd and not (here > 0 and _was_hot(one, c.name, here, recordings)):
                side = "above" if here > 0 else "below"
                rest = [n for r, n in away if r == one.name and n != c.name]
                alike = "the other temperatures, which agree" if siblings > 1 else f"'{rest[0]}'"
                what = (
                    f"'{c.name}' starts at {_first(one, c.name):.3g} degC, {abs(here):.3g} K {side} {alike}"
                )
                yield warning(one, c, 0, what, "look at the sensor, its unit and its contact", "start", 2.0)


def _was_hot(one: Seen, name: str, above: float, recordings: Sequence[Seen]) -> bool:
    """Whether a recording began while a body was hot, by what it does then: it cools, or a controller holds
    it where other recordings hold it, too. A sensor with an offset does neither.
    """
    read, start = one.known(name)[1], _first(one, name)
    if start - np.percentile(read, 2) > above / 2:
        return True
    others = [float(np.median(r.known(name)[1])) for r in recordings if r is not one and name in r.values]
    held = np.ptp(np.percentile(read, [5, 95])) < _START
    return bool(held and others and min(abs(start - level) for level in others) < _START)


def _stays_apart(one: Seen, name: str, recordings: Sequence[Seen]) -> bool:
    """Whether, of two that differ, it is this one: it starts elsewhere than usual, and not from a warm
    machine, which would cool down.
    """
    usual, read = _usual_start(one, name, recordings), one.known(name)[1]
    return bool(np.percentile(read, 2) > usual + _START or _first(one, name) < usual - _START)


def _first(one: Seen, name: str) -> float:
    """Where a temperature starts, by its first readings."""
    return float(np.median(one.known(name)[1][:5]))


def _usual_start(one: Seen, name: str, recordings: Sequence[Seen]) -> float:
    """Where it starts in the other recordings."""
    others = [r for r in recordings if r is not one and name in r.values and r.known(name)[1].size]
    return float(np.median([_first(r, name) for r in others]))
