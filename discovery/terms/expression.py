"""Expressions of model files: a small tree made from Python's own parser, behind an allow-list.

No text of a file is ever run. `parse` reads the text with `ast`, keeps the few node kinds of the contract
and refuses the rest; everything downstream (derivatives, printing, C code) walks the resulting tree of
`Number`, `Name` and `Apply`.
"""

from __future__ import annotations

import ast
import math
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from discovery.errors import UserError
from discovery.naming import FUNCTIONS

MAX_LENGTH = 4000  # characters of one expression
MAX_NODES = 400
MAX_DEPTH = 40
MEMORY = ("delay", "lag", "play")  # what they give depends on what was before

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
COMPARISONS = tuple(_COMPARE.values())


@dataclass(frozen=True, slots=True)
class Number:
    """A literal number."""

    value: float


@dataclass(frozen=True, slots=True)
class Name:
    """A state, a channel, a parameter or `time`."""

    id: str


@dataclass(frozen=True, slots=True)
class Apply:
    """An operator or a function applied to its arguments; `neg` is the unary minus."""

    function: str
    arguments: tuple[Expression, ...]


Expression = Number | Name | Apply


def parse(source: str | float, where: str = "expression") -> Expression:
    """Tree of an expression text.

    Args:
        source: text in the grammar of the contract, or a plain number.
        where: how messages name the place ("model.toml, line 12, key terms[2].expression").

    Raises:
        UserError: anything outside the grammar, or an expression that is too long or too deep.

    >>> text(parse("G*(body - table)"))
    'G*(body - table)'
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
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            items = [down(left), *(down(item) for item in comparators)]
            pairs: list[Expression] = [
                Apply(_COMPARE[type(op)], (items[i], items[i + 1]))
                for i, op in enumerate(ops)
                if type(op) in _COMPARE
            ]
            if len(pairs) == len(ops):  # a < b < c holds where both hold
                result = pairs[0]
                for pair in pairs[1:]:
                    result = Apply("*", (result, pair))
                return result
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in FUNCTIONS:
            fewest, most = FUNCTIONS[name]
            if not fewest <= len(args) <= most:
                raise UserError(
                    f"{where}: {name}() takes {_count(fewest, most)}, '{source[:60]}' gives it {len(args)}"
                )
            if name == "delay" and not isinstance(args[0], ast.Name):
                raise UserError(f"{where}: delay() takes a channel and seconds, as in delay(T_fluid, 600)")
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


def _count(fewest: int, most: int) -> str:
    if fewest == most:
        return f"{fewest} argument{'s' if fewest > 1 else ''}"
    return f"{fewest} to {most} arguments"


def names(expression: Expression) -> frozenset[str]:
    """Names that the expression uses."""
    match expression:
        case Name(id=name):
            return frozenset((name,))
        case Apply(arguments=arguments):
            return frozenset().union(*(names(argument) for argument in arguments))
        case _:
            return frozenset()


def substitute(expression: Expression, replacements: Mapping[str, Expression]) -> Expression:
    """The expression with names replaced by other expressions."""
    match expression:
        case Name(id=name):
            return replacements.get(name, expression)
        case Apply(function=function, arguments=arguments):
            return Apply(function, tuple(substitute(argument, replacements) for argument in arguments))
        case _:
            return expression


def rewrite(expression: Expression, rule: Callable[[Apply], Expression | None]) -> Expression:
    """The expression with every application for which `rule` returns something replaced, innermost first."""
    if not isinstance(expression, Apply):
        return expression
    inner = Apply(expression.function, tuple(rewrite(argument, rule) for argument in expression.arguments))
    replaced = rule(inner)
    return inner if replaced is None else replaced


def degree(expression: Expression, variables: frozenset[str]) -> int:
    """Polynomial degree in `variables`: 0 free of them, 1 affine, 2 anything else.

    >>> degree(parse("G*pump*(a - b)"), frozenset({"a", "b"}))
    1
    """
    match expression:
        case Name(id=name):
            return int(name in variables)
        case Apply(function=function, arguments=arguments):
            degrees = [degree(argument, variables) for argument in arguments]
            if not any(degrees):
                return 0
            if function in ("+", "-", "neg"):
                return max(degrees)
            if function == "*":
                return min(sum(degrees), 2)
            if function == "/":
                return degrees[0] if degrees[1] == 0 else 2
            if function == "where" and degrees[0] == 0:
                return max(degrees)
            return 2
        case _:
            return 0


_PRECEDENCE = {**dict.fromkeys(COMPARISONS, 1), "+": 2, "-": 2, "*": 3, "/": 3, "neg": 4, "**": 5}


def format_number(value: float) -> str:
    """Shortest text that reads back as the same number."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


def text(expression: Expression, number: Callable[[float], str] = format_number) -> str:
    """Text of an expression; `parse(text(e))` evaluates to the same values as `e`."""
    return _text(expression, number)[0]


def _text(expression: Expression, number: Callable[[float], str]) -> tuple[str, int]:
    match expression:
        case Number(value=value):
            return number(value), 6 if value >= 0 else 4
        case Name(id=name):
            return name, 6
        case Apply(function="neg", arguments=(inner,)):
            body, level = _text(inner, number)
            return (f"-{body}" if level > 4 else f"-({body})"), 4
        case Apply(function=function, arguments=(left, right)) if function in _PRECEDENCE:
            level = _PRECEDENCE[function]
            left_text, left_level = _text(left, number)
            right_text, right_level = _text(right, number)
            left_open = (
                left_level < level or (function == "**" and left_level <= level) or level == 1 == left_level
            )
            # brackets also where mathematics needs none: what is read back rounds as it did before
            right_open = right_level < level or (function != "**" and right_level <= level)
            right_open = right_open or right_level == 4
            left_text = f"({left_text})" if left_open else left_text
            right_text = f"({right_text})" if right_open else right_text
            tight = function in ("*", "/", "**")
            return (
                f"{left_text}{function}{right_text}" if tight else f"{left_text} {function} {right_text}"
            ), level
        case Apply(function=function, arguments=arguments):
            return f"{function}({', '.join(_text(argument, number)[0] for argument in arguments)})", 6
