"""Reduction: a model with fewer states for a small controller, and what that costs.

Balanced truncation (Moore, IEEE Trans. Automatic Control 26, 1981): the directions of the state space are
ranked by how strongly the inputs, as large as they were recorded, excite them and how strongly the outputs
show them. The model is linearised at its mean for the ranking alone; what is projected on the best directions
are its own terms, so that gates, powers and delays stay.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from discovery.errors import UserError
from discovery.export.compiled import Compiled, compile_model
from discovery.export.makedocument import exportable
from discovery.export.ranges import sampled_inputs
from discovery.export.stepper import Stepper
from discovery.models import Model, State
from discovery.recordings import Campaign
from discovery.terms import Apply, Expression, Name, Number, Term, substitute

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Reduction:
    """A reduced model and its error against the full one over the recordings it was reduced with."""

    model: Model
    full_states: int
    largest_error: Mapping[str, float]  # by output, in its unit
    rms_error: Mapping[str, float]

    def note(self) -> dict[str, Any]:
        """For the provenance of the exported model."""
        return {
            "states": len(self.model.states),
            "of": self.full_states,
            "largest_error": dict(self.largest_error),
            "rms_error": dict(self.rms_error),
        }


def reduce_model(
    model: Model, campaign: Campaign, recordings: Sequence[str], states: int, step_s: float = 10.0
) -> Reduction:
    """The model with `states` states.

    Raises:
        UserError: not fewer states than before, or a reduced model that is not stable.
    """
    full = exportable(model, campaign)
    names = tuple(full.states)
    if not 1 <= states < len(names):
        raise UserError(
            f"model '{model.name}' has {len(names)} states and cannot be reduced to {states}; "
            f"give a number from 1 to {len(names) - 1}"
        )
    compiled = compile_model(full, step_s)
    inputs = {r: sampled_inputs(campaign, r, compiled.inputs, step_s) for r in recordings}
    truth = {r: _run(compiled, u) for r, u in inputs.items()}
    mean, right, left, _ = _directions(compiled, np.concatenate(list(inputs.values())), truth, states)
    reduced = _projected(full, mean, right, left)
    small = compile_model(reduced, step_s)
    errors = []
    for recording, u in inputs.items():
        y = _run(small, u)[1]
        if len(y) < len(u):
            raise UserError(
                f"model '{model.name}' with {states} states diverges; keep more of its {len(names)} states"
            )
        errors.append(np.abs(y - truth[recording][1]))
    worst = np.max(np.concatenate(errors), axis=0)
    rms = np.sqrt(np.mean(np.concatenate(errors) ** 2, axis=0))
    outputs = compiled.outputs
    return Reduction(
        reduced,
        len(names),
        dict(zip(outputs, worst.tolist(), strict=True)),
        dict(zip(outputs, rms.tolist(), strict=True)),
    )


def _run(compiled: Compiled, inputs: Array) -> tuple[Array, Array]:
    """Mean state (n,) and outputs (K, Y) of a free run."""
    stepper = Stepper(compiled)
    stepper.start(inputs[0])
    outputs, mean = [], np.zeros(len(compiled.states))
    for chunk in np.array_split(inputs, max(1, len(inputs) // 100)):
        outputs.append(stepper.run(chunk))
        mean += stepper.x * len(chunk) / len(inputs)
    return mean, np.concatenate(outputs)


def _directions(
    compiled: Compiled, inputs: Array, truth: Mapping[str, tuple[Array, Array]], states: int
) -> tuple[Array, Array, Array, Array]:
    """Mean state (n,), directions kept: right (n, r) and left (n, r), and all Hankel singular values (n,)."""
    from scipy.linalg import solve_continuous_lyapunov, svd

    mean = np.mean([x for x, _ in truth.values()], axis=0)
    a, b, c = _linearised(compiled, mean, inputs.mean(axis=0), inputs.std(axis=0))
    slowest = float(np.max(np.linalg.eigvals(a).real))
    a = a - max(0.0, slowest + 1e-7) * np.eye(len(a))  # an integrating state is ranked as a very slow one
    reach = _root(solve_continuous_lyapunov(a, -b @ b.T))
    seen = _root(solve_continuous_lyapunov(a.T, -c.T @ c))
    u, values, vh = svd(seen.T @ reach)
    scale = 1.0 / np.sqrt(np.maximum(values[:states], 1e-30))
    return mean, reach @ vh.T[:, :states] * scale, seen @ u[:, :states] * scale, values


def _root(gramian: NDArray[np.floating]) -> Array:
    values, vectors = np.linalg.eigh(0.5 * (gramian + gramian.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)), dtype=float)


def _linearised(compiled: Compiled, x: Array, u: Array, spread: Array) -> tuple[Array, Array, Array]:
    """A, B (columns scaled by the spread of the inputs) and C at a point, by central differences."""
    stepper = Stepper(compiled)
    stepper.start(u)

    def at(x: Array, u: Array) -> tuple[Array, Array]:
        stepper.x[:] = x
        stepper.delayed[:] = [u[delay.input] for delay in compiled.delays]
        return stepper.rates(u), stepper.outputs(u)

    def slopes(point: Array, sizes: Array, which: int) -> list[tuple[Array, Array]]:
        found = []
        for k, size in enumerate(sizes):
            step = np.zeros(len(point))
            step[k] = size
            ends = [at(*((point + s, u) if which == 0 else (x, point + s))) for s in (step, -step)]
            found.append(tuple((ends[0][i] - ends[1][i]) / (2 * max(size, 1e-12)) for i in (0, 1)))
        return found

    by_state = slopes(x, np.full(len(x), 1e-3), 0)
    by_input = slopes(u, np.maximum(1e-3 * spread, 1e-9), 1)
    a = np.column_stack([f for f, _ in by_state])
    b = (
        np.column_stack([f * s for (f, _), s in zip(by_input, spread, strict=True)])
        if len(u)
        else np.zeros((len(x), 1))
    )
    return a, b, np.column_stack([y for _, y in by_state])


def _projected(model: Model, mean: Array, right: Array, left: Array) -> Model:
    """x = mean + right z, z' = left^T x': the model's own terms on the directions kept."""
    names, count = list(model.states), right.shape[1]
    taken = set(names) | set(model.parameters) | set(model.inputs)
    prefix = "z_" if not any(name.startswith("z_") for name in taken) else "reduced_state_"
    own = [f"{prefix}{k + 1}" for k in range(count)]
    rebuilt: dict[str, Expression] = {}
    for j, name in enumerate(names):
        pieces: list[tuple[float, Expression]] = [(float(right[j, k]), Name(own[k])) for k in range(count)]
        rebuilt[name] = _sum(float(mean[j]), pieces)
    terms = []
    for term in model.terms:
        inside = substitute(term.expression, rebuilt)
        for k, state in enumerate(own):
            gain = left[names.index(term.into), k] * model.states[term.into].scale
            if term.source is not None:
                gain -= left[names.index(term.source), k] * model.states[term.source].scale
            if gain:
                terms.append(
                    Term(term.name, state, Apply("*", (Number(float(gain)), inside)), None, term.effect)
                )
    states = {}
    for k, state in enumerate(own):
        begin: list[tuple[float, Expression]] = []
        offset = 0.0
        for j, name in enumerate(names):
            start = model.states[name].start
            offset -= float(left[j, k] * mean[j])
            if isinstance(start, Number):
                offset += float(left[j, k]) * start.value
            elif start is not None:
                begin.append((float(left[j, k]), start))
        states[state] = State(state, "1", None, _sum(offset, begin), 0.0, 1.0)
    outputs = {name: substitute(expression, rebuilt) for name, expression in model.outputs.items()}
    return Model(model.name, model.parameters, states, tuple(terms), outputs)


def _sum(offset: float, pieces: Sequence[tuple[float, Expression]]) -> Expression:
    """Return offset + sum of gain times expression. Equal expressions are joined."""
    gains: dict[Expression, float] = {}
    for gain, expression in pieces:
        gains[expression] = gains.get(expression, 0.0) + gain
    total: Expression = Number(offset)
    for expression, gain in gains.items():
        total = Apply("+", (total, Apply("*", (Number(gain), expression))))
    return total
