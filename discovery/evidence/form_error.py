"""Form error that stays with the operating point: no law of a lumped model is quite that of nature.

    q_k (1 + sum_m e_km psi_m),   e_km ~ N(0, share^2)

for each flow of the model, and likewise for what each output shows. psi_m are the inputs, the body and the
recording, each less its mean and over its spread, scaled so that a flow is off by the share in all. The part of form error that wanders with time is process noise
(`process_noise.py`); this one does not average out over a long recording (Kennedy & O'Hagan, J. R. Stat. Soc. B
63, 2001).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, sensitivities
from discovery.dynamics.system import predict
from discovery.effects.hypothesis import Hypothesis
from discovery.terms import Term, evaluate

Array = NDArray[np.float64]

RANK = 24  # directions in the readings that the form error of a whole model is kept in


def model_form(trajectories: Sequence[Trajectory], white: Array) -> list[Array]:
    """By recording, what the readings (R, Y, M) show more for form errors of the whole model of a share of
    one: the few directions that hold nearly all of it, each as likely as any other (unit normal).

    Args:
        white: (Y,) reading noise, in which directions are compared.
    """
    scales = _scales(trajectories)
    columns = []
    for k, run in enumerate(trajectories):
        system, pieces = run.system, []
        count = 0
        for term in (t for t in system.model.terms if not system.model.states[t.into].memory):
            points = _points(run, scales, term.into, k, len(trajectories))
            pieces += _pieces(run, term, points, count)
            count += len(points)
        flows = sensitivities(run, (), (), pieces, count=count)
        columns.append(np.concatenate([flows, _levers(run, scales, k, len(trajectories))], axis=2))
    rows = [
        np.where(t.system.grid.measured[:, :, None], c, 0.0)
        for t, c in zip(trajectories, columns, strict=True)
    ]
    stacked = np.concatenate([(c / white[None, :, None]).reshape(-1, c.shape[2]) for c in rows])
    size, axes = np.linalg.eigh(stacked.T @ stacked)
    kept = axes[:, np.argsort(-size)[:RANK]]
    return [c @ kept for c in columns]


def effect_form(trajectories: Sequence[Trajectory], hypotheses: Sequence[Hypothesis]) -> list[Array]:
    """By recording, what the readings (R, Y, M) show more where the flow of each effect is off by its own
    size, once for each psi.
    """
    scales = _scales(trajectories)
    lasting = [h for h in hypotheses if h.terms and not h.effect.is_event and h.effect.is_physics]
    found = []
    for k, run in enumerate(trajectories):
        pieces, count = [], 0
        for h in lasting:
            points = _points(run, scales, h.states[0] if h.states else "", k, len(trajectories))
            for term in h.terms:
                pieces += _pieces(run, term, points, count)
            count += len(points)
        found.append(sensitivities(run, (), (), pieces, count=count))
    return found


def _pieces(run: Trajectory, term: Term, points: Sequence[Array], first: int) -> list[Column]:
    """A flow times each psi, owners counted from `first`."""
    flow = np.asarray(evaluate(term.expression, run.at_ends(), memory=run.system.ends).value)
    return [Column(first + m, term.into, flow * point, term.source) for m, point in enumerate(points)]


def _levers(run: Trajectory, scales: Mapping[str, tuple[float, float]], index: int, count: int) -> Array:
    """What each output shows more (R, Y, M) where it is off by a share of its change since the start."""
    shown, read = predict(run), run.system.grid.read
    shown = shown - shown[:1]
    points = [p[np.minimum(2 * read, len(p) - 1)] for p in _points(run, scales, "", index, count)]
    out = np.zeros((*shown.shape, shown.shape[1] * len(points)))
    for y in range(shown.shape[1]):
        for m, point in enumerate(points):
            out[:, y, y * len(points) + m] = shown[:, y] * point
    return out


def _scales(trajectories: Sequence[Trajectory]) -> dict[str, tuple[float, float]]:
    """Mean and spread of each series that moves, inputs and states, over all recordings."""
    found = {}
    for name in (*trajectories[0].system.grid.samples, *trajectories[0].system.states):
        series = np.concatenate([np.ravel(t.at_ends()[name]) for t in trajectories])
        if np.ptp(series) > 1e-9 * (1.0 + np.abs(series).max()):
            found[name] = (float(series.mean()), float(series.std()))
    return found


def _points(
    run: Trajectory, scales: Mapping[str, tuple[float, float]], body: str, index: int, count: int
) -> list[Array]:
    """psi_m (2K,) along a recording: inputs, the body, and which of `count` recordings it is; their squares
    add up to about one.
    """
    env = run.at_ends()
    names = [n for n in scales if n == body or n in run.system.grid.samples]
    found = [(np.asarray(env[n]) - scales[n][0]) / scales[n][1] for n in names]
    size = 2 * len(run.system.grid.step)
    which = [np.full(size, float(index == k) - 1.0 / count) for k in range(count if count > 1 else 0)]
    every = [*found, *which]
    return [one / np.sqrt(len(every)) for one in every]
