"""An exported model as three straight-line programs: start values, rates with their Jacobian, outputs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from discovery.errors import UserError
from discovery.export.differentiate import Memory, Node, compile_expression
from discovery.export.program import Builder, Program
from discovery.models import Model, expanded
from discovery.terms import Apply, Expression, Name, Term, degree, names, text
from discovery.terms.expression import rewrite

MAX_DELAY_STEPS = 20_000  # a controller keeps every one of them
_ROUNDS = 8  # of Newton towards a balance that is not linear


@dataclass(frozen=True)
class Delay:
    """An input `whole + part` steps ago; `part` is below 1."""

    input: int
    whole: int
    part: float

    @property
    def length(self) -> int:
        """Values of the ring that keeps the input."""
        return self.whole + 2


@dataclass(frozen=True)
class Compiled:
    """A model ready to be stepped or printed.

    Results of the programs:
        start:   x (n), plays (P)
        rates:   dx/dt (n), nonzeros of A = d(dx/dt)/dx, plays (P)
        outputs: y (Y), plays (P)
    """

    name: str
    step_s: float
    inputs: tuple[str, ...]
    states: tuple[str, ...]
    outputs: tuple[str, ...]
    delays: tuple[Delay, ...]
    plays: int
    nonzeros: tuple[tuple[int, int], ...]  # (row, column) of the Jacobian
    parameters: tuple[tuple[str, float], ...]  # name and value, in the order of their loads
    start: Program
    rates: Program
    results: Program

    @property
    def offsets(self) -> list[int]:
        """Where the ring of each delay begins among all rings."""
        return [sum(delay.length for delay in self.delays[:k]) for k in range(len(self.delays))]


@dataclass
class _Running:
    """Memory of a running model: delays and plays are loads; the plays' new values are collected."""

    delays: Mapping[Apply, int]
    plays: Mapping[Apply, int]
    moved: dict[int, int] = field(default_factory=dict)

    def delayed(self, build: Builder, expression: Apply) -> int:
        return build.load("delayed", self.delays[expression])

    def played(self, build: Builder, expression: Apply, inner: int, width: int) -> tuple[int, int]:
        slot, half = self.plays[expression], build.apply("abs", width)
        below, above = build.apply("-", inner, half), build.apply("+", inner, half)
        value = build.apply("max", below, build.apply("min", above, build.load("played", slot)))
        self.moved[slot] = value
        return value, build.apply("max", build.apply("==", value, below), build.apply("==", value, above))


@dataclass
class _AtStart:
    """Memory at the first instant: the input never changed before, a play rests in the middle."""

    inputs: Mapping[str, Node]

    def delayed(self, build: Builder, expression: Apply) -> int:  # noqa: ARG002
        channel = expression.arguments[0]
        assert isinstance(channel, Name)
        return self.inputs[channel.id].value

    def played(self, build: Builder, expression: Apply, inner: int, width: int) -> tuple[int, int]:  # noqa: ARG002
        return inner, build.constant(1.0)


def model_inputs(model: Model) -> tuple[str, ...]:
    """Channels that the model reads, those of its start values included, in the order of every target."""
    model = expanded(model)
    own = {*model.states, *model.parameters, "time"}
    return tuple(sorted({*model.inputs, *model.start_names} - own))


