"""Where each effect of the catalogue could act in a model: one hypothesis per effect, place and shape."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product

from discovery.mismatch.catalogue.effect import ROLE_OF, Effect
from discovery.mismatch.places import places
from discovery.models import Model, Parameter
from discovery.models.units import differences, same_dimension
from discovery.recordings import Channel
from discovery.terms import Apply, Expression, Name, Term, names, parse, substitute

BEFORE = Name("what the output showed before")  # no channel has such a name


@dataclass(frozen=True)
class Hypothesis:
    """An effect at a place with its shape parameters at given values.

    `terms` enter states; `shown` is what outputs show in addition, in terms of what they showed before
    (`BEFORE`), or by how much they see the body of `states` moved. Both hold the amplitudes and shapes as
    parameters.
    """

    effect: Effect
    states: tuple[str, ...]
    amplitudes: tuple[str, ...]
    terms: tuple[Term, ...] = ()
    shown: Mapping[str, Expression] = field(default_factory=dict)
    output: str | None = None
    recording: str | None = None
    shapes: Mapping[str, float] = field(default_factory=dict)  # parameter name -> value
    channels: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)  # parameter name -> unit at this place
    cost: float = 0.0  # log of the number of instants that were searched for it

    @property
    def key(self) -> tuple[str, tuple[str, ...], str | None, str | None, tuple[str, ...]]:
        """What the hypothesis claims, whatever its shape values."""
        return (self.effect.word, self.states, self.output, self.recording, self.channels)

    @property
    def places(self) -> tuple[str, ...]:
        """States, or outputs for what happens in the measuring chain."""
        return self.states or ((self.output,) if self.output else tuple(self.shown))

    @property
    def where(self) -> str:
        """The places, or the recording of what concerns all of it."""
        return ", ".join(self.places) or self.recording or "all recordings"

    @property
    def shifts_the_zero(self) -> bool:
        """Whether outputs are shifted by something that does not depend on what they showed before."""
        return any(BEFORE.id not in names(change) for change in self.shown.values()) and not self.states

    def at(self, shapes: Mapping[str, float]) -> Hypothesis:
        """The same claim with other shape values."""
        return replace(self, shapes={**self.shapes, **shapes})

    def added_to(self, model: Model, start: Mapping[str, float] | None = None) -> Model:
        """The model with the effect, its amplitudes starting at `start` (default: a tenth of plausible)."""
        start = start or {}
        amplitude = self.effect.amplitude
        parameters = {}
        for name in self.amplitudes:
            low = 0.0 if amplitude.sign > 0 else -amplitude.most
            high = 0.0 if amplitude.sign < 0 else amplitude.most
            value = start.get(
                name,
                amplitude.fixed
                if amplitude.fixed is not None
                else 0.1 * amplitude.plausible * (amplitude.sign or 1),
            )
            parameters[name] = self._parameter(name, value, low, high, amplitude.fixed is not None)
        for (name, value), shape in zip(self.shapes.items(), self.effect.shapes, strict=True):
            parameters[name] = self._parameter(
                name, start.get(name, value), shape.low, shape.high, shape.fixed
            )
        outputs = {
            name: Apply("+", (model.outputs.get(name, Name(name)), extra))
            for name, extra in self.shows(model).items()
        }
        return model.with_terms(*self.terms, parameters=parameters, outputs=outputs)

    def shows(self, model: Model) -> dict[str, Expression]:
        """What outputs show in addition where the effect comes to a model: whatever else that one has."""
        found: dict[str, Expression] = {}
        for name, change in self.shown.items():
            y = model.outputs.get(name, Name(name))
            if self.states:
                moved = Apply("+", (Name(self.states[0]), change))
                found[name] = Apply("-", (substitute(y, {self.states[0]: moved}), y))
            else:
                found[name] = substitute(change, {BEFORE.id: y})
        return found

    def _parameter(self, name: str, value: float, low: float, high: float, fixed: bool) -> Parameter:
        unit = self.units.get(name, "1")
        if self.recording is None:
            return Parameter(value, unit, low, high, fixed)
        # An event of one recording: the common value 0 keeps it out of every other one.
        return Parameter(
            0.0, unit, min(low, 0.0), max(high, 0.0), fixed, True, values={self.recording: value}
        )


def hypotheses(
    model: Model,
    channels: Mapping[str, Channel],
    outputs: Iterable[str],
    recordings: Iterable[str],
    effects: Iterable[Effect],
) -> list[Hypothesis]:
    """Every effect at every place where it can act, at every point of its shape grid.

    Effects whose place in time has to be searched (windows, steps) come with their first shape values;
    `events.py` finds the instants.
    """
    found: list[Hypothesis] = []
    for effect in effects:
        for claim in _claims(effect, model, channels, tuple(outputs), tuple(recordings)):
            grids = [
                [(name, value) for value in shape.grid]
                for name, shape in zip(claim.shapes, effect.shapes, strict=True)
            ]
            found += [claim.at(dict(point)) for point in product(*grids)]
    return found


def _claims(
    effect: Effect,
    model: Model,
    channels: Mapping[str, Channel],
    outputs: tuple[str, ...],
    recordings: tuple[str, ...],
) -> Iterator[Hypothesis]:
    formula = parse(effect.formula, f"effect {effect.word}")
    used = names(formula)
    wanted = [variable for variable in ROLE_OF if variable in used]
    choices = [
        [
            name
            for name, c in channels.items()
            if c.role == ROLE_OF[variable] and _drives(name, model) and _is_heat(variable, c, effect)
        ]
        for variable in wanted
    ]
    several = any(len(choice) > 1 for choice in choices)
    runs: tuple[str | None, ...] = recordings if effect.one_recording else (None,)
    if effect.word == "wear":
        runs = recordings[1:]  # what is common to all recordings is the model's own parameter
    for chosen in product(*choices):
        binding: dict[str, Expression] = {v: Name(c) for v, c in zip(wanted, chosen, strict=True)}
        for states, source_terms, shown in places(effect, model, outputs, channels):
            for run in runs:
                tag = [
                    *(chosen if several else ()),
                    *(states or shown[:1] if len(shown) == 1 or states else ()),
                    *((run,) if run else ()),
                ]
                yield _claim(
                    effect,
                    model,
                    formula,
                    binding,
                    states,
                    source_terms,
                    shown,
                    run,
                    tag,
                    channels,
                    chosen if several else (),
                )


def _drives(name: str, model: Model) -> bool:
    """A channel may stand in a hypothesis unless the model predicts it."""
    return name not in model.states and name not in model.outputs


def _is_heat(variable: str, channel: Channel, effect: Effect) -> bool:
    """Whether a channel of no known role can stand where a share of it is heat: it has to be a power."""
    if variable != "other_input" or effect.amplitude.unit != "1":
        return True
    return same_dimension(channel.unit, "W")


def _claim(
    effect: Effect,
    model: Model,
    formula: Expression,
    binding: dict[str, Expression],
    states: tuple[str, ...],
    replaced: tuple[Term, ...],
    shown: tuple[str, ...],
    run: str | None,
    tag: list[str],
    channels: Mapping[str, Channel],
    chosen: tuple[str, ...],
) -> Hypothesis:
    suffix = "_".join(tag)

    def own(name: str, extra: str = "") -> str:
        full = "_".join(part for part in (name, extra, suffix) if part)
        while full in model.parameters or full in model.states or full in channels:
            full += "_x"
        return full

    shape_names = {shape.name: own(shape.name) for shape in effect.shapes}
    rename: dict[str, Expression] = {short: Name(full) for short, full in shape_names.items()}
    shapes = {full: effect.shapes[i].grid[0] for i, full in enumerate(shape_names.values())}
    base = {**binding, **rename}
    several = len(shown) > 1 and not states  # a body has one size for all errors
    amplitudes = (
        [own(effect.amplitude.name, output) for output in shown] if several else [own(effect.amplitude.name)]
    )
    amplitude = Name(amplitudes[0])
    terms: list[Term] = []
    extra: dict[str, Expression] = {}
    if replaced:  # a channel is replaced in terms of the model: the term with the new channel less the term
        fresh = substitute(formula, {**base, effect.amplitude.name: amplitude})
        for term in replaced:
            if effect.place == "inputs of a recording":
                swaps = {
                    c: substitute(formula, {**base, "input": Name(c)})
                    for c in names(term.expression) & set(channels) - set(model.states)
                }
            else:
                variable = next(v for v in ("fluid", "cooling", "flow") if v in binding)
                swaps = {n: fresh for n in names(term.expression) if Name(n) == binding[variable]}
            changed = substitute(term.expression, swaps)
            difference = Apply("-", (changed, term.expression))
            if effect.amplitude.name not in names(formula):  # then it switches the replacement on
                difference = Apply("*", (amplitude, difference))
            terms.append(
                Term(f"{effect.title}: {term.name}", term.into, difference, term.source, effect.word)
            )
    elif shown:
        for name, size in zip(shown, amplitudes if several else amplitudes * len(shown), strict=True):
            at = {"body": Name(states[0])} if states else {"y": BEFORE}
            extra[name] = substitute(formula, {**base, **at, effect.amplitude.name: Name(size)})
    else:
        bodies = {"body": Name(states[0]), **({"other": Name(states[1])} if len(states) > 1 else {})}
        expression = substitute(formula, {**base, **bodies, effect.amplitude.name: amplitude})
        exchange = len(states) > 1 and effect.place != "neighbour"
        terms.append(
            Term(
                f"{effect.title}, {' and '.join(states)}",
                states[0],
                expression,
                states[1] if exchange else None,
                effect.word,
            )
        )
    units = {
        name: _unit(effect.amplitude.unit, model, states, output, channels)
        for name, output in zip(amplitudes, shown if several else shown[:1] or ("",), strict=True)
    } | {
        name: _unit(shape.unit, model, states, shown[0] if shown else "", channels)
        for name, shape in zip(shapes, effect.shapes, strict=True)
    }
    return Hypothesis(
        effect,
        states,
        tuple(amplitudes),
        tuple(terms),
        extra,
        shown[0] if len(shown) == 1 else None,
        run,
        shapes,
        chosen,
        units,
    )


def _unit(
    unit: str, model: Model, states: tuple[str, ...], output: str, channels: Mapping[str, Channel]
) -> str:
    """Unit of a catalogue parameter at a place: um there stands for the unit of the output, W for what enters
    the state (a rate, where it has no capacity).
    """
    if output and output in channels and unit.startswith("um"):
        return differences(channels[output].unit) + unit.removeprefix("um")
    if states and unit.startswith("W") and not model.states[states[0]].capacity:
        of = differences(model.states[states[0]].unit)
        return (
            f"1/{model.time_unit}"
            if unit == f"W/{of}"
            else f"{of}/{model.time_unit}" + unit.removeprefix("W")
        )
    return unit
