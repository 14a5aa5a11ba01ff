"""The rules of place: at which bodies, links, terms or outputs of a model an effect can act."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from discovery.mismatch.catalogue.effect import Effect
from discovery.models import Model
from discovery.recordings import Channel
from discovery.terms import Name, Term, names, parse


def places(
    effect: Effect, model: Model, outputs: tuple[str, ...], channels: Mapping[str, Channel]
) -> Iterator[tuple[tuple[str, ...], tuple[Term, ...], tuple[str, ...]]]:
    """(states, terms in which a channel is replaced, outputs) of each place."""
    bodies = [
        name
        for name, state in model.states.items()
        if not state.memory and (state.capacity or not _has_bodies(model))
    ]
    role = {name: channel.role for name, channel in channels.items()}
    linked = {frozenset((t.into, t.source)) for t in model.terms if t.source}
    # Neither those of an effect found before nor the memory behind its lag().
    hand_written = [t for t in model.terms if not t.effect and not model.states[t.into].memory]

    def fed(wanted: str) -> list[str]:
        return [
            b
            for b in bodies
            if any(
                b in (t.into, t.source) and any(role.get(n) == wanted for n in names(t.expression))
                for t in model.terms
            )
        ]

    loaded = fed("heat load")
    turned = [b for b in bodies if any(t.into == b and _is_friction(t, model, role) for t in hand_written)]
    # a share of a recorded heat is asked for where that heat goes alone
    needs_load = "load" in names(parse(effect.formula))
    driven = loaded if needs_load else [b for b in bodies if b in loaded or b in turned]

    match effect.place:
        case "body":
            yield from (((b,), (), ()) for b in bodies)
        case "fluid-free body":
            wet = fed("fluid temperature")
            yield from (((b,), (), ()) for b in bodies if b not in wet)
        case "wet body":
            yield from (((b,), (), ()) for b in fed("fluid temperature"))
        case "driven body":
            yield from (((b,), (), ()) for b in driven)
        case "speed-driven body":
            yield from (((b,), (), ()) for b in turned if b not in loaded)
        case "air body":
            yield from (((b,), (), ()) for b in fed("ambient temperature"))
        case "pair" | "any pair" | "link":
            for i, a in enumerate(bodies):
                for b in bodies[i + 1 :]:
                    is_link = frozenset((a, b)) in linked
                    if effect.place == "any pair" or is_link == (effect.place == "link"):
                        yield (a, b), (), ()
        case "neighbour":
            yield from (
                ((a, b), (), ()) for a in driven for b in bodies if a != b and frozenset((a, b)) in linked
            )
        case "fluid terms" | "cooling terms":
            wanted = "fluid temperature" if effect.place == "fluid terms" else "cooling power"
            terms = tuple(t for t in hand_written if any(role.get(n) == wanted for n in names(t.expression)))
            if terms:
                yield tuple(dict.fromkeys(t.into for t in terms)), terms, ()
        case "inputs of a recording":
            terms = tuple(t for t in hand_written if names(t.expression) & set(channels) - set(model.states))
            if terms:
                yield (), terms, ()
        case "output" | "output of a recording":
            yield from (((), (), (name,)) for name in outputs)
        case "seat":
            for b in bodies:
                moved = tuple(y for y in outputs if b in names(model.outputs.get(y, Name(y))))
                if moved:
                    yield (b,), (), moved
        case "recording":
            yield (), (), outputs


def _is_friction(term: Term, model: Model, role: Mapping[str, str]) -> bool:
    """Whether a term is a loss that follows the speed; with a temperature in it, it is an exchange."""
    used = names(term.expression)
    roles = {role[n] for n in used if n in role}
    warm = not used.isdisjoint(model.states) or any("temperature" in r for r in roles)
    return "rotation speed" in roles and not warm


def _has_bodies(model: Model) -> bool:
    return any(state.capacity for state in model.states.values())
