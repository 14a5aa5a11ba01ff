"""Jumps of a sensor between two readings, which no flow makes."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.signatures import signatures
from discovery.fitting.kalman import innovations

Array = NDArray[np.float64]


def is_abrupt(answer: Scored, h: Hypothesis) -> bool:
    """Whether a fault is a jump that can be recognised however wrong the flows of the model are: with flows
    that are wrong by as much as any model's, the readings at which it comes make it more likely than not.

    What the worst other reading misses counts against it: such readings come by themselves. A sensor that
    hangs jumps when it shows its body again.
    """
    if h.effect.search != "step" or h.effect.is_physics or h.recording is None:
        return False
    parameters = answer.model.parameters
    shapes = {name: parameters[name].value for name in h.shapes}
    amounts = np.array([parameters[name].value for name in h.amplitudes])
    k = next(k for k, t in enumerate(answer.fit.trajectories) if t.system.grid.recording == h.recording)
    run, residual = answer.fit.trajectories[k], answer.seen.residuals[k]
    shown = signatures(run, [replace(h, shapes=shapes)]) @ amounts
    wrong = replace(answer.noise, share=max(thresholds.SHARES), force=None)
    left = np.nan_to_num(innovations(run, wrong, residual) ** 2)
    gain = 0.5 * (np.nan_to_num(innovations(run, wrong, residual + shown) ** 2) - left)
    grid = run.system.grid
    after = grid.measured & (grid.time[grid.read] >= min(shapes.values()))[:, None]
    moved = np.flatnonzero(after.any(axis=0) & shown.any(axis=0))
    first = after.argmax(axis=0)[moved]
    if any(_hung(grid.readings[:, y], r) for r, y in zip(first, moved, strict=True)):
        return False
    there = float(np.sum(gain[first, moved]) - 0.5 * left[:, moved].max(initial=0.0))
    return there + h.log_odds + h.log_weight > 0.0


def _hung(readings: Array, at: int) -> bool:
    """Whether readings (R,) are equal for longer just before one of them than ever else."""
    seen = np.flatnonzero(np.isfinite(readings))
    shown, place = readings[seen], int(np.searchsorted(seen, at))
    ends = [0, *(1 + np.flatnonzero(np.diff(shown) != 0)).tolist(), len(shown)]
    runs = {end: end - start for start, end in pairwise(ends)}
    before = runs.pop(place, 0)
    return before > max(runs.values(), default=0)
