"""Form error that depends on the operating point: no law of a lumped model is exactly that of nature.

    q_k (1 + sum_m e_km psi_m),   e_km ~ N(0, share^2)

for each flow of the model, and in the same way for each output. psi_m are the inputs, the body and the
recording, each minus its mean and divided by its spread, scaled so that the total error of a flow is the
share. The bodies of a lumped model also have no sharp edges, and are not equally warm everywhere: a share of
each flow enters a neighbour of its body, the inside of a body follows its surface, and the place that an
output sees answers to the flow before the whole body does, by a third of its Biot number (a plate that is
heated on one side; Incropera, DeWitt, ch. 5: a body is one mass up to a Biot number of 0.1). The shares are
unknown and grow together from an exact model to a coarse one. The part of the form error that changes with
time is process noise (`process_noise.py`). This part does not average out over a long recording (Kennedy &
O'Hagan, J. R. Stat. Soc. B 63, 2001).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from discovery.dynamics import Column, Trajectory, predict, sensitivities
from discovery.dynamics.prediction import output_matrix
from discovery.dynamics.sensitivity import moved_terms
from discovery.effects.hypothesis import Hypothesis
from discovery.evidence.signatures import signatures
from discovery.fitting import Fit
from discovery.terms import Apply, Expression, Name, Number, Term, evaluate, names

Array = NDArray[np.float64]

LAWS, PLACES = 36, 36  # directions in the readings in which form errors of laws and of places are kept
DEPTH = 1 / 3  # of its Biot number: share of its rise by which a plate is warmer where it is heated
INNER = (0.05, 0.2)  # of the time constant of a body: how fast its inside, and the place that is seen, follow


def model_form(
    fit: Fit, white: Array, sensors: Sequence[str], air: Sequence[str]
) -> tuple[list[Array], tuple[int, int, int, int]]:
    """By recording, what the readings (R, Y, M) show more for form errors of the whole model of a share of
    one: the directions, each as likely as any other (unit normal), that hold nearly all of what the
    parameters of the fit do not absorb. After them, what they show more for each sensor whose zero is off by
    one in all recordings, and for each body whose air is warmer by one than what is measured. The numbers of
    those that are laws, places, zeros, and airs.

    Args:
        white: (Y,) reading noise, in which directions are compared.
        sensors: channels that the model uses or shows.
        air: ambient temperatures.
    """
    runs = fit.trajectories
    own = _stacked(runs, [fit.problem.jacobian(t) for t in runs], white)
    basis = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))[0]
    kept = [
        _directions(columns, _stacked(runs, columns, white), basis, most)
        for columns, most in ((_laws(runs), LAWS), ([place_columns(run) for run in runs], PLACES))
    ]
    kept.append([sensitivities(run, sensors) for run in runs])
    kept.append([air_columns(run, air) for run in runs])
    laws, places, zeros, airs = (columns[0].shape[2] for columns in kept)
    return [np.concatenate(one, axis=2) for one in zip(*kept, strict=True)], (laws, places, zeros, airs)


def _laws(runs: Sequence[Trajectory]) -> list[Array]:
    scales = scales_of(runs)
    return [law_columns(run, scales, k, len(runs)) for k, run in enumerate(runs)]


def law_columns(
    run: Trajectory,
    scales: Mapping[str, tuple[float, float]],
    index: int = 0,
    count: int = 1,
    flows: Sequence[Term] | None = None,
) -> Array:
    """What the readings show more (R, Y, M) where each flow, and each output, is off by its own size times
    each psi.

    Args:
        scales: as of `scales_of`.
        index: which of `count` recordings it is; with one, no psi distinguishes recordings.
        flows: of the model; default all.
    """
    pieces: list[Column] = []
    owners = 0
    for term in _flows(run) if flows is None else flows:
        points = _points(run, scales, term.into, index, count)
        pieces += _pieces(run, term, points, owners)
        owners += len(points)
    seen = sensitivities(run, (), (), pieces, count=owners)
    return np.concatenate([seen, _levers(run, scales, index, count)], axis=2)


def place_columns(run: Trajectory) -> Array:
    """What the readings show more (R, Y, M) where a flow does not act in a whole body: it enters a neighbour,
    the inside of the body follows late, or the place that an output sees answers first.
    """
    return np.concatenate([edge_columns(run), inside_columns(run), inner_columns(run)], axis=2)


def air_columns(run: Trajectory, air: Sequence[str]) -> Array:
    """What the readings show more (R, Y, M) where the air at a body is warmer by one, all the time, than an
    ambient temperature of the model: a hall is warmer under its roof, a corner next to a motor.
    """
    moved = moved_terms(run, [name for name in air if name in run.system.grid.samples])
    owners = {key: k for k, key in enumerate(dict.fromkeys((c.owner, c.into) for c in moved))}
    pieces = [replace(c, owner=owners[c.owner, c.into]) for c in moved]
    return sensitivities(run, (), (), pieces, count=len(owners))


def inside_columns(run: Trajectory) -> Array:
    """What the readings show more (R, Y, M) where the inside of a body follows its surface: the mean of the
    body comes late by a third of its Biot number (of one) times its time constant, as with a mass C_m behind
    the surface that follows within a part t_m of that time constant, C_m t_m = C t / 3:

        q = C_m/t_m (lag(body, t_m) - body)
    """
    system, slow = run.system, _losses(run)
    pieces: list[Column] = []
    for i, name in enumerate(system.states):
        if system.model.states[name].memory:
            continue
        for part in INNER:
            behind = _late(run, Name(name), part / slow[i]) - run.at_ends()[name]
            flow = DEPTH * slow[i] / (part**2 * system.scale[i]) * behind
            pieces.append(Column(len(pieces), name, flow))
    return sensitivities(run, (), (), pieces, count=len(pieces))


def inner_columns(run: Trajectory) -> Array:
    """What the readings show more (R, Y, M) where the place that an output sees answers to each flow before
    its body does: by a third of the rise that the flow makes in the body (a Biot number of one), within a
    part of the time constant of the body.
    """
    system, slow = run.system, _losses(run)
    grid, nodes = system.grid, system.grid.looked_at
    levers = output_matrix(run, nodes)
    first = np.minimum(2 * nodes, 2 * len(grid.step) - 1)
    found = [np.zeros((len(nodes), len(grid.outputs), 0))]
    for term in _flows(run):
        for name, sign in ((term.into, 1.0), (term.source, -1.0)):
            if name is None:
                continue
            i = system.states.index(name)
            for part in INNER:
                late = _late(run, term.expression, part / slow[i])
                rise = sign * DEPTH * system.scale[i] / slow[i] * late
                seen = levers[:, :, i] * rise[first, None]
                found += [_only(seen, y) for y in _outputs_of(run, name)]
    return grid.at_readings(np.concatenate(found, axis=2))


def _losses(run: Trajectory) -> Array:
    """Rates (S,) at which the bodies lose what they hold, 1/s: at least one over the recording."""
    grid = run.system.grid
    losses = -np.median(np.diagonal(run.a, axis1=1, axis2=2), axis=0)  # 1 / time constant
    return np.maximum(losses, 1.0 / float(grid.time[-1] - grid.time[0]))


def are_others(ones: Sequence[Trajectory], others: Sequence[Trajectory]) -> bool:
    """Whether bodies of some runs are others in runs of another fit, so that form errors are, too: a time
    constant differs by more than those of `INNER` next to each other, which span what lies between.

    Args:
        others: of the same recordings; their model may have more states.
    """
    for one, other in zip(ones, others, strict=True):
        before, after = (dict(zip(run.system.states, _losses(run), strict=True)) for run in (one, other))
        ratios = [after[name] / before[name] for name in before if name in after]
        if max(abs(np.log(ratios))) > np.log(INNER[1] / INNER[0]):
            return True
    return False


def _late(run: Trajectory, expression: Expression, seconds: float) -> Array:
    """An expression that comes late by a first-order lag, at the interval ends (2K,)."""
    lag = Apply("lag", (expression, Number(seconds)))
    series = np.asarray(evaluate(lag, run.at_ends(), memory=run.system.ends).value, dtype=float)
    return np.broadcast_to(series, (2 * len(run.system.grid.step),))


def _outputs_of(run: Trajectory, state: str) -> list[int]:
    """Indices of the outputs that a state is a part of. A state that nothing shows but its own sensor is the
    place that the sensor sees, and not the mean of a body.
    """
    shown = run.system.model.outputs
    found = [y for y, n in enumerate(run.system.grid.outputs) if n in shown and state in names(shown[n])]
    others = [y for y in found if shown[run.system.grid.outputs[y]] != Name(state)]
    return found if others else []


def _only(seen: Array, y: int) -> Array:
    """One output of several, (R, Y) as (R, Y, 1)."""
    out = np.zeros((*seen.shape, 1))
    out[:, y, 0] = seen[:, y]
    return out


def edge_columns(run: Trajectory, flows: Sequence[Term] | None = None) -> Array:
    """What the readings show more (R, Y, M) where each flow enters each neighbour of its body in place of the
    body. `flows`: of the model; default all.
    """
    flows = _flows(run) if flows is None else flows
    pieces: list[Column] = []
    for term in flows:
        pieces += _beyond(run, term, flows, len(pieces))
    return sensitivities(run, (), (), pieces, count=len(pieces))


def _flows(run: Trajectory) -> list[Term]:
    return [t for t in run.system.model.terms if not run.system.model.states[t.into].memory]


def _directions(columns: Sequence[Array], seen: Array, basis: Array, most: int) -> list[Array]:
    """The few combinations of columns that explain most of a basis (N, U) outside of `seen` (N, M)."""
    left = seen - basis @ (basis.T @ seen)
    size, axes = np.linalg.eigh(left.T @ left)
    kept = axes[:, np.argsort(-size)[:most]]
    return [c @ kept for c in columns]


def _stacked(trajectories: Sequence[Trajectory], columns: Sequence[Array], white: Array) -> Array:
    """Columns (R, Y, M) by recording over the reading noise, what is not measured zero, as (N, M)."""
    measured = [t.system.grid.measured[:, :, None] for t in trajectories]
    parts = [np.where(m, c / white[None, :, None], 0.0) for m, c in zip(measured, columns, strict=True)]
    return np.concatenate([p.reshape(p.shape[0] * p.shape[1], p.shape[2]) for p in parts])


def effect_form(trajectories: Sequence[Trajectory], hypotheses: Sequence[Hypothesis]) -> list[Array]:
    """By recording, what the readings (R, Y, M) show more where each effect is off by its own size, once for
    each psi: its flow, or what it adds to the outputs; and where a sensor is not quite what an effect without
    a size makes of it.
    """
    scales = scales_of(trajectories)
    lasting = [h for h in hypotheses if h.effect.is_law]
    paths = [h for h in lasting if h.shown and h.effect.amplitude.fixed is None]
    lasting = [h for h in lasting if h.terms]
    sensors = [h for h in hypotheses if h.shown and not h.recording and h.effect.amplitude.fixed is not None]
    found = []
    for k, run in enumerate(trajectories):
        pieces, count = [], 0
        for h in lasting:
            points = _points(run, scales, h.states[0] if h.states else "", k, len(trajectories))
            for term in h.terms:
                pieces += _pieces(run, term, points, count)
            count += len(points)
        flows = sensitivities(run, (), (), pieces, count=count)
        shown = [_shown_beyond(run, h, scales, k, len(trajectories)) for h in paths]
        found.append(np.concatenate([flows, *shown, signatures(run, sensors)], axis=2))
    return found


def _shown_beyond(
    run: Trajectory, h: Hypothesis, scales: Mapping[str, tuple[float, float]], index: int, count: int
) -> Array:
    """What an effect adds to the outputs, times each psi, (R, Y, M)."""
    env, read = run.at_ends(), run.system.grid.read
    sizes = {n: float(np.ravel(env[n])[0]) for n in (*h.amplitudes, *h.shapes)}
    here = replace(h, shapes={n: sizes[n] for n in h.shapes})
    added = signatures(run, [here]) @ np.array([sizes[n] for n in h.amplitudes])
    points = _points(run, scales, h.states[0] if h.states else "", index, count)
    at_readings = [p[np.minimum(2 * read, len(p) - 1), None, None] for p in points]
    none = np.zeros((*added.shape, 0))  # where no input and no state moves
    return np.concatenate([none, *(added[:, :, None] * p for p in at_readings)], axis=2)


def _pieces(run: Trajectory, term: Term, points: Sequence[Array], first: int) -> list[Column]:
    """A flow times each psi, owners counted from `first`."""
    flow = np.asarray(evaluate(term.expression, run.at_ends(), memory=run.system.ends).value)
    return [Column(first + m, term.into, flow * point, term.source) for m, point in enumerate(points)]


def _beyond(run: Trajectory, term: Term, flows: Sequence[Term], first: int) -> list[Column]:
    """A flow that enters each neighbour of its body in place of the body; `flows` link the bodies."""
    links = {(t.into, t.source) for t in flows if t.source}
    near = {a if b == term.into else b for a, b in links if term.into in (a, b)}
    flow = np.asarray(evaluate(term.expression, run.at_ends(), memory=run.system.ends).value)
    others = [n for n in run.system.states if n in near and n != term.source]
    return [Column(first + k, name, flow, term.into) for k, name in enumerate(others)]


def _levers(run: Trajectory, scales: Mapping[str, tuple[float, float]], index: int, count: int) -> Array:
    """Change of the readings (R, Y, M) if the gain of each output is wrong by a share."""
    shown, read = predict(run), run.system.grid.read
    shown = shown - shown[:1]
    points = [p[np.minimum(2 * read, len(p) - 1)] for p in _points(run, scales, "", index, count)]
    out = np.zeros((*shown.shape, shown.shape[1] * len(points)))
    for y in range(shown.shape[1]):
        for m, point in enumerate(points):
            out[:, y, y * len(points) + m] = shown[:, y] * point
    return out


def scales_of(trajectories: Sequence[Trajectory]) -> dict[str, tuple[float, float]]:
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
