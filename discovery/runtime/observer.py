"""After a gap: measured errors say where the states of the model are.

Through a gap nobody fed the model, and a machine at rest is where its laws are known least. So the states
after a gap are x + dx. The standard deviation of dx is a share of what the states moved in the gap. For each
state a second model runs that began with a small step in this state. Its outputs show how each part of dx
moves the predicted errors, and a measured error corrects all states by the usual formula of linear
regression (Kalman, Trans. ASME J. Basic Eng. 82, 1960, without process noise).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.export.compiled import Compiled
from discovery.export.stepper import Stepper

Array = NDArray[np.float64]

# Chosen on seed 4000 of benchmarks/month.py and confirmed on others, see benchmarks/runtime.md
SHARE = 0.3  # standard deviation of a state after a gap, as a share of what it moved meanwhile
STEP = 0.1  # of a state in its unit (K, um), with which a stepped model begins
FAR = 4.0  # standard deviations: an error further away than this corrects nothing
SETTLED = 0.1  # standard deviation of every predicted error, in residuals of the fit, at which it ends


@dataclass
class Observer:
    """Models that began with a step in one state each, and the covariance (N, N) of the parts of dx, in the
    units of the states. `level` (Y,): residual of the fit of each output, NaN where there is none.
    """

    stepped: list[Stepper]
    covariance: Array
    level: Array
    counted: dict[str, float] = field(default_factory=dict)  # instant of the last reading of each error

    @classmethod
    def after(cls, stepper: Stepper, moved: Array, level: Array) -> Observer:
        """Of a model after a gap in which its states moved by so much (n,)."""
        places = np.flatnonzero(moved != 0.0)
        stepped = []
        for i in places:
            one = stepper.twin()
            one.x[i] += STEP
            stepped.append(one)
        return cls(stepped, np.diag((SHARE * moved[places]) ** 2), level)

    def run(self, u: Array) -> bool:
        """Take the steps of the model at work, inputs (K, U); False: one of the models failed."""
        return all(len(one.run(u)) == len(u) for one in self.stepped)

    def slopes(self, stepper: Stepper, u: Array) -> Array:
        """Slopes (Y, N) of the outputs of the model at work."""
        y = stepper.outputs(u)
        columns = [(one.outputs(u) - y) / STEP for one in self.stepped]
        return np.array(columns).reshape(-1, len(y)).T

    def uncertain(self, slopes: Array) -> float:
        """Largest standard deviation of a predicted error, in residuals of the fit."""
        spread = np.sqrt(np.einsum("yi,ij,yj->y", slopes, self.covariance, slopes)) / self.level
        return float(np.nanmax(spread, initial=0.0))

    def correct(self, stepper: Stepper, slopes: Array, left: Mapping[int, float]) -> None:
        """Move the states to where measured errors say they are; `left`: errors that the model does not
        predict, by number of the output.
        """
        at = [k for k in left if np.isfinite(self.level[k])]
        rows, seen = slopes[at], np.array([left[k] for k in at])
        spread = rows @ self.covariance @ rows.T + np.diag(self.level[at] ** 2)
        if not at or np.any(np.abs(seen) > FAR * np.sqrt(np.diag(spread))):
            return
        gain = np.linalg.solve(spread, rows @ self.covariance).T
        moves = np.array([(one.x - stepper.x) / STEP for one in self.stepped]).T @ (gain @ seen)
        for one in (stepper, *self.stepped):
            one.x += moves
        self.covariance = self.covariance - gain @ rows @ self.covariance

    def saved(self) -> dict[str, Any]:
        """What a restart needs."""
        return {
            "states": [one.x.tolist() for one in self.stepped],
            "covariance": self.covariance.tolist(),
            "counted": self.counted,
        }

    @classmethod
    def resumed(cls, saved: Mapping[str, Any], stepper: Stepper, level: Array) -> Observer:
        """As it was saved, with a model that was restored.

        Raises:
            ValueError: numbers that do not fit the model.
        """
        stepped = []
        for states in saved["states"]:
            one = stepper.twin()
            one.x[:] = np.array(states, dtype=float).reshape(len(one.x))
            stepped.append(one)
        covariance = np.array(saved["covariance"], dtype=float).reshape(len(stepped), len(stepped))
        if not all(np.isfinite(one.x).all() for one in stepped) or not np.isfinite(covariance).all():
            raise ValueError("not finite")
        counted = {str(name): float(stamp) for name, stamp in saved["counted"].items()}
        return cls(stepped, covariance, level, counted)


def levels(document: Mapping[str, Any], compiled: Compiled) -> Array:
    """Residual of the fit of each output (Y,), NaN where a document does not say it."""
    residual = document.get("knowledge", {}).get("residual", {})
    return np.array([residual.get(name) or np.nan for name in compiled.outputs])
