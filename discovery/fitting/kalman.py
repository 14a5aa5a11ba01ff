"""The whitening filter of a trajectory: the information of each reading beyond those before it.

White reading noise, slow sensor noise and small random heat at the bodies are one linear Gaussian state-space
model around a trajectory,

    z = (dx, w, v):   dx' = A dx + s(t) w/C,   w_i and v_j first-order noise,   residual = H dx + v + white,

so a Kalman filter whitens residuals and sensitivity columns alike in one pass (Sarkka & Solin, Applied
Stochastic Differential Equations, 2019, ch. 10) and gives the likelihood of the variances. `w` is held
between readings, because its time constant is hours and readings come in minutes. Its size s(t) follows the
flow through the body (`Noise`): a time-varying gain without a further state. Inputs that are recorded a
little wrong give impulses at the bodies (`impulses.py`).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.dynamics.kernel import between, copy, driven, product
from discovery.dynamics.prediction import output_matrix
from discovery.dynamics.trajectory import flows
from discovery.fitting.impulses import added, inputs_in_gaps, late_switches, noisy_inputs
from discovery.fitting.noise import Noise

Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def _propagate(way, decay, x, top):  # type: ignore[no-untyped-def]
    """Rows of x (states, heats, slow noises) one reading on, in place; `top` is room for the states' rows."""
    n = top.shape[0]
    product(way, x, top)
    copy(top, x)
    for i in range(n, x.shape[0]):
        for c in range(x.shape[1]):
            x[i, c] *= decay[i]


@njit(cache=True, nogil=True)
def _moved_on(way, decay, fresh, jumps, p, top):  # type: ignore[no-untyped-def]
    """Covariance p of states, heats and slow noises one reading on, in place; `fresh`: their variances."""
    n, q = way.shape
    size = p.shape[0]
    product(way, p, top)
    for i in range(n):
        for j in range(i, size):
            if j < n:
                total = jumps[i, j]
                for k in range(q):
                    total += top[i, k] * way[j, k]
            else:
                total = top[i, j] * decay[j]
            p[i, j] = p[j, i] = total
    for i in range(n, size):
        for j in range(n, size):
            p[i, j] *= decay[i] * decay[j]
        p[i, i] += fresh[i] * (1.0 - decay[i] ** 2)


@njit(cache=True, nogil=True)
def _gains(ways, decays, h, measured, white, fresh, nv, jumps):  # type: ignore[no-untyped-def]
    """Kalman gains (R, Y, size) and standard deviations (R, Y) of the innovations.

    They do not depend on the data: columns that are whitened later under the same noise share them.

    Args:
        fresh: (size,) variances of heats and slow noises, of states zero.
        nv: outputs with slow noise, all or none.
    """
    readings, outs, n = h.shape
    size = fresh.shape[0]
    p = np.zeros((size, size))
    for i in range(size):
        p[i, i] = fresh[i]
    gains, roots = np.zeros((readings, outs, size)), np.ones((readings, outs))
    ph = np.zeros(size)
    top = np.zeros((n, size))
    none = np.zeros((n, n))
    for r in range(readings):
        if r > 0:
            _moved_on(ways[r - 1], decays[r - 1], fresh, jumps[r - 1] if len(jumps) else none, p, top)
        for y in range(outs):  # white noise is independent by output: update one at a time
            if not measured[r, y]:
                continue
            own = size - nv + y if nv else -1  # a reading shows the states and its own slow noise
            for i in range(size):
                ph[i] = p[own, i] if nv else 0.0
            for j in range(n):
                for i in range(size):
                    ph[i] += h[r, y, j] * p[j, i]
            s = white[r, y] ** 2 + (ph[own] if nv else 0.0)
            for j in range(n):
                s += h[r, y, j] * ph[j]
            roots[r, y] = np.sqrt(s)
            for i in range(size):
                gain = ph[i] / s
                gains[r, y, i] = gain
                for j in range(size):
                    p[i, j] -= gain * ph[j]
    return gains, roots


