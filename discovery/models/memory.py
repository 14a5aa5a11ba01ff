"""What holds wherever an expression remembers: delay() of a channel, and for a constant time."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping

import numpy as np

from discovery.errors import UserError
from discovery.models.model import Parameter
from discovery.terms import Apply, Expression, Name, evaluate, names, text
from discovery.terms.expression import MEMORY, rewrite

# the second argument, and how small it may be
_SIZES = {
    "delay": ("delay", "a number of seconds from 0 up"),
    "lag": ("time constant", "a number of seconds above 0"),
    "play": ("width", "a number"),
}


def check_memory(
    expression: Expression, parameters: Mapping[str, Parameter], states: Collection[str], where: str
) -> None:
    """Refuse what a fit would take for something else, and an export does not take at all.

    Args:
        parameters: of the model; one that is `per_recording` may be negative, as the shift of a clock.
        states: of the model.
        where: how messages name the place.

    Raises:
        UserError: a delay of what is no channel; a delay, time constant or width that is no constant, or out
        of its range.
    """

    def visit(apply: Apply) -> None:
        if apply.function not in MEMORY:
            return
        fed, size = apply.arguments
        shown = f"'{text(apply)[:60]}'"
        if apply.function == "delay" and isinstance(fed, Name) and fed.id in {*states, *parameters, "time"}:
            raise UserError(
                f"{where}: {shown} is not of an input; only a channel can be delayed (use lag() for the rest)"
            )
        word, wanted = _SIZES[apply.function]
        constant = names(size) <= set(parameters) and not remembers(size)
        if not constant or not _possible(apply.function, size, parameters):
            raise UserError(
                f"{where}: the {word} in {shown} must be {wanted}; "
                "it may hold parameters, no states and no channels"
            )

    rewrite(expression, visit)


def check_before_fit(expression: Expression, parameters: Mapping[str, Parameter], where: str) -> None:
    """Refuse a delay that a fit may make negative.

    Raises:
        UserError: naming the parameter without a bound.
    """

    def visit(apply: Apply) -> None:
        for name in sorted(names(apply.arguments[1])) if apply.function == "delay" else ():
            p = parameters[name]
            if p.min < 0 and not p.fixed and not p.per_recording:
                raise UserError(
                    f"{where}: a fit may give '{name}' a value below 0, where '{text(apply)[:60]}' would "
                    "look into the future; give the parameter min = 0.0"
                )

    rewrite(expression, visit)


def check_start(start: Expression, where: str) -> None:
    """Refuse the start of a state that asks for what was before the recording.

    Raises:
        UserError: naming the place.
    """
    if remembers(start):
        raise UserError(
            f"{where}: '{text(start)[:60]}' needs what was before the recording; "
            f"a start knows only the first instant: take {', '.join(f'{f}()' for f in MEMORY)} away"
        )


def remembers(expression: Expression) -> bool:
    """Whether what an expression gives depends on what was before."""
    return isinstance(expression, Apply) and (
        expression.function in MEMORY or any(remembers(argument) for argument in expression.arguments)
    )


def _possible(function: str, size: Expression, parameters: Mapping[str, Parameter]) -> bool:
    used = {name: parameters[name] for name in names(size)}
    if any(p.per_recording for p in used.values()):
        return True
    value = float(np.mean(evaluate(size, {name: p.value for name, p in used.items()}).value))
    least = {"delay": value >= 0.0, "lag": value > 0.0, "play": True}
    return math.isfinite(value) and least[function]
