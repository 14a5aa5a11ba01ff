"""What a refit of the baseline can absorb: the very model of the case file, fitted to readings without noise.

Parameters and the start values of all states are free. A signature that a refit absorbs is no evidence,
whoever looks at it; what a refit leaves of it, over the noise of a reading, is the size of an effect.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discovery.dynamics import (
    System,
    Trajectory,
    make_grid,
    make_system,
    predict,
    sensitivities,
    simulate,
    start_values,
)
from discovery.dynamics.system import inputs_of
from discovery.errors import RunsAwayError
from discovery.models import Model, expanded
from discovery.recordings import Campaign, Recording
from discovery.recordings import Channel as Column
from discovery.recordings.roles import ROLES
from discovery.virtual.log import Columns
from discovery.virtual.machine import Machine
from discovery.virtual.network import Array

_FAR = 1e6  # residual, in noise, of a trial that runs away
_SEEN = 1e-12  # of the largest slope: an unknown that shows less, as a loss of exp(-600) W, stays where it is


@dataclass(frozen=True)
class Refit:
    """A baseline fitted to noise-free readings of some recordings; residual and slopes in units of noise."""

    systems: tuple[System, ...]
    model: Model
    sigma: Array  # (Y,)
    theta: Array  # (U,): parameters over their nominal values, then start values recording by recording
    residual: Array  # (R,)
    slopes: Array  # (R, U)

    @property
    def rms(self) -> float:
        """Rms over noise that the baseline leaves."""
        return float(np.sqrt(np.mean(self.residual**2)))

    def left(self, change: Array) -> Array:
        """What a further refit leaves of a small change of the readings (R,), in units of noise."""
        scale = np.linalg.norm(self.slopes, axis=0) + 1e-300
        moved = np.linalg.lstsq(self.slopes / scale, change, rcond=1e-8)[0]
        return np.asarray(change - self.slopes / scale @ moved)

    def on(self, machine: Machine, recordings: Mapping[str, Columns]) -> Array:
        """The residual (R,) that this fit leaves of other logs of the same recordings."""
        systems = _systems(machine, self.model, recordings)
        return _Problem(systems, self.model, self.sigma).residual(self.theta)

    def slope(self, machine: Machine, recordings: Mapping[str, Columns]) -> Array:
        """The slope (R,), in units of noise, along a parameter that the baseline of this machine has beyond
        that of the fit, where it is zero.
        """
        model = believed_of(machine, recordings)
        problem = _Problem(_systems(machine, model, recordings), model, self.sigma)
        mine = _Problem(self.systems, self.model, self.sigma)
        theta = np.concatenate([self.theta[: len(mine.size)], [0.0], self.theta[len(mine.size) :]])
        return np.asarray(problem.jacobian(theta)[:, len(mine.size)])


def refit(
    machine: Machine, recordings: Mapping[str, Columns], sigma: Array, begin: Refit | None = None
) -> Refit:
    """Fit the baseline of a machine.

    Args:
        recordings: logs with noise-free readings, by name.
        sigma: (Y,) noise of a reading of each output.
        begin: a refit of the same recordings with other readings, to start from.
    """
    from scipy.optimize import least_squares

    model = believed_of(machine, recordings)
    systems = _systems(machine, model, recordings)
    problem = _Problem(systems, model, sigma)
    start = problem.start if begin is None else begin.theta
    found = least_squares(
        problem.residual,
        start,
        problem.jacobian,
        bounds=(problem.lowest, np.inf),
        x_scale="jac",
        max_nfev=60,
        ftol=1e-5,
    )
    return Refit(systems, model, sigma, found.x, found.fun, np.asarray(found.jac))


def believed_of(machine: Machine, recordings: Mapping[str, Columns]) -> Model:
    """The baseline of a machine at the values of its drawing, its memories written out."""
    channels = campaign_of(machine, recordings).channels
    return expanded(machine.baseline.with_values(machine.nominal), channels)


def _systems(machine: Machine, model: Model, recordings: Mapping[str, Columns]) -> tuple[System, ...]:
    campaign = campaign_of(machine, recordings)
    inputs = inputs_of(model, campaign, machine.outputs)
    return tuple(make_system(model, make_grid(campaign, r, inputs, machine.outputs)) for r in recordings)


def campaign_of(machine: Machine, recordings: Mapping[str, Columns]) -> Campaign:
    """Logs in memory as a campaign."""
    channels = {c.name: Column(c.name, c.role, c.unit, None, ROLES[c.role].between) for c in machine.channels}
    return Campaign(
        machine.title,
        channels,
        {
            name: Recording(name, c["time"], {k: v for k, v in c.items() if k != "time"})
            for name, c in recordings.items()
        },
    )


class _Problem:
    """Residual and slopes of a trial, which is run once for both."""

    def __init__(self, systems: Sequence[System], model: Model, sigma: Array) -> None:
        self.systems, self.model, self.sigma = systems, model, sigma
        values = model.values()
        self.size = {name: abs(values[name]) or 1.0 for name in model.free}
        self.states = [name for name, state in model.states.items() if not state.memory]
        self.latest: tuple[Array, list[Trajectory | None]] | None = None

    @property
    def start(self) -> Array:
        values = self.model.values()
        free = [values[name] / size for name, size in self.size.items()]
        return np.array(free + [0.0] * (len(self.states) * len(self.systems)))

    @property
    def lowest(self) -> Array:
        """The least value (U,) of each unknown. A size that cannot be negative may come down to zero and
        leave it again; its logarithm would not.
        """
        free = [self.model.parameters[name].min / size for name, size in self.size.items()]
        return np.array(free + [-np.inf] * (len(self.states) * len(self.systems)))

    def values(self, theta: Array) -> dict[str, float]:
        """Parameters by name."""
        pairs = zip(self.size.items(), theta.tolist(), strict=False)
        return {name: x * size for (name, size), x in pairs}

    def residual(self, theta: Array) -> Array:
        return np.concatenate(
            [
                np.full(s.grid.readings.size, _FAR)
                if run is None
                else ((predict(run) - s.grid.readings) / self.sigma).ravel()
                for s, run in zip(self.systems, self._runs(theta), strict=True)
            ]
        )

    def jacobian(self, theta: Array) -> Array:
        P, S = len(self.size), len(self.states)
        inner = np.array(list(self.size.values()))
        slopes = []
        for k, (system, run) in enumerate(zip(self.systems, self._runs(theta), strict=True)):
            rows = system.grid.readings.size
            wide = np.zeros((rows, len(theta)))
            if run is not None:
                dy = sensitivities(run, list(self.size), self.states) / self.sigma[:, None]
                wide[:, :P] = dy[:, :, :P].reshape(rows, P) * inner
                wide[:, P + k * S : P + (k + 1) * S] = dy[:, :, P:].reshape(rows, S)
            slopes.append(wide)
        together = np.concatenate(slopes)
        size = np.linalg.norm(together, axis=0)
        together[:, size < _SEEN * size.max(initial=0.0)] = 0.0
        return together

    def _runs(self, theta: Array) -> list[Trajectory | None]:
        """Free runs at a trial; None for one that runs away."""
        if self.latest is not None and np.array_equal(self.latest[0], theta):
            return self.latest[1]
        P, S = len(self.size), len(self.states)
        values = self.model.values() | self.values(theta)
        runs: list[Trajectory | None] = []
        for k, system in enumerate(self.systems):
            start = start_values(system, values)
            own = theta[P + k * S : P + (k + 1) * S]
            start[[system.states.index(name) for name in self.states]] += own
            try:
                runs.append(simulate(system, values, start))
            except RunsAwayError:
                runs.append(None)
        self.latest = theta.copy(), runs
        return runs