@njit(cache=True, nogil=True)
def _whitened(ways, decays, h, measured, gains, roots, nv, data):  # type: ignore[no-untyped-def]
    """Whitened data, a row for each of the readings that were measured, by gains from `_gains`."""
    readings, outs, n = h.shape
    m, size = data.shape[2], gains.shape[2]
    z = np.zeros((size, m))
    out = np.empty((np.count_nonzero(measured), m))
    top = np.zeros((n, m))
    made = 0
    for r in range(readings):
        if r > 0:
            _propagate(ways[r - 1], decays[r - 1], z, top)
        for y in range(outs):
            if not measured[r, y]:
                continue
            row = out[made]
            made += 1
            for c in range(m):
                row[c] = data[r, y, c]
            if nv:
                for c in range(m):
                    row[c] -= z[size - nv + y, c]
            for j in range(n):
                factor = h[r, y, j]
                if factor != 0.0:
                    for c in range(m):
                        row[c] -= factor * z[j, c]
            for i in range(size):
                gain = gains[r, y, i]
                if gain != 0.0:
                    for c in range(m):
                        z[i, c] += gain * row[c]
            root = 1.0 / roots[r, y]
            for c in range(m):
                row[c] *= root
    return out


@njit(cache=True, nogil=True)
def _spread(ways, decays, h, fresh, nv, jumps):  # type: ignore[no-untyped-def]
    """Variances (R, Y) of what the readings show where none of them corrects the states; arguments as in
    `_gains`.
    """
    readings, outs, n = h.shape
    size = fresh.shape[0]
    p = np.zeros((size, size))
    for i in range(size):
        p[i, i] = fresh[i]
    shown = np.zeros((readings, outs))
    top = np.zeros((n, size))
    none = np.zeros((n, n))
    for r in range(readings):
        if r > 0:
            _moved_on(ways[r - 1], decays[r - 1], fresh, jumps[r - 1] if len(jumps) else none, p, top)
        for y in range(outs):
            total = fresh[size - nv + y] if nv else 0.0
            for i in range(n):
                for j in range(n):
                    total += h[r, y, i] * p[i, j] * h[r, y, j]
            shown[r, y] = total
    return shown


@dataclass(frozen=True)
class _Parts:
    """What a noise makes of a filter: the way (R - 1, n, n + heats) of states from one reading to the next,
    decays (R - 1, size) of heats and slow noises and their variances (size,), of states zero; how many of
    them are slow noises.
    """

    ways: Array
    decays: Array
    fresh: Array
    slow: int


