"""Vetoes: laws of physics that data cannot overrule. Each is a sentence, or None if it does not apply."""

from __future__ import annotations

from collections.abc import Callable

from discovery.diagnosis import thresholds
from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis

Veto = Callable[[Context, Scored, Hypothesis], str | None]


def one_recording(context: Context, _: Scored, h: Hypothesis) -> str | None:
    """Unrecorded heat for some hours is an event only if another recording is without it."""
    if len(context.recordings) > 1 or h.effect.search != "window":
        return None
    return (
        f"with a single recording to fit, {h.effect.word} at {h.where} cannot be distinguished from a law "
        "that differs a little from the model's; record the machine once more, or fit a held-out recording"
    )


def every_clock(context: Context, answer: Scored, h: Hypothesis) -> str | None:
    """If the clocks of all recordings are wrong, a dead time of the machine explains it as well."""
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
    """Events of one recording and faults of the measuring chain can only be recognised with a model that is
    nearly right.
    """
    if answer.coarse < thresholds.NAMED or (h.effect.is_physics and not h.effect.is_event):
        return None
    return (
        f"{h.effect.word} at {h.where} is not named: the flows of the model are wrong by about "
        f"{100 * answer.off:.0f} %, which may look the same"
    )


VETOES: tuple[Veto, ...] = (one_recording, every_clock, far_from_the_machine)


def vetoed(context: Context, answer: Scored, h: Hypothesis) -> str | None:
    """The first reason for which an effect must not be named; None if there is none."""
    return next((text for veto in VETOES if (text := veto(context, answer, h))), None)
