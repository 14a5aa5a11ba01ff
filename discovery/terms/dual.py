"""Values and exact first derivatives of expressions, vectorised over time (forward-mode differentiation).

A `Dual` carries the value of an expression on all instants at once and, for each name asked for, the
derivative array. Sparse by construction: a name that does not occur costs nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from discovery.terms.expression import Apply, Expression, Name, Number

Array = NDArray[np.float64]
Value = float | Array

_COMPARISONS = {
    "<": np.less,
    "<=": np.less_equal,
    ">": np.greater,
    ">=": np.greater_equal,
    "==": np.equal,
    "!=": np.not_equal,
}


@dataclass(slots=True)
class Dual:
    """Value (scalar or (N,)) and partial derivatives by name (scalar or (N,))."""

    value: Value
    partials: dict[str, Value] = field(default_factory=dict)


class Memory(Protocol):
    """What an expression with memory asks of the recording it is evaluated on."""

    def delayed(self, channel: str, seconds: float) -> tuple[Array, Array]:
        """Channel `seconds` ago, and its derivative with respect to `seconds`."""

    def lagged(self, value: Array, time_constant: float) -> Array:
        """First-order lag that starts settled."""

    def play(self, value: Array, width: float) -> tuple[Array, NDArray[np.intp], Array]:
        """Play operator: output, index of the instant it follows, sign of the contact (0 at rest)."""


def evaluate(
    expression: Expression,
    values: Mapping[str, Value],
    wrt: frozenset[str] = frozenset(),
    memory: Memory | None = None,
) -> Dual:
    """Value and derivatives of an expression.

    Args:
        expression: tree from `parse`.
        values: name -> scalar or (N,) array.
        wrt: names to differentiate by.
        memory: needed by `delay`, `play` and, along a given trajectory, `lag`.

    Raises:
        KeyError: a name without a value.

    >>> from discovery.terms import parse
    >>> d = evaluate(parse("a*x**2"), {"a": 3.0, "x": np.array([1.0, 2.0])}, frozenset({"a", "x"}))
    >>> d.value.tolist(), d.partials["x"].tolist(), d.partials["a"].tolist()
    ([3.0, 12.0], [6.0, 12.0], [1.0, 4.0])
    """
    with np.errstate(
        all="ignore"
    ):  # what is undefined is NaN or infinite; the caller sees a trajectory run away
        return _evaluate(expression, values, wrt, memory)


def _evaluate(
    expression: Expression, values: Mapping[str, Value], wrt: frozenset[str], memory: Memory | None
) -> Dual:
    match expression:
        case Number(value=number):
            return Dual(np.float64(number))  # numpy's numbers divide by zero without a crash
        case Name(id=name):
            value = values[name]
            return Dual(
                np.float64(value) if np.ndim(value) == 0 else value, {name: 1.0} if name in wrt else {}
            )
        case Apply(function="delay", arguments=(Name(id=channel), seconds)):
            duration = _evaluate(seconds, values, wrt, memory)
            assert memory is not None
            late, slope = memory.delayed(channel, float(np.mean(duration.value)))
            partials: dict[str, Value] = {n: slope * p for n, p in duration.partials.items()}
            if channel in wrt:  # a channel that moves by a constant moved as much a while ago
                partials[channel] = partials.get(channel, 0.0) + 1.0
            return Dual(late, partials)
        case Apply(function="lag", arguments=(inner, tau)) if memory is not None:
            # a model's own lags are states (models.expanded); here are those of candidates on a trajectory
            series = np.asarray(evaluate(inner, values, memory=memory).value, dtype=float)
            return Dual(memory.lagged(series, float(np.mean(evaluate(tau, values, memory=memory).value))))
        case Apply(function="play", arguments=(inner, width)):
            return _play(_evaluate(inner, values, wrt, memory), _evaluate(width, values, wrt, memory), memory)
        case Apply(function=function, arguments=arguments):
            return _apply(function, [_evaluate(argument, values, wrt, memory) for argument in arguments])


def _chain(value: Value, pieces: list[tuple[Value, Dual]]) -> Dual:
    """Chain rule: sum of (outer derivative) times (inner partials)."""
    partials: dict[str, Value] = {}
    for outer, dual in pieces:
        for name, partial in dual.partials.items():
            product = outer * partial
            partials[name] = partials[name] + product if name in partials else product
    return Dual(value, partials)


def _apply(function: str, a: list[Dual]) -> Dual:
    x = a[0].value
    y = a[1].value if len(a) > 1 else 0.0
    match function:
        case "+":
            return _chain(x + y, [(1.0, a[0]), (1.0, a[1])])
        case "-":
            return _chain(x - y, [(1.0, a[0]), (-1.0, a[1])])
        case "*":
            return _chain(x * y, [(y, a[0]), (x, a[1])])
        case "/":
            below = _divisor(y)
            return _chain(x / below, [(1.0 / below, a[0]), (-x / (below * below), a[1])])
        case "**":
            return _power(a[0], a[1])
        case "neg":
            return _chain(-x, [(-1.0, a[0])])
        case "<" | "<=" | ">" | ">=" | "==" | "!=":
            return Dual(_COMPARISONS[function](x, y) * 1.0)
        case "abs":
            return _chain(np.abs(x), [(np.sign(x), a[0])])
        case "exp":
            e = np.exp(np.minimum(x, 500.0))  # beyond this a fit has left all physics; keep it finite
            return _chain(e, [(e, a[0])])
        case "log":
            return _chain(np.log(x), [(1.0 / _divisor(x), a[0])])
        case "sqrt":
            root = np.sqrt(x)
            return _chain(root, [(0.5 / np.maximum(root, 1e-12), a[0])])
        case "tanh":
            t = np.tanh(x)
            return _chain(t, [(1.0 - t * t, a[0])])
        case "sign":
            return Dual(np.sign(x))
        case "where":
            inside = np.not_equal(x, 0.0)
            partials: dict[str, Value] = {}
            for name in (
                a[1].partials.keys() | a[2].partials.keys()
            ):  # selected, so that the other branch may be NaN
                partials[name] = np.where(inside, a[1].partials.get(name, 0.0), a[2].partials.get(name, 0.0))
            return Dual(np.where(inside, y, a[2].value), partials)
        case "min" | "max":
            pick = np.minimum if function == "min" else np.maximum
            result = a[0]
            for other in a[1:]:
                value = pick(result.value, other.value)
                first = np.equal(value, result.value) * 1.0
                result = _chain(value, [(first, result), (1.0 - first, other)])
            return result
    raise ValueError(f"unknown function {function}")


def _divisor(value: Value) -> Value:
    """The same as a number of numpy, which divides by zero without an exception."""
    return np.float64(value) if np.ndim(value) == 0 else value


def _power(base: Dual, exponent: Dual) -> Dual:
    x, p = np.asarray(base.value, dtype=float), exponent.value
    value = np.power(x, p)
    # 0**p has no slope to speak of for 0 < p < 1; a finite one keeps Newton steps finite.
    floor = np.where(np.abs(x) < 1e-9, 1e-9, x)
    slope = p * np.power(floor, np.asarray(p) - 1.0) if base.partials else 0.0
    growth = np.where(x > 0, value * np.log(np.where(x > 0, x, 1.0)), 0.0) if exponent.partials else 0.0
    return _chain(value if value.ndim else float(value), [(slope, base), (growth, exponent)])


def _play(inner: Dual, width: Dual, memory: Memory | None) -> Dual:
    if memory is None:  # a single instant: at rest in the middle
        return inner
    series = np.atleast_1d(np.asarray(inner.value, dtype=float))
    value, follows, contact = memory.play(series, float(np.mean(width.value)))
    partials: dict[str, Value] = {}
    for name, partial in inner.partials.items():
        full = np.broadcast_to(np.asarray(partial, dtype=float), series.shape)
        partials[name] = full[follows] * (contact != 0)
    for name, partial in width.partials.items():
        partials[name] = partials.get(name, 0.0) - contact * partial
    return Dual(value, partials)
