"""Expressions as a small tree of `Number`, `Name` and `Apply`, and what is asked of one.

Everything downstream (derivatives, printing, C code) walks this tree; `parsing` makes it from text.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

MEMORY = ("delay", "lag", "play")  # what they give depends on what was before
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")


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


def names(expression: Expression) -> frozenset[str]:
    """Names that the expression uses."""
    found, left = set(), [expression]
    while left:
        one = left.pop()
        if isinstance(one, Name):
            found.add(one.id)
        elif isinstance(one, Apply):
            left += one.arguments
    return frozenset(found)


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

    >>> from discovery.terms import parse
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


def mixed(expression: Expression, some: frozenset[str], others: frozenset[str]) -> bool:
    """Whether a factor with a name of `some` is multiplied by one with a name of `others`, or divided by it.

    >>> from discovery.terms import parse
    >>> [mixed(parse(t), frozenset({"a"}), frozenset({"b"})) for t in ("G*(b - a)", "b*(c - a)", "b*b + a")]
    [False, True, False]
    """
    if not isinstance(expression, Apply):
        return False
    if any(mixed(argument, some, others) for argument in expression.arguments):
        return True
    if expression.function in ("+", "-", "neg"):
        return False
    held = [names(argument) for argument in expression.arguments]
    return any(
        held[i] & some and held[j] & others for i in range(len(held)) for j in range(len(held)) if i != j
    )
