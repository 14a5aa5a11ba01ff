"""The equations of a model as a paper prints them, and its terms as rows of a table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape

from discovery.models import Model, Parameter, State
from discovery.report import mathml
from discovery.report.run import pretty_unit
from discovery.report.text import number
from discovery.terms import Apply, Expression, Term, names, text


@dataclass(frozen=True)
class Value:
    """A parameter in print."""

    name: str
    symbol: str
    value: str
    interval: str
    unit: str
    weak: bool = False  # the interval holds zero

    @property
    def plain(self) -> str:
        """In one line of text, as a saved table holds it."""
        return f"{self.name} = {self.value} {self.unit}".rstrip() + f" ({self.interval})"


@dataclass(frozen=True)
class Row:
    """One term: where it acts, its formula, its numbers, its share of what moves its state."""

    name: str
    place: str
    formula: str
    plain: str
    values: tuple[Value, ...]
    share: float | None
    effect: str


_LINE = 34
_COLUMN = 32  # of a formula in the table of terms


def symbols(model: Model) -> dict[str, str]:
    """Bodies are printed by their temperature: T with the body as index."""
    return {
        name: mathml.temperature(name)
        for name, state in model.states.items()
        if state.capacity or state.unit in ("degC", "K")
    }


def equations(model: Model) -> list[str]:
    """One MathML block for each state and output."""
    signs = symbols(model)
    lines = [_balance(model, state, signs) for state in model.states.values()]
    return lines + [
        _equation(_read(name, model, signs), _summands(tree, signs)) for name, tree in model.outputs.items()
    ]


def _read(name: str, model: Model, signs: Mapping[str, str]) -> str:
    """Return the symbol of an output. An output with the name of a state is the reading of that state."""
    body = signs.get(name) or mathml.symbol(name)
    return f"<msup><mrow>{body}</mrow><mtext>read</mtext></msup>" if name in model.states else body


def _balance(model: Model, state: State, signs: Mapping[str, str]) -> str:
    unknown = signs.get(state.name) or mathml.symbol(state.name)
    left = f"<mfrac><mrow><mi>d</mi>{unknown}</mrow><mrow><mi>d</mi><mi>t</mi></mrow></mfrac>"
    if state.capacity:
        index = escape(state.name.replace("_", " "))
        left = f"<msub><mi>C</mi><mtext>{index}</mtext></msub><mspace width='0.17em'/>{left}"
    parts = []
    for term in model.terms:
        for sign, place in (("+", term.into), ("−", term.source)):
            if place == state.name:
                body = mathml.stacked(mathml.lines(term.expression, signs))
                if _is_sum(term.expression) and sign == "−":
                    body = mathml.bracketed(body)
                parts.append((sign, body, mathml.extent(term.expression)))
    return _equation(left, parts)


def _summands(tree: Expression, signs: Mapping[str, str]) -> list[tuple[str, str, int]]:
    """The summands of a sum with their signs and lengths."""
    if isinstance(tree, Apply) and tree.function in ("+", "-") and len(tree.arguments) == 2:
        left, right = tree.arguments
        body = mathml.stacked(mathml.lines(right, signs))
        if _is_sum(right):
            body = mathml.bracketed(body)
        return [*_summands(left, signs), ("+" if tree.function == "+" else "−", body, mathml.extent(right))]
    return [("+", mathml.stacked(mathml.lines(tree, signs)), mathml.extent(tree))]


def _equation(left: str, parts: list[tuple[str, str, int]]) -> str:
    """Return an equation. Its right side is broken between summands if it is too long."""
    lines: list[str] = [""]
    room = _LINE
    for index, (sign, body, length) in enumerate(parts):
        if index and length > room:
            lines.append("")
            room = _LINE
        lead = "" if index == 0 and sign == "+" else f'<mo form="infix">{sign}</mo>'
        lines[-1] += f"{lead}<mrow>{body}</mrow>"
        room -= length
    rows = [
        f"<mtr><mtd>{left}</mtd><mtd><mo>=</mo></mtd><mtd><mrow>{lines[0] or '<mn>0</mn>'}</mrow></mtd></mtr>"
    ]
    rows += [f"<mtr><mtd></mtd><mtd></mtd><mtd><mrow>{line}</mrow></mtd></mtr>" for line in lines[1:]]
    return mathml.math(f'<mtable class="equation-lines">{"".join(rows)}</mtable>', block=True)


def _is_sum(tree: Expression) -> bool:
    return getattr(tree, "function", "") in ("+", "-")


def rows(model: Model, shares: Mapping[str, float] | None = None) -> list[Row]:
    """A row for each term, largest share first where shares are known."""
    shares = shares or {}
    found = [_row(model, term, shares.get(term.name)) for term in model.terms]
    return sorted(found, key=lambda row: -(row.share if row.share is not None else 0.0))


def _row(model: Model, term: Term, share: float | None) -> Row:
    used = [name for name, p in model.parameters.items() if not p.fixed and name in names(term.expression)]
    place = f"{term.source} → {term.into}" if term.source else f"into {term.into}"
    formula = mathml.math(mathml.stacked(mathml.lines(term.expression, symbols(model), _COLUMN)))
    values = tuple(value(name, model.parameters[name]) for name in used)
    return Row(term.name, place, formula, text(term.expression), values, share, term.effect)


def other_values(model: Model) -> list[Value]:
    """Parameters that were given, or stand in outputs or start values only."""
    used = frozenset().union(*(names(term.expression) for term in model.terms))
    return [value(name, p) for name, p in model.parameters.items() if p.fixed or name not in used]


def value(name: str, parameter: Parameter) -> Value:
    """A parameter in print: value, 95 % interval (or "given"), unit."""
    symbol, unit = mathml.math(mathml.symbol(name)), pretty_unit(parameter.unit)
    if parameter.values:
        each = ", ".join(
            f"{recording}: {number(one)}{_between(parameter.intervals.get(recording))}"
            for recording, one in parameter.values.items()
        )
        return Value(name, symbol, each, "by recording", unit)
    if parameter.fixed:
        return Value(name, symbol, number(parameter.value), "given", unit)
    low, high = parameter.low, parameter.high
    if low is None or high is None:
        return Value(name, symbol, number(parameter.value), "–", unit)
    return Value(
        name, symbol, number(parameter.value), f"{number(low)} to {number(high)}", unit, low <= 0 <= high
    )


def _between(interval: tuple[float, float] | None) -> str:
    return f" ({number(interval[0])} to {number(interval[1])})" if interval else ""


def capacities(model: Model) -> list[tuple[str, str]]:
    """(state, heat capacity) of the states that have one."""
    return [
        (name, f"{number(state.capacity / 1000)} kJ/K")
        for name, state in model.states.items()
        if state.capacity
    ]
