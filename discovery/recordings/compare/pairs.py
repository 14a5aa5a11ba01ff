"""Two channels that move together in the other recordings: exchanged, or one of them stands still."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen, smallest_step
from discovery.recordings.finding import Finding

_FEWEST = 30  # readings
_APART = 2.0  # times the usual spread: another level
_DIGITS = 2.0  # times its last digit: what an input should move by while it stays at one value
_KEEPS = 0.8  # of the readings after one at that value have it, too
_STILL, _LINE = 0.1, 0.8  # of the recording; correlation elsewhere
_GOES_ON = 0.3  # of what the other one moves in all: it does not stand still, too
_NEAR, _HELD = 0.02, 0.01  # of the range elsewhere; of the readings elsewhere: a value that was held there
_RELATED = 0.5  # of what a channel moves: what a straight line of its sibling leaves


def pair_findings(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> Iterator[Finding]:
    """Pairs of inputs of which one looks swapped; channels that look frozen, or at the end of their range."""
    inputs = [channel for channel in channels.values() if channel.is_input]
    yield from _exchanged(recordings, inputs)
    yield from _stuck(recordings, [c for c in channels.values() if c.is_input or c.measured])


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


def _stuck(recordings: Sequence[Seen], read: Sequence[Channel]) -> Iterator[Finding]:
    """A channel that keeps one value while another one, with which it moves elsewhere, goes on: frozen or
    full. The other one is an input next to an input, or has the same unit.

    Only values of the other channel that occur elsewhere count. Nothing says where an input stands at others:
    a pump stays on while its flow is set to new rates.
    """
    for b in read:
        for a in read:
            alike = a.unit == b.unit or (a.is_input and b.is_input and "degC" not in (a.unit, b.unit))
            if a.name == b.name or not alike:
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
                still = _longest(y == value) if b.between == "held" else y == value
                known = still & _occurs(x, np.concatenate([o[0] for o in others]))
                goes_on = float(np.std(x[known])) / (float(np.std(x)) or 1.0) if known.any() else 0.0
                usual = max((_goes_on(o) for o in others), default=0.0)
                moves = _answer(others) * float(np.std(x[known])) if known.any() else 0.0
                digits = smallest_step(np.concatenate([o[1] for o in others]))
                # what is set moves by steps of any size; a sensor moves by more than its digits
                seen = b.between == "held" or (moves > _DIGITS * digits and _lasts(still))
                if known.mean() > _STILL and goes_on > _GOES_ON and usual < 0.5 * goes_on and seen:
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


def _longest(still: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The longest of the times (N,) for which a channel keeps a value. What is set comes back to the same
    values, what is frozen stays.
    """
    stretch = np.cumsum(np.diff(still, prepend=still[:1]))
    counts = np.bincount(stretch, weights=still)
    return np.asarray(still & (stretch == np.argmax(counts)))


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