def compile_model(model: Model, step_s: float) -> Compiled:
    """The programs of a model with its parameters at their values and a fixed step [s].

    Raises:
        UserError: a delay that is no constant, is negative, or is longer than a controller can keep.
    """
    model = expanded(model)
    inputs, states = model_inputs(model), tuple(model.states)
    build = Builder()
    common = {name: Node(build.load("parameter", k)) for k, name in enumerate(model.parameters)}
    fixed = {name: Node(build.constant(p.value)) for name, p in model.parameters.items()}
    fed = {name: Node(build.load("input", i)) for i, name in enumerate(inputs)}
    delays, plays = _with_memory(model, build, {**fixed, **fed}, inputs, step_s)
    kept = {apply: k for k, apply in enumerate(delays)}
    slots = {apply: k for k, apply in enumerate(plays)}

    start = _start_program(model, build, {**common, **fed}, _AtStart(fed), plays)
    running = _Running(kept, slots)
    one = build.constant(1.0)
    env = {**common, **fed, "time": Node(build.load("time"))}
    env |= {name: Node(build.load("state", i), {name: one}) for i, name in enumerate(states)}
    rates, jacobian, notes = _rates(model, build, env, running)
    read = [
        compile_expression(build, expression, env, running).value for expression in model.outputs.values()
    ]
    shown = [
        (node, f"{name} = {text(expression)}")
        for node, (name, expression) in zip(read, model.outputs.items(), strict=True)
    ]
    for apply in plays:
        compile_expression(build, apply, env, running)
    moved = [running.moved[k] for k in range(len(plays))]
    return Compiled(
        model.name,
        step_s,
        inputs,
        states,
        tuple(model.outputs),
        tuple(delays.values()),
        len(plays),
        tuple(jacobian),
        tuple((name, p.value) for name, p in model.parameters.items()),
        start,
        build.program([*rates, *jacobian.values(), *moved], notes),
        build.program([*read, *moved], shown),
    )


def _start_program(
    model: Model, build: Builder, fed: Mapping[str, Node], rest: _AtStart, plays: Sequence[Apply]
) -> Program:
    """Start values of the states from channels and parameters, or in the balance of their terms; plays at
    rest.
    """
    zero = Node(build.constant(0.0))
    known = {**dict.fromkeys(model.states, zero), **fed, "time": zero}
    first = {
        name: Node(compile_expression(build, state.start, known, rest).value)
        if state.start is not None
        else zero
        for name, state in model.states.items()
    }
    free = [name for name, state in model.states.items() if state.start is None]
    affine = all(degree(term.expression, frozenset(free)) <= 1 for term in model.terms)
    for _ in range((1 if affine else _ROUNDS) if free else 0):
        first |= _nearer_to_balance(model, build, {**known, **first}, rest, free)
    known |= first
    at_rest = [compile_expression(build, apply, known, rest).value for apply in plays]
    return build.program([*(node.value for node in first.values()), *at_rest])


def _nearer_to_balance(
    model: Model, build: Builder, known: Mapping[str, Node], rest: _AtStart, free: Sequence[str]
) -> dict[str, Node]:
    """Some states after a step of Newton towards the balance of their terms."""
    one = build.constant(1.0)
    rates, slopes, _ = _rates(
        model, build, {**known, **{name: Node(known[name].value, {name: one}) for name in free}}, rest
    )
    index = [list(model.states).index(name) for name in free]
    zero = build.constant(0.0)
    matrix = [[slopes.get((i, j), zero) for j in index] for i in index]
    change = _solution(build, matrix, [rates[i] for i in index])
    return {
        name: Node(build.apply("-", known[name].value, by)) for name, by in zip(free, change, strict=True)
    }


def _solution(build: Builder, matrix: list[list[int]], right: list[int]) -> list[int]:
    """The solution of matrix x = right by elimination. What leaves a body grows with its own temperature more
    than with any other, so no rows are exchanged; what does not move with itself (an integral) stays.
    """
    apply, zero, one = build.apply, build.constant(0.0), build.constant(1.0)
    inverse = []
    for k, row in enumerate(matrix):
        none = apply("==", row[k], zero)
        inverse.append(apply("select", none, zero, apply("/", one, apply("select", none, one, row[k]))))
        for below in range(k + 1, len(matrix)):
            factor = apply("*", matrix[below][k], inverse[k])
            matrix[below] = [
                apply("-", a, apply("*", factor, b)) for a, b in zip(matrix[below], row, strict=True)
            ]
            right[below] = apply("-", right[below], apply("*", factor, right[k]))
    found: list[int] = [zero] * len(matrix)
    for k in reversed(range(len(matrix))):
        others = build.sum([apply("*", matrix[k][c], found[c]) for c in range(k + 1, len(matrix))])
        found[k] = apply("*", apply("-", right[k], others), inverse[k])
    return found


