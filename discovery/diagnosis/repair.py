"""The repaired model: fitted as the proof has it, and written in the form that an engineer would use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from discovery.diagnosis.context import Context
from discovery.diagnosis.named import Named
from discovery.diagnosis.refit import shape_priors, with_effects
from discovery.diagnosis.scored import Scored
from discovery.diagnosis.selection import Search
from discovery.diagnosis.verdict import Verdict
from discovery.diagnosis.withdrawal import beyond_range, runs_away
from discovery.effects.hypothesis import Hypothesis
from discovery.errors import RunsAwayError
from discovery.fitting import Fit, Prior, fit_model
from discovery.fitting.covariance import Z95
from discovery.models import Model
from discovery.recordings import Campaign
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


def with_repair(
    context: Context, found: Search, verdict: Verdict, model: Model, seen: Campaign
) -> tuple[Verdict, Scored, Fit | None]:
    """The verdict with names that the repaired model bears out, the model with them and nothing else as the
    search has it, and its fit as the proof has it: None without names.
    """
    while verdict.named:
        keys = frozenset(n.hypothesis.key for n in verdict.named)
        if keys in found.tried and found.tried[keys].fit.ended_early:
            found.finish(found.tried[keys])
        alone = found.tried.get(keys, verdict.answer)
        after = _repaired(context, alone, verdict.named, model, seen)
        sure = runs_away(verdict) if after is None else beyond_range(verdict, after)
        if sure is verdict:
            return verdict, alone, after
        verdict = sure
    return verdict, verdict.answer, None


def _repaired(
    context: Context, answer: Scored, names: Sequence[Named], model: Model, seen: Campaign
) -> Fit | None:
    """The model with effects of an answer, fitted in the same way as the baseline of the proof; None if it
    does not stay finite from the starts of free runs.

    A jump that no flow makes keeps the size that the readings next to it show: a model that is far from the
    machine would make up for its own error with it.
    """
    chosen = [n.hypothesis for n in names]
    grown = with_effects(model, chosen)
    values = answer.fit.model.parameters
    start = {n: values[n].value for n in grown.free if n in values}
    priors = shape_priors(chosen)  # readings may leave the shape of an effect open
    for name in (name for n in names if n.is_abrupt for name in n.hypothesis.amplitudes):
        if (ends := answer.interval(name)) is not None:
            priors[name] = Prior(values[name].value, (ends[1] - ends[0]) / (2 * Z95))
    try:
        return fit_model(
            grown,
            seen,
            context.recordings,
            context.outputs,
            priors=priors,
            guess=start,
            begin=answer.fit,
            max_rounds=25,
        )
    except RunsAwayError:
        return None
