"""Jumps of a sensor between two readings, which no flow makes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discovery.diagnosis import thresholds
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.signatures import signatures
from discovery.fitting.kalman import innovations
from discovery.recordings.standing import stood_before


def is_abrupt(answer: Scored, h: Hypothesis) -> bool:
    """Whether a fault is a jump that can be recognised however wrong the flows of the model are: with flows
    that are wrong by as much as any model's, the readings at which it comes make it more likely than not.

    What the worst other reading misses counts against it: such readings come by themselves. A sensor that
    hangs jumps when it shows its body again. Where two sensors jump in the same block of time, one cause
    moves both, and it is no fault of either.
    """
    if not _is_jump(h) or h.recording is None or any(comes_with(answer, h, o) for o in answer.hypotheses):
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
    if any(stood_before(grid.readings[:, y], r) for r, y in zip(first, moved, strict=True)):
        return False
    there = float(np.sum(gain[first, moved]) - 0.5 * left[:, moved].max(initial=0.0))
    return there + h.log_odds + h.log_weight > 0.0


def _is_jump(h: Hypothesis) -> bool:
    return h.effect.search == "step" and not h.effect.is_physics


def comes_with(answer: Scored, h: Hypothesis, other: Hypothesis) -> bool:
    """Whether another sensor jumps in the block of time in which one does."""
    if other.key == h.key or not _is_jump(other) or other.recording != h.recording:
        return False
    times = [min(answer.model.parameters[name].value for name in one.shapes) for one in (h, other)]
    grid = next(t.system.grid for t in answer.fit.trajectories if t.system.grid.recording == h.recording)
    block = float(grid.time[-1] - grid.time[0]) / answer.seen.blocks
    return set(h.shown).isdisjoint(other.shown) and abs(times[0] - times[1]) < block
