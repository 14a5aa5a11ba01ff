"""Vetoes: laws of physics that data cannot overrule. Each is a sentence, or None if it does not apply."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from discovery.diagnosis import thresholds
from discovery.diagnosis.coarse_bodies import coarse_at
from discovery.diagnosis.context import Context
from discovery.diagnosis.scored import Scored
from discovery.effects.hypothesis import Hypothesis
from discovery.printed import printed

Added = Callable[[Hypothesis], float]  # log evidence that goes with an effect of an answer
Veto = Callable[[Context, Scored, Hypothesis, Added], str | None]


def every_recording(context: Context, answer: Scored, h: Hypothesis, _: Added) -> str | None:
    """What every recording shows is no event: a clock that is wrong, or, where most show it, unrecorded heat
    for some hours. An offset that is another one in every recording is no offset.
    """
    is_clock = h.effect.place == "inputs of a recording"
    is_offset = h.effect.place == "input temperature"
    is_event = h.effect.search == "window" or (h.effect.is_event and h.effect.is_physics)
    if not is_clock and not is_offset and not is_event:
        return None
    alike = _alike(answer, h)
    every = set(context.recordings)
    runs = every if h.recording is None else {o.recording for o in alike if o.recording is not None}
    if not (2 * len(runs) > len(every) if is_event else runs >= every):
        return None
    if is_clock:
        late = {run: _shift(answer, alike, run) for run in context.recordings}
        each = [f"{_late(seconds)} in {run}" for run, seconds in late.items()]
        by = _late(max(late.values())) if len(set(late.values())) == 1 else ", ".join(each)
        return (
            f"the clock of every recording would be shifted (readings {by}); a dead time between the inputs "
            "and the readings explains this as well"
        )
    if is_offset and len(context.recordings) > 1:
        return (
            f"{h.effect.word} at {h.where} would be another one in every recording; heat that the model "
            "leaves out explains this as well"
        )
    if len(context.recordings) > 1:
        often = "every recording" if runs >= every else f"{len(runs)} of {len(every)} recordings"
        return (
            f"{h.effect.word} at {h.where} would come in {often}; a law that the model leaves out explains "
            "this as well"
        )
    return (
        f"with a single recording to fit, {h.effect.word} at {h.where} cannot be distinguished from a law "
        "that differs a little from the model's; record the machine once more, or fit a held-out recording"
    )


def _alike(answer: Scored, h: Hypothesis) -> list[Hypothesis]:
    """Effects of the kind of one, at its place, in any recording."""
    return [o for o in answer.hypotheses if o.effect.place == h.effect.place and o.places == h.places]


def _shift(answer: Scored, clocks: Sequence[Hypothesis], run: str) -> float:
    """By how much the clocks are shifted in a recording, all together, s."""
    mine = [o for o in clocks if o.recording in (None, run)]
    return sum(answer.model.parameters[t].value for o in mine for t in o.shapes)


def _late(seconds: float) -> str:
    return f"{printed(abs(seconds))} s {'late' if seconds >= 0 else 'early'}"


def far_from_the_machine(context: Context, answer: Scored, h: Hypothesis, added: Added) -> str | None:
    """An effect can only be recognised with a model that is nearly right. For a law, this is the model of the
    bodies where it acts. For events of one recording and faults of the measuring chain, it is the whole
    model, and one with events in the place of a law is not, if they explain as much as a name has to.
    """
    wrong = coarse_at(answer)
    if h.states and wrong.keys() >= set(h.states):
        return (
            f"{h.effect.word} at {h.where} is not named: with it, the flows there are still wrong by about "
            f"{100 * max(wrong[state] for state in h.states):.0f} %, those elsewhere by "
            f"{100 * answer.noise.share:.0f} %"
        )
    if h.effect.is_law:
        return None
    laws = (o for o in answer.hypotheses if every_recording(context, answer, o, added))
    law = next((o for o in laws if sum(map(added, _alike(answer, o))) >= thresholds.SHORT), None)
    if law and len(context.recordings) > 1:
        return (
            f"{h.effect.word} at {h.where} is not named: {law.effect.word} at {law.where} stands for a law "
            f"that the model leaves out, and {h.effect.word} may make up for the rest of that law"
        )
    if not answer.coarse:
        return None
    return (
        f"{h.effect.word} at {h.where} is not named: the flows of the model are wrong by about "
        f"{100 * answer.off:.0f} %, which may look the same"
    )


VETOES: tuple[Veto, ...] = (every_recording, far_from_the_machine)


def vetoed(context: Context, answer: Scored, h: Hypothesis, added: Added) -> str | None:
    """The first reason for which an effect must not be named; None if there is none."""
    return next((text for veto in VETOES if (text := veto(context, answer, h, added))), None)
