"""Do the units of a model's expressions fit together? Warnings, since literals may carry a unit that nobody
wrote.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from discovery.models.model import Model
from discovery.recordings import Channel
from discovery.terms import Apply, Expression, Name, Number, text
from discovery.terms.expression import COMPARISONS

if TYPE_CHECKING:
    from collections.abc import Callable

# Exponents of the base quantities; None: a wildcard, of any dimension.
Dimension = Mapping[str, float] | None
_SAME = ("+", "-", "min", "max", *COMPARISONS)
_PURE = ("exp", "log", "tanh")
_TURNS = ("revolutions_per_minute", "revolution", "turn", "radian", "degree")


class _Mismatch(Exception):  # noqa: N818  (control flow, caught here)
    """Two units that cannot meet."""


def same_dimension(one: str, other: str) -> bool:
    """Whether two units measure the same quantity; False for a unit that is not known."""
    return _known(one) and _known(other) and _dimension(one) == _dimension(other)


def check_dimensions(model: Model, channels: Mapping[str, Channel]) -> list[str]:
    """A sentence for each term and output whose units do not fit; empty when all do.

    A literal is a wildcard, and so is whatever it is multiplied with: its unit is not written down. An angle
    counts as a dimension (rpm is not 1/s), a temperature as an absolute one (a difference of degC is a K).
    """
    units = {name: p.unit for name, p in model.parameters.items()}
    units |= {name: s.unit for name, s in model.states.items()}
    units |= {name: c.unit for name, c in channels.items() if name not in units} | {"time": "s"}
    sentences = [
        f"model '{model.name}': the unit '{u}' of {n} is not known" for n, u in units.items() if not _known(u)
    ]
    dimensions = {name: _dimension(unit) for name, unit in units.items()}
    for term in model.terms:
        state = model.states[term.into]
        wanted, name = (
            ("W", "W, a heat flow")
            if state.capacity
            else (f"({differences(state.unit)})/({model.time_unit})", f"{state.unit}/{model.time_unit}")
        )
        found = _compare(term.expression, dimensions, _dimension(wanted), name)
        if found:
            sentences.append(f"model '{model.name}', term '{term.name}': {found}")
    for name, expression in model.outputs.items():
        unit = channels[name].unit if name in channels else None
        found = _compare(expression, dimensions, _dimension(unit) if unit else None, unit or "")
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
    dimensions = {name: _dimension(unit) for name, unit in units.items()}
    parameters = dict(model.parameters)
    for term in model.terms:
        match term.expression:
            case Apply("*", (Name(coefficient), rest)) if coefficient in parameters:
                state = model.states[term.into]
                rate = "W" if state.capacity else f"{differences(state.unit)}/{model.time_unit}"
                if not _compare(term.expression, dimensions, _dimension(rate), rate):
                    continue
                of = unit_of(rest, units)
                unit = rate if of == "1" else f"{rate}/({of})" if set("*/") & set(of) else f"{rate}/{of}"
                parameters[coefficient] = replace(parameters[coefficient], unit=unit)
            case _:
                pass
    return replace(model, parameters=parameters)


def unit_of(expression: Expression, units: Mapping[str, str]) -> str:
    """Unit of an expression from those of its names; literals have none, a difference of degC has K.

    >>> from discovery.terms import parse
    >>> unit_of(parse("pump*(T_env - 21.9)*speed**2"), {"pump": "1", "T_env": "degC", "speed": "rpm"})
    'K*rpm**2'
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
            base = unit_of(a, units)
            return (
                "1"
                if base == "1"
                else f"({base})**{power:g}"
                if set("*/") & set(base)
                else f"{base}**{power:g}"
            )
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


def _first_unit(expressions: Sequence[Expression], units: Mapping[str, str]) -> str:
    return next((unit for e in expressions if (unit := unit_of(e, units)) != "1"), "1")


def _compare(
    expression: Expression, dimensions: Mapping[str, Dimension], wanted: Dimension, name: str
) -> str | None:
    try:
        found = _of(expression, dimensions)
    except _Mismatch as mismatch:
        return str(mismatch)
    if found is not None and wanted is not None and found != wanted:
        return f"'{text(expression)[:60]}' has the dimension {_spell(found)} where {name} is expected"
    return None


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
            if power:
                raise _Mismatch(
                    f"the exponent '{text(b)}' has the dimension {_spell(power)}; it must be a pure number"
                )
            if base == {}:
                return {}
            return _times(base, b.value) if base is not None and isinstance(b, Number) else None
        case Apply(function="sqrt", arguments=(a,)):
            inner = _of(a, dimensions)
            return None if inner is None else _times(inner, 0.5)
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
            if inner:
                raise _Mismatch(
                    f"{function}() of '{text(a)}', which is {_spell(inner)}; it must be a pure number"
                )
            return {}
        case Apply(function="sign"):
            return {}
        case Apply(function="lag" | "delay", arguments=(a, seconds)):
            duration = _of(seconds, dimensions)
            if duration not in (None, {"[time]": 1.0}):
                raise _Mismatch(f"'{text(seconds)}' is a time in s but has the dimension {_spell(duration)}")
            return _of(a, dimensions)
        case Apply(arguments=arguments):  # abs, neg, play
            return _of(arguments[0], dimensions)


def _equal(a: Expression, b: Expression, dimensions: Mapping[str, Dimension]) -> Dimension:
    left, right = _of(a, dimensions), _of(b, dimensions)
    if left is not None and right is not None and left != right:
        raise _Mismatch(
            f"'{text(a)[:40]}' ({_spell(left)}) meets '{text(b)[:40]}' ({_spell(right)}), another dimension"
        )
    return right if left is None else left


def _combine(a: Dimension, b: Dimension, sign: float) -> Dimension:
    if a is None or b is None:
        return None
    total = {base: a.get(base, 0.0) + sign * b.get(base, 0.0) for base in a.keys() | b.keys()}
    return _times(total, 1.0)


def _times(a: Mapping[str, float], power: float) -> dict[str, float]:
    return {base: round(power * n, 9) for base, n in a.items() if abs(power * n) > 1e-9}


def _spell(dimension: Dimension) -> str:
    if not dimension:
        return "of a pure number"
    return " ".join(base + (f"^{n:g}" if n != 1 else "") for base, n in sorted(dimension.items()))


@lru_cache(maxsize=512)
def _dimension(unit: str) -> Dimension:
    if not _known(unit) or unit == "":
        return None
    if unit == "1":
        return {}
    parsed = _units()(unit)
    # rpm and rad count turns, which pint holds for a pure number
    turns = sum(float(n) for name, n in parsed._units.items() if name in _TURNS)
    found = {str(base): float(n) for base, n in parsed.dimensionality.items()}
    return found | ({"[angle]": turns} if turns else {})


@lru_cache(maxsize=512)
def _known(unit: str) -> bool:
    if unit in ("", "1"):
        return True
    try:
        _units()(unit)
    except Exception:  # pint's parser fails in many ways
        return False
    return True


@lru_cache(maxsize=1)
def _units() -> Callable[[str], Any]:
    import pint

    registry: Any = pint.UnitRegistry()

    def parse(unit: str) -> Any:
        return registry.Unit(differences(unit))

    return parse


def differences(unit: str) -> str:
    """degC counts as K: here only dimensions matter."""
    return unit.replace("delta_degC", "K").replace("degC", "K").replace("degF", "K")
