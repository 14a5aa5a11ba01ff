"""Inputs that may be logged late: a switch some seconds before its stamp looks like missing heat.

A logger that holds, averages or smooths its samples is late or early by up to about one of its intervals.
This shift is an unknown of each recording, like the offset of an input with a spread. It is left out if a
shift by a whole interval could not pass for an effect.

A shift that differs from switch to switch is noise (`process_noise.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from discovery.dynamics import Grid
from discovery.fitting import Fit, make_problem
from discovery.fitting.noise import resolution, roughness
from discovery.printed import printed
from discovery.recordings import Campaign

SAID = 3.0  # standard errors beyond which what was found is said
SMALL = 0.25  # of an interval, below which it is not


def perhaps_late(fit: Fit, campaign: Campaign, grids: Mapping[str, Grid], enough: float) -> dict[str, Grid]:
    """Grids with an unknown shift in time of each input that may be logged late, if the recordings could show
    it.

    Args:
        fit: of the model, to some or all readings of the grids.
        enough: log likelihood that a shift by a whole interval has to change, under the noise of readings
            (as stated, or as rough as they are).
    """
    possible = {name: _possible(grid) for name, grid in grids.items()}
    if not any(possible.values()):
        return dict(grids)
    fitted = {t.system.grid.recording: t.system.grid for t in fit.trajectories}
    unsure = {name: replace(grid, unsure=possible[name]) for name, grid in fitted.items()}
    problem = make_problem(fit.model, campaign, list(unsure), fit.problem.outputs, unsure)
    known = {u.key: value for u, value in zip(fit.problem.unknowns, fit.theta, strict=True)}
    theta = np.array([known.get(u.key, u.start) for u in problem.unknowns])
    steps = resolution([grid.readings for grid in fitted.values()])
    noise = [
        campaign.channels[y].noise or max(roughness([g.readings[:, k] for g in fitted.values()]), steps[k])
        for k, y in enumerate(fit.problem.outputs)
    ]
    shown: dict[str, dict[str, float]] = {name: {} for name in grids}
    for system in problem.systems:
        name = system.grid.recording
        jacobian = problem.jacobian(problem.run(system, theta)) / np.array(noise)[:, None]
        for k, u in enumerate(problem.unknowns):
            if u.is_late and u.recording == name:
                interval = possible[name][u.name]
                if 0.5 * float(np.nansum((jacobian[..., k] * interval) ** 2)) > enough:
                    shown[name][u.name] = interval
    return {name: replace(grid, unsure=shown[name]) for name, grid in grids.items()}


def _possible(grid: Grid) -> dict[str, float]:
    """Logging interval in s of each input that moves."""
    moving = [n for n, one in grid.samples.items() if n in grid.logged and np.ptp(one.value) > 0]
    return {n: grid.logged[n] for n in moving}


def sentences(fit: Fit, is_right: bool = True) -> list[str]:
    """A sentence for each input that is logged late or early.

    Args:
        is_right: whether nothing else is missing. If something is, the shift may stand for it, and is said
            only where it is more than a logger makes.
    """
    found: dict[str, list[str]] = {}
    for u, value, error in zip(fit.problem.unknowns, fit.theta, fit.standard_errors, strict=True):
        least = (SMALL if is_right else 1.0) * u.prior[1] if u.is_late and u.prior else np.inf
        if abs(value) > max(SAID * error, least):
            size = f"{abs(value):.0f}" if abs(value) >= 1 else printed(abs(value), 2)
            late = f"{size} s {'late' if value > 0 else 'early'} in {u.recording}"
            found.setdefault(u.name, []).append(late)
    runs = len(fit.trajectories)
    if not is_right:
        return [
            f"in the fit, {name} is logged {', '.join(late)}: a dead time, or what the model leaves out, may "
            "look like this"
            for name, late in found.items()
        ]
    return [
        f"{name} is logged {', '.join(late)}; the fit allows for it"
        + (", and a dead time looks the same" if 1 < runs == sum("early" in text for text in late) else "")
        for name, late in found.items()
    ]
