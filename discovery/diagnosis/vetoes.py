"""Vetoes: what data cannot overrule. Each is a sentence, or None where it does not apply to an effect."""

from __future__ import annotations

from collections.abc import Callable

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis

Veto = Callable[[Context, Scored, Hypothesis], str | None]


def one_recording(context: Context, _: Scored, h: Hypothesis) -> str | None:
    """Heat that nothing records, for some hours, is an event only where another recording is without it."""
    if len(context.recordings) > 1 or h.effect.search != "window":
        return None
    return (
        f"with a single recording, {h.effect.word} at {h.where} cannot be distinguished from a law that "
        "differs a little from the model's; record the machine once more"
    )


def every_clock(context: Context, answer: Scored, h: Hypothesis) -> str | None:
    """Clocks that are wrong in every recording are as well a dead time of the machine."""
    if h.effect.place != "inputs of a recording":
        return None
    shifted = {o.recording for o in answer.hypotheses if o.effect.place == h.effect.place}
    if h.recording is not None and not shifted >= set(context.recordings):
        return None
    return (
        "the clock of every recording would be shifted; a dead time between the inputs and the readings "
        "explains this as well"
    )


def far_from_the_machine(_: Context, answer: Scored, h: Hypothesis) -> str | None:
    """What happens in one recording, or in the measuring chain, is told from a model that is nearly right."""
    if answer.coarse < thresholds.NAMED or (h.effect.is_physics and not h.effect.is_event):
        return None
    return (
        f"{h.effect.word} at {h.where} is not named: the flows of the model are wrong by about "
        f"{100 * answer.off:.0f} %, which may look the same"
    )


VETOES: tuple[Veto, ...] = (one_recording, every_clock, far_from_the_machine)


def vetoed(context: Context, answer: Scored, h: Hypothesis) -> str | None:
    """The first reason for which an effect may not be named; None where there is none."""
    return next((text for veto in VETOES if (text := veto(context, answer, h))), None)
