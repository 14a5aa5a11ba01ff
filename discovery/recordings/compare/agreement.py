"""Do the recordings of a campaign agree? And if one does not: what would make it agree?

Every measured channel is predicted in each recording by what the others say of it: a sum of first-order
responses to the inputs, from the first reading on, with coefficients from the other recordings alone. Where a
recording disagrees, each known damage is undone in turn (`repairs`); one that brings it back into
agreement is named. The damage with the largest gain is undone first, and the rest is looked at anew.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.repairs import Repair, all_repairs, drifting, offset, shiftable, shifted
from discovery.recordings.compare.seen import Seen, inputs_of, outputs_of
from discovery.recordings.responses import even_grid, filtered, input_on_grid
from discovery.threads import one_thread

_SHARES = (0.0, 1 / 500, 1 / 150, 1 / 50, 1 / 15, 1 / 5)  # of the longest recording: time constants
_POINTS = 1000
_READINGS = 400  # of an output in a recording: more say nothing new
_FEWEST = 20
_RIDGE = 1e-3
_ROOM = 22.0  # degC: responses to temperatures are counted from here
_SUSPECT = 1.3  # times the usual misfit: a recording that may be damaged
# log likelihood a reading, over the root of the outputs, that a repair has to gain: of 100 sound campaigns
# drawn at random none gains so much by chance, of damaged ones nine in ten gain more
_GAIN, _TWO_GAIN = 1.3, 1.7  # among several recordings; of two that stand against each other
# a recording that is so many times as far off as the others, and as near as they are once the repair is made,
# needs less of a gain
_FAR, _BACK, _WHOLE = 3.0, 1.15, 0.75
_AGREES = 3.0  # times the usual misfit, at most, after a repair
_TWO_AGREES = 0.4  # of the movement itself
_JUDGES = 8  # other recordings that say what misfit is usual
_LEAST = 0.03  # of the movement: a misfit so small is usual
_LEVERAGE = 3.0  # times the usual movement of an output: more weighs no more
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
}
_LATE = np.arange(0.002, 0.25, 0.001)  # of a recording: how late a channel may be
_MOST = 6  # repairs of a campaign that are looked for


@dataclass(frozen=True)
class Disagreement:
    """A repair that makes a recording agree: misfit before and after, in parts of the movement."""

    recording: str
    repair: Repair
    before: float
    after: float
    usual: float
    gain: float


@dataclass(frozen=True)
class _Features:
    """Responses of a recording on its even grid: by input (G, taus); free responses (G, taus - 1)."""

    grid: Array
    even: Mapping[str, Array]  # the inputs themselves, (G,)
    of_input: Mapping[str, Array]
    free: Array


@dataclass(frozen=True)
class _Reading:
    """Readings of one output in one recording: at (R,), read (R,), their place in the grid."""

    at: Array
    read: Array

    @property
    def first(self) -> float:
        """What it starts from."""
        return float(np.median(self.read[:3]))


@one_thread
def disagreements(recordings: Sequence[Seen], channels: Mapping[str, Channel]) -> list[Disagreement]:
    """Repairs that make recordings agree with the others, the largest gain first."""
    recordings = [one for one in recordings if len(one.time) >= _FEWEST and one.time[-1] > 0]
    inputs, outputs = inputs_of(channels, recordings), outputs_of(channels)
    if len(recordings) < 2 or not inputs or not outputs:
        return []
    # one clock that runs in other units must not set the time constants of all
    longest = float(np.median(sorted(one.time[-1] for one in recordings)[len(recordings) // 2 :]))
    story = _Story(recordings, channels, inputs, outputs, [share * longest for share in _SHARES])
    found: list[Disagreement] = []
    while len(found) < _MOST and (best := story.best_repair()) is not None:
        found.append(best)
        story = story.having(best.repair.made)
    return found


class _Story:
    """Recordings with their responses, and what each output of each is predicted by."""

    def __init__(
        self,
        recordings: Sequence[Seen],
        channels: Mapping[str, Channel],
        inputs: Sequence[str],
        outputs: Sequence[str],
        taus: Sequence[float],
        known: Mapping[str, _Features] | None = None,
    ) -> None:
        self.recordings = {one.name: one for one in recordings}
        self.channels, self.inputs, self.outputs, self.taus = (
            channels,
            list(inputs),
            list(outputs),
            list(taus),
        )
        self.has_room = any(channels[name].role == "ambient temperature" for name in inputs)
        self.features = {one.name: (known or {}).get(one.name) or self._responses(one) for one in recordings}
        self.names = list(next(iter(self.features.values())).of_input)
        self.scale = {n: self._usual_size(n) for n in self.names}
        self.readings = {(one.name, y): _readings(one, y) for one in recordings for y in self.outputs}
        self.size = {y: self._usual_movement(y) for y in self.outputs}
        self.grams = {
            key: self._gram(self.features[key[0]], key[1], reading)
            for key, reading in self.readings.items()
            if reading is not None
        }

    def having(self, made: Seen) -> _Story:
        """The same with one recording repaired."""
        recordings = [made if name == made.name else one for name, one in self.recordings.items()]
        known = {name: f for name, f in self.features.items() if name != made.name}
        return _Story(recordings, self.channels, self.inputs, self.outputs, self.taus, known)

    def best_repair(self) -> Disagreement | None:
        """The repair with the largest gain, or None where every recording agrees or none helps."""
        found = [pair for one in self.recordings.values() for pair in self._repairs(one)]
        return max(found, key=lambda pair: pair[0])[1] if found else None

    def _repairs(self, one: Seen) -> list[tuple[float, Disagreement]]:
        """Repairs of a recording that make it agree, with their gains."""
        two = len(self.recordings) == 2
        theta = {y: t for y in self.outputs if (t := self._theta(y, {one.name})) is not None}
        features = self.features[one.name]
        parts = {y: self._parts(features, theta[y]) for y in theta}
        misfit = {
            y: m
            for y in theta
            if (m := self._misfit(features, parts[y], theta[y], y, self.readings[one.name, y]))
        }
        usual = {y: self._usual_misfit(one.name, y) for y in misfit}
        wrong = {y for y, m in misfit.items() if m > _SUSPECT * usual[y]}
        if not wrong and not two:
            return []
        found = []
        late = (
            shifted(one, group, seconds)
            for group in shiftable(one, self.channels, self.inputs, self.outputs)
            if (seconds := self._lateness(one, group, features, parts, theta)) != 0.0
        )
        creeping = (
            drifting(one, y, self._drift(features, parts[y], theta[y], y, self.readings[one.name, y]))
            for y in misfit
            if self.has_room  # else what creeps may be the air around, which nobody recorded
        )
        higher = (
            offset(one, y, *self._offset(features, parts[y], theta[y], y, reading), self.channels[y].unit)
            for y in misfit
            if (reading := self.readings[one.name, y]) is not None
        )
        known = all_repairs(one, self.channels, self.inputs, self.outputs)
        for repair in chain(known, late, creeping, higher):
            touched = [y for y in misfit if y in repair.channels] or list(misfit)
            if not two and not set(touched) & wrong:
                continue
            after = self._after(repair, features, parts, theta, touched)
            if len(after) < len(touched):
                continue
            b, a, limit = (
                float(np.sqrt(np.mean([of[y] ** 2 for y in touched]))) for of in (misfit, after, usual)
            )
            agrees = a < _TWO_AGREES if two else a < min(_AGREES * limit, 0.6)
            # the log likelihood of each output's readings; a half of them by chance is as good as all by
            # little
            each = [np.log(max(misfit[y], _LEAST) / max(after[y], _LEAST)) for y in touched]
            gain = float(np.sum(each)) / len(touched) ** 0.5
            least = (_TWO_GAIN if two else _GAIN) + _DOUBT[repair.kind]
            whole = b > _FAR * limit and a < _BACK * limit and gain > _WHOLE and not two
            # an offset of free size and place fits a little of anything: it has to mend the whole
            if agrees and (whole or (gain > least and repair.kind != "offset")):
                found.append(
                    (gain - 2 * _DOUBT[repair.kind], Disagreement(one.name, repair, b, a, limit, gain))
                )
        return found

    def _drift(
        self, features: _Features, parts: Mapping[str, Array], theta: Array, y: str, reading: _Reading | None
    ) -> float:
        """By how much an output creeps away from what the story says, per second."""
        if reading is None:
            return 0.0
        return float(np.polyfit(reading.at, self._left(features, parts, theta, y, reading), 1)[0])

    def _offset(
        self, features: _Features, parts: Mapping[str, Array], theta: Array, y: str, reading: _Reading
    ) -> tuple[float, float]:
        """From when on [s], and by how much, an output is higher than the story says: the split that explains
        most of what is left.
        """
        left = self._left(features, parts, theta, y, reading)
        count = np.arange(1, left.size)
        below, above = np.cumsum(left)[:-1] / count, (left.sum() - np.cumsum(left)[:-1]) / (left.size - count)
        explained = count * (left.size - count) * (above - below) ** 2
        explained[: _FEWEST - 1] = explained[1 - _FEWEST :] = 0.0
        best = int(np.argmax(explained))
        return float(reading.at[best]), float(above[best] - below[best])

    def _left(
        self, features: _Features, parts: Mapping[str, Array], theta: Array, y: str, reading: _Reading
    ) -> Array:
        """Readings minus story."""
        free = features.free @ theta[-features.free.shape[1] :] * self._start(y, reading)
        return np.asarray(reading.read - np.interp(reading.at, features.grid, sum(parts.values()) + free))

    def _lateness(
        self,
        one: Seen,
        group: Sequence[str],
        features: _Features,
        parts: Mapping[str, Mapping[str, Array]],
        theta: Mapping[str, Array],
    ) -> float:
        """By how many seconds a channel, or all readings, are late: the response to a late input is late
        by as much, so that nothing has to be filtered anew.
        """
        length = float(one.time[-1])
        shifts = np.concatenate([[0.0], -_LATE * length, _LATE * length])
        cost = np.zeros(len(shifts))
        mine = set(self._with(set(group) & set(self.inputs)))
        for y in [y for y in parts if y in group] or list(parts):
            reading = self.readings[one.name, y]
            if reading is None:
                continue
            free = features.free @ theta[y][-features.free.shape[1] :] * self._start(y, reading)
            still = sum(v for n, v in parts[y].items() if n not in mine) + free
            moves = sum((v for n, v in parts[y].items() if n in mine), start=np.zeros(len(features.grid)))
            if not mine:
                still, moves = np.zeros(len(features.grid)), still
            base = reading.read - np.interp(reading.at, features.grid, still)
            at = reading.at + (shifts if mine else -shifts)[:, None]  # (shifts, R)
            inside = (at >= 0) & (at <= length)
            left = np.where(inside, base - np.interp(at, features.grid, moves), 0.0)
            count = np.maximum(inside.sum(axis=1), 1)
            middle = left.sum(axis=1) / count
            spread = np.sqrt(np.maximum((left**2).sum(axis=1) / count - middle**2, 1e-24))
            cost += np.where(count > _FEWEST, np.log(spread), np.inf)
        return float(shifts[int(np.argmin(cost))])

    def _after(
        self,
        repair: Repair,
        features: _Features,
        parts: Mapping[str, Mapping[str, Array]],
        theta: Mapping[str, Array],
        outputs: Sequence[str],
    ) -> dict[str, float]:
        """Misfit of a repaired recording."""
        changed = set(repair.channels) & set(self.inputs)
        if not repair.channels:
            features, changed = self._responses(repair.made), set(self.inputs)
        elif changed:
            features = self._changed(features, repair.made, changed)
        found = {}
        for y in outputs:
            reading = (
                _readings(repair.made, y)
                if y in repair.channels or not repair.channels
                else (self.readings[repair.made.name, y])
            )
            mine = (
                parts[y]
                if not changed
                else {**parts[y], **self._parts(features, theta[y], self._with(changed))}
            )
            misfit = self._misfit(features, mine, theta[y], y, reading)
            if misfit is not None:
                found[y] = misfit
        return found

    def _with(self, changed: set[str]) -> list[str]:
        """Inputs and products that hold one of some inputs."""
        return [name for name in self.names if changed & set(name.split("*"))]

    def _parts(
        self, features: _Features, theta: Array, names: Sequence[str] | None = None
    ) -> dict[str, Array]:
        """What each input does to an output, on the grid (G,)."""
        width = len(self.taus)
        return {
            name: features.of_input[name] @ theta[k * width : (k + 1) * width] / self.scale[name]
            for k, name in enumerate(self.names)
            if names is None or name in names
        }

    def _misfit(
        self, features: _Features, parts: Mapping[str, Array], theta: Array, y: str, reading: _Reading | None
    ) -> float | None:
        """rms that the story of the other recordings leaves of an output, in parts of its movement."""
        if reading is None:
            return None
        free = features.free @ theta[-features.free.shape[1] :] * self._start(y, reading)
        left = reading.read - np.interp(reading.at, features.grid, sum(parts.values()) + free)
        return _std(left) / max(_std(reading.read), 0.25 * self.size[y], 1e-12)

    def _usual_misfit(self, without: str, y: str) -> float:
        """Median misfit of other recordings in a story that does not know the one in question."""
        others = [name for name, of in self.grams if of == y and name != without]
        every = max(1, len(others) // _JUDGES)
        found = []
        for name in others[::every][:_JUDGES]:
            theta = self._theta(y, {without, name})
            reading = self.readings[name, y]
            if theta is not None:
                parts = self._parts(self.features[name], theta)
                found.append(self._misfit(self.features[name], parts, theta, y, reading) or 0.0)
        return max(float(np.median(found)) if found else 0.0, _LEAST)

    def _theta(self, y: str, without: set[str]) -> Array | None:
        """Coefficients of an output, from all recordings but some."""
        known = [gram for (name, of), gram in self.grams.items() if of == y and name not in without]
        if not known:
            return None
        gram = np.sum([g for g, _, _ in known], axis=0)
        target = np.sum([b for _, b, _ in known], axis=0)
        count = sum(n for _, _, n in known)
        found: Array = np.linalg.solve(gram + _RIDGE * count * np.eye(len(target)), target)
        return found

    def _gram(self, features: _Features, y: str, reading: _Reading) -> tuple[Array, Array, float]:
        columns = [features.of_input[name] / self.scale[name] for name in self.names]
        F = _at(
            features.grid, np.column_stack([*columns, features.free * self._start(y, reading)]), reading.at
        )
        F = F - F.mean(axis=0)
        read = reading.read - reading.read.mean()
        # a recording that moves far more than the others says no more than they do
        weight = min(1.0, (_LEVERAGE * self.size[y] / max(float(np.std(read)), 1e-12)) ** 2)
        return weight * F.T @ F, weight * F.T @ read, weight * len(read)

    def _start(self, y: str, reading: _Reading) -> float:
        return (reading.first - (_ROOM if self.channels[y].unit == "degC" else 0.0)) / max(
            self.size[y], 1e-12
        )

    def _changed(self, features: _Features, made: Seen, changed: set[str]) -> _Features:
        """Responses with those of some inputs made anew."""
        fresh = {
            n: input_on_grid(made.time, made.values[n], features.grid, self.channels[n].between)
            for n in changed
        }
        even = {**features.even, **fresh}
        series = _with_products(even, self.channels)
        renewed = {n: self._filtered(series[n], features.grid) for n in self._with(changed)}
        return _Features(features.grid, even, {**features.of_input, **renewed}, features.free)

    def _responses(self, one: Seen) -> _Features:
        grid = even_grid(one.time, _POINTS)
        even = {
            n: input_on_grid(one.time, one.values[n], grid, self.channels[n].between) for n in self.inputs
        }
        found = {
            name: self._filtered(series, grid) for name, series in _with_products(even, self.channels).items()
        }
        return _Features(grid, even, found, np.column_stack([np.exp(-grid / tau) for tau in self.taus[1:]]))

    def _filtered(self, series: Array, grid: Array) -> Array:
        step = float(grid[1] - grid[0])
        return np.column_stack([filtered(series, step, tau, rest=True) for tau in self.taus])

    def _usual_size(self, name: str) -> float:
        sizes = [float(np.sqrt(np.mean(f.of_input[name] ** 2))) for f in self.features.values()]
        return max(float(np.median([s for s in sizes if s > 0] or [1.0])), 1e-12)

    def _usual_movement(self, y: str) -> float:
        sizes = [float(np.std(r.read)) for (_, of), r in self.readings.items() if of == y and r is not None]
        return float(np.median(sizes)) if sizes else 1.0


def _std(values: Array) -> float:
    """Standard deviation; numpy's own takes five times as long for a few hundred values."""
    middle = values.sum() / values.size
    return float(np.sqrt(max(float(values @ values) / values.size - middle**2, 0.0)))


