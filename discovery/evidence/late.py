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
    runs = len(fit.trajectories)
    if not is_right:
        return [
            f"in the fit, {name} is logged {_those(late)}: a dead time, or what the model leaves out, may "
            "look like this"
            for name, late in _found(fit, 1.0).items()
        ]
    return [
        f"{name} is logged {_those(late)}; the fit allows for it"
        + (", and a dead time looks the same" if 1 < runs == len(late) and max(late.values()) < 0 else "")
        for name, late in _found(fit, SMALL).items()
    ]


def beyond(fit: Fit) -> list[str]:
    """A sentence for each input that every recording has late, or early, by more than a logger makes."""
    said = []
    for name, late in _found(fit, 1.0, apart=True).items():
        is_early, is_late = max(late.values()) < 0, min(late.values()) > 0
        if len(late) == len(fit.trajectories) and (is_early or is_late):
            alike = (
                "a dead time, or another body on the way to what is read," if is_early else "a wrong clock"
            )
            said.append(
                f"{name} would be logged {_those(late)}, more than the interval of its samples: {alike} "
                "looks the same"
            )
    return said


def _found(fit: Fit, least: float, apart: bool = False) -> dict[str, dict[str, float]]:
    """Seconds by which each input is logged late in each recording, where this is sure.

    Args:
        least: of a logging interval, what is worth saying.
        apart: it is more than that by as many standard errors as it has to be more than nothing.
    """
    found: dict[str, dict[str, float]] = {}
    for u, value, error in zip(fit.problem.unknowns, fit.theta, fit.standard_errors, strict=True):
        if u.is_late and u.prior and u.recording:
            size, sure = least * u.prior[1], SAID * error
            if abs(value) > (size + sure if apart else max(size, sure)):
                found.setdefault(u.name, {})[u.recording] = float(value)
    return found


def _those(late: dict[str, float]) -> str:
    def one(seconds: float) -> str:
        size = f"{abs(seconds):.0f}" if abs(seconds) >= 1 else printed(abs(seconds), 2)
        return f"{size} s {'late' if seconds > 0 else 'early'}"

    return ", ".join(f"{one(seconds)} in {run}" for run, seconds in late.items())
