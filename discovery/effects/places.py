"""The rules of place: at which bodies, links, terms, inputs or outputs of a model an effect can act."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from discovery.effects.form import TERM, Effect
from discovery.models import Model
from discovery.models.units import same_dimension
from discovery.recordings import Channel
from discovery.terms import Name, Term, names, parse

TEMPERATURES = ("degC", "K")
OF_TERMS = {  # places that are terms: the role of a channel that stands in them
    "fluid terms": "fluid temperature",
    "coolant terms": "coolant temperature",
    "cooling terms": "cooling power",
    "loss terms": "heat load",
    "loss terms and a neighbour": "heat load",
    "air terms": "ambient temperature",
}


@dataclass(frozen=True)
class Spot:
    """One place: `bodies` that heat enters (and, for an exchange, leaves), `terms` of the model that change,
    `outputs` that show more. `each`: one law at each of the bodies, of one size or, with `sizes`, of a size
    of its own at each.
    """

    bodies: tuple[str, ...] = ()
    terms: tuple[Term, ...] = ()
    outputs: tuple[str, ...] = ()
    channel: str = ""
    each: bool = False
    sizes: bool = False


@dataclass(frozen=True)
class Layout:
    """What a model is made of, in the words of the rules."""

    bodies: tuple[str, ...]
    errors: tuple[str, ...]  # states that are errors: what enters them is a rate
    wet: tuple[str, ...]
    loaded: tuple[str, ...]
    turned: tuple[str, ...]
    aired: tuple[str, ...]
    links: frozenset[frozenset[str]]
    own: tuple[Term, ...]  # neither those of an effect found before nor the memory behind its lag()


def layout(model: Model, channels: Mapping[str, Channel]) -> Layout:
    """The parts of a model. A body is a state with a capacity, or one that is a temperature."""
    states = {n: s for n, s in model.states.items() if not s.memory}
    bodies = tuple(n for n, s in states.items() if s.capacity or s.unit in TEMPERATURES)
    role = _roles(channels)
    own = tuple(t for t in model.terms if not t.effect and not model.states[t.into].memory)

    def fed(wanted: str) -> tuple[str, ...]:
        touched = {b for t in own for b in (t.into, t.source) if _holds(t, wanted, role)}
        return tuple(b for b in bodies if b in touched)

    return Layout(
        bodies,
        tuple(n for n in states if n not in bodies),
        fed("fluid temperature"),
        fed("heat load"),
        tuple(b for b in bodies if any(t.into == b and _is_friction(t, model, role) for t in own)),
        fed("ambient temperature"),
        frozenset(frozenset((t.into, other)) for t in own for other in _others(t, bodies)),
        own,
    )


def spots(
    effect: Effect, model: Model, outputs: tuple[str, ...], channels: Mapping[str, Channel]
) -> Iterator[Spot]:
    """Every place at which an effect can act in a model."""
    parts = layout(model, channels)
    alone = _bodies(effect, parts)
    if alone is not None:
        yield from (Spot((b,)) for b in alone)
        if effect.shared and len(group := _group(effect, parts, alone)) > 1:
            yield Spot(group, each=True)
        if effect.spreads:
            pairs = (p for p in combinations(alone, 2) if frozenset(p) in parts.links)
            yield from (Spot(p, each=True, sizes=True) for p in pairs)
        return
    role = _roles(channels)
    match effect.place:
        case "pair" | "any pair" | "link":
            for a, b in combinations(parts.bodies, 2):
                is_link = frozenset((a, b)) in parts.links
                if effect.place == "any pair" or is_link == (effect.place == "link"):
                    yield Spot((a, b), _between(parts, a, b) if TERM in names(parse(effect.formula)) else ())
        case "driven and another":
            yield from (Spot((a, b)) for a in _driven(effect, parts) for b in parts.bodies if a != b)
        case "current terms":
            currents = {n for n, c in channels.items() if same_dimension(c.unit, "A")}
            yield from _of(tuple(t for t in parts.own if names(t.expression) & currents))
        case place if place in OF_TERMS or place == "heat of a body":
            yield from _of_terms(effect, model, parts, role)
        case "input temperature" | "driving input":
            yield from _of_inputs(effect, model, parts, channels)
        case "error state":
            yield from (Spot((name,)) for name in parts.errors)
        case place if place.startswith("output"):
            single = _single_outputs(effect, model, parts, outputs, channels)
            yield from (Spot(outputs=(name,)) for name in single)
        case "seat" | "lever" | "thermometer":
            warm = {y for y in outputs if same_dimension(channels[y].unit, "degC")}
            for b in parts.bodies:
                moved = tuple(y for y in outputs if b in names(model.outputs.get(y, Name(y))))
                if effect.place == "thermometer":
                    yield from (Spot((b,), outputs=(y,)) for y in moved if y in warm)
                    continue
                shown = tuple(y for y in (moved if effect.place == "seat" else outputs) if y not in warm)
                if moved and shown:
                    yield Spot((b,), outputs=shown)
        case "inputs of a recording":
            terms = tuple(t for t in parts.own if names(t.expression) & set(channels) - set(model.states))
            if terms:
                yield Spot(terms=terms)
        case "recording":
            yield from _of_a_device(outputs, channels)


def _single_outputs(
    effect: Effect,
    model: Model,
    parts: Layout,
    outputs: tuple[str, ...],
    channels: Mapping[str, Channel],
) -> tuple[str, ...]:
    """Outputs of which one alone shows an effect."""
    match effect.place:
        case "output of a state":
            states = {*parts.bodies, *parts.errors}
            return tuple(n for n in outputs if states & names(model.outputs.get(n, Name(n))))
        case "output of errors" if parts.bodies:
            return ()
        case "output next to others" if len(outputs) == 1:
            return ()
        case "output that is a temperature":
            return tuple(n for n in outputs if same_dimension(channels[n].unit, "degC"))
        case "output that is no temperature":
            return tuple(n for n in outputs if not same_dimension(channels[n].unit, "degC"))
    return outputs


def _of_a_device(outputs: tuple[str, ...], channels: Mapping[str, Channel]) -> Iterator[Spot]:
    """All errors together, which one device shows."""
    errors = tuple(y for y in outputs if not same_dimension(channels[y].unit, "degC"))
    if len(errors) > 1:
        yield Spot(outputs=errors)


def _bodies(effect: Effect, parts: Layout) -> tuple[str, ...] | None:
    """Single bodies of a place; None where it is another kind of place."""
    match effect.place:
        case "body":
            return parts.bodies
        case "fluid-free body":
            return tuple(b for b in parts.bodies if b not in parts.wet)
        case "wet body":
            return parts.wet
        case "driven body":
            return _driven(effect, parts)
        case "air body":
            return parts.aired
    return None


def _driven(effect: Effect, parts: Layout) -> tuple[str, ...]:
    """Bodies with drive losses; a share of a recorded heat is asked for where that heat goes alone."""
    turned = () if "load" in names(parse(effect.formula)) else parts.turned
    return tuple(b for b in parts.bodies if b in (*parts.loaded, *turned))


def _group(effect: Effect, parts: Layout, alone: tuple[str, ...]) -> tuple[str, ...]:
    """Bodies on which a law of a fluid, of the drive, or of the air acts together where it can act at any."""
    if effect.place != "body":
        return alone
    if effect.group == "drive and cooling":
        return _driven(effect, parts)
    return parts.wet if effect.group == "cutting fluid" else parts.aired


def _of_terms(effect: Effect, model: Model, parts: Layout, role: Mapping[str, str]) -> Iterator[Spot]:
    """Terms of a kind. Heat that enters a body has a source of its own."""
    if effect.place == "heat of a body":
        heats = _heats(model, parts, role)
        for body in dict.fromkeys(t.into for t in heats):
            yield Spot((body,), tuple(t for t in heats if t.into == body))
        return
    wanted = OF_TERMS[effect.place]
    every = tuple(t for t in parts.own if _holds(t, wanted, role))
    found = _of(_losses(model, parts, role) if wanted == "heat load" else every)
    if effect.place != "loss terms and a neighbour":
        yield from found
        return
    for spot in found:
        if len(spot.bodies) == 1:
            near = (b for b in parts.bodies if frozenset((*spot.bodies, b)) in parts.links)
            yield from (Spot((*spot.bodies, b), spot.terms) for b in near)


def _losses(model: Model, parts: Layout, role: Mapping[str, str]) -> tuple[Term, ...]:
    """Terms that may be friction. At a body where a law of the speed is, what heats it next to that is
    something else: a heater, or the copper of a motor.
    """
    heats = _heats(model, parts, role)
    rubbed = {t.into for t in heats if _is_friction(t, model, role)}
    return tuple(t for t in heats if t.into not in rubbed or _is_friction(t, model, role))


def _heats(model: Model, parts: Layout, role: Mapping[str, str]) -> tuple[Term, ...]:
    """Terms in which a heat load stands, or a law of the speed or another input."""
    return tuple(t for t in parts.own if _holds(t, "heat load", role) or _is_loss(t, model, role))


def _between(parts: Layout, a: str, b: str) -> tuple[Term, ...]:
    """Terms of the link of two bodies."""
    return tuple(t for t in parts.own if {a, b} in [{t.into, other} for other in _others(t, parts.bodies)])


def _others(term: Term, bodies: Sequence[str]) -> list[str]:
    """The body that a flow leaves; where rates have no capacities, each of two bodies has a term that follows
    the other one.
    """
    if term.source:
        return [term.source]
    return [b for b in bodies if b != term.into and b in names(term.expression)]


def _of(terms: tuple[Term, ...]) -> Iterator[Spot]:
    """All of some terms, and those of each body alone: the air, a fluid or a loss at one body need not be as
    elsewhere.
    """
    bodies = tuple(dict.fromkeys(t.into for t in terms))
    if terms:
        yield Spot(bodies, terms)
    if len(bodies) > 1:
        yield from (Spot((b,), tuple(t for t in terms if t.into == b)) for b in bodies)


def _of_inputs(
    effect: Effect, model: Model, parts: Layout, channels: Mapping[str, Channel]
) -> Iterator[Spot]:
    """Each recorded temperature, or each other input, with the terms that it drives."""
    warm = effect.place == "input temperature"
    for name, channel in channels.items():
        terms = tuple(t for t in parts.own if name in names(t.expression))
        if terms and name not in model.states and (channel.unit in TEMPERATURES) == warm:
            yield Spot(terms=terms, channel=name)


def _roles(channels: Mapping[str, Channel]) -> dict[str, str]:
    """What each channel is to a place. What shines on a body is no stroke of a press: nothing rubs there."""
    return {n: "irradiance" if same_dimension(c.unit, "W/m**2") else c.role for n, c in channels.items()}


def _holds(term: Term, wanted: str, role: Mapping[str, str]) -> bool:
    return any(role.get(n) == wanted for n in names(term.expression))


def _is_friction(term: Term, model: Model, role: Mapping[str, str]) -> bool:
    """Whether a term is a loss that follows the speed; with a temperature in it, it is an exchange."""
    return _is_loss(term, model, role) and _holds(term, "rotation speed", role)


def _is_loss(term: Term, model: Model, role: Mapping[str, str]) -> bool:
    """Whether a term is heat that a speed or another input makes (strokes of a press), whatever is warm."""
    used: Collection[str] = names(term.expression)
    roles = {role[n] for n in used if n in role}
    warm = not set(used).isdisjoint(model.states) or any("temperature" in r for r in roles)
    return not warm and not roles.isdisjoint(("rotation speed", "other input"))