def _readings(one: Seen, y: str) -> _Reading | None:
    """Readings of an output, thinned out; None where there are too few."""
    if y not in one.values:
        return None
    at, read = one.known(y)
    if read.size < _FEWEST:
        return None
    every = max(1, read.size // _READINGS)
    return _Reading(at[::every], read[::every])


def _with_products(even: Mapping[str, Array], channels: Mapping[str, Channel]) -> dict[str, Array]:
    """Inputs on the grid, temperatures from room temperature on, and each fluid while it flows."""
    found = {n: v - _ROOM if channels[n].unit == "degC" else v for n, v in even.items()}
    flows = [n for n in even if channels[n].role == "fluid flow"]
    fluids = [n for n in even if channels[n].role in ("fluid temperature", "coolant temperature")]
    return found | {f"{a}*{b}": found[a] * found[b] for a in flows for b in fluids}


def _at(grid: Array, columns: Array, at: Array) -> NDArray[np.float64]:
    """Columns on a grid (G, K) at other instants (R, K), straight between."""
    place = np.clip(np.searchsorted(grid, at) - 1, 0, len(grid) - 2)
    share = ((at - grid[place]) / (grid[place + 1] - grid[place]))[:, None]
    return np.asarray((1 - share) * columns[place] + share * columns[place + 1])
