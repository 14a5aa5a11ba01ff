"""Values and exact first derivatives of expressions, vectorised over time (forward-mode differentiation).

An expression is compiled once into a list of array operations, derivatives included and equal operations
shared; it is then run on all instants at once. Sparse by construction: a name that does not occur costs
nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from discovery.terms.expression import Apply, Expression, Name, Number

Array = NDArray[np.float64]
Value = float | Array


@dataclass(slots=True)
class Dual:
    """Value (scalar or (N,)) and partial derivatives by name (scalar or (N,))."""

    value: Value
    partials: dict[str, Value] = field(default_factory=dict)


class Memory(Protocol):
    """What an expression with memory asks of the recording it is evaluated on."""

    def delayed(self, channel: str, seconds: float) -> tuple[Array, Array]:
        """Channel `seconds` ago, and its derivative with respect to `seconds`."""

    def lagged(self, value: Array, time_constant: float) -> Array:
        """First-order lag that starts settled."""

    def play(self, value: Array, width: float) -> tuple[Array, NDArray[np.intp], Array]:
        """Play operator: output, index of the instant it follows, sign of the contact (0 at rest)."""


def evaluate(
    expression: Expression,
    values: Mapping[str, Value],
    wrt: frozenset[str] = frozenset(),
    memory: Memory | None = None,
) -> Dual:
    """Value and derivatives of an expression.

    Args:
        expression: tree from `parse`.
        values: name -> scalar or (N,) array.
        wrt: names to differentiate by.
        memory: needed by `delay`, `play` and, along a given trajectory, `lag`.

    Raises:
        KeyError: a name without a value.

    >>> from discovery.terms import parse
    >>> d = evaluate(parse("a*x**2"), {"a": 3.0, "x": np.array([1.0, 2.0])}, frozenset({"a", "x"}))
    >>> d.value.tolist(), d.partials["x"].tolist(), d.partials["a"].tolist()
    ([3.0, 12.0], [6.0, 12.0], [1.0, 4.0])
    """
    return compiled((expression,), wrt).run(values, memory)[0]


@dataclass(frozen=True, slots=True)
class Program:
    """Several expressions with their derivatives as operations in order: each makes one number, scalar or
    (N,), from numbers made before.
    """

    loads: tuple[tuple[int, str], ...]
    constants: tuple[tuple[int, Any], ...]
    operations: tuple[tuple[int, Callable[..., Any], tuple[int, ...]], ...]
    memories: frozenset[int]  # operations that also get the memory of the recording
    size: int
    results: tuple[tuple[int, tuple[tuple[str, int], ...]], ...]  # value and derivatives of each expression

    def run(self, values: Mapping[str, Value], memory: Memory | None = None) -> list[Dual]:
        """Value and derivatives of each expression, as `evaluate` gives them."""
        # what is undefined is NaN or infinite; the caller sees a trajectory run away
        with np.errstate(all="ignore"):
            return self._run(values, memory)

    def _run(self, values: Mapping[str, Value], memory: Memory | None) -> list[Dual]:
        made: list[Any] = [None] * self.size
        for place, name in self.loads:
            value = values[name]
            # numpy's numbers divide by zero without a crash
            made[place] = value if isinstance(value, np.ndarray) else np.float64(value)
        for place, number in self.constants:
            made[place] = number
        if self.memories:
            for place, function, arguments in self.operations:
                given = [made[a] for a in arguments]
                made[place] = function(memory, *given) if place in self.memories else function(*given)
        else:
            for place, function, arguments in self.operations:
                made[place] = function(*[made[a] for a in arguments])
        return [
            Dual(made[value], {name: made[place] for name, place in partials})
            for value, partials in self.results
        ]


@dataclass(slots=True)
class _Node:
    """Where a value stands in a program, and its derivatives by name."""

    value: int
    partials: dict[str, int] = field(default_factory=dict)


class _Builder:
    """Collects operations; equal ones become one, products with zero and one vanish."""

    def __init__(self, wrt: frozenset[str]) -> None:
        self.wrt = wrt
        self.numbers: Mapping[str, float] = {}  # names that stand for numbers
        self.loads: dict[str, int] = {}
        self.constants: dict[float, int] = {}
        self.known: dict[tuple[object, ...], int] = {}
        self.operations: list[tuple[int, Callable[..., Any], tuple[int, ...]]] = []
        self.memories: set[int] = set()
        self.size = 0

    def _place(self) -> int:
        self.size += 1
        return self.size - 1

    def constant(self, value: float) -> int:
        if value not in self.constants:
            self.constants[value] = self._place()
        return self.constants[value]

    def load(self, name: str) -> int:
        if name not in self.loads:
            self.loads[name] = self._place()
        return self.loads[name]

    def call(self, function: Callable[..., Any], *arguments: int, memory: bool = False) -> int:
        key = (function, *arguments)
        if key not in self.known:
            place = self._place()
            self.known[key] = place
            self.operations.append((place, function, arguments))
            if memory:
                self.memories.add(place)
        return self.known[key]

    def times(self, a: int, b: int) -> int:
        one = self.constant(1.0)
        return b if a == one else a if b == one else self.call(np.multiply, a, b)

    def program(self, nodes: Iterable[_Node]) -> Program:
        """All operations, for the values and derivatives of some nodes."""
        return Program(
            tuple((place, name) for name, place in self.loads.items()),
            tuple((place, np.float64(value)) for value, place in self.constants.items()),
            tuple(self.operations),
            frozenset(self.memories),
            self.size,
            tuple((node.value, tuple(node.partials.items())) for node in nodes),
        )

    def chain(self, value: int, pieces: list[tuple[int, _Node]]) -> _Node:
        """Chain rule: sum of (outer derivative) times (inner partials)."""
        partials: dict[str, int] = {}
        for outer, node in pieces:
            for name, partial in node.partials.items():
                product = self.times(outer, partial)
                partials[name] = self.call(np.add, partials[name], product) if name in partials else product
        return _Node(value, partials)

    def node(self, expression: Expression) -> _Node:
        match expression:
            case Number(value=number):
                return _Node(self.constant(float(number)))
            case Name(id=name) if name in self.numbers:
                return _Node(self.constant(self.numbers[name]))
            case Name(id=name):
                return _Node(self.load(name), {name: self.constant(1.0)} if name in self.wrt else {})
            case Apply(function=function, arguments=arguments):
                if function == "delay" and isinstance(arguments[0], Name):
                    return self._delay(arguments[0].id, self.node(arguments[1]))
                of = [self.node(argument) for argument in arguments]
                if function == "lag":
                    # a model's own lags are states (models.expanded); these are those of candidates
                    return _Node(self.call(_lagged, of[0].value, of[1].value, memory=True))
                return self._play(*of) if function == "play" else self._apply(function, of)

    def _delay(self, channel: str, seconds: _Node) -> _Node:
        both = self.call(_delayed(channel), seconds.value, memory=True)
        late, slope = self.call(_first, both), self.call(_second, both)
        found = self.chain(late, [(slope, seconds)])
        if channel in self.wrt:  # a channel that moves by a constant moved as much a while ago
            one = self.constant(1.0)
            before = found.partials.get(channel)
            found.partials[channel] = one if before is None else self.call(np.add, before, one)
        return found

    def _play(self, inner: _Node, width: _Node) -> _Node:
        played = self.call(_played, inner.value, width.value, memory=True)
        value, contact = self.call(_first, played), self.call(_third, played)
        partials = {name: self.call(_followed, played, place) for name, place in inner.partials.items()}
        for name, place in width.partials.items():
            loss = self.call(np.multiply, contact, place)
            before = partials.get(name, self.constant(0.0))
            partials[name] = self.call(np.subtract, before, loss)
        return _Node(value, partials)

    def _apply(self, function: str, a: list[_Node]) -> _Node:
        x = a[0].value
        y = a[1].value if len(a) > 1 else x
        call, constant = self.call, self.constant
        one, minus = constant(1.0), constant(-1.0)
        match function:
            case "+":
                return self.chain(call(np.add, x, y), [(one, a[0]), (one, a[1])])
            case "-":
                return self.chain(call(np.subtract, x, y), [(one, a[0]), (minus, a[1])])
            case "*":
                return self.chain(self.times(x, y), [(y, a[0]), (x, a[1])])
            case "/":
                value = call(np.divide, x, y)
                if not (a[0].partials or a[1].partials):
                    return _Node(value)
                below = call(np.divide, one, y)
                return self.chain(value, [(below, a[0]), (call(_slope_below, x, y), a[1])])
            case "**":
                return self._power(a[0], a[1])
            case "neg":
                return self.chain(call(np.negative, x), [(minus, a[0])])
            case "<" | "<=" | ">" | ">=" | "==" | "!=":
                return _Node(call(_COMPARISONS[function], x, y))
            case "sign":
                return _Node(call(np.sign, x))
            case "where":
                inside = call(_is_on, x)
                names = a[1].partials.keys() | a[2].partials.keys()
                zero = constant(0.0)
                # selected, so that the other branch may be NaN
                partials = {
                    n: call(np.where, inside, a[1].partials.get(n, zero), a[2].partials.get(n, zero))
                    for n in sorted(names)
                }
                return _Node(call(np.where, inside, y, a[2].value), partials)
            case "min" | "max":
                pick, result = (np.minimum if function == "min" else np.maximum), a[0]
                for other in a[1:]:
                    value = call(pick, result.value, other.value)
                    if result.partials or other.partials:
                        first = call(_same, value, result.value)
                        result = self.chain(value, [(first, result), (call(np.subtract, one, first), other)])
                    else:
                        result = _Node(value)
                return result
        value = call(_FUNCTIONS[function], x)
        return (
            self.chain(value, [(call(_SLOPES[function], x, value), a[0])]) if a[0].partials else _Node(value)
        )

    def _power(self, base: _Node, exponent: _Node) -> _Node:
        value = self.call(_power, base.value, exponent.value)
        pieces = []
        if base.partials:
            pieces.append((self.call(_power_slope, base.value, exponent.value), base))
        if exponent.partials:
            pieces.append((self.call(_power_growth, base.value, value), exponent))
        return self.chain(value, pieces)


@lru_cache(maxsize=8192)
def compiled(expressions: tuple[Expression, ...], wrt: frozenset[str]) -> Program:
    """The program of several expressions, equal parts of them shared."""
    build = _Builder(wrt)
    return build.program([build.node(expression) for expression in expressions])


def program_of(expressions: Iterable[tuple[Expression, Mapping[str, float]]]) -> Program:
    """The program of several expressions, without derivatives, some names of each at numbers of its own."""
    build, nodes = _Builder(frozenset()), []
    for expression, build.numbers in expressions:
        nodes.append(build.node(expression))
    return build.program(nodes)


def _compared(function: Callable[..., Any]) -> Callable[..., Any]:
    return lambda x, y: function(x, y) * 1.0


_COMPARISONS = {
    "<": _compared(np.less),
    "<=": _compared(np.less_equal),
    ">": _compared(np.greater),
    ">=": _compared(np.greater_equal),
    "==": _compared(np.equal),
    "!=": _compared(np.not_equal),
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "abs": np.abs,
    "exp": lambda x: np.exp(np.minimum(x, 500.0)),  # beyond this a fit has left all physics; keep it finite
    "log": np.log,
    "sqrt": np.sqrt,
    "tanh": np.tanh,
}
_SLOPES: dict[str, Callable[..., Any]] = {  # of the argument and the value
    "abs": lambda x, _: np.sign(x),
    "exp": lambda _, value: value,
    "log": lambda x, _: 1.0 / x,
    "sqrt": lambda _, value: 0.5 / np.maximum(value, 1e-12),
    "tanh": lambda _, value: 1.0 - value * value,
}


def _is_on(x: Value) -> Any:
    return np.not_equal(x, 0.0)


def _same(x: Value, y: Value) -> Any:
    return np.equal(x, y) * 1.0


def _slope_below(x: Any, y: Any) -> Any:
    return -x / (y * y)


_PRODUCTS = (2.0, 3.0, 4.0)


def _power(x: Any, p: Any) -> Any:
    if np.ndim(p) or p not in _PRODUCTS:
        return np.power(x, p)
    square = x * x  # numpy's power takes ten times as long as products
    return square if p == 2.0 else square * x if p == 3.0 else square * square


def _power_slope(x: Any, p: Any) -> Any:
    # 0**p has no slope to speak of for 0 < p < 1; a finite one keeps Newton steps finite.
    if np.ndim(p) == 0 and p in _PRODUCTS:
        return p * (x if p == 2.0 else _power(x, p - 1.0))
    floor = np.where(np.abs(x) < 1e-9, 1e-9, x)
    return p * np.power(floor, p - 1.0)


def _power_growth(x: Any, value: Any) -> Any:
    return np.where(x > 0, value * np.log(np.where(x > 0, x, 1.0)), 0.0)


@lru_cache(maxsize=256)
def _delayed(channel: str) -> Callable[..., Any]:
    def of(memory: Memory | None, seconds: Value) -> Any:
        assert memory is not None
        return memory.delayed(channel, float(np.mean(seconds)))

    return of


def _lagged(memory: Memory | None, inner: Value, tau: Value) -> Any:
    assert memory is not None
    return memory.lagged(np.asarray(inner, dtype=float), float(np.mean(tau)))


def _played(memory: Memory | None, inner: Value, width: Value) -> Any:
    if memory is None:  # a single instant: at rest in the middle
        return inner, None, np.float64(0.0)
    return memory.play(np.atleast_1d(np.asarray(inner, dtype=float)), float(np.mean(width)))


def _followed(played: Any, partial: Value) -> Any:
    value, follows, _ = played
    if follows is None:
        return partial
    # before any contact it rests where it began, and moves with that
    return np.broadcast_to(np.asarray(partial, dtype=float), np.shape(value))[follows]


def _first(several: Any) -> Any:
    return several[0]


def _second(several: Any) -> Any:
    return several[1]


def _third(several: Any) -> Any:
    return several[2]
