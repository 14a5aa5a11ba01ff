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
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from discovery.dynamics import Trajectory
from discovery.dynamics.kernel import between, driven
from discovery.dynamics.prediction import output_matrix
from discovery.dynamics.trajectory import flows
from discovery.fitting.impulses import added, late_switches, noisy_inputs
from discovery.fitting.noise import Noise

Array = NDArray[np.float64]


@njit(cache=True, nogil=True)
def _propagate(f, b, heat_decay, slow_decay, x, top):  # type: ignore[no-untyped-def]
    """Rows of x (states, heats, slow noises) one reading on, in place; `top` is room for the states' rows."""
    n, nh = b.shape
    m = x.shape[1]
    for i in range(n):
        for c in range(m):
            top[i, c] = 0.0
        for j in range(n):
            for c in range(m):
                top[i, c] += f[i, j] * x[j, c]
        for j in range(nh):
            for c in range(m):
                top[i, c] += b[i, j] * x[n + j, c]
    x[:n] = top
    x[n : n + nh] *= heat_decay
    x[n + nh :] *= slow_decay


@njit(cache=True, nogil=True)
def _gains(f, b, h, measured, white, slow, heat, slow_decay, heat_decay, jumps):  # type: ignore[no-untyped-def]
    """Kalman gains (R, Y, size) and standard deviations (R, Y) of the innovations.

    They do not depend on the data: columns that are whitened later under the same noise share them.
    """
    readings, outs, n = h.shape
    nh, nv = heat.shape[0], slow.shape[0]
    size = n + nh + nv
    p = np.zeros((size, size))
    for i in range(nh):
        p[n + i, n + i] = heat[i] ** 2
    for j in range(nv):
        p[n + nh + j, n + nh + j] = slow[j] ** 2
    gains, roots = np.zeros((readings, outs, size)), np.ones((readings, outs))
    ph = np.zeros(size)
    top_p = np.zeros((n, size))
    for r in range(readings):
        if r > 0:
            _propagate(f[r - 1], b[r - 1], heat_decay[r - 1], slow_decay[r - 1], p, top_p)
            p = p.T.copy()  # symmetric: the other side is the same step on the transpose
            _propagate(f[r - 1], b[r - 1], heat_decay[r - 1], slow_decay[r - 1], p, top_p)
            if len(jumps):
                p[:n, :n] += jumps[r - 1]
            for j in range(nh):
                p[n + j, n + j] += heat[j] ** 2 * (1.0 - heat_decay[r - 1] ** 2)
            for j in range(nv):
                p[n + nh + j, n + nh + j] += slow[j] ** 2 * (1.0 - slow_decay[r - 1] ** 2)
        for y in range(outs):  # white noise is independent by output: update one at a time
            if not measured[r, y]:
                continue
            own = n + nh + y if nv else -1  # a reading shows the states and its own slow noise
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
def _whitened(f, b, h, measured, gains, roots, nv, slow_decay, heat_decay, data):  # type: ignore[no-untyped-def]
    """Whitened data, a row for each of the readings that were measured, by gains from `_gains`.

    `nv`: outputs with slow noise, all or none.
    """
    readings, outs, n = h.shape
    m, size = data.shape[2], gains.shape[2]
    z = np.zeros((size, m))
    out = np.empty((np.count_nonzero(measured), m))
    top_z = np.zeros((n, m))
    made = 0
    for r in range(readings):
        if r > 0:
            _propagate(f[r - 1], b[r - 1], heat_decay[r - 1], slow_decay[r - 1], z, top_z)
        for y in range(outs):
            if not measured[r, y]:
                continue
            row = out[made]
            made += 1
            row[:] = data[r, y]
            if nv:
                slow = z[size - nv + y]
                for c in range(m):
                    row[c] -= slow[c]
            for j in range(n):
                factor = h[r, y, j]
                if factor != 0.0:
                    state = z[j]
                    for c in range(m):
                        row[c] -= factor * state[c]
            for i in range(size):
                gain = gains[r, y, i]
                if gain != 0.0:
                    part = z[i]
                    for c in range(m):
                        part[c] += gain * row[c]
            root = 1.0 / roots[r, y]
            for c in range(m):
                row[c] *= root
    return out


