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

import numpy as np
from numpy.typing import NDArray

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.crossvalidation import left_out
from discovery.diagnosis.refit import score
from discovery.diagnosis.scan import attempt, in_play
from discovery.diagnosis.scored import Scored, is_large, is_usual
from discovery.effects.form import Amplitude, Effect
from discovery.effects.hypothesis import Hypothesis
from discovery.effects.places import TEMPERATURES
from discovery.evidence.bayes import scan
from discovery.printed import printed
from discovery.terms import Apply, Expression, Name, Number, Term

Array = NDArray[np.float64]

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
    best, *_ = scan(one.seen, [one.setting], offered, context.slab(offered)).claims
    h = best.hypothesis
    sizes = dict(zip(h.amplitudes, best.size, strict=True))
    if best.odds <= 0:
        return []
    found = score(context, (*one.hypotheses, h), one.noise, one.fit, sizes, goal)
    if found is None:
        return []
    (body,), odds = h.states, h.log_odds
    return [replace(found, hypotheses=one.hypotheses, forced=_law(h), forced_state=body, log_odds_force=odds)]


def instead(context: Context, one: Scored) -> str | None:
    """A law of two inputs that a model lacks whose flows are wrong by more than usual, in words: with it they
    are not, and recordings that are left out are predicted far better. None if there is none.
    """
    made = _made_usual(context, one)
    if made is None:
        return None
    found, h = made
    outside = left_out(context, found, [h])[h.key]
    if outside is None or not outside.improves or not outside.free.mostly:
        return None
    old, new = (printed(rms) for rms in outside.free.judged)
    beside = " and ".join(o.stated for o in one.hypotheses)
    return (
        f"{_law(h)} is a law to look for: with it{f', next to {beside}' if beside else ''}, the flows of the "
        f"model are wrong by {printed(100 * found.off)} %, not {printed(100 * one.off)} %, and it misses "
        f"recordings that are left out of the fit by {new} times the reading noise, not {old}"
    )


def _made_usual(context: Context, one: Scored) -> tuple[Scored, Hypothesis] | None:
    """A model whose flows are wrong by more than usual, with the law of two inputs that it lacks: with it,
    they are not. None if no law does that, or if the model is no such one.

    Large process noise and form errors explain any law. So laws are scored as if there were little of them.
    """
    offered = list(_laws(context))
    if is_usual(one.setting) or not offered:
        return None
    found = scan(one.seen, in_play(context, one), offered, context.slab(offered))
    claims = [*found.claims[:1], *found.quiet[:1]]
    tries = [(attempt(context, one, one.hypotheses, c), c.hypothesis) for c in claims if c.odds > 0]
    enough = [(m, h) for m, h in tries if m and is_usual(m.setting) and m.off < one.off]
    return max(enough, key=lambda pair: pair[0].evidence, default=None)


def _law(h: Hypothesis) -> str:
    """A law in words.

    >>> from types import SimpleNamespace as Law
    >>> _law(Law(states=("cell",), channels=("I", "I"))), _law(Law(states=("motor",), channels=("I", "n")))
    ('heat at cell that follows the square of I', 'heat at motor that follows I times n')
    """
    (body,), (one, other) = h.states, h.channels
    inputs = f"the square of {one}" if one == other else f"{one} times {other}"
    return f"heat at {body} that follows {inputs}"


def _laws(context: Context) -> Iterator[Hypothesis]:
    """Each product of two inputs, or the square of one, at each body; all share the odds of one effect. The
    square of an input that is on or off is that input: heat that follows it is in the catalogue.
    """
    channels, largest = context.campaign.channels, context.scene.largest
    inputs = [n for n in largest if channels[n].unit not in TEMPERATURES and n not in context.model.states]
    grids = context.grids.values()
    part = {n: np.concatenate([g.nodes[n] for g in grids]) / largest[n] for n in inputs}
    pairs = [
        pair
        for pair in combinations_with_replacement(inputs, 2)
        if not any(_is_same(part[pair[0]] * part[pair[1]], part[n]) for n in pair)
    ]
    for one, other in pairs:
        flow: Expression = Name(_SIZE)
        for name in (one, other):
            flow = Apply("*", (flow, Apply("/", (Name(name), Number(largest[name])))))
        for body in context.floor:
            term = Term(f"{_LAW.title}, {body}", body, flow, None, _LAW.word)
            odds = log(thresholds.ODDS) - log(len(pairs) * len(context.floor))
            yield Hypothesis(_LAW, (body,), (_SIZE,), (term,), channels=(one, other), log_odds=odds)


def _is_same(law: Array, one: Array) -> bool:
    """Whether a law (N,) differs from an input (N,) by no more than a usual law is off."""
    return not is_large(float(np.linalg.norm(law - one) / np.linalg.norm(one)))
