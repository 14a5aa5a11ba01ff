"""Straight-line programs: what Python, C and structured text run instead of expressions.

A `Program` is a list of instructions, each a number made from earlier numbers: no loops, no calls of its own
functions, no memory. Equal instructions are one, constants are folded, products with 0 and 1 vanish. Because
every target prints or interprets the *same* list, they can differ by the rounding of `pow`, `exp`, `log` and
`tanh` alone.

Meaning of the instructions (the same in every target):

    select(c, a, b)   a where c is not 0, else b; both sides are computed, the other one may be inf or NaN
    min(a, b)         a where a < b, else b          max(a, b)   a where a > b, else b
    exp(a)            of min(a, 500)
    comparisons       1 or 0
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

LOADS = ("input", "parameter", "state", "delayed", "played", "time")  # values that come from outside
UNARY = ("neg", "abs", "exp", "log", "sqrt", "tanh", "sign")
BINARY = ("+", "-", "*", "/", "**", "<", "<=", ">", ">=", "==", "!=", "min", "max")
OPERATIONS = ("constant", *LOADS, *UNARY, *BINARY, "select")


@dataclass(frozen=True, slots=True)
class Instruction:
    """One number: `operation` on the numbers at `arguments`; `value` of a constant, `index` of a load."""

    operation: str
    arguments: tuple[int, ...] = ()
    value: float = 0.0
    index: int = 0


@dataclass(frozen=True)
class Program:
    """Instructions in order, which of them are the results, and what some of them are in words."""

    instructions: tuple[Instruction, ...]
    results: tuple[int, ...]
    notes: Mapping[int, tuple[str, ...]] = field(default_factory=dict)


def _divide(a: float, b: float) -> float:
    if b == 0.0:
        return math.nan if a == 0.0 or a != a else math.copysign(math.inf, a) * math.copysign(1.0, b)
    return a / b


def _power(a: float, b: float) -> float:
    try:
        return math.pow(a, b)
    except ValueError:
        return math.nan if a != 0.0 else math.inf
    except OverflowError:
        return math.inf


def _log(a: float) -> float:
    return math.log(a) if a > 0.0 else (-math.inf if a == 0.0 else math.nan)


_FOLD: dict[str, Callable[..., float]] = {
    "neg": lambda a: -a,
    "abs": abs,
    "exp": lambda a: math.exp(min(a, 500.0)),
    "log": _log,
    "sqrt": lambda a: math.sqrt(a) if a >= 0.0 else math.nan,
    "tanh": math.tanh,
    "sign": lambda a: float((a > 0.0) - (a < 0.0)),
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": _divide,
    "**": _power,
    "<": lambda a, b: float(a < b),
    "<=": lambda a, b: float(a <= b),
    ">": lambda a, b: float(a > b),
    ">=": lambda a, b: float(a >= b),
    "==": lambda a, b: float(a == b),
    "!=": lambda a, b: float(a != b),
    "min": lambda a, b: a if a < b else b,
    "max": lambda a, b: a if a > b else b,
    "select": lambda c, a, b: a if c != 0.0 else b,
}


@dataclass
class Builder:
    """Collects instructions; equal ones become one."""

    instructions: list[Instruction] = field(default_factory=list)
    known: dict[Instruction, int] = field(default_factory=dict)

    def _add(self, instruction: Instruction) -> int:
        if instruction not in self.known:
            self.known[instruction] = len(self.instructions)
            self.instructions.append(instruction)
        return self.known[instruction]

    def constant(self, value: float) -> int:
        """A number."""
        return self._add(Instruction("constant", value=float(value) + 0.0))  # + 0.0: one zero, not two

    def load(self, kind: str, index: int = 0) -> int:
        """A value from outside, one of `LOADS`."""
        return self._add(Instruction(kind, index=index))

    def constant_of(self, node: int) -> float | None:
        """The number at `node` where it is a constant."""
        found = self.instructions[node]
        return found.value if found.operation == "constant" else None

    def apply(self, operation: str, *arguments: int) -> int:
        """An operation on earlier numbers, folded and simplified where that changes no rounding."""
        constants = [self.constant_of(node) for node in arguments]
        if all(value is not None for value in constants):
            return self.constant(_FOLD[operation](*constants))
        simple = self._simplified(operation, arguments, constants)
        return self._add(Instruction(operation, arguments)) if simple is None else simple

    def _simplified(
        self, operation: str, arguments: Sequence[int], constants: Sequence[float | None]
    ) -> int | None:
        a, b = arguments[0], arguments[-1]
        first, last = constants[0], constants[-1]
        match operation:
            case "+" if first == 0.0:
                return b
            case "+" | "-" if last == 0.0:
                return a
            case "*" if first == 0.0 or last == 0.0:
                return self.constant(0.0)
            case "*" if first == 1.0:
                return b
            case "*" | "/" | "**" if last == 1.0:
                return a
            case "/" if first == 0.0:
                return self.constant(0.0)
            case "select" if first is not None:
                return arguments[1] if first != 0.0 else b
            case "select" if arguments[1] == b:
                return b
        return None

    def sum(self, nodes: Sequence[int]) -> int:
        """Sum of numbers, in order."""
        total = self.constant(0.0)
        for node in nodes:
            total = self.apply("+", total, node)
        return total

    def program(self, results: Sequence[int], notes: Sequence[tuple[int, str]] = ()) -> Program:
        """The program of `results`, without the instructions that none of them needs; `notes` on numbers."""
        needed: set[int] = set()
        stack = list(results)
        while stack:
            node = stack.pop()
            if node not in needed:
                needed.add(node)
                stack.extend(self.instructions[node].arguments)
        order = sorted(needed)
        place = {node: k for k, node in enumerate(order)}
        instructions = tuple(
            Instruction(i.operation, tuple(place[a] for a in i.arguments), i.value, i.index)
            for i in (self.instructions[node] for node in order)
        )
        said: dict[int, tuple[str, ...]] = {}
        for node, text in notes:
            if node in place:
                said[place[node]] = (*said.get(place[node], ()), text)
        return Program(instructions, tuple(place[node] for node in results), said)
