"""Symmetry check: an error that a symmetric design keeps small, E_X0C of the paper.

The rotary table is symmetric about the Y-Z plane, so E_X0C should hold noise alone. Where it follows another
error, the machine is heated from one side.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Symmetry:
    """rms and peak in the unit of the error; `noise`: standard deviation of a reading from the differences of
    neighbours; `slow`: rms of what neighbours share; `follows`: the other error it is most alike, with the
    correlation and the share of the variance that goes with it.
    """

    rms: float
    peak: float
    noise: float
    slow: float
    follows: str
    correlation: float

    def kept(self, resolution: float) -> bool:
        """Whether symmetry holds: nothing slow beyond the axis resolution, so nothing can be compensated."""
        return self.slow <= resolution


def symmetry(error: Array, others: Mapping[str, Array]) -> Symmetry | None:
    """Check one error on one recording; None for fewer than 8 readings.

    Args:
        error: (N,), NaN where not read. others: (N,) each, the other errors at the same instants.
    """
    seen = np.isfinite(error)
    y = error[seen]
    if len(y) < 8:
        return None
    noise2 = float(np.mean(np.diff(y) ** 2)) / 2.0  # von Neumann: slow parts cancel in differences
    slow2 = max(float(np.mean(y**2)) - noise2, 0.0)
    alike: dict[str, float] = {}
    for name, other in others.items():
        both = seen & np.isfinite(other)
        if both.sum() > 8 and np.ptp(other[both]) > 0 and np.ptp(error[both]) > 0:
            alike[name] = float(np.corrcoef(error[both], other[both])[0, 1])
    follows = max(alike, key=lambda n: abs(alike[n]), default="")
    return Symmetry(
        float(np.sqrt(np.mean(y**2))),
        float(np.max(np.abs(y))),
        noise2**0.5,
        slow2**0.5,
        follows,
        alike.get(follows, 0.0),
    )
