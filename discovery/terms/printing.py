"""Expressions back to the text of model files."""

from __future__ import annotations

from collections.abc import Callable

from discovery.terms.expression import COMPARISONS, Apply, Expression, Name, Number

_PRECEDENCE = {**dict.fromkeys(COMPARISONS, 1), "+": 2, "-": 2, "*": 3, "/": 3, "neg": 4, "**": 5}


def format_number(value: float) -> str:
    """Shortest text that reads back as the same number."""
    return str(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)


def text(expression: Expression, number: Callable[[float], str] = format_number) -> str:
    """Text of an expression; `parse(text(e))` evaluates to the same values as `e`.

    >>> from discovery.terms import parse
    >>> text(parse("G*(body - table)"))
    'G*(body - table)'
    """
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
