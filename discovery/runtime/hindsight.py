"""Hindsight: once a lost input is back, the model goes through the gap again with what is known now.

While an input is replaced, the model integrates a value that is only held. When all inputs are good again,
the model returns to where it was before and takes the same steps once more, a lost temperature running
straight from its last good value to the first one after the gap. The difference reaches the offsets no
faster than their rate.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from discovery.export.document import Exported
from discovery.export.stepper import Snapshot, Stepper

Array = NDArray[np.float64]

LONGEST_S = 24 * 3600.0  # of a gap that is computed again


@dataclass
class Hindsight:
    """The steps since an input was lost: where the model was, its inputs (one row a step), which were
    replaced.
    """

    before: Snapshot
    last: Array  # (U,) inputs of the step before
    rows: list[Array] = field(default_factory=list)
    replaced: list[NDArray[np.bool_]] = field(default_factory=list)

    def add(self, rows: Array, replaced: NDArray[np.bool_]) -> None:
        """Steps taken under inputs (K, U), those in `replaced` (U,) not known."""
        self.rows += list(rows)
        self.replaced += [replaced] * len(rows)

    def known(self, exported: Exported) -> Array:
        """The inputs as they are known once all are back: (K, U)."""
        rows, lost = np.array(self.rows), np.array(self.replaced)
        for i, spec in enumerate(exported.inputs):
            if spec.between != "linear" or not lost[:, i].any():
                continue
            places = np.concatenate([[-1], np.flatnonzero(~lost[:, i])])
            values = np.concatenate([[self.last[i]], rows[~lost[:, i], i]])
            rows[:, i] = np.interp(np.arange(len(rows)), places, values)
        return rows

    def replay(self, exported: Exported, stepper: Stepper) -> Array | None:
        """Take the steps again; outputs (Y,) after the last one. None: a step fails, and nothing has
        changed.
        """
        now = stepper.snapshot()
        stepper.restore(self.before)
        y = stepper.run(self.known(exported))
        if len(y) < len(self.rows):
            stepper.restore(now)
            return None
        return np.asarray(y[-1])
