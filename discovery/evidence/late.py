"""Inputs that may be logged late: with fast bodies and frequent readings, a switch some seconds before its
stamp looks like missing heat.

A logger that holds or smooths its samples is late by up to about one of its intervals. This shift is an
unknown of each recording, like the offset of an input with a spread. It is left out if the fastest body needs
many intervals to respond, or if readings are too rare to follow it.

A shift that differs from switch to switch is noise (`process_noise.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Grid, Trajectory
from discovery.dynamics.grid import MOVED
from discovery.fitting import Fit

FAST = 10.0  # intervals of an input within which a body answers, for a late stamp to matter
OFTEN = 2.0  # intervals of an input between readings that still show it
SAID = 3.0  # standard errors beyond which what was found is said
SMALL = 0.25  # of an interval, below which it is not


def perhaps_late(fit: Fit, grids: Mapping[str, Grid]) -> dict[str, Grid]:
    """Grids with an unknown shift in time of each input that may be logged late, if the recordings could show
    it.
    """
    fastest = min(_fastest(t) for t in fit.trajectories)
    return {name: replace(grid, unsure=_unsure(grid, fastest)) for name, grid in grids.items()}


def beside_switches(grid: Grid) -> NDArray[np.bool_]:
    """Which readings (R,) come within a logging interval of a switch of an input that may be logged late."""
    read = grid.time[grid.read]
    beside = np.zeros(len(read), dtype=bool)
    for name, interval in grid.unsure.items():
        samples = grid.samples[name]
        switches = samples.time[1:][np.abs(np.diff(samples.value)) > MOVED * np.ptp(samples.value)]
        before = np.searchsorted(switches, read - interval, side="left")
        beside |= np.searchsorted(switches, read + interval, side="right") > before
    return beside


def _unsure(grid: Grid, fastest: float) -> dict[str, float]:
    """Logging interval in s of each held input that switches, where a late stamp can matter."""
    spacing = float(np.median(np.diff(grid.time[grid.read]))) if len(grid.read) > 1 else np.inf
    found = {}
    for name, samples in grid.samples.items():
        if samples.linear or not np.ptp(samples.value) > 0:
            continue
        interval = grid.logged.get(name, np.inf)
        if fastest <= FAST * interval and spacing <= OFTEN * interval:
            found[name] = interval
    return found


def _fastest(trajectory: Trajectory) -> float:
    """The shortest time constant in s of a model anywhere on a trajectory."""
    kinds, first = np.unique(trajectory.which, return_index=True)
    size = np.abs(np.linalg.eigvals(trajectory.e[kinds])).min(axis=1)
    decay = -np.log(np.clip(size, 1e-300, 1.0)) / trajectory.system.grid.step[first]
    return float(1.0 / max(decay.max(initial=0.0), 1e-300))


def sentences(fit: Fit) -> list[str]:
    """A sentence for each input that is logged late or early."""
    found: dict[str, list[str]] = {}
    for u, value, error in zip(fit.problem.unknowns, fit.theta, fit.standard_errors, strict=True):
        if u.is_late and u.prior and abs(value) > max(SAID * error, SMALL * u.prior[1]):
            late = f"{abs(value):.0f} s {'late' if value > 0 else 'early'} in {u.recording}"
            found.setdefault(u.name, []).append(late)
    return [f"{name} is logged {', '.join(runs)}; the fit allows for it" for name, runs in found.items()]
