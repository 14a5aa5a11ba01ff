"""What few new readings say of the model at work on an ageing machine.

Three hypotheses for what the new readings leave:

* noise: parameters that follow the machine explain them no better than those at work;
* drift: they do, by more than chance, over all recordings since the last revision. The belief about the
  parameters is recursive: what was known, forgotten a little with each recording, is the prior of the next
  (Kalman filter of parameters on a random walk, Ljung, System Identification, chapter 11; with bounds);
* a new effect: even then the residual stays larger than it was when the model was fitted. The mismatch
  method is asked.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.document import Exported
from discovery.export.knowledge import stretch
from discovery.fitting.covariance import Z95
from discovery.fitting.problem import make_problem
from discovery.models import Model
from discovery.recordings import Campaign
from discovery.runtime.leastsquares import minimise

Array = NDArray[np.float64]
Verdict = Literal["noise", "drift", "new effect"]

WALK = 0.03  # of a parameter from one recording to the next, relative: how fast a machine may age
SIGNIFICANT = 0.05  # chance of calling noise a drift; a shadow run stands before every change
AS_NEW = 1.1  # residual, as a multiple of that of the fit, below which there is nothing to gain
EXCESS = 1.6  # residual after the update, as a multiple of that of the fit, from which an effect is new
WIDEST = 3.0  # prior standard deviations never grow beyond this multiple of the first fit's
SURPRISE = 2.0  # prior standard deviations that a parameter moves, from which its prior was too narrow


@dataclass(frozen=True)
class Belief:
    """What is known of the parameters: values in `model`, covariance (P, P) of those named; and what speaks
    against the model `at_work` since its revision: `gain` in squared residuals for `effective` parameters."""

    model: Model
    at_work: Model
    parameters: tuple[str, ...]
    covariance: Array
    first: Array  # (P,) standard deviations at the first fit
    slow_share: float  # of the variance of the fit's residual
    gain: float = 0.0
    effective: float = 0.0


@dataclass(frozen=True)
class Finding:
    """What one recording of new readings said. rms in units of the residual that the fit left (1: as good as
    new).
    """

    recording: str
    verdict: Verdict
    readings: int
    before: float
    after: float
    p_value: float
    moved: Mapping[str, tuple[float, float]]  # parameter: from, to

    def __str__(self) -> str:
        if self.verdict == "noise" and self.p_value < SIGNIFICANT:
            text = f"{self.recording}: noise (residual {self.before:.2f} of the fit's, {self.readings} "
            text += "readings: as good as new, whatever all recordings so far say of its parameters, "
            return f"{text}p = {self.p_value:.2g})"
        text = f"{self.recording}: {self.verdict} (p = {self.p_value:.2g}, {self.readings} readings, "
        text += f"residual {self.before:.2f}{f' -> {self.after:.2f}' if self.moved else ''} of the fit's)"
        moved = ", ".join(f"{name} {old:.4g} -> {new:.4g}" for name, (old, new) in self.moved.items())
        return f"{text}; {moved}" if moved else text


def belief_of(exported: Exported) -> Belief:
    """What an exported model says of its parameters.

    Raises:
        UserError: a model without knowledge of its parameters.
    """
    found = exported.document["knowledge"]
    if not found["parameters"]:
        raise UserError(
            f"model '{exported.model.name}' does not say how well its parameters are known; "
            "export it again from its run"
        )
    covariance = np.array(found["covariance"])
    model = exported.model
    return Belief(
        model, model, tuple(found["parameters"]), covariance, np.array(found["first"]), found["slow_share"]
    )


def residual_levels(exported: Exported) -> dict[str, float]:
    """Residual of the fit by output, where it is known."""
    return {n: r for n, r in exported.document["knowledge"]["residual"].items() if r is not None}


def update_belief(
    belief: Belief, levels: Mapping[str, float], campaign: Campaign, recording: str
) -> tuple[Belief, Finding]:
    """Take in the readings of one recording.

    Args:
        levels: residual of the fit by output: the noise of a reading, model errors of everyday included.

    Raises:
        UserError: no reading of any output.
    """
    data = campaign.recordings[recording]
    outputs = [n for n in levels if n in data.values and np.isfinite(data.values[n]).any()]
    if not outputs:
        raise UserError(
            f"{campaign.path}: recording '{recording}' holds no reading of {', '.join(levels)}; "
            "there is nothing to learn from"
        )
    problem = make_problem(belief.model, campaign, [recording], outputs)
    now = make_problem(belief.at_work, campaign, [recording], outputs)
    prior = _prior(belief)
    known = [
        next(i for i, u in enumerate(problem.unknowns) if u.name == n and not u.is_start)
        for n in belief.parameters
    ]
    starts = [i for i, u in enumerate(problem.unknowns) if u.is_nuisance]
    grid = problem.systems[0].grid
    alike = stretch(belief.slow_share, grid.time[grid.read])
    weights = 1.0 / np.array([levels[n] for n in outputs]) / np.sqrt(alike)
    fixed = minimise(now, weights, starts, starts, np.zeros((0, 0)))
    freed = minimise(problem, weights, [*known, *starts], starts, prior)
    prior, surprised = _widened(belief, prior, freed.theta[known])
    if surprised:
        freed = minimise(problem, weights, [*known, *starts], starts, prior)
    from scipy.stats import chi2

    gain, effective = belief.gain + fixed.cost - freed.cost, belief.effective + freed.effective
    p_value = float(chi2.sf(max(gain, 0.0), max(effective, 1.0)))
    count = int(np.isfinite(grid.readings).sum())
    before, after = fixed.rms * np.sqrt(alike), freed.rms * np.sqrt(alike)
    if after > EXCESS and count / alike >= 8:  # nothing is learnt from what the model cannot explain
        return replace(belief, covariance=prior), Finding(
            recording, "new effect", count, before, after, p_value, {}
        )
    sd = np.sqrt(np.maximum(np.diag(freed.covariance), 0.0))
    values = freed.theta[known]
    moved = {}
    for k, name in enumerate(belief.parameters):
        old = belief.at_work.parameters[name].value
        if abs(values[k] - old) > 0.25 * belief.first[k]:
            moved[name] = (old, float(values[k]))
    verdict: Verdict = "drift" if p_value < SIGNIFICANT and before > AS_NEW else "noise"
    learnt = replace(
        belief,
        model=_with(belief.model, belief.parameters, values, sd),
        covariance=freed.covariance,
        gain=gain,
        effective=effective,
    )
    return learnt, Finding(
        recording, verdict, count, before, after, p_value, moved if verdict == "drift" else {}
    )


def _prior(belief: Belief) -> Array:
    """Covariance before a recording: what was known, a random walk added, never wider than a multiple of the
    first fit's.
    """
    walk = [WALK * abs(belief.model.parameters[name].value) for name in belief.parameters]
    wider = belief.covariance + np.diag(np.square(walk))
    sd = np.sqrt(np.maximum(np.diag(wider), 1e-300))
    shrink = np.minimum(1.0, WIDEST * belief.first / sd)
    return np.asarray(wider * np.outer(shrink, shrink))


def _widened(belief: Belief, prior: Array, values: Array) -> tuple[Array, bool]:
    """A prior that allows a full step of the walk to what has left it, and whether anything has.

    What the first fit knew well may not stay so: a prior that forbids the machine to age would pull the
    estimate back, and its interval would miss the truth.
    """
    old = np.array([belief.model.parameters[name].value for name in belief.parameters])
    sd = np.sqrt(np.maximum(np.diag(prior), 1e-300))
    wider = np.where(np.abs(values - old) > SURPRISE * sd, np.maximum(1.0, WALK * np.abs(old) / sd), 1.0)
    return np.asarray(prior * np.outer(wider, wider)), bool(np.any(wider > 1.0))


def _with(model: Model, names: Sequence[str], values: Array, sd: Array) -> Model:
    parameters = dict(model.parameters)
    for name, value, s in zip(names, values.tolist(), sd.tolist(), strict=True):
        p = parameters[name]
        parameters[name] = replace(
            p, value=value, low=max(value - Z95 * s, p.min), high=min(value + Z95 * s, p.max)
        )
    return replace(model, parameters=parameters)