@dataclass(frozen=True)
class Filter:
    """The parts of the whitening filter that do not depend on the variances, made once for a trajectory."""

    trajectory: Trajectory
    f: Array
    flow: Array  # (K, n) what flows through each state
    h: Array
    step: Array
    measured: NDArray[np.bool_]
    last: dict[str, tuple[Noise, Any]] = field(default_factory=dict, repr=False)

    @cached_property
    def late(self) -> Array:
        """Covariance of impulses between readings for a jitter of one, none where none can be."""
        return late_switches(self.trajectory)

    @cached_property
    def noisy(self) -> Array:
        """The same for noise of inputs as large as they are rough."""
        return noisy_inputs(self.trajectory)

    @cached_property
    def silent(self) -> Array:
        """The same for what inputs may have done while they were not recorded."""
        return inputs_in_gaps(self.trajectory)

    def gains(self, noise: Noise) -> tuple[Array, Array]:
        """What `_gains` gives under a noise. The last one is kept: a residual and its sensitivities, or the
        columns of one search after another, are whitened alike.
        """
        if "gains" not in self.last or self.last["gains"][0] != noise:
            one = self._parts(noise)
            white = self.trajectory.system.grid.sd(noise.white)
            jumps = self._jumps(noise)
            found = _gains(one.ways, one.decays, self.h, self.measured, white, one.fresh, one.slow, jumps)
            self.last["gains"] = (noise, found)
        known: tuple[Array, Array] = self.last["gains"][1]
        return known

    def spread(self, noise: Noise) -> Array:
        """Variance (R, Y) of the readings around a free run, without their white noise."""
        one = self._parts(noise)
        found: Array = _spread(one.ways, one.decays, self.h, one.fresh, one.slow, self._jumps(noise))
        return found

    def _jumps(self, noise: Noise) -> Array:
        always = (1.0, lambda: self.silent)
        return added([(noise.jitter, lambda: self.late), (noise.rough, lambda: self.noisy), always])

    def _parts(self, noise: Noise) -> _Parts:
        if "parts" not in self.last or self.last["parts"][0] != noise:
            self.last["parts"] = (noise, self._made(noise))
        made: _Parts = self.last["parts"][1]
        return made

    def _made(self, noise: Noise) -> _Parts:
        t, heat = self.trajectory, noise.heat or {}
        system = t.system
        heated = [i for i, name in enumerate(system.states) if heat.get(name, 0.0) > 0]
        names = [system.states[i] for i in heated]
        own = [(noise.force or {}).get(name, (heat[name], noise.share)) for name in names]
        floor, share = np.array(own).reshape(-1, 2).T * system.scale[heated]
        read, into = system.grid.read.astype(np.int64), np.array(heated, dtype=np.int64)
        ways = driven(t.which, t.e, t.w0, t.w1, read, self.f, into, floor, share, self.flow)
        slow = np.array(noise.slow) if any(noise.slow) else np.zeros(0)
        counts = len(system.states), len(heated), len(slow)
        decays = np.exp(-self.step[:, None] / [np.inf, noise.heat_time, noise.slow_time])
        fresh = np.concatenate([np.zeros(counts[0]), np.ones(counts[1]), slow**2])
        return _Parts(ways, decays[:, np.repeat(np.arange(3), counts)], fresh, counts[2])

    def whitened(self, noise: Noise, data: Array) -> tuple[Array, Array]:
        """Columns (measured readings, M) of data (R, Y, M), whitened, and the logarithm (measured readings,)
        of the standard deviation of each innovation.
        """
        if is_white(self.trajectory, noise):
            white = self.trajectory.system.grid.sd(noise.white)[self.measured]
            return data[self.measured] / white[:, None], np.log(white)
        one, (gains, roots) = self._parts(noise), self.gains(noise)
        columns = np.ascontiguousarray(data)
        out = _whitened(one.ways, one.decays, self.h, self.measured, gains, roots, one.slow, columns)
        return out, np.log(roots[self.measured])


def is_white(trajectory: Trajectory, noise: Noise) -> bool:
    """Whether whitening is a plain division."""
    return noise.is_white and not trajectory.system.grid.silent


def make_filter(trajectory: Trajectory) -> Filter:
    """Filter of a trajectory."""
    system = trajectory.system
    read = system.grid.read.astype(np.int64)
    return Filter(
        trajectory,
        between(trajectory.which, trajectory.e, read),
        flows(trajectory),
        output_matrix(trajectory),
        np.diff(system.grid.time[read]),
        system.grid.measured,
    )


def whiten(trajectory: Trajectory, noise: Noise, data: Array, part: Filter | None = None) -> Array:
    """Whitened columns (measured readings, M) of data (R, Y, M); `part`: filter of the trajectory, where it
    was made before.
    """
    if is_white(trajectory, noise):
        grid = trajectory.system.grid
        return np.asarray(data[grid.measured] / grid.sd(noise.white)[grid.measured][:, None])
    return (part or make_filter(trajectory)).whitened(noise, data)[0]


def innovations(trajectory: Trajectory, noise: Noise, residual: Array) -> Array:
    """Information of each reading (R, Y) beyond those before it, in its standard deviations; NaN without a
    reading.
    """
    out = np.full(residual.shape, np.nan)
    out[trajectory.system.grid.measured] = whiten(trajectory, noise, residual[:, :, None])[:, 0]
    return out
