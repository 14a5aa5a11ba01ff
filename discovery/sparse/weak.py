"""The weak form: a library integrated against test functions, for states that are measured densely.

    first order:  -int w'(t) y dt = sum_k theta_k int w(t) phi_k dt        w(t) = (1 - (t/H)^2)^p on |t| < H
    second order:  int w''(t) y dt = sum_k theta_k int w(t) phi_k dt

(Messenger & Bortz, Multiscale Model. Simul. 19, 2021). Readings may be irregular and slow while inputs come
every few seconds: readings are joined by straight lines, inputs keep their own sampling, and both are
integrated on the fine raster. No derivative is taken. Noise of `y` inside the library biases the pole a
little; output error refines it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.sparse.gram import Gram, gram
from discovery.terms import Expression, evaluate

Array = NDArray[np.float64]

_SHARE, _READINGS = 1 / 36, 8  # half width: share of the recording, and at least so many readings
_POWER = {1: 2, 2: 3}  # by order
_OVERLAP = 8  # windows per half width
_POINTS = 40_000  # of the raster of one recording at most
_SMOOTHER = 0.25  # of the half width: of the windows that smooth y and its rate
_WORTH, _TRIED = 0.02, 4  # share of the most information that a width needs to be tried, number of trials
_FINEST, _COARSEST, _STEP = 4, 4, 1.5  # half widths tried: readings, share of the recording (1/4), ratio


@dataclass(frozen=True)
class Rows:
    """Rows of the weak regression: columns (W, M), target (W,), middle of each window (W,) [s], half width
    [s].
    """

    columns: Array
    target: Array
    time: Array
    half: float

    @property
    def gram(self) -> Gram:
        """Normal equations."""
        return gram(self.columns, self.target)


@dataclass(frozen=True)
class Window:
    """Test function and its derivatives on a raster: weights of its integral, each (2 n + 1,)."""

    w: Array
    slope: Array
    bend: Array

    @staticmethod
    def make(half: float, step: float, power: int) -> Window:
        """(1 - (t/H)^2)^p times the step."""
        reach = max(round(half / step), 2)
        x = np.arange(-reach, reach + 1) / reach
        base = 1 - x**2
        slope = -2 * power * x * base ** (power - 1) / half
        bend = (
            -2 * power * (base ** (power - 1) - 2 * (power - 1) * x**2 * base ** max(power - 2, 0)) / half**2
        )
        return Window(step * base**power, step * slope, step * bend)


def half_widths(grids: Sequence[Grid], output: str, noise: float, order: int = 1) -> list[float]:
    """Half widths [s] of windows with information on the rate, the one with the most first: (signal/noise)^2
    times their number.

    White noise of a reading every d seconds makes noise^2 d int w'^2 (w''^2) of the target. Held inputs put
    as much information into wide windows, which balance the laws alone, as ringing puts into narrow ones,
    which show the inertia: a few of those that have a share of the most are worth a trial.
    """
    spans = [float(g.time[-1] - g.time[0]) for g in grids]
    reading = min(float(np.median(np.diff(g.time[g.read]))) for g in grids if len(g.read) > 1)
    longest = max(spans)
    tried = np.arange(np.log(_FINEST * reading), np.log(max(longest / _COARSEST, 5 * reading)), np.log(_STEP))
    found: dict[float, float] = {}
    for half in np.exp(tried):
        information = 0.0
        for grid, span in zip(grids, spans, strict=True):
            if half > span / _COARSEST:
                continue
            rows = weak_rows(grid, output, [], order=order, half=float(half))
            step = float(rows.half) / 200
            window = Window.make(rows.half, step, _POWER[order])
            shape = (window.slope if order == 1 else window.bend) / step
            made = noise**2 * reading * float(shape @ shape) * step
            information += max(float(np.mean(rows.target**2)) / made - 1.0, 0.0) * span / half
        found[float(half)] = information
    most = max(found.values(), default=0.0)
    if most == 0.0:
        return [_READINGS * reading]
    worth = [half for half, information in found.items() if information > _WORTH * most]
    few = worth[:: max(1, len(worth) // _TRIED)]
    return list(dict.fromkeys([max(found, key=lambda half: found[half]), *few]))


def weak_rows(
    grid: Grid,
    output: str,
    library: Sequence[Expression],
    constants: Mapping[str, float] | None = None,
    aliases: Mapping[str, str] | None = None,
    order: int = 1,
    half: float | None = None,
    rates: Mapping[str, str] | None = None,
    second: float = 1.0,
) -> Rows:
    """Rows of the weak regression of d(output)/dt (of order 2: its second derivative) on a library.

    Args:
        library: expressions of channels and outputs, without memory.
        constants: values of further names.
        aliases: further names of outputs, as {"y": "E_Y0C"}.
        half: half width [s]; default a 36th of the recording and at least 8 readings; at most a quarter.
        rates: names of the rates of outputs in the library.
        second: seconds in the unit of time that rates count in.
    """
    span = float(grid.time[-1] - grid.time[0])
    usual = max(_SHARE * span, _READINGS * float(np.median(np.diff(grid.time[grid.read]))))
    half = min(half or usual, span / 4)
    finest = float(np.min(grid.step))
    step = half / max(8, round(half / max(finest, span / _POINTS)))
    time = np.arange(grid.time[0], grid.time[-1] + 1e-6 * step, step)
    values: dict[str, float | Array] = {name: s.at(time) for name, s in grid.samples.items()}
    values |= {"time": time, **(constants or {})}
    for k, name in enumerate(grid.outputs):
        known = np.isfinite(grid.readings[:, k])
        values[name] = np.interp(time, grid.time[grid.read][known], grid.readings[known, k])
    for alias, name in (aliases or {}).items():
        values[alias] = values[name]
    window = Window.make(half, step, _POWER[order])
    seen = np.asarray(values[output])
    smoother = Window.make(max(_SMOOTHER * half, 2 * step), step, 2)
    for name, rate in (rates or {}).items():
        values[rate] = (
            second * np.convolve(np.asarray(values[name]), smoother.slope, "same") / smoother.w.sum()
        )
    reach = (len(window.w) - 1) // 2
    middles = np.arange(reach, len(time) - reach, max(1, reach // _OVERLAP))
    windows = middles[:, None] + np.arange(-reach, reach + 1)
    series = [np.broadcast_to(evaluate(one, values).value, time.shape) for one in library]
    columns = np.array([one[windows] @ window.w for one in series]).reshape(len(series), len(middles)).T
    target = seen[windows] @ (-window.slope if order == 1 else window.bend)
    return Rows(columns, second**order * target, time[middles], half)
