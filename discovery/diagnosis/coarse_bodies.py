"""Bodies whose flows are wrong by more than those of the others.

All bodies of a lumped model are off by about the same share of what flows through them. Where one body is
modelled worse than the others, that share would make the flows of all of them uncertain, and hide what each
other body lacks.
"""

from __future__ import annotations

from collections.abc import Sequence

from discovery.diagnosis.context import Context, with_coarser
from discovery.diagnosis.scored import Scored, is_large, under_noise_of
from discovery.effects.hypothesis import Hypothesis
from discovery.terms import Name
from discovery.terms.expression import names

OPENED = 16.0  # log evidence from which a body is coarse by itself: each such body takes time


def with_coarse_bodies(context: Context, model: Scored) -> Context:
    """The context with each body that may be off by more than the others, where the readings show this.

    Args:
        model: what is known so far.
    """
    begin, chosen = model.evidence, context.settings.coarser
    while len(chosen) + 1 < len(context.floor):
        others = [with_coarser(context, (*chosen, s)) for s in context.floor if s not in chosen]
        found = [(under_noise_of(other, model).evidence, k) for k, other in enumerate(others)]
        best, k = max(found)
        if best < begin + OPENED:
            break
        context, begin, chosen = others[k], best, others[k].settings.coarser
    return context


def judging(context: Context, answer: Scored, chosen: Sequence[Hypothesis]) -> list[int]:
    """Outputs by which effects are judged in free runs: what shows a coarse body alone says nothing of
    effects that act elsewhere, as long as other outputs are read.
    """
    coarse = set(coarse_at(answer))
    every = list(range(len(context.outputs)))
    shown = [names(context.model.outputs.get(name, Name(name))) for name in context.outputs]
    apart = {context.outputs[y] for y in every if shown[y] and shown[y] <= coarse}
    if not chosen or any(coarse & set(h.states) or apart & set(h.shown) for h in chosen):
        return every
    return [y for y in every if context.outputs[y] not in apart] or every


def sentences(answer: Scored) -> list[str]:
    """What is said of each body that is off by more than the others, and than is usual."""
    return [
        f"the flows at {state} are wrong by about {100 * share:.0f} %, those elsewhere by "
        f"{100 * answer.noise.share:.0f} %: something acts at {state} that no effect explains"
        for state, share in coarse_at(answer).items()
    ]


def coarse_at(answer: Scored) -> dict[str, float]:
    """Share by which the flows of each body are wrong that are wrong by more than those of the others."""
    noise = answer.noise
    each = {state: share for state, (_, share) in (noise.force or {}).items()}
    return {state: share for state, share in each.items() if is_large(share) and share > noise.share}
