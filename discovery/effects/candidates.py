"""Where each effect of the catalogue could act in a model: one hypothesis per effect, place and shape."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import product

from discovery.mismatch.catalogue.effect import ROLE_OF, Effect
from discovery.mismatch.hypothesis import BEFORE, Hypothesis
from discovery.mismatch.places import places
from discovery.models import Model
from discovery.models.units import differences, same_dimension
from discovery.recordings import Channel
from discovery.terms import Apply, Expression, Name, Term, delays_at, names, parse, substitute


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
        for states, replaced, shown in places(effect, model, outputs, channels):
            for run in runs:
                place = _Place(states, replaced, shown, run, chosen if several else (), binding)
                yield _claim(effect, model, place, channels)


def _drives(name: str, model: Model) -> bool:
    """A channel may stand in a hypothesis unless the model predicts it."""
    return name not in model.states and name not in model.outputs


def _is_heat(variable: str, channel: Channel, effect: Effect) -> bool:
    """Whether a channel of no known role can stand where a share of it is heat: it has to be a power."""
    if variable != "other_input" or effect.amplitude.unit != "1":
        return True
    return same_dimension(channel.unit, "W")


@dataclass(frozen=True)
class _Place:
    """Where a claim acts, and what its formula stands for there."""

    states: tuple[str, ...]
    replaced: tuple[Term, ...]  # terms in which a channel becomes another
    shown: tuple[str, ...]  # outputs
    run: str | None
    chosen: tuple[str, ...]  # channels, where several have the role
    binding: Mapping[str, Expression]  # variable of the formula -> channel


def _claim(effect: Effect, model: Model, place: _Place, channels: Mapping[str, Channel]) -> Hypothesis:
    states, shown = place.states, place.shown
    at = states or (shown if len(shown) == 1 else ())
    suffix = "_".join([*place.chosen, *at, *((place.run,) if place.run else ())])

    def own(name: str, extra: str = "") -> str:
        full = "_".join(part for part in (name, extra, suffix) if part)
        while full in model.parameters or full in model.states or full in channels:
            full += "_x"
        return full

    shape_names = {shape.name: own(shape.name) for shape in effect.shapes}
    shapes = {full: effect.shapes[i].grid[0] for i, full in enumerate(shape_names.values())}
    several = len(shown) > 1 and not states  # a body has one size for all errors
    exchange = len(states) > 1 and effect.place != "neighbour"
    # without capacities what leaves one body in K/h is not what enters the other: a size of its own for each
    apart = exchange and not model.states[states[0]].capacity
    extras = shown if several else tuple(f"into_{body}" for body in states) if apart else ("",)
    amplitudes = tuple(own(effect.amplitude.name, extra) for extra in extras)
    rename: dict[str, Expression] = {short: Name(full) for short, full in shape_names.items()}
    known = {**place.binding, **rename, effect.amplitude.name: Name(amplitudes[0])}
    formula = parse(effect.formula, f"effect {effect.word}")
    terms: tuple[Term, ...] = ()
    changes: dict[str, Expression] = {}
    if place.replaced:
        inputs = set(channels) - set(model.states)
        terms = tuple(_replacing(effect, formula, known, place, term, inputs) for term in place.replaced)
    elif shown:
        body = {"body": Name(states[0])} if states else {"y": BEFORE}
        each = amplitudes if several else amplitudes * len(shown)
        changes = {
            name: substitute(formula, {**known, **body, effect.amplitude.name: Name(size)})
            for name, size in zip(shown, each, strict=True)
        }
    elif apart:
        sizes = ({**known, effect.amplitude.name: Name(size)} for size in amplitudes)
        ways = (states, states[::-1])
        terms = tuple(
            replace(_flow(effect, formula, size, way), source=None)
            for size, way in zip(sizes, ways, strict=True)
        )
    else:
        terms = (_flow(effect, formula, known, states),)
    units = {
        name: _unit(effect.amplitude.unit, model, states, output, channels)
        for name, output in zip(
            amplitudes, shown if several else (shown[:1] or ("",)) * len(amplitudes), strict=True
        )
    } | {
        name: _unit(shape.unit, model, states, shown[0] if shown else "", channels)
        for name, shape in zip(shapes, effect.shapes, strict=True)
    }
    return Hypothesis(
        effect,
        states,
        amplitudes,
        terms,
        changes,
        shown[0] if len(shown) == 1 else None,
        place.run,
        shapes,
        place.chosen,
        units,
    )


def _flow(
    effect: Effect, formula: Expression, known: Mapping[str, Expression], states: tuple[str, ...]
) -> Term:
    """A heat flow into a body, out of another where the effect is an exchange."""
    bodies = {"body": Name(states[0]), **({"other": Name(states[1])} if len(states) > 1 else {})}
    exchange = len(states) > 1 and effect.place != "neighbour"
    return Term(
        f"{effect.title}, {' and '.join(states)}",
        states[0],
        substitute(formula, {**known, **bodies}),
        states[1] if exchange else None,
        effect.word,
    )


def _replacing(
    effect: Effect,
    formula: Expression,
    known: Mapping[str, Expression],
    place: _Place,
    term: Term,
    inputs: set[str],
) -> Term:
    """A term with its channel replaced by the formula, less the term."""
    if effect.place == "inputs of a recording":
        used = names(term.expression) & inputs
        swaps = {c: substitute(formula, {**known, "input": Name(c)}) for c in used}
    else:
        variable = next(v for v in ("fluid", "cooling", "flow") if v in place.binding)
        fresh = substitute(formula, known)
        swaps = {n: fresh for n in names(term.expression) if Name(n) == place.binding[variable]}
    replaced = delays_at(inputs, substitute(term.expression, swaps))  # the term may delay the channel itself
    difference = Apply("-", (replaced, term.expression))
    if effect.amplitude.name not in names(formula):  # then it switches the replacement on
        difference = Apply("*", (known[effect.amplitude.name], difference))
    return Term(f"{effect.title}: {term.name}", term.into, difference, term.source, effect.word)


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
