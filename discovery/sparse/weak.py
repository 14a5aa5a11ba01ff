"""The weak form: a library integrated against test functions, for states that are measured densely.

    -int w'(t) y dt = sum_k theta_k int w(t) phi_k(u, y) dt,       w(t) = (1 - (t/H)^2)^p on |t| < H

(Messenger & Bortz, Multiscale Model. Simul. 19, 2021). Readings may be irregular and slow while inputs come
every few seconds: readings are joined by straight lines, inputs keep their own sampling, and both are
integrated on the fine raster. No derivative is taken. Noise of `y` inside the library biases the pole a
little; output error refines it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid
from discovery.sparse.gram import Gram, gram
from discovery.terms import Expression, evaluate

Array = NDArray[np.float64]

_SHARE, _READINGS = 1 / 36, 8  # half width: share of the recording, and at least so many readings
_POWER = 2
_OVERLAP = 8  # windows per half width
_MOST_POINTS = 40_000  # of the raster of one recording


def weak_rows(
    grid: Grid,
    output: str,
    library: Sequence[Expression],
    constants: Mapping[str, float] | None = None,
    aliases: Mapping[str, str] | None = None,
) -> tuple[Array, Array, Array]:
    """Rows of the weak regression of d(output)/dt on a library, rates per second.

    H is a 36th of the recording and at least 8 readings, at most a quarter.

    Args:
        library: expressions of channels and outputs, without memory.
        constants: values of further names.
        aliases: further names of outputs, as {"y": "E_Y0C"}.

    Returns:
        columns (W, M), target (W,), time of each window's middle (W,) [s].
    """
    span = float(grid.time[-1] - grid.time[0])
    usual = max(_SHARE * span, _READINGS * float(np.median(np.diff(grid.time[grid.read]))))
    half = min(usual, span / 4)
    finest = float(np.min(grid.step))
    step = half / max(8, round(half / max(finest, span / _MOST_POINTS)))
    time = np.arange(grid.time[0], grid.time[-1] + 1e-6 * step, step)
    values: dict[str, float | Array] = {name: s.at(time) for name, s in grid.samples.items()}
    values |= {"time": time, **(constants or {})}
    for k, name in enumerate(grid.outputs):
        known = np.isfinite(grid.readings[:, k])
        values[name] = np.interp(time, grid.time[grid.read][known], grid.readings[known, k])
    for alias, name in (aliases or {}).items():
        values[alias] = values[name]
    columns = np.column_stack(
        [np.broadcast_to(evaluate(expression, values).value, time.shape) for expression in library]
    )
    reach = round(half / step)
    x = np.arange(-reach, reach + 1) / reach
    bump = (1 - x**2) ** _POWER * step
    slope = -2 * _POWER * x * (1 - x**2) ** (_POWER - 1) / half * step
    middles = np.arange(reach, len(time) - reach, max(1, reach // _OVERLAP))
    windows = middles[:, None] + np.arange(-reach, reach + 1)
    rows = np.column_stack([column[windows] @ bump for column in columns.T])
    return rows, -(np.asarray(values[output])[windows] @ slope), time[middles]


def weak_gram(rows: tuple[Array, Array, Array]) -> Gram:
    """Normal equations of weak rows."""
    return gram(rows[0], rows[1])
