"""Questioning what a search has taken up: is it needed, would something else stand better in its place?"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discovery.fitting import Noise
from discovery.mismatch.assess import Assessment
from discovery.mismatch.context import Context
from discovery.mismatch.events import meets
from discovery.mismatch.evidence import Score
from discovery.mismatch.gates import bent, matters, objections
from discovery.mismatch.hypotheses import hypotheses
from discovery.mismatch.hypothesis import Hypothesis
from discovery.mismatch.leftout import least_added, least_taken, left_out
from discovery.mismatch.look import attempt, look

NAMED = 8.0  # log evidence that a claim has to add to be taken up
SMALL = 0.1  # share of the whole gain below which what is doubtful is dropped and not the answer
TRACE = 0.6  # log evidence of a law's traces, times the root of what adds the most beside it
AGAIN = 2.0  # log evidence of heat at the same body in another recording, from which heat is no event
EVENTS = ("unmeasured_heat", "rezero", "sensor_offset")
BLUNT = 30.0  # log evidence that the coarseness of a model with few bodies does not reach
CLEAR = 60.0  # of log-likelihood in every recording of the fit: what takes that off each one carries over
EACH = 20.0  # log evidence that each recording left out adds: ghosts reached 15, true effects 10 to 58
CARRIED = 0.65  # of the mean square that an effect takes off the fit, to show on recordings left out
TOLD = 0.02  # of the mean square: what an effect takes off the fit below which its share elsewhere is noise
HOPELESS = 0.3  # of the best claim's gain: places where nothing sees more are not tried
RIVALS = 3  # claims that are tried in the place of another


def recurs(context: Context, chosen: Sequence[Hypothesis]) -> bool:
    """Whether what was taken up for events is none, and looking for a further one is idle: heat without a
    record came twice, or there are more events (two at least) than recordings.

    What meets in time is one event: a model of few bodies shows it at a neighbour, too.
    """
    events = [h for h in chosen if h.effect.word in EVENTS]
    heats = [h for h in events if h.effect.word == "unmeasured_heat"]
    again = [h for k, h in enumerate(heats) if any(meets(h, other) for other in heats[:k])]
    number = len(events) - len(again)
    return len(heats) - len(again) > 1 or number > max(2, len(context.recordings))


def echoes(event: Hypothesis, claims: Sequence[Score]) -> bool:
    """Whether another recording speaks for heat at the same body, too, if faintly: then it is no event."""
    if event.effect.word != "unmeasured_heat" or event.recording is None:
        return False
    others = (c for c in claims if c.hypothesis.effect.word == event.effect.word and c.gain > AGAIN)
    return any(
        c.hypothesis.states == event.states and c.hypothesis.recording != event.recording for c in others
    )


def trace(gain: float) -> float:
    """Log evidence that the traces of something may have that adds `gain`: its law is never exact in form."""
    return TRACE * float(np.sqrt(max(gain, 0.0)))


def prune(context: Context, baseline: Assessment, current: Assessment) -> tuple[Assessment, list[Assessment]]:
    """Drop what is not needed: effects that the others have made idle, small ones that a gate objects to, and
    the traces that a law slightly off in form leaves; these grow with the effect that leaves them.
    """
    tried: list[Assessment] = []
    while len(current.hypotheses) > 1:
        gain, again = current.evidence - baseline.evidence, recurs(context, current.hypotheses)
        lost: list[tuple[Hypothesis, float, Assessment]] = []
        for h in current.hypotheses:
            others = tuple(o for o in current.hypotheses if o.key != h.key)
            if without := attempt(context, current, others):
                lost.append((h, current.evidence - without.evidence, without))
        tried += [without for _, _, without in lost]
        shorter = []
        for h, share, without in lost:
            beside = max((s for o, s, _ in lost if o is not h and o.effect.is_physics), default=0.0)
            largest = min(beside, gain)  # alone, h may be worse than nothing
            # heat that comes again and again is a sign of its own: the verdict needs to see it
            bar = NAMED + (0.0 if again else trace(largest))
            # one of several small events is what a law slightly off in form leaves here and there
            doubtful = (again and h.effect.word in EVENTS) or objections(current, h, gain)
            if share < bar or (share < SMALL * gain and doubtful):
                shorter.append((bent(current, h) is None, share, without))
        if not shorter:
            break
        current = min(shorter, key=lambda item: item[:2])[2]  # what is bent goes first
    return current, tried


def question(
    context: Context, current: Assessment, known: Sequence[Assessment] = ()
) -> tuple[Assessment, list[Assessment]]:
    """Take each effect out, see what would stand in its place, also the same effect at another body, and drop
    what is not needed.

    Args:
        known: refits that were made before and need not be made again.
    """
    tried: list[Assessment] = []
    for h in current.hypotheses:
        others = tuple(o for o in current.hypotheses if o.key != h.key)
        if len(others) == len(current.hypotheses) or h.key not in {o.key for o in current.hypotheses}:
            continue
        without = _apart(context, current, others, known)
        if without is None:
            continue
        tried.append(without)
        claims = [c for c in look(context, without).claims if c.hypothesis.key != h.key]
        # a claim that sees so little at first sight does not turn out the best
        seen = {c.hypothesis.places for c in claims if c.gain > HOPELESS * claims[0].gain}
        pool = [(c.hypothesis, c.size) for c in claims[:RIVALS] if c.gain > 2.0]
        pool += [(o, size) for o, size in _elsewhere(context, current, h, others) if o.places in seen]
        attempts = [a for o, size in pool if (a := attempt(context, without, others, o, size)) is not None]
        attempts = [a for a in attempts if all(matters(context, a, o) for o in a.hypotheses)]
        tried += attempts
        best = max([*attempts, current], key=lambda a: a.evidence)
        current = best if best.evidence > without.evidence + NAMED else without
    return current, tried


def supported(
    context: Context, current: Assessment, known: Sequence[Assessment] = ()
) -> tuple[Assessment, list[Assessment], list[Hypothesis]]:
    """Drop what helps to fit and not to predict: a cause takes nearly as much off free runs on recordings
    left out of the fit as off the fit itself, or each of them speaks for it clearly. Events of one recording
    say nothing on others and stay; with a single recording all stays.

    Args:
        known: refits that were made before and need not be made again.

    Returns:
        The model, everything tried, what was dropped.
    """
    tried: list[Assessment] = []
    dropped: list[Hypothesis] = []
    if len(context.recordings) < 2:
        return current, tried, dropped
    while lasting := [h for h in current.hypotheses if h.recording is None]:
        noise = current.best_view.noise
        others = [tuple(o for o in current.hypotheses if o is not h) for h in lasting]
        apart = [a for rest in others if (a := _apart(context, current, rest, known)) is not None]
        tried += apart
        unclear = [a for a in apart if least_taken(context, current, a, noise) < CLEAR]
        if not unclear:
            break
        whole = left_out(context, current, noise)
        if np.isnan(whole):
            break
        shares = [_carried(context, current, without, noise, whole) for without in unclear]
        weakest = unclear[int(np.argmin(shares))]
        if min(shares) >= CARRIED or least_added(context, current, weakest, noise) > EACH:
            break
        dropped += [h for h in current.hypotheses if h not in weakest.hypotheses]
        current = weakest
    return current, tried, dropped


def _apart(
    context: Context, current: Assessment, others: tuple[Hypothesis, ...], known: Sequence[Assessment]
) -> Assessment | None:
    """The model with the others alone: a refit that is known under the same noise, or a new one."""
    for a in known:
        if a.hypotheses == others and a.views and a.fit.noise == current.best_view.noise:
            return a
    return attempt(context, current, others)


def _carried(context: Context, current: Assessment, without: Assessment, noise: Noise, whole: float) -> float:
    """Of the mean square that an effect takes off the fit, the share that it takes off recordings left out,
    which leave `whole` with it.
    """
    own = {h.recording for h in current.hypotheses if h.recording}  # not run there either
    inside = without.rms(own) ** 2 - current.rms(own) ** 2
    # where the model runs away both with it and without, nothing speaks for it
    outside = float(np.nan_to_num(left_out(context, without, noise) ** 2 - whole**2, posinf=np.inf))
    if 0 < inside < TOLD * current.rms(own) ** 2 and outside >= 0:
        return np.inf
    return outside / inside if inside > 0 else float(np.sign(outside))


def _elsewhere(
    context: Context, current: Assessment, h: Hypothesis, others: Sequence[Hypothesis]
) -> list[tuple[Hypothesis, tuple[float, ...]]]:
    """The effect at every other body where it can act, with the size and shape that it has here.

    What needs a wet body may wet a dry one: offered only where a simpler fluid term stands, it follows
    that one to a wrong body. Everything else keeps its places: no friction without a drive.
    """
    if len(h.states) != 1 or h.recording is not None:
        return []
    parameters = current.model.parameters
    size = tuple(parameters[name].value for name in h.amplitudes)
    shapes = [parameters[name].value for name in h.shapes]
    entry = replace(h.effect, place="body") if h.effect.place == "wet body" else h.effect
    taken = {(o.effect.word, o.states) for o in (h, *others)}
    found = {
        o.states: replace(o.at(dict(zip(o.shapes, shapes, strict=True))), effect=h.effect)
        for o in hypotheses(
            context.baseline.problem.model,
            context.campaign.channels,
            context.outputs,
            context.recordings,
            [entry],
        )
        if o.channels == h.channels and (o.effect.word, o.states) not in taken
    }
    return [(o, size) for o in found.values()]
