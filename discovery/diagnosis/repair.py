"""The repaired model as a file: written in the form that an engineer would use."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model
from discovery.terms import Apply, Expression, Name, Term, names
from discovery.terms.expression import rewrite


def written(model: Model, hypotheses: Sequence[Hypothesis]) -> Model:
    """The fitted model without switches that are always on and without terms that an effect replaces."""
    switches = {
        h.amplitudes[0] for h in hypotheses if h.effect.amplitude.fixed is not None and not h.recording
    }

    def simplify(apply: Apply) -> Expression | None:
        match apply:
            case Apply(
                function="*", arguments=(Name(id=name), Apply(function="-", arguments=(changed, _)))
            ) if name in switches:
                return changed
        return None

    terms: list[Term] = []
    for term in model.terms:
        plain = rewrite(term.expression, simplify)
        for t in terms:
            if (changed := _instead_of(t, term, switches)) is not None:
                terms.remove(t)
                plain = changed
                break
        terms.append(replace(term, expression=plain))
    parameters = {n: p for n, p in model.parameters.items() if n not in switches or _used(n, terms, model)}
    for h in hypotheses:  # what acts in some recordings is a matter of these: a clock may be ahead there
        for name in h.shapes if h.switch else ():
            if not parameters[name].fixed:
                value = parameters[name].value
                parameters[name] = replace(
                    parameters[name], per_recording=True, values=dict.fromkeys(h.acting, value)
                )
    return replace(model, name=f"{model.name}, repaired", terms=tuple(terms), parameters=parameters)


def _instead_of(term: Term, effect: Term, switches: Collection[str]) -> Expression | None:
    """The law that an effect puts in place of a term, written as (new - term), perhaps with a switch."""
    if not effect.effect or (term.into, term.source) != (effect.into, effect.source):
        return None
    match effect.expression:
        case Apply(function="*", arguments=(Name(id=name), Apply(function="-", arguments=(changed, old)))):
            return changed if name in switches and old == term.expression else None
        case Apply(function="-", arguments=(changed, old)):
            return changed if old == term.expression else None
    return None


def _used(name: str, terms: Sequence[Term], model: Model) -> bool:
    expressions = [*(t.expression for t in terms), *model.outputs.values()]
    return any(name in names(e) for e in expressions)
