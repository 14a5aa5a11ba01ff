"""First-order responses to the inputs: what any thermal answer is made of, whatever the machine.

    r' = (u - r)/tau

The sum of such responses over a few time constants is a rough model of every measured channel that needs
no fit but least squares. It serves to compare recordings with each other and to find what drives an output.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.recordings.columns import Array

POINTS = 2000  # of the grid on which responses are computed


def input_on_grid(time: Array, values: Array, grid: Array, between: str) -> Array:
    """An input on an even grid: the mean of a held one over each step, a linear one where it is; (G,)."""
    known = np.isfinite(values)
    if not known.any():
        return np.zeros(len(grid))
    stamps, read = time[known], values[known]
    if between == "linear":
        return np.interp(grid, stamps, read)
    step = grid[1] - grid[0] if len(grid) > 1 else 1.0
    # the integral of a held input is linear between its stamps
    total = np.concatenate(([0.0], np.cumsum(read[:-1] * np.diff(stamps))))

    def integral(at: Array) -> Array:
        place = np.clip(np.searchsorted(stamps, at, side="right") - 1, 0, len(stamps) - 1)
        return total[place] + read[place] * (at - stamps[place])

    return np.asarray((integral(grid) - integral(grid - step)) / step)


def filtered(values: Array, step: float, tau: float, *, rest: bool = False) -> Array:
    """Response of first order to an input on an even grid; tau 0: the input itself.

    It begins in the balance of the first value, or at zero (`rest`).
    """
    if tau <= 0.0:
        return values
    keep = float(np.exp(-step / tau))
    drive = (1.0 - keep) * values
    drive[0] += 0.0 if rest else keep * values[0]
    reach = 1  # of what has been added up; each round doubles it
    while reach < len(drive) and keep > 0.0:
        drive[reach:] += keep * drive[:-reach]
        reach, keep = 2 * reach, keep * keep
    return drive


def even_grid(time: Array, points: int = POINTS) -> Array:
    """At most so many even instants over a recording."""
    count = int(min(points, max(3 * len(time), 10)))
    return np.linspace(time[0], time[-1], count)


def responses(
    inputs: Mapping[str, Array], time: Array, between: Mapping[str, str], at: Array, taus: Sequence[float]
) -> NDArray[np.float64]:
    """Responses of each input at each time constant, in this order; (A, inputs * taus).

    Args:
        inputs: each (T,), NaN where not recorded. time: (T,) s. at: (A,) s. taus: s.
    """
    grid = even_grid(time)
    step = float(grid[1] - grid[0])
    columns = []
    for name, values in inputs.items():
        even = input_on_grid(time, values, grid, between[name])
        columns += [np.interp(at, grid, filtered(even, step, tau)) for tau in taus]
    return np.column_stack(columns) if columns else np.zeros((len(at), 0))
