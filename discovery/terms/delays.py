"""Delays stand at channels, as evaluation wants them, also where a formula has come in place of one."""

from __future__ import annotations

from collections.abc import Collection

from discovery.terms.expression import Apply, Expression, Name, rewrite


def delays_at(channels: Collection[str], expression: Expression) -> Expression:
    """The same with every delay at a channel: what a formula gave a while ago is the formula of what its
    channels were then. Other names than channels and `time` are constants.

    >>> from discovery.terms import parse, substitute, text
    >>> late = substitute(parse("hF*delay(T, 60)"), {"T": parse("lag(T, tau) + rise*(time > 0)")})
    >>> text(delays_at({"T"}, late))
    'hF*(lag(delay(T, 60), tau) + rise*(time - 60 > 0))'
    """

    def rule(apply: Apply) -> Expression | None:
        if apply.function != "delay" or isinstance(apply.arguments[0], Name):
            return None
        inner, seconds = apply.arguments
        return _before(inner, seconds, channels)

    return rewrite(expression, rule)


def _before(expression: Expression, seconds: Expression, channels: Collection[str]) -> Expression:
    """Return an expression as it was some seconds ago. Its own delays are at channels."""
    match expression:
        case Name(id="time"):
            return Apply("-", (expression, seconds))
        case Name(id=name) if name in channels:
            return Apply("delay", (expression, seconds))
        case Apply(function="delay", arguments=(channel, sooner)):
            return Apply("delay", (channel, Apply("+", (sooner, seconds))))
        case Apply(function=function, arguments=arguments):
            return Apply(function, tuple(_before(argument, seconds, channels) for argument in arguments))
        case _:
            return expression
