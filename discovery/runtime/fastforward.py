"""Through a gap: what a model does while nobody fed it.

The machine is taken to have been off: flows, speeds and heat are zero, temperatures run straight from the
last value known to the first one after the gap, everything else stays.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported
from discovery.export.stepper import Stepper

Array = NDArray[np.float64]

OFF_WITH_THE_MACHINE = ("fluid flow", "rotation speed", "heat load", "cooling power")
_CHUNK = 10_000  # steps at once


def fast_forward(exported: Exported, stepper: Stepper, before: Array, after: Array, steps: int) -> None:
    """Take `steps` steps from inputs `before` (U,) to inputs `after` (U,); stops where a step fails."""
    off = np.array([spec.role in OFF_WITH_THE_MACHINE for spec in exported.inputs])
    straight = np.array([spec.between == "linear" for spec in exported.inputs])
    for first in range(0, steps, _CHUNK):
        k = np.arange(first, min(first + _CHUNK, steps))
        share = ((k + 0.5) / steps)[:, None]
        u = np.where(straight, before + share * (after - before), before)
        u[:, off] = 0.0
        if len(stepper.run(u)) < len(u):
            return
