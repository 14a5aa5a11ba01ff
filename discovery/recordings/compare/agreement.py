"""Do the recordings of a campaign agree? And if one does not: what would make it agree?

Every measured channel is predicted in each recording from the other recordings (`crossprediction`). Where a
recording disagrees, each known damage is undone in turn (`repairs`); one that brings it back into
agreement is named. The damage with the largest gain is undone first, and the rest is compared again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.crossprediction import (
    FEWEST,
    LEAST,
    CrossPrediction,
    Prediction,
    Reading,
    readings_of,
)
from discovery.recordings.compare.pace import odd_pace
from discovery.recordings.compare.repairs import (
    Disagreement,
    Repair,
    all_repairs,
    drifting,
    offset,
    shiftable,
    shifted,
)
from discovery.recordings.compare.seen import Seen, inputs_of, outputs_of
from discovery.recordings.compare.switches import used_inverted
from discovery.threads import one_thread

_SHARES = (0.0, 1 / 500, 1 / 150, 1 / 50, 1 / 15, 1 / 5)  # of the longest recording: time constants
_SUSPECT = 1.3  # times the usual misfit: a recording that may be damaged
# log likelihood a reading, over the root of the outputs, that a repair has to gain: of 100 sound campaigns
# drawn at random none gains so much by chance, of damaged ones nine in ten gain more
_GAIN, _TWO_GAIN = 1.3, 1.7  # among several recordings; of two that stand against each other
# a recording that is so many times as far off as the others, and as near as they are once the repair is made,
# needs less of a gain
_FAR, _BACK, _WHOLE = 3.0, 1.15, 0.75
_INVERTED = 0.6  # of a switch that is on as much as it is off elsewhere: two signs of one damage
_AGREES = 3.0  # times the usual misfit, at most, after a repair
_POOR = (
    0.5  # of the movement: what others predict no better has causes that nobody recorded, and says nothing
)
_TWO_AGREES = 0.4  # of the movement itself
_APART = 2.0  # times the usual movement: others do not know how what begins so far away goes on
_SCALED = ("unit", "factor", "sign", "halfway", "swap")  # repairs that change values from an instant on
_MOST_OF = (0.05, 0.5, 0.95)  # of the values of an input: what lies there says where it is
_CLEARLY = 0.1  # of the range of an input: by so much nearer to other recordings is no chance
_BEGINS = 5.0  # K: by so much more a temperature begins elsewhere than in any other recording
_FREE = ("drift", "offset")  # repairs whose size is fitted
_FREE_AGREES = 0.3  # of the movement: a drift or an offset of any size fits a little of a poor prediction
# how much larger the gain of a less usual damage must be to go before a usual one
_DOUBT = {
    "unit": 0.0,
    "time": 0.0,
    "sign": 0.0,
    "swap": 0.0,
    "shift": 0.0,
    "halfway": 0.0,
    "factor": 0.2,
    "drift": 0.2,
    "offset": 0.0,
    "level": 0.05,
}
_LATE = np.arange(0.002, 0.25, 0.001)  # of a recording: how late a channel may be
_STEP = 0.05  # of a recording, on both sides of an offset: half of it has come there
_MOST = 6  # repairs of a campaign that are looked for


@one_thread
def disagreements(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> list[Disagreement]:
    """Repairs that make recordings agree with the others, the largest gain first."""
    recordings = [one for one in recordings if len(one.time) >= FEWEST and one.time[-1] > 0]
    inputs, outputs = inputs_of(channels, recordings), outputs_of(channels)
    if len(recordings) < 2 or not inputs or not outputs:
        return []
    # one clock that runs in other units must not set the time constants of all
    longest = float(np.median(sorted(one.time[-1] for one in recordings)[len(recordings) // 2 :]))
    known = CrossPrediction(recordings, channels, inputs, outputs, [share * longest for share in _SHARES])
    found: list[Disagreement] = []
    while len(found) < _MOST and (best := _best_repair(known)) is not None:
        found.append(best)
        known = known.having(best.repair.made)
    if (odd := odd_pace(known)) is not None:
        found.append(odd)
    return found


def _best_repair(known: CrossPrediction) -> Disagreement | None:
    """Return the repair with the largest gain. None: all recordings agree, or no repair helps."""
    found = [pair for one in known.recordings.values() for pair in _repairs(known, one)]
    return max(found, key=lambda pair: pair[0])[1] if found else None


def _repairs(known: CrossPrediction, one: Seen) -> list[tuple[float, Disagreement]]:
    """Repairs of a recording that make it agree, with their gains."""
    two = len(known.recordings) == 2
    predicted = known.predicted(one.name)
    read = {y: r for y in predicted.theta if (r := known.readings[one.name, y]) is not None}
    misfit = {y: m for y, r in read.items() if (m := known.misfit(predicted, y, r))}
    usual = {y: known.usual_misfit(one.name, y) for y in misfit}
    misfit = {y: m for y, m in misfit.items() if two or usual[y] <= _POOR}
    wrong = {y for y, m in misfit.items() if m > _SUSPECT * usual[y]}
    if not misfit or not (wrong or two):  # nothing can be compared, or nothing is off
        return []
    found = []
    for repair in _candidates(known, one, predicted, {y: read[y] for y in misfit}):
        touched = [y for y in misfit if y in repair.channels] or list(misfit)
        if not two and not set(touched) & wrong:
            continue
        if _begins_elsewhere(known, one, repair) or _goes_elsewhere(known, one, repair):
            continue
        after = _after(known, predicted, repair, touched)
        if len(after) < len(touched):
            continue
        b, a, limit = (
            float(np.sqrt(np.mean([of[y] ** 2 for y in touched]))) for of in (misfit, after, usual)
        )
        most = _FREE_AGREES if repair.kind in _FREE else 0.6
        agrees = a < _TWO_AGREES if two else a < min(_AGREES * limit, most)
        # the log likelihood of each output's readings; half of them by chance is as good as all by a little
        each = [np.log(max(misfit[y], LEAST) / max(after[y], LEAST)) for y in touched]
        gain = float(np.sum(each)) / len(touched) ** 0.5
        least = (_TWO_GAIN if two else _GAIN) + _DOUBT[repair.kind]
        if repair.kind == "sign" and used_inverted(one, list(known.recordings.values()), repair.channels[0]):
            least = _INVERTED
        whole = b > _FAR * limit and a < _BACK * limit and gain > _WHOLE and not two
        # an offset of free size and place fits a little of anything: it has to explain the whole
        helps = agrees and (whole or (gain > least and repair.kind != "offset"))
        if helps and two and repair.kind in _FREE and not agree_both_ways(known, repair, touched):
            continue  # of two, the other one may hold what this one does not
        if helps and not any(_begins_apart(known, repair, y) for y in touched):
            found.append((gain - 2 * _DOUBT[repair.kind], Disagreement(one.name, repair, b, a, limit, gain)))
    return found


def agree_both_ways(known: CrossPrediction, repair: Repair, outputs: Sequence[str]) -> bool:
    """Whether a repaired recording predicts each other one, too."""
    again = known.having(repair.made)
    for name in again.recordings.keys() - {repair.made.name}:
        predicted = again.predicted(name, outputs)
        for y in predicted.theta:
            reading = again.readings[name, y]
            if reading is not None and again.misfit(predicted, y, reading) > _FREE_AGREES:
                return False
    return True


def _begins_elsewhere(known: CrossPrediction, one: Seen, repair: Repair) -> bool:
    """Return whether a temperature begins as in another recording, and would not after the change of unit.

    Its unit is right then, because machines begin at about the temperature of the room.
    """
    for name in repair.channels if repair.kind == "unit" else ():
        others = [_first(other, name) for other in known.recordings.values() if other.name != one.name]
        if known.channels[name].unit == "degC" and np.isfinite(others).any():
            now, then = (np.nanmin(np.abs(_first(s, name) - np.array(others))) for s in (one, repair.made))
            if then > now + _BEGINS:
                return True
    return False


def _goes_elsewhere(known: CrossPrediction, one: Seen, repair: Repair) -> bool:
    """Return whether the inputs that a repair changes, or the time between two readings, lie where other
    recordings have theirs, and would lie further away after it.

    Their unit, sign and column are right then: programs use the same speeds and flows, loggers the same
    interval. So is a temperature that goes on from one reading to the next, and would jump.
    """
    there, then = _places(known, one, repair)
    return then - there > _CLEARLY or _jumps_then(known, one, repair)


def _jumps_then(known: CrossPrediction, one: Seen, repair: Repair) -> bool:
    """Return whether a temperature that a repair changes from an instant on would jump there: it does not."""
    for name in repair.channels if repair.kind == "halfway" else ():
        now, then = one.values[name], repair.made.values[name]
        since = int(np.argmax(np.isfinite(now) & (now != then)))
        if known.channels[name].unit == "degC" and since > 0:
            return bool(abs(then[since] - now[since - 1]) > abs(now[since] - now[since - 1]))
    return False


def _places(known: CrossPrediction, one: Seen, repair: Repair) -> tuple[float, float]:
    """How far the inputs that a repair changes, or the time between two readings, lie from the other
    recordings, without it and after it.
    """
    others = [other for other in known.recordings.values() if other.name != one.name]
    if repair.kind == "time":
        usual = np.concatenate([np.diff(other.time) for other in others])
        return _away(np.diff(one.time), usual), _away(np.diff(repair.made.time), usual)
    there = then = 0.0
    # two heaters of one unit may stand in for each other: a swap shows in other units alone
    alike = repair.kind == "swap" and len({known.channels[n].unit for n in repair.channels}) == 1
    inputs = [name for name in repair.channels if known.channels[name].is_input]
    for name in inputs if repair.kind in _SCALED and not alike else ():
        now, made = one.values[name], repair.made.values[name]
        usual = np.concatenate([now[now == made], *(o.values[name] for o in others if name in o.values)])
        there += _away(now[now != made], usual)
        then += _away(made[now != made], usual)
    return there, then


def _away(values: Array, usual: Array) -> float:
    """How far values lie from usual ones, from 0 to 1: where nearly all of them lie, and half of them. Zeros
    do not count: they are the same in every unit.
    """
    values, usual = (v[np.isfinite(v) & (v != 0)] for v in (values, usual))
    if not (values.size and usual.size):
        return 0.0
    here, there = np.quantile(values, _MOST_OF), np.quantile(usual, _MOST_OF)
    return float(np.abs(here - there).mean() / max(np.ptp(np.concatenate([here, there])), 1e-300))


def _begins_apart(known: CrossPrediction, repair: Repair, y: str) -> bool:
    """Return whether an output begins far from where it begins in any other recording, also after a repair:
    none of them says how it goes on from there.
    """
    made = repair.made
    reading = readings_of(made, y) if y in repair.channels else known.readings[made.name, y]
    return reading is not None and known.begins_apart(made.name, y, reading) > _APART


def _first(one: Seen, name: str) -> float:
    values = one.values[name] if name in one.values else np.empty(0)
    known = values[np.isfinite(values)]
    return float(known[0]) if known.size else np.nan


def _candidates(
    known: CrossPrediction, one: Seen, predicted: Prediction, read: Mapping[str, Reading]
) -> Iterator[Repair]:
    """Every repair to try: those of known size, then shifts in time, drifts and offsets of fitted size."""
    yield from all_repairs(one, known.channels, known.inputs, known.outputs)
    for group in shiftable(one, known.channels, known.inputs, known.outputs):
        if (seconds := _lateness(known, one, group, predicted)) != 0.0:
            yield shifted(one, group, known.channels, seconds)
    if known.has_room:  # otherwise a drift may be the air around, which nobody recorded
        for y, reading in read.items():
            left = known.residual(predicted, y, reading)
            rate = float(np.polyfit(reading.at, left, 1)[0])
            rivals = _rivals(known, predicted, reading, left, left - rate * reading.at)
            yield drifting(one, y, rate, known.channels[y].unit, rivals)
    for y, reading in read.items():
        left = known.residual(predicted, y, reading)
        since, size = _offset(reading.at, left)
        near = _STEP * float(one.time[-1])
        # a poor prediction may jump where the readings do not, or creep away from them
        if all(_at_once(reading.at, values, since, size, near) for values in (left, reading.read)):
            rivals = _rivals(known, predicted, reading, left, left - size * (reading.at > since))
            yield offset(one, y, since, size, known.channels[y].unit, rivals)


def _rivals(
    known: CrossPrediction, predicted: Prediction, reading: Reading, left: Array, after: Array
) -> list[str]:
    """Inputs of another size than recorded that leave as little of a residual (R,) as a drift or an offset of
    the output does: `after` (R,). Where a load hardly moves, a body follows it like a drift.
    """
    least = float(np.std(after)) * np.exp(_DOUBT["factor"])
    every = known.left_by_inputs(predicted, reading, left)
    return [name for name, rest in every.items() if rest < least]


def _at_once(at: Array, values: Array, since: float, size: float, near: float) -> bool:
    """Whether half of an offset comes within `near` seconds on both sides."""
    before, after = (values[(at > low) & (at <= low + near)] for low in (since - near, since))
    if not (before.size and after.size):
        return False
    return bool((np.median(after) - np.median(before)) * np.sign(size) > 0.5 * abs(size) > 0.0)


def _offset(at: Array, left: Array) -> tuple[float, float]:
    """From when on [s], and by how much, an output is higher than predicted: the split that explains most of
    the residual.
    """
    count = np.arange(1, left.size)
    below, above = np.cumsum(left)[:-1] / count, (left.sum() - np.cumsum(left)[:-1]) / (left.size - count)
    explained = count * (left.size - count) * (above - below) ** 2
    explained[: FEWEST - 1] = explained[1 - FEWEST :] = 0.0
    best = int(np.argmax(explained))
    return float(at[best]), float(above[best] - below[best])


def _lateness(known: CrossPrediction, one: Seen, group: Sequence[str], predicted: Prediction) -> float:
    """By how many seconds a channel, or all readings, are late: the response to a late input is late
    by as much, so that nothing has to be filtered again.
    """
    length, grid = float(one.time[-1]), predicted.responses.grid
    shifts = np.concatenate([[0.0], -_LATE * length, _LATE * length])
    cost = np.zeros(len(shifts))
    mine = set(known.with_any(set(group) & set(known.inputs)))
    for y in [y for y in predicted.parts if y in group] or list(predicted.parts):
        reading = known.readings[one.name, y]
        if reading is None:
            continue
        parts = predicted.parts[y]
        still = sum(v for n, v in parts.items() if n not in mine) + known.free(predicted, y, reading)
        moves = sum((v for n, v in parts.items() if n in mine), start=np.zeros(len(grid)))
        if not mine:
            still, moves = np.zeros(len(grid)), still
        base = reading.read - np.interp(reading.at, grid, still)
        at = reading.at + (shifts if mine else -shifts)[:, None]  # (shifts, R)
        inside = (at >= 0) & (at <= length)
        left = np.where(inside, base - np.interp(at, grid, moves), 0.0)
        count = np.maximum(inside.sum(axis=1), 1)
        middle = left.sum(axis=1) / count
        spread = np.sqrt(np.maximum((left**2).sum(axis=1) / count - middle**2, 1e-24))
        cost += np.where(count > FEWEST, np.log(spread), np.inf)
    return float(shifts[int(np.argmin(cost))])


def _after(
    known: CrossPrediction, predicted: Prediction, repair: Repair, outputs: Sequence[str]
) -> dict[str, float]:
    """Return the misfit of some outputs after a repair. An output with too few readings has no misfit."""
    made = repair.made
    again = known.repaired(predicted, made, repair.channels, outputs)
    found = {}
    for y in outputs:
        new = y in repair.channels or not repair.channels
        reading = readings_of(made, y) if new else known.readings[made.name, y]
        if reading is not None:
            found[y] = known.misfit(again, y, reading)
    return found
