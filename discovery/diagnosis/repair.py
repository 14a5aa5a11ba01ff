"""The repaired model as it goes out: fitted for free runs, and written as an engineer would write it.

A diagnosis allows for everyday heat, so that it takes no cause for granted; every recording then forgives
a level that is a little off. A compensation runs free and is forgiven nothing. Where the model is not quite
that of the machine the two fits differ, and recordings left out of the fit say which one runs better.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from discovery.mismatch.assess import Assessment, assess
from discovery.mismatch.context import Context
from discovery.mismatch.leftout import left_out
from discovery.models import Model
from discovery.terms import Apply, Expression, Name, Term, names
from discovery.terms.expression import rewrite

BETTER = 0.99  # rms of free runs, as a share of the other's, from which everyday heat is allowed for


def delivered(context: Context, best: Assessment) -> Assessment:
    """The same effects, fitted as they predict recordings best that the fit has not seen.

    Only the recordings of the diagnosis take part: of each, left out in turn, free runs with everyday heat
    and without are compared. Where they run alike, nothing is forgiven. With a single recording the
    diagnosis' own fit stays.
    """
    noise = best.best_view.noise
    if not any((noise.heat or {}).values()) or len(context.recordings) == 1:
        return best
    strict = replace(noise, heat=dict.fromkeys(noise.heat or {}, 0.0))
    forgiving, unforgiving = (left_out(context, best, n) for n in (noise, strict))
    if forgiving < BETTER * unforgiving:
        return best
    return assess(context, best.hypotheses, strict, best)


def written(best: Assessment) -> Model:
    """The fitted model with no switch that is always on, and each term that an effect replaces gone."""
    model = best.fit.model
    switches = {
        h.amplitudes[0] for h in best.hypotheses if h.effect.amplitude.fixed is not None and not h.recording
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
    return replace(model, name=f"{model.name}, repaired", terms=tuple(terms), parameters=parameters)


def _instead_of(term: Term, effect: Term, switches: Collection[str]) -> Expression | None:
    """What an effect puts in the place of a term: it is written as (new - term), perhaps with a switch."""
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
