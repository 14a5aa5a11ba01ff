"""Signatures: the change of the readings for a unit of an effect, through the dynamics of the model."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.effects.hypothesis import Hypothesis
from discovery.terms import Expression, evaluate, names

Array = NDArray[np.float64]


def signatures(trajectory: Trajectory, hypotheses: Sequence[Hypothesis]) -> Array:
    """dy/d(amplitude) at the reading instants, (R, Y, A), A amplitudes in the order of the hypotheses.

    To first order in the amplitude: bodies answer through the model's own dynamics, memories (lag, delay,
    play) are taken along the present trajectory. What does not act in this recording is zero.
    """
    system = trajectory.system
    run = system.grid.recording
    total = sum(len(h.amplitudes) for h in hypotheses)
    ends = trajectory.at_ends()
    first = np.minimum(
        2 * system.grid.read, 2 * len(system.grid.step) - 1
    )  # of the step that a reading begins
    columns: list[Column] = []
    direct: list[tuple[int, int, Array]] = []
    owner = 0
    for h in hypotheses:
        if not h.acts_in(run):
            owner += len(h.amplitudes)
            continue
        values = h.values(run)
        for term in h.terms:
            series = evaluate(term.expression, {**ends, **values}, memory=system.ends).value
            mine = owner
            if len(h.amplitudes) > 1:
                used = names(term.expression)
                mine += next((k for k, name in enumerate(h.amplitudes) if name in used), 0)
            columns.append(Column(mine, term.into, np.asarray(series, dtype=float), term.source))
        if h.shown:
            for k, (name, expression) in enumerate(h.shows(system.model).items()):
                column = owner + (k if len(h.amplitudes) > 1 else 0)
                # along the ends of the steps: what is held is held there, also for a memory of it
                series = evaluate(expression, {**ends, **values}, memory=system.ends).value
                whole = np.broadcast_to(np.asarray(series, dtype=float), (2 * len(system.grid.step),))
                direct.append((column, system.grid.outputs.index(name), whole[first]))
        owner += len(h.amplitudes)
    out = sensitivities(trajectory, (), (), columns, count=total)
    for column, y, series in direct:
        out[:, y, column] += series
    return out


def heat_rms(trajectory: Trajectory, expression: Expression) -> float:
    """Root mean square over time of a heat flow (or rate) along a trajectory."""
    series = evaluate(expression, trajectory.at_ends(), memory=trajectory.system.ends).value
    return float(np.sqrt(np.mean(np.square(series))))
