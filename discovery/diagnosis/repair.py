"""The repaired model, fitted as the proof has it, and the names that it bears out."""

from __future__ import annotations

from collections.abc import Sequence

from discovery.diagnosis.context import Context
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
        after = repaired(context, alone, [n.hypothesis for n in verdict.named], model, seen)
        sure = runs_away(verdict) if after is None else beyond_range(verdict, after)
        if sure is verdict:
            return verdict, alone, after
        verdict = sure
    return verdict, verdict.answer, None


def repaired(
    context: Context,
    answer: Scored,
    chosen: Sequence[Hypothesis],
    model: Model,
    seen: Campaign,
) -> Fit | None:
    """The model with effects of an answer, fitted in the same way as the baseline of the proof; None if it
    does not stay finite from the starts of free runs.

    What the answer says of the size of an effect is known before: a model that is not quite the machine
    would make up for its own error with it, and a jump of 1.5 K would become one of 0.8 K.
    """
    grown = with_effects(model, chosen)
    values = answer.fit.model.parameters
    start = {n: values[n].value for n in grown.free if n in values}
    priors = shape_priors(chosen)  # readings may leave the shape of an effect open
    for name in (name for h in chosen for name in h.amplitudes):
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
