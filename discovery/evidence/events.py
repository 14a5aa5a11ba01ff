"""Events: when did an unknown heat act, when did a sensor jump, which single reading is wrong.

Steps at many instants are seen through the model at once; a window is the difference of two of them, so all
windows of a recording are scored from one Gram matrix and only the best edges are refined.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.lens import Lens, View

Array = NDArray[np.float64]

COARSE = 60  # steps per recording in the first look
LEAST = 4  # readings before and after a jump, while heat acts and after it began: fewer may be wrong ones
FINE = 8  # steps on each side of an edge in the second, and in a third, closer one


def place_events(
    lens: Lens, view: View, claims: Iterable[Hypothesis], spread: dict[str, float]
) -> list[Hypothesis]:
    """Claims about events with the instants that speak for them most; claims of other kinds as they are.

    Args:
        spread: prior standard deviation by amplitude name.
    """
    out: list[Hypothesis] = []
    heat: dict[str, list[Hypothesis]] = {}
    jumps: dict[str, list[Hypothesis]] = {}
    for h in claims:
        if h.effect.word == "unmeasured_heat" and h.recording:
            heat.setdefault(h.recording, []).append(h)
        elif h.effect.word in ("sensor_offset", "rezero") and h.recording:
            jumps.setdefault(h.recording, []).append(h)
        elif h.effect.word != "outlier":
            out.append(h)
    for run, group in heat.items():
        out += _windows(lens, view, run, group, spread)
    for run, group in jumps.items():
        out += _jumps(lens, view, run, group, spread)
    return out


def _index(lens: Lens, run: str) -> int:
    return next(i for i, t in enumerate(lens.fit.trajectories) if t.system.grid.recording == run)


def whiten_one(lens: Lens, view: View, run: str, columns: Array) -> Array:
    """Projected whitened columns of one recording (N, M)."""
    parts = []
    for t, part in zip(lens.fit.trajectories, lens.filters, strict=True):
        if t.system.grid.recording == run:
            parts.append(part.apply(view.noise, columns)[0])
        else:
            parts.append(np.zeros((int(t.system.grid.measured.sum()), columns.shape[2])))
    parts.append(np.zeros((len(lens.priors[0]), columns.shape[2])))
    return view.project(np.concatenate(parts))


def heat_steps(trajectory: Trajectory, body: str, instants: Array) -> Array:
    """Response (R, Y, M) to a unit heat at a body from each instant on."""
    system = trajectory.system
    time, step = system.grid.time, system.grid.step
    # an interval that the step divides gets its share, so that edges need not lie on nodes
    share = np.clip((time[1:, None] - instants[None, :]) / step[:, None], 0.0, 1.0)
    columns = [Column(k, body, np.repeat(share[:, k], 2)) for k in range(len(instants))]
    return sensitivities(trajectory, (), (), columns)


def _windows(
    lens: Lens, view: View, run: str, group: list[Hypothesis], spread: dict[str, float]
) -> list[Hypothesis]:
    trajectory = lens.fit.trajectories[_index(lens, run)]
    time = trajectory.system.grid.time
    read_time = time[trajectory.system.grid.read]
    if len(read_time) < 2 * LEAST:
        return []
    latest = float(read_time[-2 * LEAST])
    coarse = np.linspace(time[0], time[-1], COARSE + 1)
    shortest = LEAST * float(np.median(np.diff(read_time)))
    width, found = coarse[1] - coarse[0], []
    for h in group:

        def seen(instants: Array, h: Hypothesis = h) -> Array:
            steps, sd = heat_steps(trajectory, h.states[0], instants), spread[h.amplitudes[0]]
            gains = _window_gains(lens, view, run, steps, instants <= latest, sd)
            gains[instants[None, :] - instants[:, None] < shortest] = -np.inf
            return gains

        on, off = _best(seen(coarse), coarse)
        near = _around(on, off, width, time[0], time[-1])
        gains = seen(near)
        on, off = _best(gains, near)
        closer = _around(on, off, width / FINE, time[0], time[-1])
        edges = dict(zip(h.shapes, _best(seen(closer), closer), strict=True))
        with np.errstate(over="ignore"):
            ranges = [_span(np.logaddexp.reduce(gains, axis=axis), near) for axis in (1, 0)]
        claim = replace(h.at(edges), spans=dict(zip(h.shapes, ranges, strict=True)))
        found.append(replace(claim, cost=float(2 * np.log(COARSE))))  # two edges were searched
    return found


def _best(gains: Array, instants: Array) -> tuple[float, float]:
    """The two edges for which most speaks."""
    i, j = np.unravel_index(int(np.argmax(gains)), gains.shape)
    return float(instants[i]), float(instants[j])


def _around(on: float, off: float, width: float, first: float, last: float) -> Array:
    """Instants within a width of two edges, in a recording from the first instant to the last."""
    steps = np.linspace(-width, width, 2 * FINE + 1)
    return np.unique(np.clip(np.concatenate([on + steps, off + steps]), first, last))


def meets(one: Hypothesis, other: Hypothesis) -> bool:
    """Whether two claims of heat without a record speak of the same hours of a recording, or of hours that
    follow each other.
    """
    if one.recording != other.recording:
        return False
    (on, off), (start, end) = one.shapes.values(), other.shapes.values()
    return on <= end and start <= off


def _span(gains: Array, instants: Array) -> tuple[float, float]:
    """Where an instant lies at 95 %, by its log evidence: from one tried instant outside to another."""
    share = np.cumsum(np.exp(gains - np.max(gains)))
    first, last = np.searchsorted(share / share[-1], (0.025, 0.975))
    return float(instants[max(first - 1, 0)]), float(instants[min(last + 1, len(instants) - 1)])


def _window_gains(
    lens: Lens, view: View, run: str, steps: Array, starts: NDArray[np.bool_], sd: float
) -> Array:
    """Log evidence for a window between each two edges, on at the first; it begins where `starts` allows."""
    z = whiten_one(lens, view, run, steps)
    dot = z.T @ view.residual
    gram = z.T @ z
    size = np.maximum(np.diag(gram)[:, None] + np.diag(gram)[None, :] - 2 * gram, 0.0) + sd**-2
    gain = 0.5 * np.subtract.outer(dot, dot) ** 2 / size - 0.5 * np.log(size * sd**2)
    gain[np.tril_indices(len(dot))] = -np.inf
    gain[~starts] = -np.inf
    return np.asarray(gain)


def _jumps(
    lens: Lens, view: View, run: str, group: list[Hypothesis], spread: dict[str, float]
) -> list[Hypothesis]:
    grid = lens.fit.trajectories[_index(lens, run)].system.grid
    read_time = grid.time[grid.read]
    every = max(1, len(read_time) // (2 * COARSE))
    outs = len(grid.outputs)

    def columns(instants: Array) -> Array:
        steps = (read_time[:, None] >= instants[None, :]).astype(float)
        out = np.zeros((len(read_time), outs, outs * len(instants)))
        for y in range(outs):
            out[:, y, y * len(instants) : (y + 1) * len(instants)] = steps
        return whiten_one(lens, view, run, out)

    found: list[Hypothesis] = []
    last = len(read_time) - LEAST
    coarse = read_time[max(every, LEAST) : last : every]
    if not len(coarse):
        return found
    first = columns(coarse)
    for h in group:
        rows = [grid.outputs.index(name) for name in h.shown]
        sd = [spread[a] for a in h.amplitudes]
        k = int(np.argmax(_jump_gains(view, first, rows, len(coarse), sd)))
        centre = int(np.searchsorted(read_time, coarse[k]))
        near = read_time[max(LEAST, centre - every) : min(centre + every + 1, last)]
        gains = _jump_gains(view, columns(near), rows, len(near), sd)
        (name,) = h.shapes
        claim = h.at({name: float(near[int(np.argmax(gains))])})
        found.append(replace(claim, spans={name: _span(gains, near)}, cost=float(np.log(COARSE))))
    return found


def _jump_gains(view: View, z: Array, rows: list[int], count: int, sd: list[float]) -> Array:
    """Log evidence for a jump at each of the instants of `z`."""
    gains = np.zeros(count)
    for k in range(count):
        mine = z[:, [row * count + k for row in rows]]
        precision = mine.T @ mine + np.diag(np.array(sd) ** -2.0)
        dot = mine.T @ view.residual
        gains[k] = 0.5 * dot @ np.linalg.solve(precision, dot) - 0.5 * np.linalg.slogdet(precision)[1]
    return gains
