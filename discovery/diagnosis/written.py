"""The repaired model as an engineer would write it: without switches that are always on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discovery.effects.hypothesis import Hypothesis
from discovery.models import Model
from discovery.terms import Apply, Expression, Name, Number, Term, names
from discovery.terms.expression import rewrite


def written(model: Model, hypotheses: Sequence[Hypothesis]) -> Model:
    """The fitted model without switches that are always on and without terms that an effect replaces."""
    switches = {
        h.amplitudes[0] for h in hypotheses if h.effect.amplitude.fixed is not None and not h.recording
    }

    def simplify(apply: Apply) -> Expression | None:
        match apply:
            case Apply(function="*", arguments=(Name(id=name), rest)) if name in switches:
                return rest
        return None

    terms: list[Term] = []
    for term in model.terms:
        plain = replace(term, expression=rewrite(term.expression, simplify))
        for t in terms:
            if (changed := _instead_of(t, plain)) is not None:
                terms.remove(t)
                plain = replace(plain, expression=changed)
                break
        terms.append(plain)
    parameters = {n: p for n, p in model.parameters.items() if n not in switches or _used(n, terms, model)}
    for h in hypotheses:  # what acts in some recordings is a matter of these: a clock may be ahead there
        for name in h.shapes if h.switch else ():
            if not parameters[name].fixed:
                value = parameters[name].value
                parameters[name] = replace(
                    parameters[name], per_recording=True, values=dict.fromkeys(h.acting, value)
                )
    return replace(model, name=f"{model.name}, repaired", terms=tuple(terms), parameters=parameters)


def _instead_of(term: Term, effect: Term) -> Expression | None:
    """The law that an effect puts in place of a term, written as (new - term) or (factor - 1)*term."""
    if not effect.effect or (term.into, term.source) != (effect.into, effect.source):
        return None
    match effect.expression:
        case Apply(function="-", arguments=(changed, old)):
            return changed if old == term.expression else None
        case Apply(function="*", arguments=(Apply(function="-", arguments=(factor, Number(value=1.0))), old)):
            return Apply("*", (factor, old)) if old == term.expression else None
    return None


def _used(name: str, terms: Sequence[Term], model: Model) -> bool:
    expressions = [*(t.expression for t in terms), *model.outputs.values()]
    return any(name in names(e) for e in expressions)
