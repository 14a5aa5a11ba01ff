"""A model: states, terms, outputs and parameters, whoever wrote it down."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import reduce
from itertools import count

from discovery.terms import Apply, Expression, Name, Number, Term, names, substitute
from discovery.terms.expression import MEMORY, rewrite

TIME_UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0, "d": 86400.0}


@dataclass(frozen=True, slots=True)
class Parameter:
    """A number of the model: given, bounded or found.

    `value` is the start value before a fit and the estimate after it, `low` and `high` its 95 % interval.
    With `per_recording` every recording has its own, kept in `values`, with its interval in `intervals`;
    `spread` is the standard deviation about `value` in a recording that no fit has seen.
    `prior` penalises a fit: mean and standard deviation.
    """

    value: float
    unit: str = "1"
    min: float = -math.inf
    max: float = math.inf
    fixed: bool = False
    per_recording: bool = False
    low: float | None = None
    high: float | None = None
    values: Mapping[str, float] = field(default_factory=dict)
    intervals: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    prior: tuple[float, float] | None = None
    spread: float = 0.0

    def at(self, recording: str) -> float:
        """Value in a recording; the common value where the recording has none of its own."""
        return self.values.get(recording, self.value)


@dataclass(frozen=True, slots=True)
class State:
    """A state. With a capacity [J/K] its terms are heat flows in W, without it rates in `unit` per time unit.

    `start` is an expression of channels and parameters at the first instant, or None: the balance of its
    terms there. `start_sd` is the spread around it (0: exact). Without one, a state that an output shows as
    it is starts at the first reading of that output, known to the noise of a reading, and any other state
    has a spread that a fit finds. `start_with`: by state above it, how much of what that one begins off its
    start this one begins off, too; `start_sd` is then the spread of the rest. `scale` turns the sum of its
    terms into unit per second. `memory`: it is what a lag() remembers, no part of the machine.
    """

    name: str
    unit: str = "degC"
    capacity: float | None = None
    start: Expression | None = None
    start_sd: float | None = None
    scale: float = 1.0
    memory: bool = False
    start_with: Mapping[str, float] = field(default_factory=dict)
    read_as: str = ""  # output at whose first reading it starts; set where a model meets recordings


@dataclass(frozen=True)
class Model:
    """dx/dt = sum of terms, y = outputs(x, u)."""

    name: str
    parameters: Mapping[str, Parameter]
    states: Mapping[str, State]
    terms: tuple[Term, ...]
    outputs: Mapping[str, Expression]
    time_unit: str = "s"
    guessed: bool = False  # the start values are guesses, not what somebody knows

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the parameters that a fit may move."""
        return tuple(name for name, parameter in self.parameters.items() if not parameter.fixed)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names that are neither state nor parameter nor `time`: channels of the campaign."""
        used: set[str] = set()
        for expression in self.expressions():
            used |= names(expression)
        own = set(self.states) | set(self.parameters) | {"time"}
        return tuple(sorted(used - own))

    @property
    def start_names(self) -> frozenset[str]:
        """Names that the formulas of start values use."""
        starts = (state.start for state in self.states.values() if state.start is not None)
        return frozenset().union(*(names(start) for start in starts))

    @property
    def only_starting(self) -> frozenset[str]:
        """Names that the formulas of start values use, and nothing else."""
        return self.start_names - frozenset().union(*(names(one) for one in self.expressions()))

    def with_starts_held(self) -> Model:
        """The model with fixed values of the parameters that only its start values use.

        They belong to the first readings of a recording. A fit to later readings would change them to absorb
        what the model lacks.
        """
        parameters = {
            name: replace(parameter, fixed=parameter.fixed or name in self.only_starting)
            for name, parameter in self.parameters.items()
        }
        return replace(self, parameters=parameters)

    def expressions(self) -> list[Expression]:
        """Right-hand sides and outputs."""
        return [*(term.expression for term in self.terms), *self.outputs.values()]

    def values(self, recording: str = "") -> dict[str, float]:
        """Parameter values in a recording."""
        return {name: parameter.at(recording) for name, parameter in self.parameters.items()}

    def with_terms(
        self,
        *terms: Term,
        parameters: Mapping[str, Parameter] | None = None,
        states: Mapping[str, State] | None = None,
        outputs: Mapping[str, Expression] | None = None,
    ) -> Model:
        """The model with terms, parameters and states added and outputs replaced."""
        return replace(
            self,
            terms=self.terms + terms,
            parameters={**self.parameters, **(parameters or {})},
            states={**self.states, **(states or {})},
            outputs={**self.outputs, **(outputs or {})},
        )

    def with_values(self, values: Mapping[str, float]) -> Model:
        """The model with other parameter values and without their intervals."""
        parameters = {
            name: replace(parameter, value=float(values[name]), low=None, high=None, intervals={})
            if name in values
            else parameter
            for name, parameter in self.parameters.items()
        }
        return replace(self, parameters=parameters)


def in_time_unit(model: Model) -> Model:
    """The model with every rate per its time unit, as a file states it.

    A hidden state may count in seconds where the model counts in hours; its terms then take the factor.
    """
    unit = 1.0 / TIME_UNITS[model.time_unit]
    odd = {
        name: state.scale / unit
        for name, state in model.states.items()
        if not state.capacity and not math.isclose(state.scale, unit, rel_tol=1e-12)
    }
    if not odd:
        return model
    terms = []
    for term in model.terms:
        into, out = odd.get(term.into, 1.0), odd.get(term.source or "", 1.0)
        if (
            term.source is not None and into != out
        ):  # what enters and what leaves are no longer the same number
            leaving = Apply("*", (Number(-out), term.expression))
            terms.append(
                replace(term, name=f"{term.name}, leaving", into=term.source, source=None, expression=leaving)
            )
            term = replace(term, source=None)
        terms.append(
            term if into == 1.0 else replace(term, expression=Apply("*", (Number(into), term.expression)))
        )
    states = {
        name: replace(state, scale=unit) if name in odd else state for name, state in model.states.items()
    }
    return replace(model, terms=tuple(terms), states=states)


def shown_states(model: Model, outputs: Collection[str]) -> dict[str, str]:
    """States that an output shows directly: state -> output."""
    shown = {name: model.outputs.get(name, Name(name)) for name in outputs}
    return {e.id: name for name, e in reversed(shown.items()) if isinstance(e, Name) and e.id in model.states}


def read_at_start(model: Model, outputs: Collection[str]) -> Model:
    """An expanded model with the start of each state that is read, and has no spread of its own, at its first
    reading; one that is read through something that settles (a lag) or adds up starts near it, with a spread.
    """
    shown, states = shown_states(model, outputs), dict(model.states)
    for name, output in shown.items():
        if states[name].start_sd is None or states[name].memory:
            states[name] = replace(states[name], start=Name(output), start_sd=None, read_as=output)
    for output in sorted(outputs):
        found = _read_in(model, model.outputs.get(output, Name(output)))
        if found is None or found[0] in shown:
            continue
        body, more = found
        if states[body].start is None or (more is None and states[body].start_sd is None):
            start = Name(output) if more is None else Apply("-", (Name(output), more))
            states[body] = replace(states[body], start=start)
    return replace(model, states=states)


def _read_in(model: Model, expression: Expression) -> tuple[str, Expression | None] | None:
    """The state that an output shows once everything that remembers has settled, and what it shows in
    addition, which no state changes (None: nothing); None where it shows none or more than one.
    """
    memories = fed_with(model)
    while memories.keys() & names(expression):
        expression = substitute(expression, memories)
    parts = _addends(rewrite(rewrite(expression, _settled), _short))
    bodies = [part.id for part in parts if isinstance(part, Name) and part.id in model.states]
    held = [part for part in parts if names(part) & model.states.keys()]
    if not len(bodies) == len(held) == 1:
        return None
    rest = [part for part in parts if part is not held[0]]
    return bodies[0], reduce(lambda a, b: Apply("+", (a, b)), rest) if rest else None


def fed_with(model: Model) -> dict[str, Expression]:
    """By memory of an expanded model: what it follows, and shows once it has settled."""
    found: dict[str, Expression] = {}
    for term in model.terms:
        match term.expression:
            case Apply("/", (Apply("-", (inner, _)), _)) if model.states[term.into].memory:
                found[term.into] = inner
    return found


def _addends(expression: Expression) -> list[Expression]:
    match expression:
        case Apply("+", (a, b)):
            return [*_addends(a), *_addends(b)]
        case Apply("-", (a, b)):
            return [*_addends(a), Apply("-", (Number(0.0), b))]
    return [expression]


def _short(apply: Apply) -> Expression | None:
    """Return an expression in a shorter form, without zeros and terms that cancel. None: it has none."""
    match apply:
        case Apply("-", (a, b)) if a == b:
            return Number(0.0)
        case Apply("*", (Number(0.0), _)) | Apply("*", (_, Number(0.0))):
            return Number(0.0)
        case Apply("+", (a, Number(0.0))) | Apply("+", (Number(0.0), a)) | Apply("-", (a, Number(0.0))):
            return a
    return None


def expanded(model: Model, channels: Collection[str] = ()) -> Model:
    """The model with every lag(e, tau) written out as a hidden state: tau ds/dt = e - s, settled at first;
    one of inputs alone only if the machine begins in balance with them (`fitting/begin.py`).

    One mechanism then serves its dynamics, its sensitivities to e and to tau, its report and its export.
    Equal lags share one state.

    Args:
        channels: names that the campaign has; no hidden state takes one of them, or one of the model's.
    """
    found: dict[Apply, str] = {}
    own = {*model.states, *model.parameters, *model.outputs}
    taken = own.union(channels, *(names(e) for e in model.expressions()))
    free = (name for n in count(1) if (name := f"lag_{n}") not in taken)

    def rule(apply: Apply) -> Expression | None:
        if apply.function != "lag":
            return None
        if apply not in found:
            found[apply] = next(free)
        return Name(found[apply])

    terms = tuple(replace(term, expression=rewrite(term.expression, rule)) for term in model.terms)
    outputs = {name: rewrite(expression, rule) for name, expression in model.outputs.items()}
    if not found:
        return model
    states, extra = dict(model.states), []
    for apply, name in found.items():
        inner, tau = apply.arguments
        # it starts settled; what it was fed with before, where the machine was not at rest, is not known
        states[name] = State(name, "", memory=True)
        extra.append(Term(f"{name} follows", name, Apply("/", (Apply("-", (inner, Name(name))), tau))))
    return replace(model, states=states, terms=terms + tuple(extra), outputs=outputs)


def with_settled_memories(model: Model) -> Model:
    """An expanded model whose memories start with what they are fed with, as expressions, unless they follow
    a state that begins in balance.
    """
    states, fed = dict(model.states), fed_with(model)
    for name in [n for n in states if n in fed and states[n].start is None]:
        starts = {s: state.start for s, state in states.items() if state.start is not None}
        start = rewrite(substitute(fed[name], starts), _settled)
        if not names(start) & {s for s, state in states.items() if state.start is None}:
            states[name] = replace(states[name], start=start)
    return replace(model, states=states)


def _settled(apply: Apply) -> Expression | None:
    """At the first instant nothing has moved yet: what remembers shows what it is fed with."""
    return apply.arguments[0] if apply.function in MEMORY else None
