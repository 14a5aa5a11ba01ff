"""A channel against its siblings and against itself in the other recordings: level, noise, resolution,
speed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen, noise_of
from discovery.recordings.finding import Finding

_FEWEST = 30  # readings
_NOISIER = 8.0  # times the noise elsewhere
_ROUNDING = 1e-6  # of what a channel moves
_RESCALED, _PLACES = 50.0, 15  # times the noise before; places where a recording may change
_COARSER = 20.0  # times the steps of readings elsewhere, and more than a hundredth of what the channel moves
_START = 10.0  # K: the first reading against its siblings, beyond what it is elsewhere
_AGREE = 6.0  # K: siblings that agree so well show the odd one out in a single recording
_ALONE = 15.0  # K
_SPREADS = 8.0  # times the usual spread of a start between recordings
_FASTER = 8.0  # times the fastest that a temperature moves elsewhere
_CLIMB = 8.0  # K within a few minutes, at least
_FLAT = 0.02  # of the readings at the largest value: a range that is full
_PILE, _NEXT = 4.0, 3  # times as many readings as at any of so many next values: the end of a range
_SET, _VISITS = 0.5, 3  # of the readings are as the one before; stays at the largest value
_LOWER = 0.97  # of what the other recordings reach
_MINUTES = 360.0  # s
_APART = 2.0  # times the usual spread: another level
_DIGITS = 2.0  # times its last digit: what an input should move by while it stays at one value
_KEEPS = 0.8  # of the readings after one at that value have it, too
_STILL, _LINE = 0.1, 0.8  # of the recording; correlation elsewhere
_NEAR, _HELD = 0.02, 0.01  # of the range elsewhere; of the readings elsewhere: a value that was held there
_RELATED = 0.5  # of what a channel moves: what a straight line of its sibling leaves


def level_findings(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """What stands out in level, noise, resolution, rate or range, the channel and the recording named."""
    for name, channel in channels.items():
        having = [one for one in recordings if name in one.values and name not in one.constant]
        yield from _noise(having, channel)
        yield from _scale(having, channel)
        yield from _resolution(having, channel)
        yield from _full_range(having, channel)
        if channel.unit == "degC" and channel.between == "linear":  # what is held is set, not measured
            yield from _climbs(having, channel)
    yield from _starts(recordings, [c for c in channels.values() if c.unit == "degC"])
    inputs = [c for c in channels.values() if c.is_input]
    yield from _exchanged(recordings, inputs)
    yield from _stuck(recordings, inputs)


def _noise(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    if not channel.measured and channel.between != "linear":
        return
    found = {one.name: noise_of(one.known(channel.name)[1]) for one in recordings}
    sizes = {one.name: one.known(channel.name)[1].size for one in recordings}
    for one in recordings:
        others = [v for name, v in found.items() if name != one.name and v > 0 and sizes[name] >= _FEWEST]
        usual = float(np.median(others)) if others else channel.noise or 0.0
        if sizes[one.name] >= _FEWEST and usual > 0 and found[one.name] > _NOISIER * usual:
            times = found[one.name] / usual
            where = "than in the other recordings" if others else "than the campaign says"
            what = (
                f"'{channel.name}' is {times:.2g} times noisier {where} ({found[one.name]:.2g} "
                f"{channel.unit})"
            )
            yield _finding(
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
        least = _ROUNDING * float(np.std(read))  # less is no noise: a straight line, or digits
        for row in np.linspace(_FEWEST, read.size - _FEWEST, _PLACES).astype(int):
            before, after = noise_of(read[:row]), noise_of(read[row:])
            if min(before, after) > least and abs(np.log(after / before)) > abs(np.log(best)):
                best, where = after / before, int(row)
        if max(best, 1 / best) > _RESCALED:
            change = f"{best:.2g} times as" if best > 1 else f"1/{1 / best:.2g} as"
            at = (time[where] - time[0]) / 3600
            what = f"'{channel.name}' is {change} noisy from about {at:.2g} h on"
            do = "another unit or range from there on: split the recording, or mend it"
            yield _finding(one, channel, where, what, do, "halfway", 6.0)


def _resolution(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    if not channel.measured and channel.between != "linear":
        return
    steps = {one.name: _step(one.known(channel.name)[1]) for one in recordings}
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
            yield _finding(one, channel, 0, what, "record it with more digits", "resolution", 0.5)


def _step(readings: Array) -> float:
    """The smallest step between different readings, where most steps are multiples of it."""
    different = np.diff(np.unique(readings))
    return float(np.min(different)) if different.size > 2 else 0.0


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
            clipped = _piles_up(sign * read) and not _is_a_setting(sign * read)
            flat[one.name, sign] = float(np.mean(sign * read == top)) if clipped else 0.0
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
                yield _finding(one, channel, row, what, "a full range or a limit: widen it", "saturated", 2.0)


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


def _climbs(recordings: Sequence[Seen], channel: Channel) -> Iterator[Finding]:
    """A temperature that moves far faster than it does in any other recording, and not by a single
    reading.
    """
    fastest = {one.name: _fastest(*one.known(channel.name)) for one in recordings}
    for one in recordings:
        others = [v for name, (v, _) in fastest.items() if name != one.name]
        if len(others) < 2:
            continue
        change, row = fastest[one.name]
        usual = max(others)
        if abs(change) > max(_CLIMB, _FASTER * usual):
            word = "climbs" if change > 0 else "falls"
            what = (
                f"'{channel.name}' {word} by {abs(change):.3g} K within {_MINUTES / 60:.0f} min, "
                f"elsewhere by at most {usual:.2g} K"
            )
            yield _finding(one, channel, row, what, "look at the sensor and its contact", "climbs", 2.0)


def _fastest(time: Array, read: Array) -> tuple[float, int]:
    """Largest lasting change within a few minutes [K], and its first reading."""
    if read.size < _FEWEST:
        return 0.0, 0
    smooth = np.median(np.lib.stride_tricks.sliding_window_view(read, 5), axis=1)
    stamps = time[2:-2]
    ahead = np.minimum(np.searchsorted(stamps, stamps + _MINUTES), len(stamps) - 1)
    ahead = np.maximum(ahead, np.minimum(np.arange(len(stamps)) + 1, len(stamps) - 1))
    change = smooth[ahead] - smooth
    row = int(np.argmax(np.abs(change)))
    return float(change[row]), row + 2


def _starts(recordings: Sequence[Seen], temperatures: Sequence[Channel]) -> Iterator[Finding]:
    """Find a temperature that differs from the others at a cold start, and does not in other recordings."""
    away: dict[tuple[str, str], float] = {}
    agree: dict[str, float] = {}
    for one in recordings:
        first = {}
        for c in temperatures:
            if (
                c.name in one.values
                and c.name not in one.constant
                and (read := one.known(c.name)[1]).size >= 3
            ):
                first[c.name] = float(np.median(read[:5]))
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
                odd = abs(here - middle) > max(_START, _SPREADS * spread, 1.5 * np.ptp(elsewhere))
                odd = odd and agree[f"{one.name}|{c.name}"] < _START
                odd = odd and (siblings > 1 or _stays_apart(one, c.name, recordings))
            else:
                odd = siblings >= 5 and abs(here) > _ALONE and agree[f"{one.name}|{c.name}"] < _AGREE
            if odd and not (here > 0 and _was_hot(one, c.name, here, recordings)):
                read = one.known(c.name)[1]
                side = "above" if here > 0 else "below"
                what = (
                    f"'{c.name}' starts at {np.median(read[:5]):.3g} degC, {abs(here):.2g} K {side} "
                    "the other "
                    f"temperatures, which agree"
                )
                yield _finding(one, c, 0, what, "look at the sensor, its unit and its contact", "start", 2.0)


def _was_hot(one: Seen, name: str, above: float, recordings: Sequence[Seen]) -> bool:
    """Whether a recording began while a body was hot, by what it does then: it cools, or a controller holds
    it where other recordings hold it, too. A sensor with an offset does neither.
    """
    read = one.known(name)[1]
    start = float(np.median(read[:5]))
    if start - np.percentile(read, 2) > above / 2:
        return True
    others = [float(np.median(r.known(name)[1])) for r in recordings if r is not one and name in r.values]
    held = np.ptp(np.percentile(read, [5, 95])) < _START
    return bool(held and others and min(abs(start - level) for level in others) < _START)


def _stays_apart(one: Seen, name: str, recordings: Sequence[Seen]) -> bool:
    """Whether, of two that differ, it is this one: it starts elsewhere than usual, and not from a warm
    machine, which would cool down.
    """
    others = [r for r in recordings if r is not one and name in r.values]
    starts = [float(np.median(r.known(name)[1][:5])) for r in others]
    usual, read = float(np.median(starts)), one.known(name)[1]
    return bool(np.percentile(read, 2) > usual + _START or np.median(read[:5]) < usual - _START)


def _exchanged(recordings: Sequence[Seen], inputs: Sequence[Channel]) -> Iterator[Finding]:
    """Find two inputs that have the level of each other, or a relation that fits only after an exchange."""
    for k, a in enumerate(inputs):
        for b in inputs[k + 1 :]:
            if (a.unit == "degC") != (b.unit == "degC"):
                continue
            both = {
                one.name: pair for one in recordings if (pair := _together(one, a.name, b.name)) is not None
            }
            for one in recordings:
                others = [pair for name, pair in both.items() if name != one.name]
                if one.name not in both or len(others) < 2:
                    continue
                if _levels_exchanged(both[one.name], others) or _relation_exchanged(both[one.name], others):
                    what = (
                        f"'{a.name}' and '{b.name}' look swapped: each stands where the other does elsewhere"
                    )
                    yield Finding(
                        "warning", one.file, None, what, "look at their columns", "swap", a.name, 6.0
                    )


def _stuck(recordings: Sequence[Seen], inputs: Sequence[Channel]) -> Iterator[Finding]:
    """An input that keeps one value while another one, with which it moves elsewhere, goes on: frozen or
    full.

    Only values of the other input that occur elsewhere count. Nothing says where an input stands at others: a
    pump stays on while its flow is set to new rates.
    """
    for b in inputs:
        for a in inputs:
            if a.name == b.name or (a.unit == "degC") != (b.unit == "degC"):
                continue
            both = {
                one.name: pair for one in recordings if (pair := _together(one, a.name, b.name)) is not None
            }
            for one in recordings:
                others = [pair for name, pair in both.items() if name != one.name]
                if one.name not in both or len(others) < 2 or not _related(others):
                    continue
                x, y = both[one.name]
                values, counts = np.unique(y, return_counts=True)
                value = float(values[np.argmax(counts)])
                still = y == value
                known = still & _occurs(x, np.concatenate([o[0] for o in others]))
                goes_on = float(np.std(x[known])) / (float(np.std(x)) or 1.0) if known.any() else 0.0
                usual = max((_goes_on(o) for o in others), default=0.0)
                moves = _answer(others) * float(np.std(x[known])) if known.any() else 0.0
                digits = _step(np.concatenate([o[1] for o in others]))
                # what is set comes and goes, by steps of any size; a sensor moves by more than its digits
                seen = b.between == "held" or (moves > _DIGITS * digits and _lasts(still))
                if known.mean() > _STILL and goes_on > 0.4 and usual < 0.5 * goes_on and seen:
                    what = (
                        f"'{b.name}' stays at {value:.4g} in {still.mean():.0%} of the recording "
                        f"while '{a.name}', with "
                        "which it moves elsewhere, goes on"
                    )
                    do = "frozen, or at the end of its range: look at the sensor"
                    yield Finding("warning", one.file, None, what, do, "stuck", b.name, 3.0)


def _occurs(values: Array, elsewhere: Array) -> NDArray[np.bool_]:
    """Return for each of `values` (N,) whether the readings `elsewhere` (M,) stayed near it for a while."""
    ordered = np.sort(elsewhere)
    width = _NEAR * float(np.ptp(ordered))
    near = np.searchsorted(ordered, values + width, "right") - np.searchsorted(
        ordered, values - width, "left"
    )
    return near >= _HELD * ordered.size


def _lasts(still: NDArray[np.bool_]) -> bool:
    """Whether a channel (N,) keeps its value once it has it; one with noise and few digits comes and goes."""
    before = still[:-1]
    return bool(before.any() and np.mean(still[1:][before]) > _KEEPS)


def _answer(others: Sequence[Array]) -> float:
    """How much the second channel moves for each unit of the first, by a straight line."""
    covariance = np.mean([np.cov(o) for o in others], axis=0)
    return float(abs(covariance[0, 1]) / (covariance[0, 0] or 1.0))


def _goes_on(pair: Array) -> float:
    """Return how much one channel moves while the other has its most frequent value."""
    values, counts = np.unique(pair[1], return_counts=True)
    still = pair[1] == values[np.argmax(counts)]
    return float(np.std(pair[0][still])) / (float(np.std(pair[0])) or 1.0)


def _related(others: Sequence[Array]) -> bool:
    """Whether one channel is nearly a straight line of the other in every recording."""
    return all(abs(float(np.atleast_2d(np.corrcoef(o))[0, 1])) > _LINE for o in others)


def _together(one: Seen, a: str, b: str) -> Array | None:
    """Return the values of two channels where both are known, (2, N). None: one is a switch or does not
    move.
    """
    if a not in one.values or b not in one.values or {a, b} & one.constant:
        return None
    pair = np.array([one.values[a], one.values[b]])
    pair = pair[:, np.isfinite(pair).all(axis=0)]
    moves = pair.shape[1] >= _FEWEST and all(np.unique(row).size > 2 for row in pair)
    return pair if moves else None


def _levels_exchanged(pair: Array, others: Sequence[Array]) -> bool:
    middle = np.array([np.median(other, axis=1) for other in others])
    usual, spread = np.median(middle, axis=0), np.ptp(middle, axis=0)
    inside = np.median([np.percentile(o, 75, axis=1) - np.percentile(o, 25, axis=1) for o in others], axis=0)
    size = np.maximum(np.maximum(spread, inside), 1e-3 * np.abs(usual) + 1e-9)
    here = np.median(pair, axis=1)
    now, exchanged = np.abs(here - usual) / size, np.abs(here[::-1] - usual) / size
    return bool((now > _APART).all() and (exchanged < 1.0).all())


def _relation_exchanged(pair: Array, others: Sequence[Array]) -> bool:
    """One channel as a straight line of the other, fitted to the other recordings."""
    for x, y in ((0, 1), (1, 0)):
        slope, zero = np.polyfit(
            np.concatenate([o[x] for o in others]), np.concatenate([o[y] for o in others]), 1
        )
        size = float(np.median([np.std(o[y]) for o in others])) or 1e-12
        usual = max(float(np.sqrt(np.mean((o[y] - slope * o[x] - zero) ** 2))) for o in others) / size
        now = float(np.sqrt(np.mean((pair[y] - slope * pair[x] - zero) ** 2))) / size
        exchanged = float(np.sqrt(np.mean((pair[x] - slope * pair[y] - zero) ** 2))) / size
        if usual < _RELATED and now > _APART * usual and exchanged < 1.2 * usual:
            return True
    return False


def _finding(one: Seen, channel: Channel, row: int, what: str, do: str, kind: str, weight: float) -> Finding:
    return Finding(
        "warning", one.file, one.line(channel.name, row), what, do, kind, channel.name, float(weight)
    )
