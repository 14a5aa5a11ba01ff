"""The search for events: when an unknown heat or draught acts, and when a sensor jumps.

Steps at many instants are filtered through the model at once. A window is the difference of two steps, so one
Gram matrix scores all windows of a recording. All instants are equally likely in the prior. The weight of the
best instants is the share of all instants that the readings do not exclude.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.effects.candidates import with_shapes
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.bayes import ROUNDING, Projected, Slab, project_one
from discovery.evidence.outliers import MOST
from discovery.evidence.settings import Setting
from discovery.evidence.signatures import Claims, signatures
from discovery.evidence.whitening import Absorbed, Whitened, log_sum_exp
from discovery.fitting import Noise
from discovery.threads import side_by_side

Array = NDArray[np.float64]

COARSE = 60  # steps per recording in the first look for heat
TOGETHER = 256  # jumps looked at at a time: their columns are large
LEAST = 2 * MOST  # readings on each side of a jump, and of each edge of heat: fewer may be wrong ones
FINE = 8  # steps on each side of an edge in the second, closer look
CLOSER = 6  # claims that get one


def place_events(
    seen: Whitened, settings: Sequence[Setting], claims: Sequence[Hypothesis], slabs: Sequence[Slab]
) -> list[list[Hypothesis]]:
    """Under each of some noises: the claims with the instants that the readings make most likely.

    Args:
        claims: events (`search` "window" or "step"), each of one recording.
        slabs: prior of the amplitudes of each claim.
    """
    noises = [(setting.noise, seen.absorbed(setting.noise)) for setting in settings]

    def of_recording(run: str) -> list[list[tuple[float, Hypothesis, Slab]]]:
        searches = [_Search(seen, noise, gone, run) for noise, gone in noises]
        found: list[list[tuple[float, Hypothesis, Slab]]] = [[] for _ in noises]
        for h, slab in zip(claims, slabs, strict=True):
            look = searches[0].first_look(h) if h.recording == run else None
            for search, mine in zip(searches, found, strict=True):
                if look is not None and (one := search.rough(h, slab, *look)):
                    mine.append((one[0] + h.log_odds, one[1], slab))
        return found

    def closer(one: tuple[int, Hypothesis, Slab]) -> Hypothesis:
        k, h, slab = one
        return _Search(seen, *noises[k], str(h.recording)).close(h, slab)

    by_run = side_by_side(of_recording, list(dict.fromkeys(str(h.recording) for h in claims)))
    rough = [[one for each in by_run for one in each[k]] for k in range(len(noises))]
    for mine in rough:
        mine.sort(key=lambda one: -one[0])
    best = [(k, h, slab) for k, mine in enumerate(rough) for _, h, slab in mine[:CLOSER]]
    closest = iter(side_by_side(closer, best))
    return [[*(next(closest) for _ in mine[:CLOSER]), *(h for _, h, _ in mine[CLOSER:])] for mine in rough]


class _Search:
    """Instants of one recording under one noise, of which a refit absorbs what is `gone`."""

    def __init__(self, seen: Whitened, noise: Noise, gone: Absorbed, run: str) -> None:
        self.seen, self.noise, self.gone = seen, noise, gone
        self.index = [t.system.grid.recording for t in seen.fit.trajectories].index(run)
        self.trajectory = seen.fit.trajectories[self.index]
        grid = self.trajectory.system.grid
        self.read = grid.time[grid.read]
        self.jumps: dict[str, tuple[Array, Array]] = {}

    def projected(self, columns: Array) -> Projected:
        """Columns (R, Y, M) of the recording, seen through what a refit absorbs."""
        return project_one(self.seen, self.noise, self.gone, self.index, columns)

    def first_look(self, h: Hypothesis) -> tuple[Array, Array] | None:
        """Evenly spread instants (M,) and what the claim shows from each on (R, Y, M), under any noise; for a
        jump all readings, whose columns are simple. None where the recording is too short.
        """
        instants, none = self._coarse(), np.zeros((0, 0, 0))
        if h.effect.search == "window":
            return instants, event_steps(self.trajectory, h, instants)
        if not h.terms:
            instants = self.read[LEAST : len(self.read) - LEAST]
            return (instants, none) if len(instants) else None
        sooner = np.searchsorted(self.read, instants)
        instants = instants[_enough(sooner, len(self.read) - sooner)]
        return (instants, self._beginning(h, instants)) if len(instants) else None

    def rough(
        self, h: Hypothesis, slab: Slab, instants: Array, columns: Array
    ) -> tuple[float, Hypothesis] | None:
        """The claim at the best instants of a first look, with what share of all the readings leave, and its
        log Bayes factor; None where no window is possible.
        """
        if h.effect.search == "window":
            return self._rough_window(h, slab, instants, columns)
        return self._pulse(h, slab, instants, columns) if h.terms else self._step(h, slab, instants)

    def close(self, h: Hypothesis, slab: Slab) -> Hypothesis:
        """The candidate at the best instants near its present ones."""
        if h.effect.search == "window":
            return self._close_window(h, slab)
        return self._close_pulse(h, slab) if h.terms else h

    def _rough_window(
        self, h: Hypothesis, slab: Slab, coarse: Array, columns: Array
    ) -> tuple[float, Hypothesis] | None:
        """An effect between two instants; it may begin before the recording and end after it."""
        gains = self._allowed(self._windows(columns, slab), coarse)
        possible = int(np.isfinite(gains).sum())
        if not possible:
            return None
        weight = float(log_sum_exp(gains.ravel()) - np.max(gains)) - float(np.log(possible))
        edges = dict(zip(h.instants, _best(gains, coarse), strict=True))
        spans = {n: (t - coarse[1] + coarse[0], t + coarse[1] - coarse[0]) for n, t in edges.items()}
        return float(np.max(gains)) + weight, replace(h.at(edges, weight), spans=spans)

    def _close_window(self, h: Hypothesis, slab: Slab) -> Hypothesis:
        coarse = self._coarse()
        width = float(coarse[1] - coarse[0])
        begin, end = h.instants

        def gains(instants: Array) -> Array:
            columns = event_steps(self.trajectory, h, instants)
            return self._allowed(self._windows(columns, slab), instants)

        near = _around(h.shapes[begin], h.shapes[end], width, coarse[0], coarse[-1])
        found = gains(near)
        closer = _around(*_best(found, near), width / FINE, coarse[0], coarse[-1])
        on, off = _best(gains(closer), closer)
        with np.errstate(over="ignore"):
            spans = {n: _span(log_sum_exp(found, axis), near) for n, axis in ((begin, 1), (end, 0))}
        return replace(h.at({begin: on, end: off}, h.log_weight), spans=spans)

    def _coarse(self) -> Array:
        time = self.trajectory.system.grid.time
        return np.linspace(time[0], time[-1], COARSE + 1)

    def _allowed(self, gains: Array, instants: Array) -> Array:
        """Windows with readings enough on each side of both edges: heat during all but a few readings at an
        end says no more than these readings do. An edge at an end of the recording is none.
        """
        time, count = self.trajectory.system.grid.time, len(self.read)
        sooner = np.searchsorted(self.read, instants, side="right")
        inside = sooner[None, :] - sooner[:, None]
        first = np.where(instants > time[0], sooner, count)[:, None]
        last = np.where(instants < time[-1], count - sooner, count)[None, :]
        gains[~_enough(inside, first, last)] = -np.inf
        return gains

    def _windows(self, columns: Array, slab: Slab) -> Array:
        """Log Bayes factor of an effect between each two instants, from what it shows from each on."""
        part, count = self.projected(columns), columns.shape[2]
        matrix = part.block(range(count))
        diagonal = np.diag(matrix)
        # between two instants nothing may act, and the difference of two responses is rounding
        least = ROUNDING * float(diagonal.max()) + 1e-30
        gram = np.maximum(diagonal[:, None] + diagonal[None, :] - 2 * matrix, least)
        dot = np.subtract.outer(part.dot, part.dot)
        upper = np.triu_indices(count, 1)
        flat = Slab(*(np.broadcast_to(v, len(upper[0])) for v in (slab.median, slab.factor, slab.sign)))
        out = np.full((count, count), -np.inf)
        out[upper] = _log_bayes(dot[upper], gram[upper], flat)
        return out

    def _pulse(
        self, h: Hypothesis, slab: Slab, instants: Array, columns: Array
    ) -> tuple[float, Hypothesis] | None:
        """What begins to act in the machine at an instant, and is seen from there on."""
        gains = self._of_instants(columns, slab)
        weight = float(log_sum_exp(gains) - np.max(gains)) - float(np.log(len(gains)))
        best = {h.instants[0]: float(instants[int(np.argmax(gains))])}
        return float(np.max(gains)) + weight, h.at(best, weight)

    def _close_pulse(self, h: Hypothesis, slab: Slab) -> Hypothesis:
        """At the shape values that a search integrates over, closer and closer: what comes at once and what
        comes slowly begin at other instants. The better half of them has a closer look each time.
        """
        coarse, least = self._coarse(), float(np.min(self.trajectory.system.grid.step))
        width, left = float(coarse[1] - coarse[0]), with_shapes(h)
        while True:
            looks = [self._closest(one, slab, width, coarse) for one in left]
            looks.sort(key=lambda found: -found[0])
            width /= FINE
            if width <= least:
                return looks[0][1]
            left = [found for _, found in looks[: (len(looks) + 1) // 2]]

    def _closest(self, h: Hypothesis, slab: Slab, width: float, coarse: Array) -> tuple[float, Hypothesis]:
        """The hypothesis at the best instant within a width of its present one, with its log Bayes factor."""
        (name,) = h.instants
        steps = np.linspace(-width, width, 2 * FINE + 1)
        near = np.clip(h.shapes[name] + steps, coarse[0], coarse[-1])
        gains = self._of_instants(self._beginning(h, near), slab)
        best = {name: float(near[np.argmax(gains)])}
        found = replace(h.at(best, h.log_weight), spans={name: _span(gains, near)})
        return float(np.max(gains)) + h.log_weight, found

    def _beginning(self, h: Hypothesis, instants: Array) -> Array:
        """What an effect shows (R, Y, M) that begins at each of some instants."""
        (name,) = h.instants
        return signatures(self.trajectory, [h.at({name: float(t)}) for t in instants])

    def _of_instants(self, columns: Array, slab: Slab) -> Array:
        """Log Bayes factor of an effect at each instant, from what it shows."""
        part, count = self.projected(columns), columns.shape[2]
        flat = Slab(*(np.broadcast_to(v[:1], count) for v in (slab.median, slab.factor, slab.sign)))
        return _log_bayes(part.dot, np.maximum(part.gram, 1e-30), flat)

    def _step(self, h: Hypothesis, slab: Slab, instants: Array) -> tuple[float, Hypothesis] | None:
        """A jump of one output, or of all, at an instant. Every reading is tried: a filter that follows the
        machine sees a jump in one or two readings only, and knows nothing of it some readings away.
        """
        (name,) = h.instants
        gains = np.zeros(len(instants))
        for k, output in enumerate(h.shown):
            one = slab.take(np.full(len(instants), min(k, len(slab.median) - 1)))
            gains += _log_bayes(*self._jumps(output, instants), one)
        weight = float(log_sum_exp(gains) - np.max(gains)) - float(np.log(len(gains)))
        best = {name: float(instants[int(np.argmax(gains))])}
        return float(np.max(gains)) + weight, replace(
            h.at(best, weight), spans={name: _span(gains, instants)}
        )

    def _jumps(self, output: str, instants: Array) -> tuple[Array, Array]:
        """Inner products of a jump of an output at each of all instants, with the residual and with itself.
        They are the same for all claims.
        """
        if output not in self.jumps:
            outputs = self.trajectory.system.grid.outputs
            parts = []
            for k in range(0, len(instants), TOGETHER):
                steps = self.read[:, None] >= instants[None, k : k + TOGETHER]
                columns = np.zeros((len(self.read), len(outputs), steps.shape[1]))
                columns[:, outputs.index(output), :] = steps
                part = self.projected(columns)
                parts.append((part.dot, np.maximum(part.gram, 1e-30)))
            dot, gram = (np.concatenate(one) for one in zip(*parts, strict=True))
            self.jumps[output] = dot, gram
        return self.jumps[output]


def _enough(*counts: NDArray[np.intp]) -> NDArray[np.bool_]:
    """Whether there are readings enough in each place, so that these are no wrong ones."""
    return np.asarray(np.minimum.reduce(np.broadcast_arrays(*counts)) >= LEAST)


def _log_bayes(dot: Array, gram: Array, slab: Slab) -> Array:
    mean, variance = dot / gram, 1.0 / gram
    return np.asarray(0.5 * dot**2 / gram + slab.average(mean, variance) + 0.5 * np.log(2 * np.pi * variance))


def event_steps(trajectory: Trajectory, h: Hypothesis, instants: Array) -> Array:
    """Response (R, Y, M) to a unit of an effect between two instants that acts from each instant on."""
    begin, end = h.instants
    whole = Claims.of([h.at({begin: -np.inf, end: np.inf})], trajectory.system.model)
    entering, showing = whole.along(trajectory)
    out = _from_each(trajectory, entering, instants)
    grid = trajectory.system.grid
    for _, y, series in showing:
        out[:, y] += series[:, None] * (grid.time[grid.read][:, None] >= instants[None, :])
    return out


def heat_steps(trajectory: Trajectory, body: str, instants: Array) -> Array:
    """Response (R, Y, M) to a unit heat at a body from each instant on."""
    return _from_each(trajectory, [Column(0, body, np.ones(2 * len(trajectory.system.grid.step)))], instants)


def _from_each(trajectory: Trajectory, entering: Sequence[Column], instants: Array) -> Array:
    """Response (R, Y, M) to what enters states, from each instant on."""
    time, step = trajectory.system.grid.time, trajectory.system.grid.step
    # an interval that the step divides gets its share, so that edges need not lie on nodes
    share = np.clip((time[1:, None] - instants[None, :]) / step[:, None], 0.0, 1.0)
    columns = [
        Column(k, piece.into, piece.series * np.repeat(share[:, k], 2), piece.source)
        for k in range(len(instants))
        for piece in entering
    ]
    return sensitivities(trajectory, (), (), columns, count=len(instants))


def _best(gains: Array, instants: Array) -> tuple[float, float]:
    """The two edges that are most likely."""
    i, j = np.unravel_index(int(np.argmax(gains)), gains.shape)
    return float(instants[i]), float(instants[j])


def _around(on: float, off: float, width: float, first: float, last: float) -> Array:
    """Instants within a width of two edges, in a recording from the first instant to the last."""
    steps = np.linspace(-width, width, 2 * FINE + 1)
    return np.unique(np.clip(np.concatenate([on + steps, off + steps]), first, last))


def _span(gains: Array, instants: Array) -> tuple[float, float]:
    """95 % interval of an instant from its log evidence, between the tried instants just outside."""
    share = np.cumsum(np.exp(gains - np.max(gains)))
    first, last = np.searchsorted(share / share[-1], (0.025, 0.975))
    return float(instants[max(first - 1, 0)]), float(instants[min(last + 1, len(instants) - 1)])
