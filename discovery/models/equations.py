"""A model as equations that a person reads: numbers with their units in the place of parameters."""

from __future__ import annotations

from collections.abc import Sequence

from discovery.models.model import Model, Parameter, in_time_unit
from discovery.terms import Apply, Expression, Name, substitute, text


def equations(model: Model) -> list[str]:
    """One line for each state and each output, with the values of the parameters.

    A body with a capacity is an energy balance in W. Numbers are rounded to four digits; the model file has
    them all.

    >>> from discovery.models.reduced import reduced
    >>> from discovery.recordings import Channel
    >>> y, u = Channel("y", "error", "um", None, "held"), Channel("u", "heat load", "W", None, "held")
    >>> model = reduced(["u"], ["y"], {"y": y, "u": u})
    >>> equations(model.with_values({"p1_y": -0.5, "p2_y": 0.25, "p3_y": -3}))
    ['d/dt y = -0.5 [1/h]*y + 0.25 [um/W/h]*u - 3 [um/h]']
    """
    model = in_time_unit(model)
    values = {name: _printed(parameter) for name, parameter in model.parameters.items()}
    lines = []
    for state in model.states.values():
        parts = [(1.0, term.expression) for term in model.terms if term.into == state.name]
        flows = [(-1.0, term.expression) for term in model.terms if term.source == state.name]
        left = f"{state.capacity:.4g} [J/K] * d/dt {state.name}" if state.capacity else f"d/dt {state.name}"
        lines.append(f"{left} = {_sum([*parts, *flows], values)}")
    lines += [f"{name} = {_write(substitute(e, values))}" for name, e in model.outputs.items()]
    return lines


def _printed(parameter: Parameter) -> Expression:
    """Return a value and its unit as one name. The minus sign stands before it, as the grammar needs it."""
    unit = "" if parameter.unit in ("1", "") else f" [{parameter.unit}]"
    name = Name(f"{abs(parameter.value):.4g}{unit}")
    return Apply("neg", (name,)) if parameter.value < 0 else name


def _write(expression: Expression) -> str:
    return text(expression, lambda value: f"{value:.6g}")


def _sum(parts: Sequence[tuple[float, Expression]], values: dict[str, Expression]) -> str:
    """Return a sum with plain signs. A term that starts with a minus or leaves the state is subtracted."""
    line = ""
    for sign, expression in parts:
        tree = substitute(expression, values)
        shown = _write(tree)
        if sign < 0 and isinstance(tree, Apply) and tree.function in ("+", "-"):
            shown = f"({shown})"
        negative = shown.startswith("-") != (sign < 0)
        shown = shown.removeprefix("-")
        line += (f"-{shown}" if negative else shown) if not line else f" {'-' if negative else '+'} {shown}"
    return line or "0"
