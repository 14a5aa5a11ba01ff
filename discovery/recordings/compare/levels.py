"""A channel against itself in the other recordings: noise, resolution, range."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from discovery.printed import lasting, printed
from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen, noise_of, rounding_of, smallest_step, warning
from discovery.recordings.finding import Finding

_FEWEST = 30  # readings
_NOISIER = 8.0  # times the noise elsewhere
_ROUNDING = 1e-6  # of what a channel moves
_RESCALED, _PLACES = 50.0, 15  # times the noise before; places where a recording may change
_COARSER = 20.0  # times the steps of readings elsewhere, and more than a hundredth of what the channel moves
_FLAT = 0.02  # of the readings at the largest value: a range that is full
_PILE, _NEXT = 4.0, 3  # times as many readings as at any of so many next values: the end of a range
_SET, _VISITS = 0.5, 3  # of the readings are as the one before; stays at the largest value
_LOWER = 0.97  # of what the other recordings reach


def level_findings(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """What stands out in noise, resolution or range, the channel and the recording named."""
    for name, channel in channels.items():
        having = [one for one in recordings if name in one.values and name not in one.constant]
        yield from _noise(having, channel)
        yield from _scale(having, channel)
        yield from _resolution(having, channel)
        yield from _full_range(having, channel)


def _noise(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    if not channel.measured and channel.between != "linear":
        return
    reads = {one.name: one.known(channel.name)[1] for one in recordings}
    found = {name: noise_of(read) for name, read in reads.items()}
    hidden = {name: rounding_of(read) for name, read in reads.items()}
    sizes = {name: read.size for name, read in reads.items()}
    for one in recordings:
        others = [
            max(v, hidden[name])
            for name, v in found.items()
            if name != one.name and v > 0 and sizes[name] >= _FEWEST
        ]
        usual = float(np.median(others)) if others else channel.noise or 0.0
        if sizes[one.name] >= _FEWEST and usual > 0 and found[one.name] > _NOISIER * usual:
            times = found[one.name] / usual
            where = "than in the other recordings" if others else "than the campaign says"
            what = (
                f"'{channel.name}' is {times:.2g} times noisier {where} ({found[one.name]:.2g} "
                f"{channel.unit})"
            )
            yield warning(
                one, channel, 0, what, "look at its cable, range and filter", "noise", np.log(times)
            )


def _scale(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    """Find a noise that changes by orders of magnitude within a recording: from there on the unit is
    another.
    """
    if not channel.measured and channel.between != "linear":
        return
    for one in recordings:
        time, read = one.known(channel.name)
        if read.size < 2 * _FEWEST:
            continue
        best, where = 1.0, 0
        rounding = rounding_of(read)  # readings that stand still hide less noise than this
        least = _ROUNDING * float(np.std(read))  # less is no noise: a straight line, or digits
        for row in np.linspace(_FEWEST, read.size - _FEWEST, _PLACES).astype(int):
            before, after = (max(noise_of(part), rounding) for part in (read[:row], read[row:]))
            if min(before, after) > least and abs(np.log(after / before)) > abs(np.log(best)):
                best, where = after / before, int(row)
        if max(best, 1 / best) > _RESCALED and _is_lasting(read, where, rounding):
            change = f"{printed(best, 2)} times as" if best > 1 else f"1/{printed(1 / best, 2)} as"
            at = lasting(float(time[where] - time[0]))
            what = f"'{channel.name}' is {change} noisy from about {at} on"
            do = "another unit or range from there on: split the recording, or mend it"
            yield warning(one, channel, where, what, do, "halfway", 6.0)


def _is_lasting(read: Array, where: int, rounding: float) -> bool:
    """Whether every stretch is noisier on one side of a row than every stretch on the other: what is quiet
    each night has the same unit. The stretches next to the row count only if there are no others.
    """
    size = max(_FEWEST, read.size // _PLACES)
    before, after = (np.array_split(some, max(1, some.size // size)) for some in (read[:where], read[where:]))
    first = [max(noise_of(part), rounding) for part in before[:-1] or before]
    then = [max(noise_of(part), rounding) for part in after[1:] or after]
    return max(first) < min(then) or max(then) < min(first)


def _resolution(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    if not channel.measured and channel.between != "linear":
        return
    steps = {one.name: smallest_step(one.known(channel.name)[1]) for one in recordings}
    for one in recordings:
        others = [v for name, v in steps.items() if name != one.name and v > 0]
        read = one.known(channel.name)[1]
        if not others or read.size < _FEWEST:
            continue
        usual, span = float(np.median(others)), float(np.ptp(read))
        if steps[one.name] > _COARSER * usual and steps[one.name] > 0.02 * span > 0:
            what = (
                f"'{channel.name}' is recorded in steps of {steps[one.name]:.2g} {channel.unit}, "
                f"elsewhere of {usual:.2g}"
            )
            yield warning(one, channel, 0, what, "record it with more digits", "resolution", 0.5)


def _full_range(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    """Readings that stay at the very largest value again and again, where elsewhere it goes higher and never
    does so.
    """
    flat, tops = {}, {}
    for one in recordings:
        read = one.known(channel.name)[1]
        if read.size < _FEWEST or np.unique(read).size < 30:
            continue
        for sign in (1.0, -1.0):
            top = float(np.max(sign * read))
            tops[one.name, sign] = top
            moved = read[int(np.argmax(read != read[0])) :]  # before, it is at rest
            clipped = moved.size > _NEXT and _piles_up(sign * moved) and not _is_a_setting(sign * moved)
            flat[one.name, sign] = float(np.mean(sign * moved == top)) if clipped else 0.0
    for one in recordings:
        for sign in (1.0, -1.0):
            if (one.name, sign) not in flat or flat[one.name, sign] < _FLAT:
                continue
            others = [name for name, s in flat if s == sign and name != one.name]
            middle = float(np.median(one.known(channel.name)[1])) * sign
            higher = [n for n in others if tops[n, sign] - middle > (tops[one.name, sign] - middle) / _LOWER]
            usual = max((flat[n, sign] for n in others), default=1.0)
            if higher and usual < flat[one.name, sign] / 4:
                read = one.known(channel.name)[1]
                row = int(np.argmax(sign * read))
                what = (
                    f"'{channel.name}' stays at its {'largest' if sign > 0 else 'smallest'} value "
                    f"{read[row]:.4g} in "
                    f"{flat[one.name, sign]:.0%} of its readings; elsewhere it goes "
                    f"{'higher' if sign > 0 else 'lower'} and never stays"
                )
                yield warning(one, channel, row, what, _why(channel, sign), "saturated", 2.0)


def _why(channel: Channel, sign: float) -> str:
    """What readings at the largest (`sign` 1) or smallest (-1) value may be. A current that idles is right;
    no temperature idles.
    """
    if channel.is_input and channel.unit != "degC" and sign < 0:
        return "its value at idle, or else a full range or a limit: widen it then"
    return "a full range or a limit: widen it"


def _piles_up(read: Array) -> bool:
    """Whether far more readings (N,) are at the largest value than at any of the next ones, as at the end of
    a range. A slow sensor with few digits has as many at each.
    """
    _, counts = np.unique(read, return_counts=True)
    return bool(counts[-1] > _PILE * counts[-1 - _NEXT : -1].max())


def _is_a_setting(read: Array) -> bool:
    """Whether the largest of some readings (N,) is one of the levels that an input is set to: it keeps each
    of them for a while, and comes to this one once or twice. What is clipped comes there again and again.
    """
    kept = float(np.mean(np.diff(read) == 0))
    visits = int(np.count_nonzero(np.diff((read == read.max()).astype(int), prepend=0) == 1))
    return kept > _SET and visits < _VISITS
