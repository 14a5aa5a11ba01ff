"""Expressions into program nodes, with their exact derivatives by the states (forward mode, symbolic).

The rules at kinks are those of `discovery.terms.dual`, so that the exported model linearises as the fitted
one did.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from discovery.export.program import Builder
from discovery.terms import Apply, Expression, Name, Number


@dataclass(frozen=True)
class Node:
    """A number of the program and its derivatives: name of a state -> number of the program."""

    value: int
    partials: Mapping[str, int] = field(default_factory=dict)


class Memory(Protocol):
    """How `delay` and `play` become nodes: loads of a running model's memory, or values at the start."""

    def delayed(self, build: Builder, expression: Apply) -> int: ...

    def played(self, build: Builder, expression: Apply, inner: int, width: int) -> tuple[int, int]:
        """The output of the play, and whether it is in contact now (the derivative by its input)."""


def compile_expression(
    build: Builder, expression: Expression, names: Mapping[str, Node], memory: Memory
) -> Node:
    """Node of an expression.

    Args:
        names: nodes of states, inputs, parameters and `time`.
        memory: what `delay` and `play` read.

    Raises:
        KeyError: a name without a node.
    """
    match expression:
        case Number(value=value):
            return Node(build.constant(value))
        case Name(id=name):
            return names[name]
        case Apply(function="delay"):
            return Node(memory.delayed(build, expression))
        case Apply(function="play", arguments=(inner, width)):
            x = compile_expression(build, inner, names, memory)
            w = compile_expression(build, width, names, memory)
            value, contact = memory.played(build, expression, x.value, w.value)
            return _chain(build, value, [(contact, x)])
        case Apply(function=function, arguments=arguments):
            return _apply(build, function, [compile_expression(build, a, names, memory) for a in arguments])


def _chain(build: Builder, value: int, pieces: Sequence[tuple[int, Node]]) -> Node:
    """Chain rule: sum of outer derivative times inner partials."""
    partials: dict[str, int] = {}
    for outer, node in pieces:
        for name, partial in node.partials.items():
            product = build.apply("*", outer, partial)
            partials[name] = build.apply("+", partials[name], product) if name in partials else product
    zero = build.constant(0.0)
    return Node(value, {name: partial for name, partial in partials.items() if partial != zero})


def _apply(build: Builder, function: str, a: Sequence[Node]) -> Node:
    x, y = a[0].value, a[-1].value
    one = build.constant(1.0)
    op, number = build.apply, build.constant
    match function:
        case "neg":
            return _chain(build, op("neg", x), [(number(-1.0), a[0])])
        case "+":
            return _chain(build, op("+", x, y), [(one, a[0]), (one, a[1])])
        case "-":
            return _chain(build, op("-", x, y), [(one, a[0]), (number(-1.0), a[1])])
        case "*":
            return _chain(build, op("*", x, y), [(y, a[0]), (x, a[1])])
        case "/":
            value = op("/", x, y)
            return _chain(build, value, [(op("/", one, y), a[0]), (op("neg", op("/", value, y)), a[1])])
        case "**":
            return _power(build, a[0], a[1])
        case "abs":
            return _chain(build, op("abs", x), [(op("sign", x), a[0])])
        case "exp":
            value = op("exp", x)
            return _chain(build, value, [(value, a[0])])
        case "log":
            return _chain(build, op("log", x), [(op("/", one, x), a[0])])
        case "sqrt":
            value = op("sqrt", x)
            return _chain(build, value, [(op("/", number(0.5), op("max", value, number(1e-12))), a[0])])
        case "tanh":
            value = op("tanh", x)
            return _chain(build, value, [(op("-", one, op("*", value, value)), a[0])])
        case "where":
            zero = number(0.0)
            partials = {
                name: op("select", x, a[1].partials.get(name, zero), a[2].partials.get(name, zero))
                for name in sorted(a[1].partials.keys() | a[2].partials.keys())
            }
            return Node(op("select", x, a[1].value, y), partials)
        case "min" | "max":
            result = a[0]
            for other in a[1:]:
                value = op(function, result.value, other.value)
                first = op("==", value, result.value)
                result = _chain(build, value, [(first, result), (op("-", one, first), other)])
            return result
        case "sign":
            return Node(op("sign", x))
        case _:  # comparisons
            return Node(op(function, x, y))


def _power(build: Builder, base: Node, exponent: Node) -> Node:
    op, number = build.apply, build.constant
    x, p = base.value, exponent.value
    value = op("**", x, p)
    pieces: list[tuple[int, Node]] = []
    if base.partials:  # 0**p has no finite slope for 0 < p < 1: take it at 1e-9
        floor = op("select", op("<", op("abs", x), number(1e-9)), number(1e-9), x)
        pieces.append((op("*", p, op("**", floor, op("-", p, number(1.0)))), base))
    if exponent.partials:
        positive = op(">", x, number(0.0))
        growth = op("*", value, op("log", op("select", positive, x, number(1.0))))
        pieces.append((op("select", positive, growth, number(0.0)), exponent))
    return _chain(build, value, pieces)
