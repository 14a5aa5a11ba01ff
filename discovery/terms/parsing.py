"""Expressions of model files: read by Python's own parser, behind an allow-list.

No text of a file is ever run. `parse` reads the text with `ast`, keeps the few allowed node kinds
and refuses the rest.
"""

from __future__ import annotations

import ast
import math
import warnings
from functools import reduce
from itertools import pairwise

from discovery.errors import UserError
from discovery.naming import FUNCTIONS
from discovery.terms.expression import Apply, Expression, Name, Number

MAX_LENGTH = 4000  # characters of one expression
MAX_NODES = 400
MAX_DEPTH = 40

_BINARY: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
_COMPARE: dict[type[ast.cmpop], str] = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}


def parse(source: str | float, where: str = "expression") -> Expression:
    """Tree of an expression text.

    Args:
        source: text in the grammar of model files, or a plain number.
        where: how messages name the place ("model.toml, line 12, key terms[2].expression").

    Raises:
        UserError: anything outside the grammar, or an expression that is too long or too deep.

    >>> parse("G*body")
    Apply(function='*', arguments=(Name(id='G'), Name(id='body')))
    """
    if isinstance(source, bool):
        raise UserError(f"{where}: {source} is not a number or an expression; write a formula as text")
    if isinstance(source, (int, float)):
        return _number(float(source), where)
    if len(source) > MAX_LENGTH:
        raise UserError(
            f"{where}: the expression has {len(source)} characters, at most {MAX_LENGTH} are read; split it"
        )
    if not source.isascii():  # Python's parser reads some letters as others
        odd = next(letter for letter in source if not letter.isascii())
        raise UserError(
            f"{where}: '{odd}' in '{source[:60]}' is no ASCII letter or sign; use a to z and - * /"
        )
    try:
        with warnings.catch_warnings():  # Python's remarks on style, as on `1if a else 2`
            warnings.simplefilter("ignore", SyntaxWarning)
            tree = ast.parse(source.strip(), mode="eval")
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        detail = getattr(error, "msg", None) or "it is nested too deeply"
        column = getattr(error, "offset", None)
        place = f" at column {column}" if column else ""
        raise UserError(f"{where}: '{source}' is not a formula{place}: {detail}") from None
    counter = [0]
    return _convert(tree.body, source, where, counter, 0)


def _number(value: float, where: str) -> Number:
    if not math.isfinite(value):
        raise UserError(f"{where}: {value} is not a finite number")
    return Number(value)


def _convert(node: ast.AST, source: str, where: str, counter: list[int], depth: int) -> Expression:
    counter[0] += 1
    if counter[0] > MAX_NODES or depth > MAX_DEPTH:
        raise UserError(
            f"{where}: '{source[:60]}' is too large (at most {MAX_NODES} parts, {MAX_DEPTH} deep); split it"
        )

    def down(child: ast.AST) -> Expression:
        return _convert(child, source, where, counter, depth + 1)

    match node:
        case ast.Constant(value=bool()):
            pass
        case ast.Constant(value=int() | float() as value):
            try:
                return _number(float(value), where)
            except OverflowError:
                raise UserError(f"{where}: a number in '{source[:60]}' is too large") from None
        case ast.Name(id=name):
            return Name(name)
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            inner = down(operand)
            return Number(0.0 - inner.value) if isinstance(inner, Number) else Apply("neg", (inner,))
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return down(operand)
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
            return Apply(_BINARY[type(op)], (down(left), down(right)))
        case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARE for op in ops):
            items = [down(left), *(down(item) for item in others)]
            pairs = [Apply(_COMPARE[type(op)], pair) for op, pair in zip(ops, pairwise(items), strict=True)]
            return reduce(lambda one, pair: Apply("*", (one, pair)), pairs)  # a < b < c: where both hold
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            _check_call(name, args, source, where)
            return Apply(name, tuple(down(arg) for arg in args))
        case ast.Call(func=ast.Name(id=name)):
            raise UserError(
                f"{where}: unknown function {name}() in '{source[:60]}'; "
                f"known: {', '.join(sorted(FUNCTIONS))}"
            )
        case _:
            pass
    fragment = ast.get_source_segment(source.strip(), node) if hasattr(node, "lineno") else None
    raise UserError(
        f"{where}: '{fragment or source[:60]}' is not allowed in an expression; "
        "use + - * / **, comparisons, parentheses, names, numbers and " + ", ".join(sorted(FUNCTIONS))
    )


def _check_call(name: str, args: list[ast.expr], source: str, where: str) -> None:
    """Refuse a call with too few or too many arguments, and a delay of anything but a channel."""
    fewest, most = FUNCTIONS[name]
    if not fewest <= len(args) <= most:
        raise UserError(
            f"{where}: {name}() takes {_count(fewest, most)}, '{source[:60]}' gives it {len(args)}"
        )
    if name == "delay" and not isinstance(args[0], ast.Name):
        raise UserError(f"{where}: delay() takes a channel and seconds, as in delay(T_fluid, 600)")


def _count(fewest: int, most: int) -> str:
    if fewest == most:
        return f"{fewest} argument{'s' if fewest > 1 else ''}"
    return f"{fewest} to {most} arguments"
