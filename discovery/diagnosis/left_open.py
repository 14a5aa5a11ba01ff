"""What a fit leaves open of a free run: parameters, late inputs, zeros of thermometers, air at bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Trajectory, predict, sensitivities, simulate
from discovery.dynamics.system import shifted
from discovery.errors import RunsAwayError
from discovery.evidence.form_error import air_columns
from discovery.evidence.whitening import moving
from discovery.fitting import Fit

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Usual:
    """What is off on any machine: the zeros of some sensors, each by `zero`, and the air at bodies, by
    `layer` from what is measured (`air`: ambient temperatures), standard deviations.
    """

    sensors: tuple[str, ...]
    zero: float
    air: tuple[str, ...]
    layer: float

    def columns(self, run: Trajectory) -> Array:
        """What the readings show more (R, Y, M) for a standard deviation of each."""
        zeros, airs = sensitivities(run, self.sensors), air_columns(run, self.air)
        return np.concatenate([self.zero * zeros, self.layer * airs], axis=2)


@dataclass(frozen=True)
class Absorbed:
    """What is usually off, seen through a fit to the recordings in which it was."""

    usual: Usual
    fit: Fit
    moves: Array  # (U, M) of the unknowns, where each is off by a standard deviation

    @classmethod
    def by(cls, fit: Fit, usual: Usual) -> Absorbed:
        """By a fit, to first order: least squares, with the priors of the fit."""
        free = moving(fit)
        rows = fit.problem.prior_rows(fit.theta, fit.together)[1][:, free]
        rows = np.pad(rows, ((0, 0), (0, usual.columns(fit.trajectories[0]).shape[2])))
        for run in fit.trajectories:
            weight = run.system.grid.measured / np.array(fit.noise.white)
            here = np.concatenate([fit.problem.jacobian(run)[:, :, free], usual.columns(run)], axis=2)
            here = (weight[:, :, None] * here).reshape(-1, here.shape[2])
            rows = np.asarray(np.linalg.qr(np.concatenate([rows, here]), mode="r"))  # one at a time
        own, off = rows[:, : len(free)], rows[:, len(free) :]
        scale = np.maximum(np.linalg.norm(own, axis=0), 1e-300)
        moves = np.zeros((len(fit.theta), off.shape[1]))
        moves[free] = -np.linalg.lstsq(own / scale, off)[0] / scale[:, None]
        return cls(usual, fit, moves)

    def variance(self, run: Trajectory) -> Array:
        """Of the readings (R, Y) of a recording of the fit."""
        left = self.usual.columns(run) + self.fit.problem.jacobian(run) @ self.moves
        return np.asarray(np.einsum("rym,rym->ry", left, left))


@dataclass(frozen=True)
class Known:
    """Parameters that all recordings share, `names` (P,), and their `covariance` (P, P); `late`: by how many
    seconds inputs are logged late, rms over the recordings; `fitted`: what else is off in recordings that
    were fitted.
    """

    names: tuple[str, ...]
    covariance: Array
    late: Mapping[str, float] = field(default_factory=dict)
    fitted: Absorbed | None = None

    def of_unseen(self, usual: Usual) -> Known:
        """Of a recording that no fit has seen: the same, and the zeros of sensors, each on its own."""
        count = len(self.names)
        covariance = usual.zero**2 * np.eye(count + len(usual.sensors))
        covariance[:count, :count] = self.covariance
        return Known((*self.names, *usual.sensors), covariance, self.late)

    def of_fit(self, fit: Fit, usual: Usual) -> Known:
        """Of the recordings of a fit: free runs take stamps as they are."""
        return Known((), np.zeros((0, 0)), self.late, Absorbed.by(fit, usual))

    def rms(self, run: Trajectory, size: Array, only: Sequence[int]) -> float:
        """What all this adds to the readings of some outputs of a free run, in units of a size (Y,)."""
        moved = sensitivities(run, self.names)
        variance = np.einsum("ryp,pq,ryq->ry", moved, self.covariance, moved, optimize=True)
        for name, seconds in self.late.items():
            with suppress(RunsAwayError):
                variance += moved_by(run, name, seconds) ** 2
        if self.fitted is not None:
            variance += self.fitted.variance(run)
        mine, measured = list(only), run.system.grid.measured
        return float(np.sqrt(np.mean((variance / size**2)[:, mine][measured[:, mine]])))


def moved_by(run: Trajectory, name: str, seconds: float) -> Array:
    """What the outputs show more (R, Y) where an input is logged so many seconds late."""
    grid = run.system.grid
    late = {**grid.late, name: grid.late.get(name, 0.0) + seconds}
    there = shifted(run.system, grid.offset, late)
    return predict(simulate(there, run.values, run.x[0])) - predict(run)
