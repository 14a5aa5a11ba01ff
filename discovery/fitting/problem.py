"""What a fit has to find: the unknowns of a model on a set of recordings, and the residual they leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, System, Trajectory, make_grid, make_system, sensitivities, simulate, start_values
from discovery.dynamics.system import predict
from discovery.models import Model, expanded
from discovery.recordings import Campaign
from discovery.terms import names

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Unknown:
    """One number to find: a parameter (of one recording, or common: ``recording=None``) or a start value of a state."""

    name: str
    recording: str | None
    is_start: bool
    start: float
    low: float
    high: float
    spread: float | None = None  # of a start value: standard deviation of its prior


@dataclass(frozen=True)
class Problem:
    """A model bound to recordings, with its unknowns in a fixed order."""

    model: Model  # expanded
    systems: tuple[System, ...]
    unknowns: tuple[Unknown, ...]

    @property
    def outputs(self) -> tuple[str, ...]:
        """Channels that are compared."""
        return self.systems[0].grid.outputs

    @property
    def start(self) -> Array:
        """Start values of the unknowns."""
        return np.array([u.start for u in self.unknowns])

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the unknowns."""
        return np.array([u.low for u in self.unknowns]), np.array([u.high for u in self.unknowns])

    def concerns(self, system: System) -> list[int]:
        """Indices of the unknowns that act in a recording."""
        return [i for i, u in enumerate(self.unknowns) if u.recording in (None, system.grid.recording)]

    def values(self, system: System, theta: Array) -> dict[str, float]:
        """Parameter values in a recording."""
        out = self.model.values(system.grid.recording)
        for i in self.concerns(system):
            if not self.unknowns[i].is_start:
                out[self.unknowns[i].name] = float(theta[i])
        return out

    def run(self, system: System, theta: Array, guess: Array | None = None) -> Trajectory:
        """Free run of a recording with the unknowns at `theta`."""
        values = self.values(system, theta)
        start = start_values(system, values)
        for i in self.concerns(system):
            if self.unknowns[i].is_start:
                start[system.states.index(self.unknowns[i].name)] = theta[i]
        return simulate(system, values, start, guess)

    def residual(self, trajectory: Trajectory) -> Array:
        """Readings minus model (R, Y), NaN where nothing was read."""
        return trajectory.system.grid.readings - predict(trajectory)

    def jacobian(self, trajectory: Trajectory) -> Array:
        """dy/d(unknowns) of a recording, (R, Y, U), zero for unknowns of other recordings."""
        system = trajectory.system
        mine = self.concerns(system)
        parameters = [self.unknowns[i].name for i in mine if not self.unknowns[i].is_start]
        starts = [self.unknowns[i].name for i in mine if self.unknowns[i].is_start]
        dy = sensitivities(trajectory, parameters, starts)
        ordered = [i for i in mine if not self.unknowns[i].is_start] + [i for i in mine if self.unknowns[i].is_start]
        out = np.zeros((*dy.shape[:2], len(self.unknowns)))
        out[:, :, ordered] = dy
        return out


def make_problem(
    model: Model,
    campaign: Campaign,
    recordings: Sequence[str],
    outputs: Sequence[str] | None = None,
    grids: Mapping[str, Grid] | None = None,
) -> Problem:
    """Bind a model to recordings and lay out its unknowns.

    Args:
        outputs: measured channels to compare; default every output of the model that the campaign measures.
        grids: grids made before, by recording (a model with the same inputs may share them).
    """
    model = expanded(model)
    if outputs is None:
        outputs = [name for name in (*model.outputs, *model.states) if name in campaign.channels]
    used = set().union(*(names(s.start) for s in model.states.values() if s.start is not None)) & set(campaign.channels)
    inputs = sorted((set(model.inputs) | used) - set(outputs))
    systems = []
    for recording in recordings:
        grid = grids.get(recording) if grids else None
        if grid is None or not set(inputs) <= set(grid.samples) or grid.outputs != tuple(outputs):
            grid = make_grid(campaign, recording, inputs, outputs)
        systems.append(make_system(model, grid))
    unknowns = []
    for name in model.free:
        p = model.parameters[name]
        if p.per_recording:
            unknowns += [Unknown(name, r, False, p.at(r), p.min, p.max) for r in recordings]
        else:
            unknowns.append(Unknown(name, None, False, p.value, p.min, p.max))
    for system in systems:
        declared = start_values(system, model.values(system.grid.recording))
        for state, value in zip(system.model.states.values(), declared, strict=True):
            if state.start_sd > 0:
                unknowns.append(Unknown(state.name, system.grid.recording, True, float(value), -np.inf, np.inf, state.start_sd))
    return Problem(model, tuple(systems), tuple(unknowns))
