"""The noise under which models are compared."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from discovery.diagnosis.context import Context, with_noise_of
from discovery.fitting import Fit
from tests.diagnosis.parts import dry, wetted
from tests.machine import BODIES, NOISE, SEEN, SIZES

Array = NDArray[np.float64]

PART = 0.2  # of the time constant of the motor: how fast the place that E_Y sees follows


def moved(fit: Fit, name: str, factor: float) -> Fit:
    """A fit with one parameter changed."""
    theta = np.array(fit.theta)
    theta[[u.name for u in fit.problem.unknowns].index(name)] *= factor
    return replace(
        fit, theta=theta, trajectories=tuple(fit.problem.run(t.system, theta) for t in fit.trajectories)
    )


def seen_early(context: Context, run: int) -> Array:
    """What E_Y shows more (R,) where the place that it sees is warmer by a thirtieth of what the drive warms
    the motor: the exact answer of a first-order lag to a load that is held.
    """
    grid = context.baseline.trajectories[run].system.grid
    recording = context.campaign.recordings[grid.recording]
    slow = BODIES["motor"] / (SIZES["G_mt"] + SIZES["hA_m"])
    warm, late = np.zeros(len(recording.time)), PART * slow
    for k, step in enumerate(np.diff(recording.time)):
        heat = SIZES["loss"] * recording.values["P_drive"][k] * slow / BODIES["motor"]
        warm[k + 1] = heat + (warm[k] - heat) * np.exp(-step / late)
    return SEEN["E_Y"][0] * np.interp(grid.time[grid.read], recording.time, warm) / 30


@pytest.mark.parametrize(("factor", "least", "most"), [(1.0, 0.0, 0.02), (1000.0, 0.1, 1.0)])
def test_form_errors_are_those_where_the_fit_is(factor: float, least: float, most: float) -> None:
    """A fit without an effect may link two bodies a thousand times as well as they are. What a place of one
    of them shows is then no form error, and a path of its own from the drive to E_Y stood for it.
    """
    fit = moved(wetted().fit, "G_mt", factor)
    context = with_noise_of(dry(), fit)
    assert (context.formed is fit) == (factor > 4)  # the parts of time constants that form errors know
    assert context.form_of([]) is dry().form  # the model as it is has a share of its own flows
    laws, places, *_ = context.form.kinds
    form = context.form.columns
    early = [np.zeros(f.shape[:2]) for f in form]
    for k, column in enumerate(early):
        column[:, list(SEEN).index("E_Y")] = seen_early(context, k)
    wanted = np.concatenate([c.ravel() for c in early]) / NOISE
    forms = np.concatenate([f[:, :, laws : laws + places].reshape(-1, places) for f in form]) / NOISE
    # form errors of places with a spread of a tenth, next to what is read
    e = np.linalg.solve(forms.T @ forms + np.eye(places) / 0.1**2, forms.T @ wanted)
    left = np.sum((wanted - forms @ e) ** 2) + np.sum(e**2) / 0.1**2
    assert least <= left / np.sum(wanted**2) <= most