def _rates(
    model: Model, build: Builder, env: Mapping[str, Node], running: Memory
) -> tuple[list[int], dict[tuple[int, int], int], list[tuple[int, str]]]:
    """dx/dt of each state, the nonzeros of their Jacobian by row and column, and a note on each term."""
    nodes = [compile_expression(build, term.expression, env, running) for term in model.terms]
    notes = [(node.value, _said(term)) for node, term in zip(nodes, model.terms, strict=True)]
    rates, jacobian = [], {}
    for i, (name, state) in enumerate(model.states.items()):
        scale = build.constant(state.scale)
        entering = [node for node, term in zip(nodes, model.terms, strict=True) if term.into == name]
        leaving = [node for node, term in zip(nodes, model.terms, strict=True) if term.source == name]
        rates.append(_net(build, scale, [n.value for n in entering], [n.value for n in leaving]))
        for j, other in enumerate(model.states):
            gain = _net(
                build,
                scale,
                [n.partials[other] for n in entering if other in n.partials],
                [n.partials[other] for n in leaving if other in n.partials],
            )
            if build.constant_of(gain) != 0.0:
                jacobian[i, j] = gain
    return rates, jacobian, notes


def _said(term: Term) -> str:
    """A term in words, for the comment next to its number."""
    leaving = f", out of {term.source}" if term.source is not None else ""
    return f"{term.name}: {text(term.expression)}, into {term.into}{leaving}"


def _net(build: Builder, scale: int, entering: list[int], leaving: list[int]) -> int:
    total = build.sum(entering)
    for node in leaving:
        total = build.apply("-", total, node)
    return build.apply("*", scale, total)


def _with_memory(
    model: Model, build: Builder, known: Mapping[str, Node], inputs: tuple[str, ...], step_s: float
) -> tuple[dict[Apply, Delay], list[Apply]]:
    """Return the delays and plays of a model, each one time, inner plays before outer ones."""
    delays: dict[Apply, Delay] = {}
    plays: dict[Apply, None] = {}

    def visit(apply: Apply) -> Expression | None:
        if apply.function == "play":
            plays.setdefault(apply)
        if apply.function == "delay" and apply not in delays:
            delays[apply] = _delay(model, build, apply, known, inputs, step_s)
        return None

    for expression in model.expressions():
        rewrite(expression, visit)
    return delays, list(plays)


def _delay(
    model: Model,
    build: Builder,
    apply: Apply,
    known: Mapping[str, Node],
    inputs: tuple[str, ...],
    step_s: float,
) -> Delay:
    channel, duration = apply.arguments
    assert isinstance(channel, Name)
    if channel.id not in inputs:
        raise UserError(
            f"model '{model.name}': delay({channel.id}, ...) is not of an input; "
            "only a channel can be delayed"
        )
    seconds = None
    if names(duration) <= set(model.parameters):
        seconds = build.constant_of(compile_expression(build, duration, known, _AtStart({})).value)
    if seconds is None or not math.isfinite(seconds) or seconds < 0.0:
        raise UserError(
            f"model '{model.name}': the delay of {channel.id} must be a number of seconds from 0 up to be "
            "exported; it may hold parameters, no states and no channels"
        )
    steps = seconds / step_s
    if steps > MAX_DELAY_STEPS:
        raise UserError(
            f"model '{model.name}': the delay of {channel.id} is {seconds:.0f} s, {steps:.0f} steps of "
            f"{step_s:g} s; a controller keeps at most {MAX_DELAY_STEPS}: export with a longer step"
        )
    whole = math.floor(steps)
    return Delay(inputs.index(channel.id), whole, steps - whole)
