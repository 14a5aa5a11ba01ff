"""A reader of the structured text that `block.py` writes, and of the SCL made from it, to replay it where no
compiler is installed.

It knows the subset that is written and nothing more: assignments, IF, WHILE, arrays, calls of functions and
of function blocks. It computes in the type that the text declares (REAL: 32 bit), and refuses an untyped
real literal.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

Scope = dict[str, Any]
Compute = Callable[[Scope], Any]

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:LREAL|REAL)#-?\d+\.\d+(?:[eE][+-]?\d+)?|\d+(?!\d|\.\d))|(?P<word>[A-Za-z_]\w*)|(?P<sign>:=|<>|<=|>=|\.\.|\*\*|[-+*/<>=()\[\],;:.]))"
)


@dataclass
class Block:
    """A function or a function block: its variables and what it does."""

    name: str
    inputs: list[str] = field(default_factory=list)
    variables: dict[str, tuple[str, int | None]] = field(default_factory=dict)  # type, last index of an array
    initial: dict[str, bool] = field(default_factory=dict)
    blocks: dict[str, Block] = field(default_factory=dict)  # those of its text
    run: Callable[[Scope], None] = lambda _: None

    def scope(self) -> Scope:
        """Variables at their initial values."""
        made: Scope = {}
        for name, (kind, last) in self.variables.items():
            if kind in self.blocks:
                made[name] = self.blocks[kind].scope()
                continue
            zero: Any = {"LREAL": 0.0, "REAL": np.float32(0), "DINT": 0, "BOOL": False}[kind]
            made[name] = zero if last is None else [zero] * (last + 1)
        return made | self.initial


def read_structured_text(text: str) -> dict[str, Block]:
    """Functions and function blocks of a text by name.

    Raises:
        ValueError: a text outside the subset.
    """
    return _Reader(text).blocks()


class _Reader:
    def __init__(self, text: str) -> None:
        text = re.sub(r"\(\*.*?\*\)|//[^\n]*|\{.*?\}|VERSION : [\d.]+", " ", text, flags=re.DOTALL)
        text = re.sub(r"[#\"](?=[A-Za-z_])|\"", " ", re.sub(r"(?<=REAL)#", "~", text)).replace("~", "#")
        text = text.replace("VAR_TEMP", "VAR").strip()
        self.tokens: list[str] = []
        at = 0
        while at < len(text):
            found = _TOKEN.match(text, at)
            if not found:
                raise ValueError(f"unreadable structured text: {text[at : at + 40]!r}")
            self.tokens.append(found[0].strip())
            at = found.end()
        self.at = 0
        self.found: dict[str, Block] = {}
        self.block = Block("")

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self, wanted: str | None = None) -> str:
        token = self.peek()
        if wanted is not None and token != wanted:
            raise ValueError(f"expected {wanted}, found {token!r}")
        self.at += 1
        return token

    def blocks(self) -> dict[str, Block]:
        while self.peek():
            kind = self.take()
            block = Block(self.take(), blocks=self.found)
            if kind == "FUNCTION":
                self.take(":")
                block.variables[block.name] = (self.take(), None)
            self.block = block
            while self.peek().startswith("VAR"):
                self._declarations(block)
            if self.peek() == "BEGIN":
                self.take()
            statements = self._statements((f"END_{kind}",))
            self.take(f"END_{kind}")
            block.run = _sequence(statements)
            self.found[block.name] = block
        return self.found

    def _declarations(self, block: Block) -> None:
        section = self.take()
        while self.peek() != "END_VAR":
            name = self.take()
            self.take(":")
            kind, last = self.take(), None
            if kind == "ARRAY":
                for sign in ("[", "0", ".."):
                    self.take(sign)
                last = int(self.take())
                self.take("]")
                self.take("OF")
                kind = self.take()
            if self.peek() == ":=":
                self.take(":=")
                block.initial[name] = self.take() == "TRUE"
            self.take(";")
            block.variables[name] = (kind, last)
            if section == "VAR_INPUT":
                block.inputs.append(name)
        self.take("END_VAR")

    def _statements(self, ends: tuple[str, ...]) -> list[Callable[[Scope], None]]:
        return list(self._each_statement(ends))

    def _each_statement(self, ends: tuple[str, ...]) -> Iterator[Callable[[Scope], None]]:
        while self.peek() not in ends:
            word = self.take()
            if word == "IF":
                yield self._choice()
            elif word == "WHILE":
                condition = self._expression()
                self.take("DO")
                inner = _sequence(self._statements(("END_WHILE",)))
                self.take("END_WHILE")
                self.take(";")
                yield _loop(condition, inner)
            elif self.peek() == "(":
                yield self._block_call(word)
            else:
                index = None
                if self.peek() == "[":
                    self.take("[")
                    index = self._expression()
                    self.take("]")
                self.take(":=")
                value = self._expression()
                self.take(";")
                yield _assign(word, index, value)

    def _block_call(self, instance: str) -> Callable[[Scope], None]:
        """A call of a function block: `instance(name := value, ...);`."""
        given: list[tuple[str, Compute]] = []
        self.take("(")
        while self.peek() != ")":
            name = self.take()
            self.take(":=")
            given.append((name, self._expression()))
            if self.peek() == ",":
                self.take(",")
        self.take(")")
        self.take(";")
        block = self.found[self.block.variables[instance][0]]

        def call(s: Scope) -> None:
            inner = s[instance]
            inner.update({name: value(s) for name, value in given})
            block.run(inner)

        return call

    def _choice(self) -> Callable[[Scope], None]:
        branches = []
        while True:
            condition = self._expression()
            self.take("THEN")
            branches.append((condition, _sequence(self._statements(("ELSIF", "ELSE", "END_IF")))))
            if self.peek() != "ELSIF":
                break
            self.take("ELSIF")
        otherwise = _sequence([])
        if self.peek() == "ELSE":
            self.take("ELSE")
            otherwise = _sequence(self._statements(("END_IF",)))
        self.take("END_IF")
        self.take(";")
        return _branch(branches, otherwise)

    _LEVELS = (("OR",), ("AND",), ("<", "<=", ">", ">=", "=", "<>"), ("+", "-"), ("*", "/", "MOD"), ("**",))

    def _expression(self, level: int = 0) -> Compute:
        if level == len(self._LEVELS):
            return self._unary()
        left = self._expression(level + 1)
        while self.peek() in self._LEVELS[level]:
            left = _operate(self.take(), left, self._expression(level + 1))
        return left

    def _unary(self) -> Compute:
        if self.peek() == "NOT":
            self.take()
            inner = self._unary()
            return lambda s: not inner(s)
        token = self.take()
        if token == "-":
            negated = self._unary()
            return lambda s: -negated(s)
        if token == "(":
            inside = self._expression()
            self.take(")")
            return inside
        if token in ("TRUE", "FALSE"):
            return lambda _: token == "TRUE"
        kind, typed, digits = token.partition("#")
        if typed:
            value: Any = np.float32(digits) if kind == "REAL" else float(digits)
            return lambda _: value
        if token.isdigit():
            whole = int(token)
            return lambda _: whole
        if self.peek() == "(":
            arguments = []
            while self.take() != ")":  # "(" or "," before each
                if self.tokens[self.at + 1] == ":=":  # SCL names its arguments, in order
                    self.at += 2
                arguments.append(self._expression())
            return self._call(token, arguments)
        if self.peek() == "[":
            self.take("[")
            index = self._expression()
            self.take("]")
            return lambda s: s[token][index(s)]
        if self.peek() == ".":
            self.take(".")
            member = self.take()
            return lambda s: s[token][member]
        return lambda s: s[token]

    def _call(self, name: str, arguments: list[Compute]) -> Compute:
        if name in _STANDARD:
            standard = _STANDARD[name]
            return lambda s: standard(*(argument(s) for argument in arguments))
        block = self.found[name]

        def call(s: Scope) -> Any:
            scope = block.scope()
            for key, argument in zip(block.inputs, arguments, strict=True):
                scope[key] = argument(s)
            block.run(scope)
            return scope[block.name]

        return call


def _same(function: Callable[..., float]) -> Callable[..., Any]:
    return lambda *a: type(a[0])(function(*(float(one) for one in a)))


_STANDARD: dict[str, Callable[..., Any]] = {
    "SEL": lambda which, a, b: b if which else a,
    "ABS": abs,
    "EXPT": _same(math.pow),
    "EXP": _same(math.exp),
    "LN": _same(math.log),
    "SQRT": _same(math.sqrt),
    "DINT_TO_LREAL": float,
    "DINT_TO_REAL": np.float32,
    "LREAL_TO_DINT": round,
    "REAL_TO_DINT": lambda a: round(float(a)),
}

_OPERATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "OR": lambda a, b: a or b,
    "AND": lambda a, b: a and b,
    "<": lambda a, b: a < b,
    "<=": lambda a, b: a <= b,
    ">": lambda a, b: a > b,
    ">=": lambda a, b: a >= b,
    "=": lambda a, b: a == b,
    "<>": lambda a, b: a != b,
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "MOD": lambda a, b: a % b,
    "**": _same(math.pow),
}


def _operate(sign: str, left: Compute, right: Compute) -> Compute:
    operation = _OPERATIONS[sign]
    return lambda s: operation(left(s), right(s))


def _sequence(statements: list[Callable[[Scope], None]]) -> Callable[[Scope], None]:
    def run(s: Scope) -> None:
        for statement in statements:
            statement(s)

    return run


def _loop(condition: Compute, inner: Callable[[Scope], None]) -> Callable[[Scope], None]:
    def run(s: Scope) -> None:
        while condition(s):
            inner(s)

    return run


def _assign(name: str, index: Compute | None, value: Compute) -> Callable[[Scope], None]:
    def run(s: Scope) -> None:
        if index is None:
            s[name] = value(s)
        else:
            s[name][index(s)] = value(s)

    return run


def _branch(
    branches: list[tuple[Compute, Callable[[Scope], None]]], otherwise: Callable[[Scope], None]
) -> Callable[[Scope], None]:
    def run(s: Scope) -> None:
        for condition, inner in branches:
            if condition(s):
                inner(s)
                return
        otherwise(s)

    return run
