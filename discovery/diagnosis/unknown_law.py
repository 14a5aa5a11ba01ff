"""A law that no entry of the catalogue has: heat at a body that follows the product of two recorded inputs,
or the square of one.

The unknown cause may be a law of what is recorded, and not only random heat. An effect that is named instead
of such a law has to be better than it: a brake resistor that heats while two motors work is no heat of one.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations_with_replacement
from math import inf, log

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.refit import score
from discovery.diagnosis.scored import Scored
from discovery.effects.form import Amplitude, Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.places import TEMPERATURES
from discovery.evidence.bayes import scan
from discovery.terms import Apply, Expression, Name, Number, Term

_SIZE = "q_unknown_law"  # W where both inputs are largest
_LAW = Effect(
    word="unknown_law",
    title="A law of two inputs",
    group="user",
    place="body",
    formula=_SIZE,
    amplitude=Amplitude(_SIZE, "W", 1e12, 0),  # usual is what the flows of the model say
    source="no entry of the catalogue",
    signature="the missing heat follows two inputs together",
    confused_with=(),
)


def with_law(context: Context, one: Scored, goal: float = inf) -> list[Scored]:
    """A model with the law of two inputs that it lacks most, fitted; nothing if it lacks none.

    Args:
        goal: the cost from which it matters, as in `fit_model`.
    """
    offered = list(_laws(context))
    if not offered:
        return []
    best, *_ = scan(one.seen, [one.settings[one.best]], offered, context.slab(offered)).claims
    h = best.hypothesis
    sizes = dict(zip(h.amplitudes, best.size, strict=True))
    if best.odds <= 0:
        return []
    found = score(context, (*one.hypotheses, h), one.noise, one.fit, sizes, goal)
    if found is None:
        return []
    (body,), inputs = h.states, " times ".join(h.channels)
    what = f"heat at {body} that follows {inputs}"
    odds = h.log_odds
    return [replace(found, hypotheses=one.hypotheses, forced=what, forced_state=body, log_odds_force=odds)]


def _laws(context: Context) -> Iterator[Hypothesis]:
    """Each product of two inputs, or the square of one, at each body; all share the odds of one effect."""
    channels, largest = context.campaign.channels, context.scene.largest
    inputs = [n for n in largest if channels[n].unit not in TEMPERATURES and n not in context.model.states]
    pairs = list(combinations_with_replacement(inputs, 2))
    for one, other in pairs:
        flow: Expression = Name(_SIZE)
        for name in (one, other):
            flow = Apply("*", (flow, Apply("/", (Name(name), Number(largest[name])))))
        for body in context.floor:
            term = Term(f"{_LAW.title}, {body}", body, flow, None, _LAW.word)
            odds = log(thresholds.ODDS) - log(len(pairs) * len(context.floor))
            yield Hypothesis(_LAW, (body,), (_SIZE,), (term,), channels=(one, other), log_odds=odds)
