"""What the recordings of a campaign say of each other: each output predicted with the others' coefficients.

An output is a sum of first-order responses to the inputs, from its first reading on. Its coefficients in a
recording come from the other recordings alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.campaign import Channel
from discovery.recordings.columns import Array
from discovery.recordings.compare.seen import Seen
from discovery.recordings.responses import even_grid, filtered, input_on_grid

FEWEST = 20  # readings of an output in a recording
LEAST = 0.03  # of the movement: a misfit so small is usual
_POINTS = 1000
_READINGS = 400  # of an output in a recording: more say nothing new
_RIDGE = 1e-3
_ROOM = 22.0  # degC: responses to temperatures are counted from here
_JUDGES = 8  # other recordings that say what misfit is usual
_LEVERAGE = 3.0  # times the usual movement of an output: more weighs no more


@dataclass(frozen=True)
class Responses:
    """Responses of a recording on its even grid: by input (G, taus); free responses (G, taus - 1)."""

    grid: Array
    even: Mapping[str, Array]  # the inputs themselves, (G,)
    of_input: Mapping[str, Array]
    free: Array


@dataclass(frozen=True)
class Reading:
    """Readings of one output in one recording: at (R,), read (R,)."""

    at: Array
    read: Array

    @cached_property
    def first(self) -> float:
        """What it starts from."""
        return float(np.median(self.read[:3]))

    @cached_property
    def movement(self) -> float:
        """Standard deviation of what was read."""
        return _std(self.read)


@dataclass(frozen=True)
class Prediction:
    """A recording as the others predict it: coefficients, and what each input adds on the grid (G,), by
    output.
    """

    responses: Responses
    theta: Mapping[str, Array]
    parts: Mapping[str, Mapping[str, Array]]


class CrossPrediction:
    """Recordings with their responses, and the prediction of each output of each by the others."""

    def __init__(
        self,
        recordings: Sequence[Seen],
        channels: Mapping[str, Channel],
        inputs: Sequence[str],
        outputs: Sequence[str],
        taus: Sequence[float],
        known: Mapping[str, Responses] | None = None,
    ) -> None:
        self.recordings = {one.name: one for one in recordings}
        self.channels = channels
        self.inputs, self.outputs, self.taus = list(inputs), list(outputs), list(taus)
        by_hand = {name for one in recordings for name in one.constant}  # a number is no record
        rooms = {name for name in inputs if channels[name].role == "ambient temperature"}
        self.has_room = not rooms <= by_hand
        self.responses = {
            one.name: (known or {}).get(one.name) or self.responses_of(one) for one in recordings
        }
        self.names = list(next(iter(self.responses.values())).of_input)
        self.scale = {n: self._usual_size(n) for n in self.names}
        self.readings = {(one.name, y): readings_of(one, y) for one in recordings for y in self.outputs}
        self.size = {y: self._usual_movement(y) for y in self.outputs}
        self.grams = {
            key: self._gram(self.responses[key[0]], key[1], reading)
            for key, reading in self.readings.items()
            if reading is not None
        }

    def having(self, made: Seen) -> CrossPrediction:
        """The same with one recording repaired."""
        recordings = [made if name == made.name else one for name, one in self.recordings.items()]
        known = {name: f for name, f in self.responses.items() if name != made.name}
        return CrossPrediction(recordings, self.channels, self.inputs, self.outputs, self.taus, known)

    def predicted(
        self, name: str, outputs: Sequence[str] | None = None, without: Sequence[str] = ()
    ) -> Prediction:
        """A recording as the others predict it: those of its outputs that they know.

        Args:
            outputs: default all.
            without: further recordings that say nothing.
        """
        wanted, out = self.outputs if outputs is None else outputs, {name, *without}
        theta = {y: t for y in wanted if (t := self._theta(y, out)) is not None}
        responses = self.responses[name]
        return Prediction(responses, theta, {y: self._parts(responses, t) for y, t in theta.items()})

    def repaired(
        self, predicted: Prediction, made: Seen, channels: Sequence[str], outputs: Sequence[str]
    ) -> Prediction:
        """The prediction of some outputs after a repair of some channels, or, without any, of the clock."""
        responses, theta = predicted.responses, predicted.theta
        changed = set(channels) & set(self.inputs)
        if not channels:
            responses, changed = self.responses_of(made), set(self.inputs)
        elif changed:
            responses = self._changed(responses, made, changed)
        if not changed:
            return predicted
        names = self.with_any(changed)
        parts = {y: {**predicted.parts[y], **self._parts(responses, theta[y], names)} for y in outputs}
        return Prediction(responses, theta, parts)

    def free(self, predicted: Prediction, y: str, reading: Reading) -> Array:
        """What is left of the start of an output, on the grid (G,)."""
        free = predicted.responses.free
        return np.asarray(free @ predicted.theta[y][-free.shape[1] :] * self._start(y, reading))

    def residual(self, predicted: Prediction, y: str, reading: Reading) -> Array:
        """Readings minus prediction (R,)."""
        whole = sum(predicted.parts[y].values()) + self.free(predicted, y, reading)
        return np.asarray(reading.read - np.interp(reading.at, predicted.responses.grid, whole))

    def misfit(self, predicted: Prediction, y: str, reading: Reading) -> float:
        """rms of the residual of an output without its mean, in parts of the output's movement."""
        left = self.residual(predicted, y, reading)
        return _std(left) / max(reading.movement, 0.25 * self.size[y], 1e-12)

    def left_by_inputs(self, predicted: Prediction, reading: Reading, left: Array) -> dict[str, float]:
        """Standard deviation of a residual (R,) once each input that is no temperature takes what it can: as
        if it were larger or smaller by a share, through one response of any time constant. A body that is
        slower than the recording is long integrates.
        """
        grid, found = predicted.responses.grid, {}
        for name in self.inputs:
            if self.channels[name].unit == "degC":
                continue
            added = np.cumsum(predicted.responses.even[name])[:, None]
            columns = _at(grid, np.hstack([predicted.responses.of_input[name], added]), reading.at)
            columns = columns - columns.mean(axis=0)
            size = np.sqrt((columns**2).sum(axis=0))
            moves = columns[:, size > 0] / size[size > 0]
            shown = np.max((moves.T @ left) ** 2, initial=0.0)
            found[name] = float(np.sqrt(max(_std(left) ** 2 - shown / left.size, 0.0)))
        return found

    def usual_misfit(self, without: str, y: str) -> float:
        """Median misfit of other recordings, each predicted without itself and the one in question."""
        others = [name for name, of in self.grams if of == y and name != without]
        every = max(1, len(others) // _JUDGES)
        found = []
        for name in others[::every][:_JUDGES]:
            predicted, reading = self.predicted(name, [y], [without]), self.readings[name, y]
            if predicted.theta and reading is not None:
                found.append(self.misfit(predicted, y, reading))
        return max(float(np.median(found)) if found else 0.0, LEAST)

    def begins_apart(self, name: str, y: str, reading: Reading) -> float:
        """How far an output begins from where it begins in any other recording, in parts of its movement."""
        others = [r.first for (n, of), r in self.readings.items() if of == y and n != name and r is not None]
        return min((abs(reading.first - first) for first in others), default=0.0) / max(self.size[y], 1e-12)

    def with_any(self, changed: set[str]) -> list[str]:
        """Inputs and products that hold one of some inputs."""
        return [name for name in self.names if changed & set(name.split("*"))]

    def _parts(
        self, responses: Responses, theta: Array, names: Sequence[str] | None = None
    ) -> dict[str, Array]:
        """What each input adds to an output, on the grid (G,)."""
        width = len(self.taus)
        return {
            name: responses.of_input[name] @ theta[k * width : (k + 1) * width] / self.scale[name]
            for k, name in enumerate(self.names)
            if names is None or name in names
        }

    def _theta(self, y: str, without: set[str]) -> Array | None:
        """Return the coefficients of an output, fitted to all recordings except some."""
        known = [gram for (name, of), gram in self.grams.items() if of == y and name not in without]
        if not known:
            return None
        gram = np.sum([g for g, _, _ in known], axis=0)
        target = np.sum([b for _, b, _ in known], axis=0)
        count = sum(n for _, _, n in known)
        found: Array = np.linalg.solve(gram + _RIDGE * count * np.eye(len(target)), target)
        return found

    def _gram(self, responses: Responses, y: str, reading: Reading) -> tuple[Array, Array, float]:
        columns = [responses.of_input[name] / self.scale[name] for name in self.names]
        F = _at(
            responses.grid, np.column_stack([*columns, responses.free * self._start(y, reading)]), reading.at
        )
        F = F - F.mean(axis=0)
        read = reading.read - reading.read.mean()
        # a recording that moves far more than the others says no more than they do
        weight = min(1.0, (_LEVERAGE * self.size[y] / max(float(np.std(read)), 1e-12)) ** 2)
        return weight * F.T @ F, weight * F.T @ read, weight * len(read)

    def _start(self, y: str, reading: Reading) -> float:
        return (reading.first - (_ROOM if self.channels[y].unit == "degC" else 0.0)) / max(
            self.size[y], 1e-12
        )

    def _changed(self, responses: Responses, made: Seen, changed: set[str]) -> Responses:
        """Return the responses, with those of some inputs computed again."""
        fresh = {
            n: input_on_grid(made.time, made.values[n], responses.grid, self.channels[n].between)
            for n in changed
        }
        even = {**responses.even, **fresh}
        series = _with_products(even, self.channels)
        renewed = {n: self._filtered(series[n], responses.grid) for n in self.with_any(changed)}
        return Responses(responses.grid, even, {**responses.of_input, **renewed}, responses.free)

    def responses_of(self, one: Seen) -> Responses:
        """Responses to the inputs of a recording."""
        grid = even_grid(one.time, _POINTS)
        even = {
            n: input_on_grid(one.time, one.values[n], grid, self.channels[n].between) for n in self.inputs
        }
        found = {
            name: self._filtered(series, grid) for name, series in _with_products(even, self.channels).items()
        }
        return Responses(grid, even, found, np.column_stack([np.exp(-grid / tau) for tau in self.taus[1:]]))

    def _filtered(self, series: Array, grid: Array) -> Array:
        step = float(grid[1] - grid[0])
        return np.column_stack([filtered(series, step, tau, rest=True) for tau in self.taus])

    def _usual_size(self, name: str) -> float:
        sizes = [float(np.sqrt(np.mean(f.of_input[name] ** 2))) for f in self.responses.values()]
        return max(float(np.median([s for s in sizes if s > 0] or [1.0])), 1e-12)

    def _usual_movement(self, y: str) -> float:
        sizes = [float(np.std(r.read)) for (_, of), r in self.readings.items() if of == y and r is not None]
        return float(np.median(sizes)) if sizes else 1.0


def _std(values: Array) -> float:
    """Return the standard deviation. For a few hundred values, numpy takes five times as long."""
    middle = values.sum() / values.size
    return float(np.sqrt(max(float(values @ values) / values.size - middle**2, 0.0)))


def readings_of(one: Seen, y: str) -> Reading | None:
    """Readings of an output, thinned out; None where there are too few."""
    if y not in one.values:
        return None
    at, read = one.known(y)
    if read.size < FEWEST:
        return None
    every = max(1, read.size // _READINGS)
    return Reading(at[::every], read[::every])


def _with_products(even: Mapping[str, Array], channels: Mapping[str, Channel]) -> dict[str, Array]:
    """Inputs on the grid, temperatures from room temperature on, and each fluid while it flows."""
    found = {n: v - _ROOM if channels[n].unit == "degC" else v for n, v in even.items()}
    flows = [n for n in even if channels[n].role == "fluid flow"]
    fluids = [n for n in even if channels[n].role in ("fluid temperature", "coolant temperature")]
    return found | {f"{a}*{b}": found[a] * found[b] for a in flows for b in fluids}


def _at(grid: Array, columns: Array, at: Array) -> NDArray[np.float64]:
    """Return columns on a grid (G, K) at other instants (R, K), by straight lines."""
    place = np.clip(np.searchsorted(grid, at) - 1, 0, len(grid) - 2)
    share = ((at - grid[place]) / (grid[place + 1] - grid[place]))[:, None]
    return np.asarray((1 - share) * columns[place] + share * columns[place + 1])
