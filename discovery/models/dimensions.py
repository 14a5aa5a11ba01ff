"""Do the units of a model's expressions fit together? Warnings, since literals may carry a unit that nobody
wrote.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

from discovery.models.model import TIME_UNITS, Model, State
from discovery.models.units import Dimension, differences, dimension, known, plain, ratio, spell, times
from discovery.recordings import Channel
from discovery.terms import Apply, Expression, Name, Number, text
from discovery.terms.expression import COMPARISONS

_SAME = ("+", "-", "min", "max", *COMPARISONS)
_PURE = ("exp", "log", "tanh")


class _Mismatch(Exception):  # noqa: N818  (control flow, caught here)
    """Two units that cannot meet."""


def check_dimensions(model: Model, channels: Mapping[str, Channel]) -> list[str]:
    """A sentence for each term and output whose units do not fit; empty when all do.

    A literal is a wildcard, and so is whatever it is multiplied with: its unit is not written down. Nothing
    is converted inside, so that units of one dimension have to be the same ones (s, min and h are not). Terms
    of the catalogue take a flow for a share, in whatever unit it comes: their sizes carry the rest.
    """
    units = {name: p.unit for name, p in model.parameters.items()}
    units |= {name: s.unit for name, s in model.states.items()}
    units |= {name: c.unit for name, c in channels.items() if name not in units} | {"time": "s"}
    sentences = [
        f"model '{model.name}': the unit '{u}' of {n} is not known" for n, u in units.items() if not known(u)
    ]
    dimensions = {name: dimension(unit) for name, unit in units.items()}
    for term in (t for t in model.terms if not t.effect):
        wanted, name = _entering(model, model.states[term.into])
        found = _compare(term.expression, dimensions, wanted, name)
        if found:
            remedy = _remedy(model, term.expression, dimensions, wanted)
            sentences.append(f"model '{model.name}', term '{term.name}': {found}{remedy}")
    measured = {name: Name(name) for name in model.states if name in channels}
    for name, expression in {**measured, **model.outputs}.items():
        unit = channels[name].unit if name in channels else ""
        found = _compare(expression, dimensions, dimension(unit), unit)
        if found:
            sentences.append(f"model '{model.name}', output '{name}': {found}")
    return sentences


def with_coefficient_units(model: Model, channels: Mapping[str, Channel]) -> Model:
    """The model with the unit that follows for each coefficient of a term `coefficient*(...)`.

    A search knows what it multiplies, not always in which unit the coefficient then is.
    """
    units = {name: c.unit for name, c in channels.items()} | {
        name: p.unit for name, p in model.parameters.items()
    }
    units |= {name: s.unit for name, s in model.states.items()}
    dimensions = {name: dimension(unit) for name, unit in units.items()}
    parameters = dict(model.parameters)
    for term in model.terms:
        match term.expression:
            case Apply("*", (Name(coefficient), rest)) if coefficient in parameters:
                state = model.states[term.into]
                wanted, name = _entering(model, state)
                rate = heat_unit(model, state)
                if not _compare(term.expression, dimensions, wanted, name):
                    continue
                of = unit_of(rest, units)
                unit = rate if of == "1" else f"{rate}/({of})" if set("*/") & set(of) else f"{rate}/{of}"
                parameters[coefficient] = replace(parameters[coefficient], unit=unit)
            case _:
                pass
    return replace(model, parameters=parameters)


def heat_unit(model: Model, state: State) -> str:
    """The unit of what enters a state: W, or a rate of what has no heat capacity."""
    return "W" if state.capacity else f"{differences(state.unit)}/{_clock(model, state)}"


def _entering(model: Model, state: State) -> tuple[Dimension, str]:
    """What the terms of a state are, and how a sentence calls it."""
    if state.capacity:
        return dimension("W"), "W"
    name = f"{state.unit}/{_clock(model, state)}"
    return _combine(dimension(state.unit), dimension(_clock(model, state)), -1.0), name


def _clock(model: Model, state: State) -> str:
    """Return the time unit of the rates of a state. A hidden state may have its own."""
    own = (unit for unit, seconds in TIME_UNITS.items() if math.isclose(state.scale * seconds, 1.0))
    return next(own, model.time_unit)


def unit_of(expression: Expression, units: Mapping[str, str]) -> str:
    """Unit of an expression from those of its names; literals have none, a difference of degC has K.

    >>> from discovery.terms import parse
    >>> unit_of(parse("pump*(T_env - 21.9)*speed**2"), {"pump": "1", "T_env": "degC", "speed": "rpm"})
    'K*rpm**2'
    >>> unit_of(parse("sqrt(max(level - 2.5, 0))"), {"level": "cm"})
    'cm**0.5'
    """
    match expression:
        case Name(id=name):
            return differences(units.get(name, "1"))
        case Apply(function="*" | "/" as sign, arguments=(a, b)):
            left, right = unit_of(a, units), unit_of(b, units)
            if right == "1":
                return left
            if sign == "*":
                return right if left == "1" else f"{left}*{right}"
            return f"{left}/({right})" if set("*/") & set(right) else f"{left}/{right}"
        case Apply(function="**", arguments=(a, Number(value=power))):
            return _to_power(unit_of(a, units), power)
        case Apply(function="sqrt", arguments=(a,)):
            return _to_power(unit_of(a, units), 0.5)
        case Apply(function=function) if function in (*COMPARISONS, *_PURE, "sign", "**"):
            return "1"
        case Apply(function="where", arguments=(_, *others)):
            return _first_unit(others, units)
        case Apply(function="lag" | "delay" | "play", arguments=(a, _)):
            return unit_of(a, units)
        case Apply(arguments=arguments):
            return _first_unit(arguments, units)
        case _:
            return "1"


def _to_power(unit: str, power: float) -> str:
    if unit == "1":
        return unit
    return f"({unit})**{power:g}" if set("*/") & set(unit) else f"{unit}**{power:g}"


def _first_unit(expressions: Sequence[Expression], units: Mapping[str, str]) -> str:
    return next((unit for e in expressions if (unit := unit_of(e, units)) != "1"), "1")


def _compare(
    expression: Expression, dimensions: Mapping[str, Dimension], wanted: Dimension, name: str
) -> str | None:
    try:
        found = _of(expression, dimensions)
    except _Mismatch as mismatch:
        return str(mismatch)
    if found is None or wanted is None or (apart := ratio(found, wanted)) == 1.0:
        return None
    shown = f"'{text(expression)[:60]}'"
    if apart is None:
        return f"{shown} has the dimension of {spell(found)} where {name} is expected"
    return f"{shown} counts in {apart:.4g} {name} where {name} is expected; correct the units and the numbers"


def _of(expression: Expression, dimensions: Mapping[str, Dimension]) -> Dimension:
    """Dimension of an expression. Raises _Mismatch."""
    match expression:
        case Number():
            return None
        case Name(id=name):
            return dimensions.get(name)
        case Apply(function="*", arguments=(a, b)):
            return _combine(_of(a, dimensions), _of(b, dimensions), 1.0)
        case Apply(function="/", arguments=(a, b)):
            return _combine(_of(a, dimensions), _of(b, dimensions), -1.0)
        case Apply(function="**", arguments=(a, b)):
            base, power = _of(a, dimensions), _of(b, dimensions)
            if power and plain(power):
                raise _Mismatch(
                    f"the exponent '{text(b)}' has the dimension of {spell(power)}; it must be a pure number"
                )
            if base == {}:
                return {}
            return times(base, b.value) if base is not None and isinstance(b, Number) else None
        case Apply(function="sqrt", arguments=(a,)):
            inner = _of(a, dimensions)
            return None if inner is None else times(inner, 0.5)
        case Apply(function="where", arguments=(condition, a, b)):
            _of(condition, dimensions)
            return _equal(a, b, dimensions)
        case Apply(function=function, arguments=arguments) if function in _SAME:
            shared = _of(arguments[0], dimensions)
            for a, b in pairwise(arguments):
                shared = (
                    _equal(a, b, dimensions)
                    if shared is None or len(arguments) == 2
                    else _equal(arguments[0], b, dimensions)
                )
            return {} if function in COMPARISONS else shared
        case Apply(function=function, arguments=(a,)) if function in _PURE:
            inner = _of(a, dimensions)
            if inner and plain(inner):
                raise _Mismatch(
                    f"{function}() of '{text(a)}', which has the dimension of {spell(inner)}; "
                    "it must be a pure number"
                )
            return {}
        case Apply(function="sign"):
            return {}
        case Apply(function="lag" | "delay", arguments=(a, seconds)):
            if found := _compare(seconds, dimensions, dimension("s"), "s"):
                raise _Mismatch(found)
            return _of(a, dimensions)
        case Apply(arguments=arguments):  # abs, neg, play
            return _of(arguments[0], dimensions)


def _equal(a: Expression, b: Expression, dimensions: Mapping[str, Dimension]) -> Dimension:
    left, right = _of(a, dimensions), _of(b, dimensions)
    if left is not None and right is not None and (apart := ratio(left, right)) != 1.0:
        one, other = f"'{text(a)[:40]}'", f"'{text(b)[:40]}'"
        if apart is None:
            raise _Mismatch(f"{one} ({spell(left)}) and {other} ({spell(right)}) have different dimensions")
        raise _Mismatch(f"the unit of {one} is {apart:.4g} times that of {other}; give both the same unit")
    return right if left is None else left


def _combine(a: Dimension, b: Dimension, sign: float) -> Dimension:
    if a is None or b is None:
        return None
    total = {base: a.get(base, 0.0) + sign * b.get(base, 0.0) for base in a.keys() | b.keys()}
    return times(total, 1.0)


def _remedy(
    model: Model, expression: Expression, dimensions: Mapping[str, Dimension], wanted: Dimension
) -> str:
    """Return the unit that would fit, if a term is one parameter times something."""
    factors = _factors(expression)
    mine = [f.id for f, sign in factors if isinstance(f, Name) and f.id in model.parameters and sign > 0]
    if len(mine) != 1:
        return ""
    fits = wanted
    for factor, sign in factors:
        try:
            fits = fits if factor == Name(mine[0]) else _combine(fits, _of(factor, dimensions), -sign)
        except _Mismatch:
            return ""
    unit = spell(fits, exact=True) if fits is not None else ""
    return f"; {mine[0]} in {unit} would fit".replace("in a pure number", "without a unit") if unit else ""


def _factors(expression: Expression, sign: float = 1.0) -> list[tuple[Expression, float]]:
    """Return the factors of a product (1) and of its denominator (-1)."""
    match expression:
        case Apply(function="*" | "/" as how, arguments=(a, b)):
            return [*_factors(a, sign), *_factors(b, sign if how == "*" else -sign)]
        case _:
            return [(expression, sign)]
