"""Literals and expressions of structured text, in LREAL or REAL."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from discovery.export.program import Instruction, Program
from discovery.export.statements import Language, statements

KINDS = {"double": "LREAL", "float": "REAL"}
_COMPARE = {"<": "<", "<=": "<=", ">": ">", ">=": ">=", "==": "=", "!=": "<>"}


def literal(value: float, kind: str) -> str:
    """A typed literal.

    >>> literal(-1e-06, "LREAL")
    '(-LREAL#1.0e-06)'
    """
    if not math.isfinite(value):
        return f"{kind}#1.0e30"
    if value < 0.0:  # compilers differ on where the sign of a typed literal stands; here all agree
        return f"(-{literal(-value, kind)})"
    mantissa, mark, exponent = repr(float(value)).partition("e")
    return f"{kind}#{mantissa}{'' if '.' in mantissa else '.0'}{mark}{exponent}"


def program_lines(
    program: Program,
    results: Sequence[str],
    kind: str,
    function: str,
    parameters: Sequence[str],
    state: str = "x",
    plays: str = "p",
) -> list[str]:
    """Statements of a program; `parameters`: their variables, `state`, `plays`: arrays that it reads."""
    loads: dict[str, str | Sequence[str]] = {
        "parameter": parameters,
        "input": "u[{}]",
        "state": f"{state}[{{}}]",
        "delayed": "e[{}]",
        "played": f"{plays}[{{}}]",
        "time": "t",
    }
    language = Language(
        partial(literal, kind=kind),
        loads,
        partial(_expression, kind=kind, function=function),
        "{} := {};",
        "{} := {};",
        "(* {} *)",
    )
    return statements(program, results, language)


def _expression(instruction: Instruction, words: Sequence[str], kind: str, function: str) -> str:
    a = [words[node] for node in instruction.arguments]
    zero, one, op = f"{kind}#0.0", f"{kind}#1.0", instruction.operation
    if op in ("+", "-", "*"):
        return f"{a[0]} {op} {a[1]}"
    if op in _COMPARE:
        return f"SEL({a[0]} {_COMPARE[op]} {a[1]}, {zero}, {one})"
    if op in ("min", "max"):
        return f"SEL({a[0]} {'<' if op == 'min' else '>'} {a[1]}, {a[1]}, {a[0]})"
    if op == "select":
        return f"SEL({a[0]} <> {zero}, {a[2]}, {a[1]})"
    if op == "neg":
        return f"{zero} - {a[0]}"
    if op == "sign":
        return f"SEL({a[0]} > {zero}, SEL({a[0]} < {zero}, {zero}, (-{kind}#1.0)), {one})"
    if op == "abs":
        return f"ABS({a[0]})"
    call = {"/": "DIV", "**": "POW", "exp": "EXP", "log": "LOG", "sqrt": "SQRT", "tanh": "TANH"}[op]
    return f"{function}_{call}({', '.join(a)})"
