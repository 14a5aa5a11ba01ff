"""Candidates of a diagnosis: a hypothesis for each effect, place and shape."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import log

from discovery.effects.form import INPUT, LEVEL, OF_INPUTS, RATE, REPLACED, ROLE_OF, TERM, Effect
from discovery.effects.hypothesis import BEFORE, Hypothesis
from discovery.effects.places import Spot, spots
from discovery.effects.scene import Scene, channels_for, is_flow_unit, recordings_for
from discovery.models import Model
from discovery.models.model import TIME_UNITS
from discovery.models.units import differences, dimension, ratio
from discovery.recordings import Channel
from discovery.recordings.roles import ROLES
from discovery.terms import (
    Apply,
    Expression,
    Name,
    Number,
    Term,
    degree,
    delays_at,
    names,
    parse,
    rewrite,
    substitute,
)

MEDIA = ("fluid", "coolant")  # whose exchange an input changes; without one, it is that with the air
GONE = 3.0  # time constants after which less than a twentieth of a difference is left
CAPACITIES = 3.0  # factor within which capacities are known: so much more than a power it may seem to heat


def candidates(model: Model, effects: Sequence[Effect], scene: Scene) -> list[Hypothesis]:
    """Every effect at every place where it can act, with prior odds and the middle values of its shapes.

    An effect has the same odds whatever the number of places at which it could act. What a single recording
    shows is claimed of that recording, and not of every recording as well.
    """
    found = [h for effect in effects for h in _claims(effect, model, scene)]
    if len(scene.recordings) == 1:
        known = {h.law for h in found if h.recording}
        found = [h for h in found if h.recording or h.law not in known]
    places = Counter((h.effect.word, h.recording if h.effect.is_event else None) for h in found)
    return [
        replace(
            h,
            log_odds=log(scene.event_odds if h.effect.is_event else scene.odds)
            - log(places[h.effect.word, h.recording if h.effect.is_event else None]),
        )
        for h in found
    ]


def with_shapes(h: Hypothesis) -> list[Hypothesis]:
    """A hypothesis at each of the shape values that a search integrates over; instants stay."""
    grids = [
        [(name, h.shapes[name], 0.0)] if shape.instant else [(name, *pair) for pair in shape.values]
        for name, shape in zip(h.shapes, h.effect.shapes, strict=True)
    ]
    return [
        h.at({name: value for name, value, _ in point}, h.log_weight + sum(w for _, _, w in point))
        for point in product(*grids)
    ]


def _claims(effect: Effect, model: Model, scene: Scene) -> Iterator[Hypothesis]:
    if any(scene.channels[name].role in effect.unless for name in scene.largest):
        return
    used = names(parse(effect.formula, f"effect {effect.word}"))
    any_input = () if effect.place in OF_INPUTS else (INPUT, LEVEL, RATE)
    wanted = [variable for variable in (*ROLE_OF, *any_input) if variable in used]
    choices = [channels_for(variable, effect, model, scene) for variable in wanted]
    own = (INPUT, LEVEL, *(MEDIA if effect.group == "inputs" else ()))
    in_name = [v in own or len(choice) > 1 for v, choice in zip(wanted, choices, strict=True)]
    order = sorted(range(len(wanted)), key=lambda k: wanted[k] not in (INPUT, LEVEL))  # what it follows first
    for chosen in product(*choices):
        binding = {v: _bound(v, c, scene) for v, c in zip(wanted, chosen, strict=True)}
        if LEVEL in used and INPUT in used:
            binding[INPUT] = Name(chosen[wanted.index(LEVEL)])
        for spot in spots(effect, model, scene.outputs, scene.channels):
            if {INPUT, LEVEL} & set(wanted) and _stands(chosen[-1], spot, model, effect):
                continue
            for run, grows in recordings_for(effect, scene):
                named = tuple(chosen[k] for k in order if in_name[k])
                yield _claim(effect, model, spot, run, grows, named, binding, scene)


def _bound(variable: str, channel: str, scene: Scene) -> Expression:
    if variable not in (LEVEL, RATE):
        return Name(channel)
    return Apply("/", (Name(channel), Number(float(f"{scene.largest[channel]:.3g}"))))


def _stands(channel: str, spot: Spot, model: Model, effect: Effect) -> bool:
    """Whether the model already has that input at that body, in proportion or with a curve as the effect has,
    and with a size that is free: then a refit would absorb it.
    """
    formula = parse(effect.formula)
    if spot.outputs or len(spot.bodies) != 1 or names(formula) & {"other", "ambient", *MEDIA}:
        return False
    return any(
        t.into == spot.bodies[0]
        and names(t.expression) - set(model.parameters) == {channel}
        and not names(t.expression).isdisjoint(model.free)
        and degree(t.expression, frozenset({channel})) == degree(formula, frozenset({INPUT, LEVEL}))
        for t in model.terms
        if not t.effect
    )


@dataclass(frozen=True)
class _Naming:
    """Names that the parameters of a hypothesis get in a model, and what replaces those of the formula."""

    amplitudes: tuple[str, ...]
    shapes: Mapping[str, float]
    switch: str
    known: Mapping[str, Expression]

    def sized(self, effect: Effect, k: int = 0) -> dict[str, Expression]:
        """What replaces each variable, with the k-th amplitude as the size."""
        size: Expression = Name(self.amplitudes[k])
        if self.switch:
            size = Apply("*", (Name(self.switch), size))
        return {**self.known, effect.amplitude.name: size}


def _claim(
    effect: Effect,
    model: Model,
    spot: Spot,
    run: str | None,
    grows: bool,
    chosen: tuple[str, ...],
    binding: Mapping[str, Expression],
    scene: Scene,
) -> Hypothesis:
    channels = (*chosen, *((spot.channel,) if spot.channel else ()))
    effect = _between_two(effect, model, spot, channels, scene)
    effect = _of_a_power(effect, model, spot, channels, scene)
    begins = (*((run,) if run else ()), *(("each",) if grows else ()))
    naming = _naming(effect, model, spot, begins, channels, binding, scene)
    terms, shown = _changes(effect, model, spot, naming, scene)
    acting = () if run is None else (run,) if effect.is_event else scene.after[run]
    h = Hypothesis(
        effect,
        spot.bodies,
        naming.amplitudes,
        terms,
        shown,
        () if spot.bodies else spot.outputs,
        run,
        acting,
        naming.switch,
        grows,
        naming.shapes,
        channels,
    )
    return replace(h, units=_units(h, model, scene.channels))


def _between_two(effect: Effect, model: Model, spot: Spot, channels: tuple[str, ...], scene: Scene) -> Effect:
    """The exchange of a body with what another thermometer reads, no faster than readings can tell: where
    nothing of a difference is left at the next one, both read one body, and neither is known to heat the
    other. Of a thermometer that no model predicts this is so where most of a difference is gone: the model
    does not say why it is as warm.
    """
    heats = [name for name in channels if ROLES[scene.channels[name].role].measured]
    read = [name for name in (*spot.bodies, *heats) if name in {*scene.outputs, *heats} - {*model.outputs}]
    if effect.amplitude.unit != "W/K" or len(read) < 2 or spot.each or not scene.spacing:
        return effect
    unit = TIME_UNITS[model.time_unit]
    rate = sum(1 / (model.states[b].capacity or unit) for b in spot.bodies[: 1 if heats else None])
    constants = 1.0 if heats else GONE
    most = min(effect.amplitude.most, constants / (rate * scene.spacing))
    return replace(effect, amplitude=replace(effect.amplitude, most=most))


def _of_a_power(effect: Effect, model: Model, spot: Spot, channels: tuple[str, ...], scene: Scene) -> Effect:
    """Heat that follows a recorded power, no more of it than the power gives: energy is not made."""
    if effect.group != "inputs" or effect.amplitude.unit != "W" or len(channels) != 1:
        return effect
    watts, of = dimension("W"), dimension(scene.channels[channels[0]].unit)
    factor = ratio(of, watts) if of and watts else None
    if factor is None or not all(model.states[body].capacity for body in spot.bodies):
        return effect
    most = min(effect.amplitude.most, CAPACITIES * factor * scene.largest[channels[0]])
    return replace(effect, amplitude=replace(effect.amplitude, most=most))


def _naming(
    effect: Effect,
    model: Model,
    spot: Spot,
    begins: tuple[str, ...],
    channels: tuple[str, ...],
    binding: Mapping[str, Expression],
    scene: Scene,
) -> _Naming:
    of_pair = effect.place in ("link", "any pair")
    everywhere = spot.each or (spot.terms and len({t.into for t in spot.terms}) > 1 and not of_pair)
    at = () if everywhere else spot.bodies or spot.outputs[: 1 if len(spot.outputs) == 1 else 0]
    suffix = "_".join([*channels, *at, *begins])
    taken = {*model.parameters, *model.states, *scene.channels}

    def own(*parts: str) -> str:
        full = "_".join(part for part in (*parts, suffix) if part)
        while full in taken:
            full += "_x"
        taken.add(full)
        return full

    names_of = {shape.name: own(shape.name) for shape in effect.shapes}
    amplitudes = tuple(own(effect.amplitude.name, extra) for extra in _extras(effect, model, spot))
    return _Naming(
        amplitudes,
        {names_of[s.name]: s.values[len(s.values) // 2][0] for s in effect.shapes},
        own("acts") if begins else "",
        {**binding, **{short: Name(full) for short, full in names_of.items()}},
    )


def _extras(effect: Effect, model: Model, spot: Spot) -> tuple[str, ...]:
    """What the names of several amplitudes end with: one for each error that is seen by itself, and, in a
    model without capacities, where what leaves one body in K/h is not what enters the other, one for each;
    one for each body that an effect spreads over.
    """
    if spot.sizes:
        return spot.bodies
    if len(spot.outputs) > 1 and effect.place != "seat":
        return spot.outputs
    if _is_exchange(effect, spot) and not model.states[spot.bodies[0]].capacity:
        return tuple(f"into_{body}" for body in spot.bodies)
    return ("",)


def _is_exchange(effect: Effect, spot: Spot) -> bool:
    """Whether the heat that enters the first body leaves the second one."""
    pair = len(spot.bodies) == 2 and not spot.each and not spot.terms
    return pair and effect.place != "driven and another"


def _changes(
    effect: Effect, model: Model, spot: Spot, naming: _Naming, scene: Scene
) -> tuple[tuple[Term, ...], dict[str, Expression]]:
    """Terms that are added, and changes of outputs."""
    formula = parse(effect.formula, f"effect {effect.word}")
    if spot.terms:
        inputs = set(scene.channels) - set(model.states)
        terms = tuple(_changed(effect, formula, naming, spot, term, inputs) for term in spot.terms)
        return terms, _read_otherwise(effect, formula, naming, spot, model, scene)
    if spot.outputs:
        body: dict[str, Expression] = {"body": Name(spot.bodies[0])} if spot.bodies else {"y": BEFORE}
        several = len(naming.amplitudes) > 1
        return (), {
            name: substitute(formula, {**naming.sized(effect, k if several else 0), **body})
            for k, name in enumerate(spot.outputs)
        }
    if spot.each:
        sizes = [naming.sized(effect, k if spot.sizes else 0) for k in range(len(spot.bodies))]
        pairs = zip(spot.bodies, sizes, strict=True)
        return tuple(_flow(effect, formula, size, (b,)) for b, size in pairs), {}
    if len(naming.amplitudes) > 1:
        ways = (spot.bodies, spot.bodies[::-1])
        flows = (_flow(effect, formula, naming.sized(effect, k), way) for k, way in enumerate(ways))
        return tuple(flows), {}
    flow = _flow(effect, formula, naming.sized(effect), spot.bodies)
    return (replace(flow, source=spot.bodies[1]) if _is_exchange(effect, spot) else flow,), {}


def _flow(
    effect: Effect, formula: Expression, known: Mapping[str, Expression], states: tuple[str, ...]
) -> Term:
    """A heat flow into the first of some bodies."""
    bodies = {"body": Name(states[0]), **({"other": Name(states[1])} if len(states) > 1 else {})}
    name = f"{effect.title}, {' and '.join(states)}"
    return Term(name, states[0], substitute(formula, {**known, **bodies}), None, effect.word)


def _changed(
    effect: Effect, formula: Expression, naming: _Naming, spot: Spot, term: Term, inputs: set[str]
) -> Term:
    """The change of a term: the formula if it names the term, else the term with a channel replaced by the
    formula, minus the term.
    """
    known = naming.sized(effect)
    if TERM in names(formula):
        other = term.source or next((b for b in spot.bodies if b != term.into), None)
        ends = {"body": Name(term.into), **({"other": Name(other)} if other else {})}
        change = substitute(formula, {**known, TERM: term.expression, **ends})
        return Term(f"{effect.title}: {term.name}", term.into, change, term.source, effect.word)
    change = _replaced(effect, formula, naming, spot, term.expression, inputs)
    return Term(f"{effect.title}: {term.name}", term.into, change, term.source, effect.word)


def _replaced(
    effect: Effect,
    formula: Expression,
    naming: _Naming,
    spot: Spot,
    expression: Expression,
    inputs: set[str],
) -> Expression:
    """An expression with a channel replaced by the formula, or all inputs, minus the expression."""
    known = naming.sized(effect)
    if effect.place == "inputs of a recording":
        used = names(expression) & inputs
        swaps = {c: substitute(formula, {**known, "input": Name(c)}) for c in used}
    else:
        replaced = spot.channel or next(n.id for v in REPLACED if isinstance(n := naming.known.get(v), Name))
        swaps = {replaced: substitute(formula, {**known, "input": Name(replaced)})}
    changed = delays_at(inputs, substitute(expression, swaps))  # it may delay the channel itself
    difference = Apply("-", (changed, expression))
    if effect.amplitude.name not in names(formula):  # then it switches the replacement on
        difference = Apply("*", (known[effect.amplitude.name], difference))
    return difference


def _read_otherwise(
    effect: Effect, formula: Expression, naming: _Naming, spot: Spot, model: Model, scene: Scene
) -> dict[str, Expression]:
    """Changes of the outputs that use an input whose record is wrong."""
    inputs = set(scene.channels) - set(model.states)
    wrong = {spot.channel} if spot.channel else inputs
    return {
        name: _replaced(effect, formula, naming, spot, model.outputs[name], inputs)
        for name in scene.outputs
        if effect.place in OF_INPUTS and name in model.outputs and names(model.outputs[name]) & wrong
    }


def _units(h: Hypothesis, model: Model, channels: Mapping[str, Channel]) -> dict[str, str]:
    """Unit of each parameter at its place: um of the catalogue means the unit of the output, W for what
    enters the state (a rate, where it has no capacity), and an effect of the flow counts by its unit.
    """
    outputs = tuple(h.shown)
    of_flow = _flow_unit(h, channels)

    def at(unit: str, output: str) -> str:
        if output and unit.startswith("um"):
            return differences(channels[output].unit) + unit.removeprefix("um")
        if h.terms and unit.startswith("W") and h.states and not model.states[h.states[0]].capacity:
            of = differences(model.states[h.states[0]].unit)
            rate = f"1/{model.time_unit}" if unit == f"W/{of}" else f"{of}/{model.time_unit}"
            return (rate if unit == f"W/{of}" else rate + unit.removeprefix("W")) + of_flow
        return unit + of_flow if unit.startswith("W") else unit

    several = len(h.amplitudes) > 1 and outputs
    shown = outputs if several else outputs[:1] * len(h.amplitudes) or ("",) * len(h.amplitudes)
    first = outputs[0] if outputs else ""
    return {name: at(h.effect.amplitude.unit, y) for name, y in zip(h.amplitudes, shown, strict=True)} | {
        name: at(shape.unit, first) for name, shape in zip(h.shapes, h.effect.shapes, strict=True)
    }


def _flow_unit(h: Hypothesis, channels: Mapping[str, Channel]) -> str:
    """What the unit of an effect that is in proportion to a flow carries, as "/(l/min)"; nothing where a flow
    has no unit, or where its sign alone counts.
    """
    formula = parse(h.effect.formula, f"effect {h.effect.word}")
    if "flow" not in names(rewrite(formula, lambda f: Number(1.0) if f.function == "sign" else None)):
        return ""
    used = {name for term in h.terms for name in names(term.expression)} & set(channels)
    units = [channels[n].unit for n in sorted(used)]
    return next((f"/({u})" for u in units if is_flow_unit(u)), "")
