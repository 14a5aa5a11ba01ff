"""Bodies whose flows are wrong by more than those of the others, and outputs that are slower than the others.

All bodies of a lumped model are off by about the same share of what flows through them. Where one body is
modelled worse than the others, that share would make the flows of all of them uncertain, and hide what each
other body lacks. So it is with the slow noise of one sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context, with_worse
from discovery.diagnosis.scored import Scored, is_large, under_noise_of
from discovery.effects.hypothesis import Hypothesis
from discovery.printed import printed
from discovery.terms import Name
from discovery.terms.expression import names

OPENED = 16.0  # log evidence from which one is worse by itself: each such takes time


def with_coarse_bodies(context: Context, model: Scored) -> Context:
    """The context with each body that may be off by more than the others, where the readings show this.

    Args:
        model: what is known so far.
    """
    return _opened(context, model, "coarser", tuple(context.floor))


def with_slow_outputs(context: Context, model: Scored) -> Context:
    """The context with each output whose slow noise may be larger than that of the others, where the readings
    show this. `model`: as in `with_coarse_bodies`.
    """
    return _opened(context, model, "slower", context.outputs)


def _opened(context: Context, model: Scored, kind: str, every: tuple[str, ...]) -> Context:
    """The context with one after the other of those that are worse than the others; at least one is not."""
    begin = model.evidence
    while True:
        chosen: tuple[str, ...] = getattr(context.settings, kind)
        left = [name for name in every if name not in chosen]
        if len(left) < 2:
            return context
        others = [with_worse(context, **{kind: (*chosen, name)}) for name in left]
        best, k = max((under_noise_of(other, model).evidence, k) for k, other in enumerate(others))
        if best < begin + OPENED:
            return context
        context, begin = others[k], best


def judging(context: Context, answer: Scored, chosen: Sequence[Hypothesis]) -> list[int]:
    """Outputs by which effects are judged in free runs: what shows a coarse body alone says nothing of
    effects that act elsewhere, as long as other outputs are read.
    """
    coarse = {*coarse_at(answer), *heated_at(answer)}
    every = list(range(len(context.outputs)))
    shown = [names(context.model.outputs.get(name, Name(name))) for name in context.outputs]
    apart = {context.outputs[y] for y in every if shown[y] and shown[y] <= coarse}
    if not chosen or any(coarse & set(h.states) or apart & set(h.shown) for h in chosen):
        return every
    return [y for y in every if context.outputs[y] not in apart] or every


def sentences(answer: Scored) -> list[str]:
    """What is said of each body and each output that is off by more than the others, and than is usual."""
    flows = [
        f"the flows at {state} are wrong by about {100 * share:.0f} %, those elsewhere by "
        f"{100 * answer.noise.share:.0f} %: something acts at {state} that no effect explains"
        for state, share in coarse_at(answer).items()
    ]
    return flows + of_its_own(answer)


def of_its_own(answer: Scored) -> list[str]:
    """What is said of each body with more heat that nobody records than is usual, and than the others, and of
    each output with more slow noise.
    """
    heats = [
        f"heat that the model does not give is about {100 * share:.0f} % of what flows at {state}, more than "
        "elsewhere and than in most machines: something acts there that no effect explains"
        for state, share in heated_at(answer).items()
    ]
    return heats + [
        f"{output} changes slowly by about {printed(times)} times its reading noise, the other outputs by "
        "less: something acts on it that no effect explains"
        for output, times in slow_at(answer).items()
    ]


def coarse_at(answer: Scored) -> dict[str, float]:
    """Share by which the flows of each body are wrong that are wrong by more than those of the others."""
    noise = answer.noise
    each = {state: share for state, (_, share) in (noise.force or {}).items()}
    return {state: share for state, share in each.items() if is_large(share) and share > noise.share}


def heated_at(answer: Scored) -> dict[str, float]:
    """Share that heat which nobody records is of the flows of each body, where it is more than usual and than
    at the others.
    """
    setting = answer.setting
    above = {state: level for state, level in setting.levels.items() if level > setting.level}
    each = {state: thresholds.FLOOR * level for state, level in above.items()}
    return {state: share for state, share in each.items() if is_large(share)}


def slow_at(answer: Scored) -> dict[str, float]:
    """Slow noise of each output, in reading noises, where it is larger than these and than at the others."""
    noise = answer.noise
    each = {
        name: round(slow / white, 6)
        for name, slow, white in zip(noise.outputs, noise.slow, noise.white, strict=False)
    }
    least = min(each.values(), default=0.0)
    return {name: times for name, times in each.items() if times > max(1.0, least)}
