"""Signatures: the change of the readings for a unit of an effect, through the dynamics of the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model
from discovery.terms import Expression, Program, Term, evaluate, names, program_of

Array = NDArray[np.float64]


def signatures(trajectory: Trajectory, hypotheses: Sequence[Hypothesis]) -> Array:
    """dy/d(amplitude) at the reading instants, (R, Y, A), A amplitudes in the order of the hypotheses.

    To first order in the amplitude: bodies answer through the model's own dynamics, memories (lag, delay,
    play) are taken along the present trajectory. What does not act in this recording is zero.
    """
    return Claims.of(hypotheses, trajectory.system.model).signatures(trajectory)


@dataclass(frozen=True)
class Claims:
    """Hypotheses for several recordings: what they add to states and outputs, computed together. Effects at
    several places, or with several shapes, have much in common.
    """

    count: int  # of amplitudes
    terms: tuple[tuple[Hypothesis, int, Term], ...]  # amplitude whose they are
    shown: tuple[tuple[Hypothesis, int, str], ...]  # amplitude and output
    program: Program  # series of the terms, then of what is shown

    @staticmethod
    def of(hypotheses: Sequence[Hypothesis], model: Model) -> Claims:
        """The claims for a model."""
        terms, shown, series, changes, owner = [], [], [], [], 0
        for h in hypotheses:
            numbers = h.values(h.acting[0] if h.acting else "")
            own, several = range(owner, owner + len(h.amplitudes)), len(h.amplitudes) > 1
            for term in h.terms:
                used = names(term.expression) if several else frozenset()
                mine = next((k for k, name in zip(own, h.amplitudes, strict=True) if name in used), owner)
                terms.append((h, mine, term))
                series.append((term.expression, numbers))
            for k, (name, change) in enumerate(h.shows(model).items() if h.shown else ()):
                shown.append((h, owner + k if several else owner, name))
                changes.append((change, numbers))
            owner = own.stop
        return Claims(owner, tuple(terms), tuple(shown), program_of([*series, *changes]))

    def signatures(self, trajectory: Trajectory) -> Array:
        """As the function of that name."""
        entering, showing = self.along(trajectory)
        out = sensitivities(trajectory, (), (), entering, count=self.count)
        for mine, y, series in showing:
            out[:, y, mine] += series
        for mine, y, shift in self._zeros(trajectory, showing):
            begun = sensitivities(trajectory, (trajectory.system.grid.outputs[y],))[:, :, 0]
            begun[:, y] -= 1.0
            out[:, :, mine] += shift * begun
        return out

    def _zeros(
        self, trajectory: Trajectory, showing: Sequence[tuple[int, int, Array]]
    ) -> list[tuple[int, int, float]]:
        """Amplitude, output, and by how much its first reading is off: a body that starts at what was read
        starts by as much lower.
        """
        grid = trajectory.system.grid
        off = {(mine, grid.outputs.index(y)) for h, mine, y in self.shown if h.shifts_the_zero}
        return [(mine, y, float(s[0])) for mine, y, s in showing if (mine, y) in off and len(s) and s[0]]

    def along(self, trajectory: Trajectory) -> tuple[list[Column], list[tuple[int, int, Array]]]:
        """What enters states along a trajectory, and amplitude, output and series (R,) of what is shown."""
        system = trajectory.system
        run, steps = system.grid.recording, len(system.grid.step)
        found = [one.value for one in self.program.run(trajectory.at_ends(), system.ends)]
        entering = [
            Column(mine, term.into, h.share(run) * np.asarray(series), term.source)
            for (h, mine, term), series in zip(self.terms, found, strict=False)
            if h.acts_in(run)
        ]
        # along the ends of the steps: what is held is held there, also for a memory of it
        first = np.minimum(2 * system.grid.read, 2 * steps - 1)  # of the step that a reading begins
        showing = [
            (
                mine,
                system.grid.outputs.index(name),
                h.share(run) * np.broadcast_to(series, (2 * steps,))[first],
            )
            for (h, mine, name), series in zip(self.shown, found[len(self.terms) :], strict=True)
            if h.acts_in(run)
        ]
        return entering, showing


def heat_rms(trajectory: Trajectory, expression: Expression) -> float:
    """Root mean square over time of a heat flow (or rate) along a trajectory."""
    series = evaluate(expression, trajectory.at_ends(), memory=trajectory.system.ends).value
    return float(np.sqrt(np.mean(np.square(series))))