@dataclass(frozen=True)
class Filter:
    """The parts of the whitening filter that do not depend on the variances, made once for a trajectory."""

    trajectory: Trajectory
    f: Array
    flow: Array  # (K, n) what flows through each state
    h: Array
    step: Array
    measured: NDArray[np.bool_]
    late: Array  # covariance of impulses between readings for a jitter of one, none where none can be
    noisy: Array  # the same for noise of inputs as large as they are rough
    last: dict[str, tuple[Noise, Any]] = field(default_factory=dict, repr=False)

    def gains(self, noise: Noise) -> tuple[Array, Array]:
        """What `_gains` gives under a noise. The last one is kept: a residual and its sensitivities, or the
        columns of one search after another, are whitened alike.
        """
        if "gains" not in self.last or self.last["gains"][0] != noise:
            heat, slow, response, decays = self._parts(noise)
            white = self.trajectory.system.grid.sd(noise.white)
            jumps = added([(noise.jitter, self.late), (noise.rough, self.noisy)])
            found = _gains(self.f, response, self.h, self.measured, white, slow, heat, *decays, jumps)
            self.last["gains"] = (noise, found)
        known: tuple[Array, Array] = self.last["gains"][1]
        return known

    def _parts(self, noise: Noise) -> tuple[Array, Array, Array, tuple[Array, Array]]:
        """Levels of the forces and slow noises that are not zero, responses to these forces, both decays."""
        if "parts" not in self.last or self.last["parts"][0] != noise:
            self.last["parts"] = (noise, self._made(noise))
        made: tuple[Array, Array, Array, tuple[Array, Array]] = self.last["parts"][1]
        return made

    def _made(self, noise: Noise) -> tuple[Array, Array, Array, tuple[Array, Array]]:
        t, heat = self.trajectory, noise.heat or {}
        system = t.system
        there = np.array([heat.get(name, 0.0) > 0 for name in system.states])
        own = [(noise.force or {}).get(name, (heat.get(name, 0.0), noise.share)) for name in system.states]
        floor, share = np.array(own).reshape(-1, 2).T
        gain = np.hypot(floor, share * self.flow) * system.scale * there
        read = system.grid.read.astype(np.int64)
        response = driven(t.which, t.e, t.w0, t.w1, read, gain) if there.any() else np.zeros((0, 0, 0))
        slow = np.array(noise.slow or ())
        return (
            np.ones(int(there.sum())),
            slow if slow.any() else np.zeros(0),
            np.ascontiguousarray(response[:, :, there])
            if there.any()
            else np.zeros((max(len(read) - 1, 0), len(system.states), 0)),
            (np.exp(-self.step / noise.slow_time), np.exp(-self.step / noise.heat_time)),
        )

    def whitened(self, noise: Noise, data: Array) -> tuple[Array, Array]:
        """Columns (measured readings, M) of data (R, Y, M), whitened, and the logarithm (measured readings,)
        of the standard deviation of each innovation.
        """
        if noise.is_white:
            white = self.trajectory.system.grid.sd(noise.white)[self.measured]
            return data[self.measured] / white[:, None], np.log(white)
        _, slow, response, decays = self._parts(noise)
        gains, roots = self.gains(noise)
        out = _whitened(
            self.f,
            response,
            self.h,
            self.measured,
            gains,
            roots,
            len(slow),
            *decays,
            np.ascontiguousarray(data),
        )
        return out, np.log(roots[self.measured])


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
        late_switches(trajectory),
        noisy_inputs(trajectory),
    )


def whiten(trajectory: Trajectory, noise: Noise, data: Array, part: Filter | None = None) -> Array:
    """Whitened columns (measured readings, M) of data (R, Y, M); `part`: filter of the trajectory, where it
    was made before.
    """
    if noise.is_white:
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
