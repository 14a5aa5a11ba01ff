"""Values that no sensor means: a logger's words for "nothing", zeros for missing readings, lone readings,
steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from discovery.recordings.columns import FEW, Array, Lines
from discovery.recordings.finding import Finding, more
from discovery.recordings.roles import ROLES, SENSORS

if TYPE_CHECKING:
    from discovery.recordings.campaign import Channel

# what loggers write where they have nothing: limits of number formats, broken thermocouples, power-on values
_WORDS = (
    -999.0,
    -9999.0,
    -99999.0,
    999.0,
    9999.0,
    99999.0,
    999.9,
    -999.9,
    9999.9,
    999.99,
    9999.99,
    -99.0,
    -99.9,
    -127.0,
    32767.0,
    -32768.0,
    3276.7,
    -3276.8,
    65535.0,
    6553.5,
    1e6,
    999999.0,
    2147483647.0,
    -2147483648.0,
    4294967295.0,
)
_LARGEST = 1e15  # no quantity of a machine is so large in any unit
_APART = 3.0  # times the span of the other readings
_LONE = 20.0  # median steps: a single reading so far from both neighbours is wrong
_USUAL = 6.0  # times the steps that one in ten exceeds
_AGREE = 0.3  # of that distance: what the neighbours differ by
# so far away that nothing but a fault explains it: such a reading is left out on loading
_IMPOSSIBLE = {"degC": 30.0, "um": 100.0, "um/m": 100.0}
_AFTER = 7  # readings that a first one is compared with
_ROW = 3  # such readings in a row
_LEFT = 0.02  # of a step at the start, in the readings behind it: a response leaves more
_TRACE = 3.0  # times the usual steps, or those next to it: a response leaves more behind
_SOME = 3  # readings that are none: no slip any more
_MANY, _MANY_SHARE = 5, 0.01  # so many lone readings, or such a share of all, pull at a fit
_ZERO, _FALL = 15.0, 3.0  # median steps, and large ones, that a reading falls to be exactly zero
_HOLE = 3.0  # times the usual time between readings: so far apart says nothing about a jump
_STEP = 12.0  # times the largest of the steps around it: a jump, not a response


def odd_findings(file: Path, lines: Lines, channel: Channel, column: Array, time: Array) -> Iterator[Finding]:
    """All of these. `column` (T,): canonical unit. `time` (T,) in s."""
    known = np.flatnonzero(np.isfinite(column))
    read = column[known]
    if not known.size:
        return
    words = logger_words(read)
    limits = ROLES[channel.role].ranges.get(channel.unit)
    listed = np.zeros(0, dtype=np.intp)  # what lies outside its range has a finding already
    if limits is not None:
        never = (read < limits.possible[0]) | (read > limits.possible[1])
        unusual = (read < limits.usual[0]) | (read > limits.usual[1])
        left_out = np.isin(np.arange(read.size), impossible_readings(channel, read))
        listed = np.flatnonzero(never | (unusual & ~left_out))
    words = np.setdiff1d(words, listed)
    yield from _findings(
        file,
        lines[known],
        channel,
        read,
        words,
        "a logger's code for a missing value, not a reading",
        "empty these cells",
        "sentinel",
        weight=5.0,
    )
    if not channel.is_sensor or known.size < FEW:
        return
    zeros = np.setdiff1d(_zeros(channel, read), words)
    away = impossible_readings(channel, read)
    gone = "they are left out: " if zeros.size and np.isin(zeros, away).all() else ""
    yield from _findings(
        file,
        lines[known],
        channel,
        read,
        zeros,
        "exactly zero between readings far from zero",
        gone + "empty the cells where nothing was measured",
        "zeros",
        weight=4.0,
    )
    lone = np.setdiff1d(np.union1d(lone_readings(read), away), [*words, *zeros, *listed]).astype(np.intp)
    dropped = np.intersect1d(lone, away).size
    if dropped or lone.size >= max(_MANY, _MANY_SHARE * read.size):
        first = last = int(lone[0])
        while last + 1 in lone:
            last += 1
        where = f"between {read[first - 1]:g} and {read[last + 1]:g}"
        where = where if first else f"at the start, before {read[last + 1]:g}"
        count = _count(last - first + 1)
        what = f"'{channel.name}' is {read[first]:g} {channel.unit} in {count} {where}"
        do = "it is left out" if dropped else "leave the cell empty if the sensor failed there"
        line = int(lines[known[first]])
        yield Finding("warning", file, line, what + more(lone.size), do, "outlier", channel.name, 2.0)
    if not channel.measured and channel.role in SENSORS:  # the air may jump: a door
        return
    for row in _steps(read, time[known], np.unique(np.concatenate((words, zeros, lone, listed)))):
        what = (
            f"'{channel.name}' jumps from {read[row]:g} to {read[row + 1]:g} {channel.unit} and stays there"
        )
        do = "a sensor that moved, or a new zero: split the recording there"
        yield Finding("warning", file, int(lines[known[row + 1]]), what, do, "step", channel.name, 2.0)


def odd_readings(channel: Channel, read: Array) -> Lines:
    """Rows of readings (R,) that are words for nothing, zeros for missing readings, stand alone, or that
    only a fault explains.
    """
    words = logger_words(read)
    if not channel.is_sensor or read.size < FEW:
        return words
    away = impossible_readings(channel, read)
    return np.unique(np.concatenate((words, _zeros(channel, read), lone_readings(read), away)))


def impossible_readings(channel: Channel, read: Array) -> Lines:
    """Rows of readings (R,), up to three in a row, so far from the others that only a fault explains them.

    No machine goes so far and comes back between two readings without a trace: the reading after them goes on
    where the one before them was.
    """
    least = _IMPOSSIBLE.get(channel.unit)
    if not channel.is_sensor or least is None or read.size < FEW:
        return np.zeros(0, dtype=np.intp)
    steps = np.diff(read)
    sizes, far = np.abs(steps), far_step(steps, least)
    usual = float(np.percentile(sizes, 90))
    rows: set[int] = set()
    for k in np.flatnonzero(sizes[:-1] > far).tolist():  # from the last right reading to the first wrong one
        if abs(read[k] - np.median(read[max(0, k - 2 * _ROW) : k + 3 * _ROW])) > far:
            continue  # the wrong one is this one
        for last in range(k + 1, min(k + _ROW, read.size - 2) + 1):
            around = sizes[[max(k - 1, 0), min(last + 1, sizes.size - 1)]]
            moves = max(usual, float(around[around < far].max(initial=0.0)))
            away = np.abs(read[k + 1 : last + 1] - read[k])
            if away.min() > far and abs(read[last + 1] - read[k]) <= _TRACE * moves:
                rows |= set(range(k + 1, last + 1))
    rows |= set(range(_wild_start(read, far)))
    return np.array(sorted(rows), dtype=np.intp)


def _wild_start(read: Array, far: float) -> int:
    """How many readings (R,) at the start, up to three, are far from all that follow.

    A machine that warms leaves a trace: after a large step comes a smaller one. After a wrong reading, the
    readings move no more than they do otherwise.
    """
    sizes = np.abs(np.diff(read))
    for count in range(1, _ROW + 1):
        after = read[count : count + _AFTER]
        away = np.abs(read[:count, None] - after).min()
        if away > far and np.ptp(after) <= max(_TRACE * float(np.percentile(sizes, 90)), away * _LEFT):
            return count
    return 0


def lone_readings(read: Array) -> Lines:
    """Rows of single readings (R,) far from both neighbours, which agree."""
    steps = np.diff(read)
    far = far_step(steps)
    if not np.isfinite(far):
        return np.zeros(0, dtype=np.intp)
    sizes = np.abs(steps)
    away = np.minimum(sizes[:-1], sizes[1:])
    turns = np.sign(steps[:-1]) != np.sign(steps[1:])
    agree = np.abs(read[2:] - read[:-2]) < _AGREE * away
    return np.flatnonzero((away > far) & turns & agree) + 1


def first_reading(read: Array) -> float:
    """The first of the readings (R,) that those after it do not contradict."""
    near = np.abs(read - np.median(read[:_AFTER])) <= far_step(np.diff(read))
    return float(read[np.argmax(near)])


def far_step(steps: Array, least: float = 0.0) -> float:
    """A step (R - 1,) beyond which a reading is far from the one before it; infinite where nothing moves."""
    if steps.size < 3 or not steps.any():
        return np.inf
    sizes = np.abs(steps)
    return (
        max(_LONE * 1.4826 * float(np.median(sizes)), _USUAL * float(np.percentile(sizes, 90)), least)
        or np.inf
    )


def _count(readings: int) -> str:
    """How many readings, in words.

    >>> _count(1), _count(2)
    ('one reading', '2 readings in a row')
    """
    return "one reading" if readings == 1 else f"{readings} readings in a row"


def logger_words(read: Array) -> Lines:
    """Rows of readings (R,) with a code that loggers write for a missing value, far from all others."""
    found = [np.flatnonzero(np.abs(read) > _LARGEST)]
    for word in _WORDS:
        rows = np.flatnonzero(read == word)
        if not rows.size or rows.size > 0.5 * read.size:
            continue
        rest = np.delete(read, rows)
        rest = rest[~np.isin(rest, _WORDS)]
        if rest.size and min(abs(word - rest.min()), abs(word - rest.max())) > _APART * max(
            float(np.ptp(rest)), 1.0
        ):
            found.append(rows)
    return np.unique(np.concatenate(found))


def _zeros(channel: Channel, read: Array) -> Lines:
    """Rows of exact zeros where the last and the next other reading are far from zero.

    An error may begin with zeros: its probe was set to zero there.
    """
    rows = np.flatnonzero(read == 0.0)
    others = np.flatnonzero(read != 0.0)
    if channel.role == "error" and others.size:
        rows = rows[rows > others[0]]
    if not rows.size or others.size < FEW or rows.size > 0.4 * read.size:
        return np.zeros(0, dtype=np.intp)
    steps = np.abs(np.diff(read[others]))
    usual = 1.4826 * float(np.median(steps))
    # most steps are zero where a sensor is coarse or the air calm
    largest = float(np.percentile(steps[steps > 0], 90)) if steps.any() else 0.0
    place = np.searchsorted(others, rows)
    before, after = others[np.maximum(place - 1, 0)], others[np.minimum(place, others.size - 1)]
    near = np.minimum(np.abs(read[before]), np.abs(read[after]))
    between = np.sign(read[before]) == np.sign(read[after])
    return np.asarray(rows[(near > max(_ZERO * usual, _FALL * largest)) & between])


def _steps(read: Array, time: Array, wrong: Lines) -> Iterator[int]:
    """Yield the rows after which the readings jump and stay: the step is far larger than all steps around
    it. Between readings far apart, a machine may have moved.

    Args:
        time: (R,) of the readings, s.
        wrong: rows of the readings that are set aside.
    """
    kept = np.delete(np.arange(read.size), wrong.astype(np.intp))
    steps = np.abs(np.diff(read[kept]))
    apart = np.diff(time[kept])
    near = apart <= _HOLE * np.median(apart) if apart.size else apart.astype(bool)
    usual = 1.4826 * float(np.median(steps)) if steps.size else 0.0
    if usual == 0.0 or steps.size < FEW:
        return
    for row in np.flatnonzero((steps > 2 * _STEP * usual) & near):
        around = np.concatenate((steps[max(0, row - 6) : row], steps[row + 1 : row + 7]))
        if around.size < 8 or steps[row] < _STEP * around.max():
            continue
        before, after = read[kept][max(0, row - 5) : row + 1], read[kept][row + 1 : row + 7]
        if abs(np.median(after) - np.median(before)) > 0.7 * steps[row]:
            yield int(kept[row])


def _findings(
    file: Path,
    lines: Lines,
    channel: Channel,
    read: Array,
    rows: Lines,
    why: str,
    do: str,
    kind: str,
    *,
    weight: float,
) -> Iterator[Finding]:
    if rows.size:
        what = f"'{channel.name}' is {read[rows[0]]:g}, {why}"
        yield Finding(
            "error" if rows.size >= _SOME else "warning",
            file,
            int(lines[rows[0]]),
            what + more(rows.size),
            do,
            kind,
            channel.name,
            weight,
        )
