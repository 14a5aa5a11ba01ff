"""The repaired model as it goes out: fitted for free runs, and written as an engineer would write it.

A diagnosis allows for everyday heat, so that it takes no cause for granted; every recording then forgives
a level that is a little off. A compensation runs free and is forgiven nothing. Where the model is not quite
that of the machine the two fits differ, and recordings left out of the fit say which one runs better.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from discovery.dynamics.system import predict
from discovery.evaluation.crossvalidation import folds
from discovery.fitting import Noise, predict_recording
from discovery.mismatch.assess import Assessment, assess, refit
from discovery.mismatch.context import Context
from discovery.models import Model
from discovery.terms import Apply, Expression, Name, Term, names
from discovery.terms.expression import rewrite

BETTER = 0.995  # rms of free runs, as a share of the other's, from which the unforgiving fit is taken


def delivered(context: Context, best: Assessment) -> Assessment:
    """The same effects, fitted as they predict recordings best that the fit has not seen.

    Only the recordings of the diagnosis take part: each in turn (or a quarter of them) is left out, the model
    fitted anew to the others, with everyday heat and without, and run freely on what was left out. With one
    recording, or where the two run alike, the diagnosis' own fit stays.
    """
    noise = best.best_view.noise
    if not any((noise.heat or {}).values()):
        return best
    strict = replace(noise, heat=dict.fromkeys(noise.heat or {}, 0.0))
    forgiving, unforgiving = (_left_out(context, best, n) for n in (noise, strict))
    if unforgiving < BETTER * forgiving:
        return assess(context, best.hypotheses, strict, best)
    return best


def _left_out(context: Context, best: Assessment, noise: Noise) -> float:
    """rms of free runs, in units of the reading noise, on recordings left out of the fit; nan with one."""
    events = {h.recording for h in best.hypotheses if h.recording}
    white = np.array(noise.white)
    squares, count = 0.0, 0
    for fold in folds(context.campaign, context.recordings, blocks=0):
        kept = tuple(r for r in context.recordings if r not in fold.recordings)
        seen = replace(context, recordings=kept, grids={r: context.grids[r] for r in kept})
        chosen = [h for h in best.hypotheses if h.recording is None or h.recording in kept]
        model = refit(seen, chosen, noise, best).model
        for name in set(fold.recordings) - events:  # an event of its own cannot be predicted
            run = predict_recording(
                model, context.campaign, name, context.outputs, noise.white, context.grids[name]
            )
            z = (run.system.grid.readings - predict(run)) / white
            squares, count = squares + float(np.nansum(z**2)), count + int(np.isfinite(z).sum())
    return float(np.sqrt(squares / count)) if count else float("nan")


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
